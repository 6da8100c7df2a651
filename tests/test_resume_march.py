"""A march goes on from any of its courses as if it had never been interrupted: to the last bit, by every form."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.forms import FormName, Tangent
from bipot.forms.memory import Paced
from bipot.marching import Control, march
from bipot.schedule import Schedule
from tests.courses import (
    EVENTS,
    FORMS,
    March,
    Refusing,
    cut,
    fallen_back,
    forced,
    landing,
    loaded,
    moving,
    sliding,
    stored,
    unlike,
    upset,
)


def marks(make, name):
    """Of what tells least: forms that take the longest, where nothing lands."""
    return [pytest.mark.slow] * (
        name in ("delassus", "penalty", "tangent through cvxpy", "uzawa") and make is not landing
    )


EACH = [
    pytest.param(make, name, id=f"{make.__name__}, {name}", marks=marks(make, name))
    for make in EVENTS
    for name in FORMS
]


def goes_on(asked: March) -> None:
    """Every increment from the course before it, read back, and the whole rest from the one half-way."""
    whole = asked.run()
    seen, half = [asked.seen(accepted) for accepted in whole], len(whole) // 2
    for number, before in enumerate(whole[:-1], start=1):
        going_on = march(asked.scene, asked.schedule, asked.control, stored(before.course))
        following = list(going_on) if number == half else [next(going_on)]
        expected = seen[number:] if number == half else seen[number : number + 1]
        assert unlike(expected, [asked.seen(accepted) for accepted in following]) == []


@pytest.mark.parametrize(("make", "name"), EACH)
def test_a_march_goes_on_from_every_course_to_the_last_bit(make, name):
    goes_on(make(FORMS[name]))


@pytest.mark.parametrize("name", ["newton", "tangent", "dissipation"])
def test_so_it_does_where_parts_face_others_than_at_rest(name):
    goes_on(sliding(FORMS[name]))


def test_so_it_does_after_cuts():
    asked = cut(Tangent())
    assert any(accepted.cuts and np.isfinite(accepted.course.size) for accepted in asked.run())
    goes_on(asked)


@pytest.mark.slow
def test_the_marches_meet_what_they_are_for():
    forms = {accepted.form for accepted in fallen_back(FORMS["newton"]).run()}
    assert forms == {FormName.NEWTON, FormName.TANGENT}
    assert max(accepted.course.landed.sum() for accepted in landing(FORMS["tangent"]).run()) > 1
    for make in (loaded, forced, moving):
        whole = make(FORMS["tangent"]).run()
        assert whole[-1].state.peeq.any()
        assert whole[-1].course.largest > 0
        assert whole[-1].energies.friction > 0
    assert whole[-1].course.largest > np.abs(whole[-1].state.forces).max(), "a force that is no more counts"


def test_the_first_increment_of_a_course_at_rest_is_that_of_none():
    asked = upset(FORMS["newton"])
    first = asked.run()[0]
    at_rest = type(first.course).of(first.start)
    assert unlike([asked.seen(first)], [asked.seen(asked.run(start=at_rest)[0])]) == []


def test_what_the_predictor_remembers_is_needed():
    """Without it the rest is the same to the bounds of acceptance, but not to the last bit."""
    asked = upset(FORMS["newton"])
    before, after = asked.run()[3:5]
    forgetful = replace(before.course, before=2 * (Paced.unknown(before.state),))
    other = asked.run(start=forgetful)[0]
    assert unlike([asked.seen(after)], [asked.seen(other)]) != []
    np.testing.assert_allclose(other.solved.r, after.solved.r, atol=1e-6 * after.course.largest)


def test_a_course_at_the_end_yields_nothing():
    asked = upset(FORMS["newton"])
    assert asked.run(start=asked.run()[-1].course) == []


def test_a_state_begins_and_a_course_goes_on():
    asked = upset(FORMS["newton"])
    middle = asked.run()[3]
    anew, on = (asked.run(start=start)[0] for start in (middle.state, middle.course))
    assert (anew.number, on.number) == (1, 5)
    assert anew.energies.work == pytest.approx(on.energies.work - middle.energies.work)
    assert on.course.largest >= middle.course.largest


@pytest.fixture(scope="module")
def between():
    """A course half-way between two scheduled pseudo-times, after two cuts."""
    asked = cut(Tangent())
    course = next(a.course for a in asked.run() if a.cuts == 2)
    assert course.uncut == pytest.approx(2 * course.size)
    return asked.scene, course


def test_in_another_schedule_its_pseudo_times_rule(between):
    """One may lie ahead, or be where the course is: increment control then begins anew."""
    scene, course = between
    tau, size = course.state.tau, course.size

    def ends(*landings):
        schedule = Schedule(1, landings=landings)
        return [a.state.tau for a in march(scene, schedule, Control(Tangent(), ()), course)]

    assert ends()[0] == tau + size
    assert ends(tau + size / 2)[0] == tau + size / 2
    assert ends(tau) == [1.0]


@pytest.mark.parametrize("way", [0.0, 1.0])
def test_a_pseudo_time_that_another_machine_rounds_otherwise_is_the_same(way):
    """An increment of the last bit's length tells nothing, and no form solves it."""
    asked = upset(FORMS["newton"])
    middle = asked.run()[3]
    tau = float(np.nextafter(middle.state.tau, way))
    started = replace(middle.course, state=replace(middle.state, tau=tau))
    assert asked.run(start=started)[0].state.tau == asked.run()[4].state.tau


@pytest.mark.parametrize("cuts", [1, 3])
def test_of_another_control_the_cuts_count_from_the_uncut_length(between, cuts):
    scene, course = between
    going_on = march(scene, Schedule(1), Control(Refusing(longest=course.uncut / 6), (), cuts=cuts), course)
    if cuts == 1:
        with pytest.raises(IncrementFailed):
            next(going_on)
    else:
        found = next(going_on)
        assert (found.cuts, found.state.tau) == (2, course.state.tau + course.uncut / 8)
