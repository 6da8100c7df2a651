"""A course that no march leaves is refused by name: when it is made, or where a march of the scene starts from it."""

import copy
import pickle
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from bipot.control.course import Course
from bipot.energy import Energies
from bipot.errors import SceneError
from bipot.forms.memory import Paced
from bipot.marching import march
from bipot.paper import upsetting
from bipot.schedule import Schedule
from bipot.state import ARRAYS
from tests.courses import FORMS, stored, unlike, upset
from tests.scenes import refused

NAN = float("nan")
ASKED = upset(FORMS["newton"])


@pytest.fixture(scope="module")
def accepted():
    return ASKED.run()[4]


@pytest.fixture
def course(accepted):
    return accepted.course


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"state": None}, "course.state = None: must be a State"),
        ({"number": -1}, "course.number = -1: must be >= 0"),
        ({"number": 2.0}, "course.number = 2.0: must be a whole number"),
        ({"energies": (0.0, 0.0)}, "course.energies = .*: must be an Energies"),
        ({"energies": Energies(work=NAN)}, "course.energies.work = nan: must be finite"),
        ({"energies": Energies(friction="1")}, "course.energies.friction = '1': must be a number"),
        ({"largest": 1.0}, "course.largest = 1.0: must be at least .*, the largest contact force of course.state"),
        ({"largest": float("inf")}, "course.largest = inf: must be finite"),
        ({"largest": None}, "course.largest = None: must be a number"),
        ({"size": 0.0, "uncut": 0.1}, "course.size = 0.0: must be NaN, or from 1e-20 to 1"),
        ({"proposed": 5e-324}, "course.proposed = 5e-324: must be NaN, or from 1e-20 to 1"),
        ({"size": 0.1, "uncut": 1.1}, "course.uncut = 1.1: must be NaN, or from 1e-20 to 1"),
        ({"size": Fraction(1, 2)}, "course.uncut = nan: must be NaN if course.size is, which is 0.5"),
        ({"size": 0.1}, "course.uncut = nan: must be NaN if course.size is"),
        ({"uncut": 0.1}, "course.uncut = 0.1: must be NaN if course.size is"),
        ({"landed": [0, 1]}, "course.landed = 'of type int64': must be booleans"),
        ({"landed": None}, "course.landed = 'of type object': must be booleans"),
        ({"before": None}, "course.before = None: must be a tuple of Paced"),
        ({"before": ()}, r"course.before = \(\): must be two"),
        ({"before": (None, None)}, r"course.before\[0\] = None: must be a Paced"),
    ],
)
def test_impossible_values_are_refused_when_it_is_made(course, changes, words):
    refused(lambda: replace(course, **changes), words)


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("of", ["complex", "U40", "bool"])
def test_arrays_of_a_state_are_of_numbers(course, name, of):
    """Imaginary parts were dropped and texts read as numbers; other things ended as errors of NumPy."""
    array = getattr(course.state, name)
    refused(lambda: replace(course.state, **{name: array.astype(of)}), rf"state.{name} = 'of type .*': must be numbers")
    refused(lambda: replace(course.state, **{name: [[1.0], [1.0, 2.0]]}), f"state.{name}: must be an array of numbers")


@pytest.mark.parametrize("name", ["strain", "peeq"])
@pytest.mark.parametrize("of", ["complex", "U40", "bool"])
def test_so_are_those_of_a_flow(course, name, of):
    flow = course.state.flow
    words = rf"flow.{name} = 'of type .*': must be numbers"
    refused(lambda: replace(flow, **{name: getattr(flow, name).astype(of)}), words)
    refused(lambda: replace(flow, **{name: [[1.0], [1.0, 2.0]]}), f"flow.{name}: must be an array of numbers")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"nodes": 0.0}, r"state.nodes = 'of shape \(\)': must be of shape \(a, d\)"),
        ({"stress": np.zeros((4, 7))}, r"state.stress = 'of shape \(4, 7\)': must be of shape \(e, q, s\)"),
        ({"gap": np.zeros((8, 1))}, r"state.gap = 'of shape \(8, 1\)': must be of shape \(c,\)"),
        ({"tau": None}, "state.tau = None: must be a number"),
        ({"length": "x"}, "state.length = 'x': must be a number"),
        ({"flow": 3}, "state.flow = 3: must be a Flow or None"),
    ],
)
def test_a_state_of_something_else_is_refused_when_it_is_made(course, changes, words):
    """It could not be printed, and a march refused it later."""
    refused(lambda: replace(course.state, **changes), words)


def test_a_course_begins_at_a_state():
    refused(lambda: Course.of(None), "state = None: must be a State")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tau": "0"}, "paced.tau = '0': must be a number"),
        ({"middle": None}, "paced.middle = None: must be a number"),
        ({"velocity": ["fast"]}, "paced.velocity"),
        ({"forces": None}, "paced.forces"),
    ],
)
def test_so_are_those_of_the_increment_before(course, changes, words):
    refused(lambda: replace(course.before[0], **changes), words)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            lambda c: {"landed": c.landed[1:]},
            r"start.landed = 'of shape \(\d+,\)': must be of shape",
        ),
        (lambda c: {"size": 0.9, "uncut": 0.9}, "start.size = 0.9: must be at most 0.5.*, what is left of the path"),
        (lambda c: _before(c, velocity=c.before[0].velocity[1:]), r"start.before\[0\].velocity = 'of shape"),
        (lambda c: _before(c, velocity=NAN * c.before[0].velocity), r"start.before\[0\].velocity = 'NaN or infinite'"),
        (lambda c: _before(c, forces=c.before[0].forces[1:]), r"start.before\[0\].forces = 'of shape"),
        (lambda c: _before(c, tau=0.9), r"start.before\[0\].tau = 0.9: must be below start.state.tau, 0.48"),
        (lambda c: _before(c, middle=0.41), r"start.before\[0\].middle = 0.41: must be at most start.before\[0\].tau"),
        (lambda c: _before(c, 1, tau=0.45), r"start.before\[1\].tau = 0.45: must be at most start.before\[0\].tau"),
        (lambda c: _before(c, 1, middle=0.41), r"start.before\[1\].middle = 0.41: must be at most"),
        (lambda c: _state(c, nodes=c.state.nodes + 1.0), "start.nodes = 'held ones'"),
        (lambda c: _state(c, stress=10 * c.state.stress), "start.stress"),
    ],
)
def test_what_is_not_of_the_scene_is_refused_by_the_march(course, changes, words):
    refused(lambda: ASKED.run(start=replace(course, **changes(course))), words)


def _before(course, k=0, **changes):
    before = list(course.before)
    before[k] = replace(before[k], **changes)
    return {"before": tuple(before)}


def _state(course, **changes):
    return {"state": replace(course.state, **changes)}


def test_a_course_of_another_mesh_is_refused(course):
    with pytest.raises(SceneError, match=r"start.nodes = 'of shape .*as in the scene"):
        march(upsetting(mu=0.3, elements=3, reduction=0.03), Schedule(3), start=course)


def test_its_arrays_refuse_to_be_written_to(course):
    for array in (course.landed, *(array for paced in course.before for array in (paced.velocity, paced.forces))):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


@pytest.mark.parametrize("again", [copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c)), stored])
def test_a_copy_of_it_is_the_same(course, again):
    expected, found = (ASKED.seen(ASKED.run(start=start)[0]) for start in (course, again(course)))
    assert unlike([expected], [found]) == []


def test_it_counts_what_the_march_has_done(accepted):
    whole = ASKED.run()
    course = accepted.course
    assert course.number == 5 == accepted.number
    assert course.state is accepted.state
    assert course.energies == accepted.energies
    assert course.largest == max(np.abs(a.solved.r).max() for a in whole[:5])
    assert np.isnan(course.size)
    assert not course.landed.any()
    for paced, before in zip(course.before, (whole[3], whole[2]), strict=True):
        assert paced.tau == before.state.tau
        assert paced.middle == pytest.approx((before.start.tau + before.state.tau) / 2)
        np.testing.assert_array_equal(paced.velocity, before.state.rates)
        np.testing.assert_array_equal(paced.forces, before.state.forces)


def test_one_that_begins_at_a_state_knows_of_nothing_before(accepted):
    course = Course.of(accepted.state)
    assert (course.number, course.energies) == (0, Energies())
    assert course.largest == np.abs(accepted.state.forces).max()
    assert np.isnan([course.size, course.uncut]).all()
    for paced in course.before:
        assert isinstance(paced, Paced)
        assert np.isnan([paced.tau, paced.middle]).all()
