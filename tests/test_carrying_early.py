"""Which points stop is decided before an increment is solved where that is certain, and not otherwise."""

import numpy as np
import pytest

from bipot.contact.closeness import carries
from bipot.control import carrying
from bipot.control.control import Control
from bipot.forms import Dissipation, Tangent
from bipot.increment import Trial
from bipot.marching import march
from bipot.schedule import Schedule
from bipot.tensors import norm
from studies.accuracy.paced import CONTROL
from studies.accuracy.paced_scenes import cylinder

SCENE, SCHEDULE = cylinder(0.3, elements=5), Schedule(8)


@pytest.fixture
def seen(monkeypatch):
    """Of passes not accepted: what is carried, how far points are from stopping, the error, the answer."""
    out = []

    def turned(system, carried, near, error):
        found = carrying_turned(system, carried, near, error)
        out.append((carried, carrying._short(system, carried, near), error, found))
        return found

    carrying_turned = carrying._turned
    monkeypatch.setattr(carrying, "_turned", turned)
    return out


@pytest.fixture(params=[CONTROL, Control()], ids=["newton", "tangent"])
def run(request):
    """Marches by a control whose first form tells its error."""
    return lambda: list(march(SCENE, SCHEDULE, request.param))


def test_it_saves_passes_and_changes_nothing(run, monkeypatch):
    early = run()
    monkeypatch.setattr(carrying, "EARLY", carrying.ROUGH)
    late = run()
    for a, b in zip(early, late, strict=True):
        assert a.tool_force(0) == pytest.approx(b.tool_force(0), rel=1e-6)
        assert (carries(a.solved.r) == carries(b.solved.r)).all()
    assert sum(a.passes for a in early) < sum(b.passes for b in late)


def test_how_far_points_are_from_stopping_changes_by_less_than_the_margin(run, seen, monkeypatch):
    monkeypatch.setattr(carrying, "EARLY", 0.0)
    monkeypatch.setattr(carrying, "ROUGH", 0.0)
    run()
    early, last = 0, None
    for carried, short, error, _ in reversed(seen):
        if last is None or last[0] is not carried:
            last = carried, short
        elif error <= 1e-2:
            size = norm(carried.last.strain)
            off = np.abs(short - last[1])[carried.on & (size > np.median(size[size > 0]) / 20)].max()
            assert off < carrying.MARGIN * error
            early += 1
    assert early > 5


def test_nothing_is_decided_while_a_point_is_within_the_margin(run, seen, monkeypatch):
    monkeypatch.setattr(carrying, "MARGIN", 1e6)
    run()
    assert not any(found for *_, error, found in seen if error > carrying.ROUGH)


def test_points_that_are_short_are_those_that_stop(run, seen):
    for step in run():
        for carried, short, _, _ in seen[-step.passes :]:
            flowed = carrying.Flowed.of(step.solved.iterate.increment.system, carried, step.solved)
            measured = carrying._short(step.solved.iterate.increment.system, carried, step.solved)
            assert not (flowed.stopped & (measured < 0)).any()
            assert short.shape == measured.shape


@pytest.mark.parametrize("form", [Tangent(), Dissipation()], ids=lambda form: form.name.value)
def test_the_exact_forms_tell_how_far_a_pass_is_from_equilibrium_and_law(form):
    """Without friction, by hand: of a candidate that is open nothing but its force is missed."""
    seen = list[Trial]()
    list(march(cylinder(0.0, elements=3), Schedule(2), Control(form, ()), observe=seen.append))
    for trial in seen:
        there, r, units = trial.step.iterate, trial.step.r, trial.iterate.increment.units
        pressed = np.maximum(r[:, 0] - there.motion[:, 0] * units.force / units.length, 0.0)
        law = np.column_stack([r[:, 0] - pressed, r[:, 1:]])
        balance = there.residual - there.rows.G_n.T @ r[:, 0]
        missed = np.sqrt(np.sum(balance**2) + np.sum(law**2))
        assert trial.step.error == pytest.approx(missed / np.sqrt(np.sum(r**2)), rel=1e-6)
    assert max(trial.step.error for trial in seen) > 1e-3 > 1e-7 > seen[-1].step.error
