"""How a march goes on: its schedule, fallbacks, cuts, what fails for good, and what control refuses."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.control import attempting, pacing
from bipot.errors import (
    FoldedAnswer,
    IncrementFailed,
    InvertedElement,
    NotConverged,
    ProgramError,
    Refused,
    SceneError,
    UnsuitedForm,
)
from bipot.fem.elements import Quadrature
from bipot.fem.projection import VolumeChange
from bipot.forms import Delassus, Dissipation, FormName, Newton, Penalty, Tangent
from bipot.increment import Limits
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.paper import upsetting
from tests.scenes import DIRECT, path


def test_the_schedule_lands_exactly_and_starts_small_under_friction():
    times = path(0.45, 10).times()
    np.testing.assert_allclose(np.array(times[:5]) * 0.45, 0.001 * np.arange(1, 6))
    assert times[-1] == 1.0
    steps = np.diff(times)
    np.testing.assert_allclose(steps[-10:], steps[-1])
    assert np.all(steps[1:] >= steps[:-1] * (1 - 1e-12))
    assert Schedule(4).times() == [0.25, 0.5, 0.75, 1.0]
    landed = Schedule(10, landings=(0.44,)).times()
    assert 0.44 in landed
    assert len(landed) == 10


def test_a_failing_form_falls_back_and_says_so():
    """One pass is never enough for `tangent` here: every increment is then solved by the first fallback."""
    scene = upsetting(mu=0.1, reduction=0.01, elements=2)
    helpless = FailsAlways()
    for accepted in march(scene, Schedule(2, first=0.1), Control(helpless)):
        assert accepted.form is FormName.NEWTON
        assert accepted.reason.startswith("tangent: nothing doing")


@pytest.mark.parametrize("form", [Newton(), Tangent()])
def test_by_default_the_dissipation_program_is_tried_after_all_that_take_less_time(form):
    names = [form.name for form in Control(form).forms]
    assert names[0] is form.name
    assert set(names[:2]) == {FormName.NEWTON, FormName.TANGENT}
    assert names[2:] == [FormName.DISSIPATION]


class FailsAlways:
    """A form that never converges."""

    name = FormName.TANGENT
    init = DIRECT.init

    def step(self, iterate, r, state):
        raise NotConverged("nothing doing")


class FailsAbove:
    """The tangent form, refusing increments longer than ``limit``."""

    name = FormName.TANGENT
    init = DIRECT.init

    def __init__(self, limit):
        self.limit = limit

    def step(self, iterate, r, state):
        if iterate.increment.units.length > self.limit:
            raise NotConverged("too long")
        return DIRECT.step(iterate, r, state)


def test_cuts_are_recorded_and_the_schedule_is_still_met():
    scene = upsetting(mu=0.0, reduction=0.1, elements=2)
    accepted = list(march(scene, Schedule(2), Control(FailsAbove(0.1), fallbacks=())))
    taus = [a.state.tau for a in accepted]
    assert {0.5, 1.0} <= set(taus)
    assert accepted[0].cuts == 2
    assert accepted[0].reason == "tangent: too long; cut; tangent: too long; cut"
    assert accepted[0].state.tau == 0.125


@pytest.mark.parametrize(
    ("cuts", "spared", "lengths"),
    [(8, 2, [0.25]), (8, 0, [1.0]), (1, 2, [0.5]), (0, 2, [1.0]), (8, 3, [0.125])],
)
def test_an_increment_is_halved_before_the_dissipation_program_stands_in(cuts, spared, lengths, monkeypatch):
    """Unless it has been halved as often as asked, or cannot be halved again."""
    asked = tried_in_turn(NotConverged("cycles"), monkeypatch)
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    next(march(scene, PACED, Control(Newton(), (Tangent(), Dissipation()), cuts=cuts, spared=spared)))
    assert [length for form, length in asked if form is FormName.DISSIPATION] == lengths
    assert {length for form, length in asked if form is FormName.TANGENT} >= set(lengths)


@pytest.mark.parametrize("why", [ProgramError("singular"), UnsuitedForm("refuses")])
def test_what_a_shorter_increment_would_not_help_spares_no_form(why, monkeypatch):
    asked = tried_in_turn(why, monkeypatch)
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    accepted = next(march(scene, PACED, Control(Newton(), (Dissipation(),))))
    assert accepted.cuts == 0
    assert asked == [(FormName.NEWTON, 1.0), (FormName.DISSIPATION, 1.0)]


@pytest.mark.parametrize("form", [Penalty(1e3, 1e3), Delassus()])
def test_a_scene_that_no_form_suits_ends_at_once(form):
    scene = upsetting(mu=float("inf"), reduction=0.01, elements=1)
    with pytest.raises(IncrementFailed, match=r"from tau = 0 to 1 failed .*\. Take another form, or give it fallbacks"):
        next(march(scene, Schedule(1), Control(form, fallbacks=())))


@pytest.mark.parametrize("schedule", [Schedule(accuracy=1e-2), Schedule(1)])
@pytest.mark.parametrize("why", [Refused("no answer", "Use more increments."), FoldedAnswer("no answer")])
def test_what_is_refused_though_it_solves_the_equations_is_halved_before_other_forms_find_it_too(
    why, schedule, monkeypatch
):
    """They would take all of their passes for the same answer."""
    asked = tried_in_turn(why, monkeypatch, set())
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    with pytest.raises(IncrementFailed, match="no answer"):
        next(march(scene, schedule, Control(Newton(), (Tangent(), Dissipation()), cuts=2)))
    last = [(form, 0.25) for form in (FormName.NEWTON, FormName.TANGENT, FormName.DISSIPATION)]
    assert asked == [(FormName.NEWTON, 1.0), (FormName.NEWTON, 0.5), *last]


@pytest.mark.parametrize("why", [Refused("no answer", "Use more increments."), FoldedAnswer("no answer")])
def test_what_all_forms_refuse_with_the_flow_the_first_one_refuses_without(why, monkeypatch):
    """The shortest increment is tried by all: once, because a pass of a conic program takes long."""
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    going = march(scene, Schedule(2), Control(Newton(), (Tangent(), Dissipation()), cuts=0))
    next(going)
    asked = tried_in_turn(why, monkeypatch, set())
    with pytest.raises(IncrementFailed, match="no answer"):
        next(going)
    forms = [FormName.NEWTON, FormName.TANGENT, FormName.DISSIPATION, FormName.NEWTON]
    assert asked == [(form, 0.5) for form in forms]


def test_where_an_iterate_folds_an_element_other_forms_are_tried_before_the_increment_is_halved(monkeypatch):
    """They go other ways to the answer."""
    asked = tried_in_turn(InvertedElement("on the way"), monkeypatch)
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    assert next(march(scene, Schedule(1), Control(Newton(), (Dissipation(),)))).cuts == 0
    assert asked == [(FormName.NEWTON, 1.0), (FormName.DISSIPATION, 1.0)]


@pytest.mark.parametrize("length", [1.0, 0.5])
def test_where_shorter_increments_fail_the_program_solves_the_longest_that_it_was_spared(length, monkeypatch):
    """As in a scene of one cut, whose first increment it solves as a whole and not in halves: nothing was accepted."""
    asked = tried_in_turn(NotConverged("cycles"), monkeypatch, {length})
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    accepted = next(march(scene, PACED, Control(Newton(), (Dissipation(),), cuts=3)))
    assert (accepted.form, accepted.state.tau, accepted.cuts) == (FormName.DISSIPATION, length, 3)
    assert accepted.strayed
    programs = [own for form, own in asked if form is FormName.DISSIPATION]
    assert programs == [0.25, 0.125, *[own for own in (1.0, 0.5) if own >= length]]


@pytest.mark.parametrize(("fallbacks", "again"), [((), []), ((Dissipation(),), [1.0, 0.5])])
def test_what_no_form_solves_is_tried_again_only_where_one_was_spared(fallbacks, again, monkeypatch):
    asked = tried_in_turn(NotConverged("cycles"), monkeypatch, set())
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    with pytest.raises(IncrementFailed, match=r"increment from tau = 0 to 0\.125 failed"):
        next(march(scene, PACED, Control(Newton(), fallbacks, cuts=3)))
    assert [own for form, own in asked if form is FormName.NEWTON] == [1.0, 0.5, 0.25, 0.125, *again]


def test_scheduled_increments_are_kept_if_any_form_solves_them(monkeypatch):
    asked = tried_in_turn(NotConverged("cycles"), monkeypatch)
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    accepted = list(march(scene, Schedule(2), Control(Newton(), (Dissipation(),))))
    assert [increment.state.tau for increment in accepted] == [0.5, 1.0]
    assert {length for _, length in asked} == {0.5}


PACED = Schedule(accuracy=1e-2)
"""Its first increment goes the whole way in :func:`tried_in_turn`."""


def tried_in_turn(failure, monkeypatch, lengths=None):
    """The forms tried with the lengths of the increments in pseudo-time; all fail but the dissipation program.

    It solves those of one of the ``lengths``, any if these are None. Increments by accuracy are as long as can be.
    """
    monkeypatch.setattr(pacing.Pacer, "length", lambda _pacer, _system, state, _proposed, target: target - state.tau)
    monkeypatch.setattr(pacing.Pacer, "refuses", lambda _pacer, _estimate: False)
    asked, solve = list[tuple[FormName, float]](), attempting.solve_facing

    def tried(increment, form, *rest):
        length = increment.tau - increment.start.tau
        asked.append((form.name, length))
        if form.name is not FormName.DISSIPATION or not (lengths is None or length in lengths):
            raise failure
        return solve(increment, form, *rest)

    monkeypatch.setattr(attempting, "solve_facing", tried)
    return asked


@pytest.mark.parametrize(("spared", "forms"), [(0, {FormName.NEWTON, FormName.DISSIPATION}), (2, {FormName.NEWTON})])
def test_on_a_fine_mesh_newton_goes_half_the_way_instead_of_a_conic_program(spared, forms):
    """By coarse increments it cycles on 17 x 17 elements, whose side lands on the punch."""
    scene = upsetting(mu=0.3, elements=17, element=Element.Q4, volume=VolumeChange.P0, quadrature=Quadrature.GAUSS2)
    passes = set[FormName]()
    control = Control(Newton(), (Dissipation(),), spared=spared)
    list(march(scene, Schedule(accuracy=2e-2), control, observe=lambda trial: passes.add(trial.form.name)))
    assert passes == forms


def test_after_a_cut_increments_by_accuracy_stay_as_short_as_long_as_they_take_many_passes(monkeypatch):
    """Twice the length would fail again each time, as it did here 23 times."""
    monkeypatch.setattr(pacing, "QUICK", 0)
    scene = upsetting(mu=0.0, reduction=0.3, elements=1)
    accepted = list(march(scene, Schedule(accuracy=1e-2), Control(FailsAbove(0.1), fallbacks=())))
    assert len(accepted) > 10
    assert sum("too long" in increment.reason for increment in accepted) == 1


def test_an_increment_that_fails_for_good_carries_the_state_and_advice():
    scene = upsetting(mu=0.0, reduction=0.1, elements=2)
    control = Control(FailsAlways(), fallbacks=(), cuts=2)
    with pytest.raises(IncrementFailed, match=r"from tau = 0 to .* failed \(.*nothing doing.*\)\. Use more") as caught:
        list(march(scene, Schedule(1), control))
    assert caught.value.state.tau == 0.0


def test_inversion_is_cut_with_the_reason():
    """45 % in one increment inverts nothing: it is certified or cut with its reason recorded."""
    scene = upsetting(mu=0.3, reduction=0.6, elements=2)
    accepted = list(march(scene, Schedule(1, first=0.001), Control(DIRECT)))
    assert accepted[-1].state.tau == 1.0
    assert all(a.reason for a in accepted if a.cuts)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Schedule(0), "increments = 0"),
        (lambda: Schedule(5, first=-0.1), "first = -0.1"),
        (lambda: Schedule(5, first=0.3), "start-up = 1.5"),
        (lambda: Schedule(5, first=1.5), r"first = 1.5: must be zero, or in \[1e-09, 1\)"),
        (lambda: Schedule(first=np.array([0.1, 0.2]), accuracy=1e-3), "first = array.*: must be a number"),
        (lambda: Schedule(5, growth=1.0), "growth = 1.0"),
        (lambda: Schedule(5, first=0.1, landings=(0.3,)), "landing = 0.3"),
        (lambda: Schedule(5, settling=0), "settling = 0"),
        (lambda: Control(cuts=-1), "cuts = -1"),
        (lambda: Control(spared=-1), "spared = -1: must be >= 0"),
        (lambda: Control(spared=51), "spared = 51: must be at most 50"),
        (lambda: Control(spared=True), "spared = True"),
    ],
)
def test_bad_control_is_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_tighter_bounds_are_met_or_refused():
    scene = upsetting(mu=0.1, reduction=0.01, elements=2)
    tight = Limits(replace(Bounds(), equilibrium=1e-12))
    for accepted in march(scene, Schedule(1, first=0.1), Control(DIRECT, limits=tight)):
        assert accepted.solved.certificate.equilibrium <= 1e-12


@pytest.mark.parametrize("schedule", [Schedule(2), Schedule(accuracy=1e-3)])
def test_an_increment_that_never_succeeds_ends_where_a_pseudo_time_has_no_more_digits_to_halve(schedule, monkeypatch):
    """From 0.6 on, steps of 1e-7 halved fifty times would be of 1e-22: a sum that is rounded has none below 1e-16."""
    scene = upsetting(mu=0.0, elements=1)
    begun = next(march(scene, Schedule(1, landings=(0.6,)))).course
    ends = list[float]()

    def fails(increment, *_):
        ends.append(increment.tau)
        assert len(ends) < 120
        raise NotConverged("never")

    monkeypatch.setattr(attempting, "solve_facing", fails)
    with pytest.raises(IncrementFailed, match="never"):
        next(march(scene, schedule, Control(DIRECT, (), cuts=50), replace(begun, size=1e-7, uncut=1e-7)))
    tried = list(dict.fromkeys(ends))
    assert len(tried) > 20
    assert all(0.6 < later < earlier for earlier, later in pairwise(tried))
