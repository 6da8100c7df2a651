"""What flow goes on is found from the material: where a guess is wrong, where points stop, and what is refused."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from bipot import Newton, upsetting
from bipot.certificate import Bounds
from bipot.control import carried, carrying
from bipot.control.attempt import Attempt
from bipot.control.carrying import carry_on
from bipot.control.reason import Reason, ReasonKind
from bipot.forms import Cache
from bipot.increment import LeftOff, Limits, solve_increment
from bipot.iterate import Increment
from bipot.marching import system_of
from tests.scenes import run

USUAL = Limits()


TIGHT = Limits(Bounds(equilibrium=1e-10))
"""In equilibrium they ask for a pass more."""


def solving(system, tau, limits=USUAL):
    """How to attempt the increment to ``tau``."""

    def solve(begun, near_to, leave):
        increment, passes = Increment(system, begun, tau), []
        try:
            solved = solve_increment(increment, Newton(), limits, Cache(), 0.0, passes.append, near_to, leave)
        except LeftOff as left:
            return Attempt(None, Newton().name, len(passes), (), left=left.near)
        return Attempt(solved, Newton().name, solved.passes, ())

    return solve


@cache
def flowing():
    """A system, a state in which it flows, and how to attempt the increment that follows."""
    steps = run(0.3)
    scene = upsetting(mu=0.3, reduction=0.1, elements=4)
    system, state = system_of(scene), steps[-2].state
    tau = steps[-1].state.tau

    solve = solving(system, tau)

    return system, state, tau, solve


def accepted(solved):
    return None


def refused_first(words, times):
    """Refuse the first ``times`` solutions in these words."""
    left = [Reason(ReasonKind.DISSIPATION, words)] * times
    return lambda solved: left.pop() if left else None


def carries(attempt):
    """Whether the increment of an attempt starts from a state in which flow has gone on."""
    return not np.array_equal(attempt.solved.response.state.peeq, flowing()[1].peeq)


def test_flow_that_goes_on_is_carried_in_one_solution():
    system, state, tau, solve = flowing()
    attempt = carry_on(Increment(system, state, tau), solve, accepted, second=True)
    assert carries(attempt)
    assert attempt.passes == attempt.solved.passes
    assert not carries(carry_on(Increment(system, state, tau), solve, accepted, second=False))


def test_a_refused_increment_is_solved_without_flow_and_then_given_up():
    system, state, tau, solve = flowing()
    attempt = carry_on(Increment(system, state, tau), solve, refused_first("negative", 1), second=True)
    assert [str(failure) for failure in attempt.failures] == ["flow not carried on: negative"]
    assert not carries(attempt)
    assert attempt.passes > attempt.solved.passes
    attempt = carry_on(Increment(system, state, tau), solve, refused_first("negative", 2), second=True)
    assert [str(failure) for failure in attempt.failures] == ["flow not carried on: negative", "newton: negative"]
    assert attempt.solved is None


def test_a_ratio_that_does_not_settle_ends_with_backward_euler(monkeypatch):
    system, state, tau, solve = flowing()
    monkeypatch.setattr(carried, "TOO_MUCH", -1.0)
    attempt = carry_on(Increment(system, state, tau), solve, accepted, second=True)
    assert [str(failure) for failure in attempt.failures] == ["flow not carried on: unsettled after 3 solutions"]
    assert not carries(attempt)


STALLED = Reason(ReasonKind.NOT_CONVERGED, "stalled", Newton.name)


def failing(solve, start, times):
    """``solve`` that finds no solution with flow carried on the first ``times`` times."""
    left = [8] * times

    def fails(begun, near_to, leave):
        found = begun is start or not left
        return solve(begun, near_to, leave) if found else Attempt(None, Newton().name, left.pop(), (STALLED,))

    return fails


def test_where_no_solution_is_found_with_the_flow_it_is_sought_from_the_one_without():
    system, state, tau, solve = flowing()
    at_once = carry_on(Increment(system, state, tau), solve, accepted, second=True)
    attempt = carry_on(Increment(system, state, tau), failing(solve, state, 1), accepted, second=True)
    assert [str(failure) for failure in attempt.failures] == ["newton: stalled"]
    np.testing.assert_allclose(attempt.solved.r, at_once.solved.r, atol=1e-6 * np.abs(at_once.solved.r).max())


def test_what_is_refused_with_the_flow_is_not_sought_without():
    system, state, tau, _ = flowing()
    refused = Attempt(None, Newton().name, 5, (STALLED,), refused=True)
    attempt = carry_on(Increment(system, state, tau), lambda *_: refused, accepted, second=True)
    assert (attempt.passes, attempt.solved, attempt.refused) == (5, None, True)


def test_backward_euler_does_not_stand_in_where_flow_goes_on():
    system, state, tau, solve = flowing()
    attempt = carry_on(Increment(system, state, tau), failing(solve, state, 2), accepted, second=True)
    assert [str(failure) for failure in attempt.failures] == ["newton: stalled"] * 2
    assert attempt.solved is None
    assert attempt.passes > 16


def test_backward_euler_does_where_next_to_nothing_of_the_flow_goes_on():
    system, state, _, _ = flowing()
    tau = state.tau + state.length / 50

    solve = solving(system, tau)

    misled = replace(state, length=state.length / 50)
    attempt = carry_on(Increment(system, misled, tau), failing(solve, misled, 1), accepted, second=True)
    assert [str(failure) for failure in attempt.failures] == ["newton: stalled"]
    assert not carries(attempt)


@pytest.mark.parametrize(("wrong", "part"), [(3.0, 0.05), (1 / 3, 0.7)])
def test_a_wrong_guess_is_put_right_by_what_the_material_does(wrong, part):
    """The last increment's length misremembered either way costs a part of what backward Euler does."""
    system, state, tau, solve = flowing()
    asked = partial(carry_on, solve=solve, refused=accepted)
    right, euler = (asked(Increment(system, state, tau), second=second).solved.r for second in (True, False))
    found = asked(Increment(system, replace(state, length=wrong * state.length), tau), second=True)
    assert not found.failures
    assert np.abs(found.solved.r - right).max() < part * np.abs(euler - right).max()


def test_a_flow_that_does_not_go_on_is_dropped_before_its_increment_is_solved(monkeypatch):
    """A length misremembered threefold: the same answer in fewer passes than from one solution to the next.

    Solutions to 1e-10, which are a pass away from where the flow is asked; to 1e-7 a new factor gets there at once.
    """
    system, state, tau, _ = flowing()
    solve = solving(system, tau, TIGHT)
    increment = Increment(system, replace(state, length=3 * state.length), tau)
    early = carry_on(increment, solve, accepted, second=True)
    monkeypatch.setattr(carrying, "ROUGH", 0.0)
    late = carry_on(increment, solve, accepted, second=True)
    assert early.passes < late.passes
    np.testing.assert_allclose(early.solved.r, late.solved.r, atol=1e-6 * np.abs(late.solved.r).max())
