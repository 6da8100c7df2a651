"""One increment: what an observer sees of its passes, and where its first one starts."""

from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.forms import Newton
from bipot.forms.memory import Pace, Paced
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.marching import Control, Schedule, march, system_of
from bipot.prediction import begin, predicted
from tests.scenes import scene, tool


def test_an_observer_sees_what_every_pass_was_given_and_what_it_answered():
    seen = []
    step = next(march(scene(), Schedule(2), Control(Newton(), ()), observe=seen.append))
    assert [trial.number for trial in seen] == list(range(1, step.passes + 1))
    assert len(seen) > 1
    assert not seen[0].iterate.x.any()
    np.testing.assert_array_equal(seen[0].r, step.start.forces)
    for before, after in pairwise(seen):
        assert after.iterate is before.step.iterate
        assert after.r is before.step.r
        assert not np.array_equal(after.iterate.x, before.iterate.x)
    for trial in seen:
        again, _ = trial.form.step(trial.iterate, trial.r, trial.state)
        np.testing.assert_array_equal(again.iterate.x, trial.step.iterate.x)
        np.testing.assert_array_equal(again.r, trial.step.r)
    assert seen[-1].step.iterate is step.solved.iterate
    assert seen[-1].certificate == step.solved.certificate
    assert max(seen[0].certificate.ratios(Limits().bounds).values()) > 1


@pytest.mark.parametrize(
    ("after", "share"), [(2.0, 1.0), (0.0, 0.0), (1.0, 0.0)], ids=["goes on", "turns back", "stays"]
)
def test_the_last_motion_is_predicted_to_go_on_but_not_where_the_tool_turns_back_or_stays(after, share):
    """The same pressed state, before the second half of two paths; the first half has the velocity of the last."""
    moving = scene(tools=(tool(path=((0.0, 0.0), (0.5, 1.0), (1.0, after))),))
    state = next(march(moving, Schedule(2), Control(Newton()))).state
    assert state.forces.any()
    system = system_of(moving)
    going_on = (0.25 * state.velocity).ravel()[system.body.space.free]
    found = predicted(Increment(system, state, 0.75), Pace())
    assert going_on.any()
    np.testing.assert_array_equal(found, share * going_on)


def test_a_body_that_a_tool_has_left_is_predicted_to_rest():
    """It sprang back in the increment in which the tool left it; going on, that would take it beyond yield."""
    lifted = scene(tools=(tool(path=((0.0, 0.0), (0.5, 1.0), (1.0, 0.0))),))
    euler = Control(integration=Integration.BACKWARD_EULER)
    left = [step for step in march(lifted, Schedule(10), euler) if step.state.tau > 0.5]
    assert all(not step.state.forces.any() and step.state.stress.any() for step in left)
    assert left[0].state.velocity.any()
    assert [step.passes for step in left[1:]] == [1] * (len(left) - 1)


def test_while_the_tool_stays_no_round_off_of_the_last_motion_is_predicted_to_go_on():
    """A quarter after it has stopped."""
    staying = scene(tools=(tool(path=((0.0, 0.0), (0.5, 1.0), (1.0, 1.0))),))
    *_, pressed, held = islice(march(staying, Schedule(4), Control(Newton())), 3)
    increment = Increment(system_of(staying), replace(held.state, du=1e-12 * pressed.state.du), 1.0)
    assert increment.past.rates.any()
    assert not increment.past.turns
    assert not predicted(increment, Pace()).any()


def test_nothing_is_predicted_from_rest():
    system = system_of(scene())
    assert not predicted(Increment(system, system.rest(), 1.0), Pace()).any()


@pytest.mark.parametrize(("change", "kept"), [(1e-3, False), (0.2, True)])
def test_a_velocity_that_leads_away_is_kept_instead_of_extrapolated(change, kept):
    """What the velocity turned by, node by node, would turn it as much again."""
    *_, step, _ = march(scene(), Schedule(40), Control(Newton()))
    state, system = step.state, system_of(scene())
    turned = np.random.default_rng(1).normal(size=state.rates.shape)
    turned *= change * np.linalg.norm(state.rates) / np.linalg.norm(turned)
    before = Paced(state.tau - state.length, state.tau - 1.5 * state.length, state.rates - turned, state.forces)
    iterate = begin(Increment(system, state, state.tau + state.length), Pace((before,)), Bounds())
    expected = state.rates if kept else state.rates + turned
    np.testing.assert_allclose(iterate.x, system.body.space.gather(expected * state.length), rtol=1e-9)


@pytest.mark.parametrize(("bent", "by"), [(0.1, 2), (0.4, 1)])
def test_a_velocity_that_changes_smoothly_is_extrapolated_by_a_quadratic(bent, by):
    """In increments of unequal lengths; where the change itself changes too much, along a line."""
    *_, step, _ = march(scene(), Schedule(40), Control(Newton()))
    state, system, (h, ahead) = step.state, system_of(scene()), (step.state.length, 1.3 * step.state.length)
    past = np.cumsum([0.0, h, 0.7 * h, 0.8 * h])
    middles = -(past[:-1] + past[1:]) / 2
    turn = 1e-3 * np.random.default_rng(1).normal(size=state.rates.shape) * np.linalg.norm(state.rates)
    turn /= np.sqrt(turn.size)

    def velocity(t):
        """About the last middle."""
        s = (t - middles[0]) / h
        return state.rates + turn * (s + bent * s**2)

    behind = zip(past[1:3], middles[1:], strict=True)
    before = [Paced(state.tau - end, state.tau + t, velocity(t), state.forces) for end, t in behind]
    found = predicted(Increment(system, state, state.tau + ahead), Pace(tuple(before)))
    expected = velocity(ahead / 2)
    if by == 1:
        rate = (velocity(middles[0]) - velocity(middles[1])) / (middles[0] - middles[1])
        expected = state.rates + rate * (ahead / 2 - middles[0])
    np.testing.assert_allclose(found, system.body.space.gather(expected * ahead), rtol=1e-9, atol=1e-12 * ahead)


@pytest.mark.parametrize(("stretch", "taken"), [(0.5, True), (9.0, False)])
def test_a_prediction_that_strains_the_body_by_more_than_an_answer_may_is_no_start(stretch, taken):
    """Then it starts as its supports and tools carry it: nowhere, as the base rests."""
    moving = scene(tools=(tool(travel=(0.0, -1e-3)),))
    state, system = next(march(moving, Schedule(2), Control(Newton()))).state, system_of(moving)
    velocity = np.zeros_like(state.velocity)
    velocity[:, 1] = stretch * state.nodes[:, 1] / 0.25
    increment = Increment(system, replace(state, du=state.length * velocity), state.tau + 0.25)
    found = begin(increment, Pace(), Bounds())
    assert np.abs(found.x).max() == pytest.approx(stretch * state.nodes[:, 1].max() if taken else 0.0, abs=1e-3)


@pytest.mark.parametrize("early", [1e-1, 1e-3, 1e-6])
def test_a_fast_stretch_is_not_predicted_to_go_on_into_a_slow_one(early):
    """The same path on another clock: what the body comes to is the same, without a cut."""
    ends = []
    for corner in (0.5, early):
        moving = scene(tools=(tool(path=((0.0, 0.0), (corner, 1.0), (1.0, 1.1))),))
        steps = list(march(moving, Schedule(4), Control(Newton())))
        assert not any(a.cuts for a in steps)
        ends.append(steps[-1].tool_forces)
    np.testing.assert_allclose(ends[1], ends[0], rtol=2e-2)
