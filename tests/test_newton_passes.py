"""What a pass of `newton` does beside its step: which factor it keeps, how it ends, and what forces it reports."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from bipot import (
    Amplitude,
    Control,
    DeformableTool,
    Geometry,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    SuperLU,
    Support,
    block,
    march,
    together,
    upsetting,
)
from bipot.forms import Cache
from bipot.forms.newton import Reuse
from bipot.forms.point import BAND_GAP, BAND_LAW, Law
from bipot.forms.search import Aim, Search
from bipot.iterate import Increment
from bipot.marching import system_of
from tests.deformable import STEEL, shifted
from tests.sheared import CONSTANT, OROWAN, pressed


@cache
def increment():
    """The third increment of an upsetting, with its solution."""
    scene = upsetting(mu=0.3, elements=2, reduction=0.1)
    *_, before, last = march(scene, Schedule(3), Control(Newton(), ()))
    return Increment(system_of(scene), before.state, last.state.tau), last.solved


def passes(form, part, count):
    """Steps and states of passes of a form, from so large a ``part`` of the solution and with its forces."""
    posed, solved = increment()
    iterate, r = posed.at(part * solved.iterate.x), solved.r
    state = form.init(iterate, r, Cache())
    for _ in range(count):
        step, state = form.step(iterate, r, state)
        yield step, state
        iterate, r = step.iterate, step.r


def reused(fall, part=1 + 1e-4, count=2, near=0.9):
    """Whether the last of the passes keeps the factor, the merits where passes began, and where the last one ended."""
    *_, (_, before), (_, state) = passes(Newton(Reuse(fall, near=near)), part, count)
    kept = state.linearised.factor is before.linearised.factor
    return kept, state.merits, before


def test_the_first_fall_of_the_merit_must_be_the_square_of_later_ones():
    """The first pass takes out what is linear, whatever its factor is worth."""
    _, (first, second), _ = reused(0.0)
    assert reused(np.sqrt(1.1 * second / first))[0]
    assert not reused(np.sqrt(0.9 * second / first))[0]
    assert 0.9 * second / first < np.sqrt(0.9 * second / first)


def test_a_factor_is_kept_only_near_a_solution():
    """The error is the merit over the norm of the forces."""
    kept, (_, merit), before = reused(0.9)
    assert kept
    error = merit / np.linalg.norm(before.here.r)
    assert reused(0.9, near=1.01 * error)[0]
    assert not reused(0.9, near=0.99 * error)[0]


def test_what_must_vanish_with_a_kept_factor_is_that_of_the_iterate():
    """Its caps are others, though the matrix is that of an earlier one."""
    (_, before), (_, state) = passes(Newton(Reuse(0.9, near=0.9)), 1 + 1e-4, 2)
    assert state.linearised.factor is before.linearised.factor
    assert state.linearised.pieces is before.here.pieces


def test_a_factor_with_which_the_merit_hardly_falls_is_not_the_first_of_the_next_configuration():
    """While one part slides on another; the tolerance is for the norm of the forces, by which errors are divided."""
    low, up = block(3.0, 1.0, 9, 2), shifted(block(1.0, 1.0, 4, 2), 0.1, 1.0)
    pressed, slid = (Amplitude(((0.0, 0.0), (0.2, at), (1.0, 1.0))) for at in (1.0, 0.0))
    driven = Prescribed("up/top", 1, -0.02, pressed), Prescribed("up/top", 0, 1.3, slid)
    supports = (Support("low/base", 0), Support("low/base", 1), *driven)
    tool = DeformableTool(("low/top",), ("up/base",), 0.2)
    scene = Scene(together({"low": low, "up": up}), Geometry.PLANE_STRAIN, STEEL, supports, (tool,))
    factors, seen = [], []

    class Counting(SuperLU):
        def factorise(self, transpose, panel):
            factors.append(panel)
            return super().factorise(transpose, panel)

    def observe(trial):
        began = trial.state.law.point(trial.iterate, trial.r, None).error
        seen.append((trial.iterate.increment.tau, len(factors), trial.step.error / began))

    assert len(list(march(scene, Schedule(12), Control(Newton(linear=Counting()), ()), observe=observe))) == 13
    kept = [fall for (tau, count, fall), after in pairwise(seen) if (tau, count) == after[:2]]
    assert len(kept) > 10
    assert max(kept) <= 1.1 * Reuse().fall


def test_of_trials_none_of_which_is_good_enough_the_one_of_least_merit_is_taken(monkeypatch):
    merits, point = [], Law.point

    def seen(self, *given):
        merits.append(point(self, *given).merit)
        return point(self, *given)

    monkeypatch.setattr(Law, "point", seen)
    monkeypatch.setattr(Aim, "meets", lambda *_: False)
    monkeypatch.setattr(Aim, "shorter", lambda self, t, rest: t / 4)
    ((_, state),) = passes(Newton(search=Search(trials=3)), 0.9, 1)
    tried = merits[1:]
    assert len(tried) == 4
    assert np.argmin(tried) != 3
    assert state.here.merit == min(tried)


@pytest.mark.parametrize("present", [1e-12, 1e12])
def test_the_dead_band_of_a_gap_is_small_beside_the_body_and_as_a_force(present):
    """A contact that was shut stays so up to a gap of 1e-11 body sizes, and of 1e-10 of the largest force."""
    posed, solved = increment()
    state = Newton().init(solved.iterate, solved.r, Cache())
    law = replace(state.law, present=present)
    band = np.minimum(1e-11 * posed.units.size, 1e-10 * present / law.scale)
    assert (BAND_GAP, BAND_LAW) == (1e-11, 1e-10)
    r = np.zeros_like(solved.r)
    shut = law.point(solved.iterate, solved.r, None).pieces
    shut = replace(shut, closed=np.ones_like(shut.closed))

    def closed(times):
        iterate = replace(solved.iterate)
        motion = solved.iterate.motion.copy()
        motion[:, 0] = times * band
        object.__setattr__(iterate, "motion", motion)
        return law.point(iterate, r, shut).pieces.closed

    assert closed(0.9).all()
    assert not closed(1.1).any()


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_friction_at_its_cap_is_reported_at_the_cap_of_the_new_iterate(law):
    """After any pass, not only in the end: the cap needs no force to be known."""
    last = pressed(*law)[-1]
    posed = last.solved.iterate.increment
    iterate = posed.at(0.5 * last.solved.iterate.x)
    form = Newton()
    step, _ = form.step(iterate, last.solved.r, form.init(iterate, last.solved.r, Cache()))
    rows = step.iterate.rows
    friction, pushes = np.abs(step.r[:, 1]), step.r[:, 0] > 0
    capped = pushes & (np.minimum(rows.mu, 1e9) * step.r[:, 0] > 1.1 * rows.cap) & (friction > 0.9 * rows.cap)
    assert capped.sum() >= 2
    np.testing.assert_allclose(friction[capped], rows.cap[capped], rtol=1e-14)


def test_forces_that_the_law_says_are_none_are_exactly_none():
    """What the solution of such a row leaves is round-off."""
    posed, _ = increment()
    for step, _ in passes(Newton(), 0.9, 2):
        apart = step.iterate.motion[:, 0] > 1e-6 * posed.units.size
        assert apart.any()
        assert (step.r[apart] == 0).all()
