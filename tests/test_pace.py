"""A change of pace, in which all goes on in the same proportions, changes no answer: the body is rate-independent."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import Control, Dissipation, FlatTool, Newton, Pressure, Schedule, ShapedTool, march, upsetting
from bipot.control.estimate import error_estimate
from bipot.control.lag import lag
from bipot.fem.reduction import Geometry
from bipot.forms.memory import Paced
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.paces import Paces, paces_of
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Moment, Turn
from bipot.tools.surfaces import Plane
from bipot.yielding import is_past_yield
from studies.fuzz.unfolded import unfolded
from tests.scenes import Listed

METAL = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 600.0))
TRAVELS = np.array([0.02, 0.04, 0.08, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
HALF = 0.5


def clock(quicker):
    """Pseudo-times of parts of the way: the second half is ``quicker`` times as fast as the first."""
    kink = quicker / (1 + quicker)
    return lambda part: np.interp(part, (0.0, HALF, 1.0), (0.0, kink, 1.0))


def along(points, quicker):
    """Points (part of the way, multiple) on that clock."""
    at = clock(quicker)
    taus = sorted({*(part for part, _ in points), HALF})
    values = np.array([np.ravel(multiple) for _, multiple in points])
    own = [np.interp(taus, [part for part, _ in points], column) for column in values.T]
    return tuple((float(at(tau)), tuple(map(float, row))) for tau, row in zip(taus, np.transpose(own), strict=True))


def scalar(points, quicker):
    return tuple((tau, multiple[0]) for tau, multiple in along(points, quicker))


STRAIGHT = ((0.0, 0.0), (1.0, 1.0))
SWERVING = ((0.0, (0.0, 0.0)), (0.2, (0.0, 0.3)), (1.0, (1.0, 1.0)))


def upset(quicker):
    scene = upsetting(mu=0.3, reduction=0.2, elements=4)
    punch, *others = scene.tools
    return replace(scene, tools=(replace(punch, path=scalar(STRAIGHT, quicker)), *others))


def slid(quicker):
    """Pressed, then pressed and slid, beneath a growing pressure from aside."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.1, -0.1), ("top",), 0.2, along(SWERVING, quicker))
    held = Support("base", 0), Support("base", 1)
    pressure = Pressure("right", 30.0, Amplitude(scalar(STRAIGHT, quicker)))
    return Scene(block(2.0, 1.0, 4, 3), Geometry.PLANE_STRAIN, METAL, held, (tool,), loads=(pressure,))


def twisted(quicker):
    """A brick beneath a lid that presses and turns."""
    top = (0.5, 0.5, 1.0)
    turn = Turn(0.1, top, Amplitude(scalar(STRAIGHT, quicker)), axis=(0.0, 0.0, 1.0))
    path = scalar(STRAIGHT, quicker)
    lid = ShapedTool(Plane(top, (0.0, 0.0, -1.0)), (0.0, 0.0, -0.04), ("top",), 0.1, path, turn=turn)
    held = tuple(Support("base", d) for d in range(3))
    return Scene(brick(1.0, 1.0, 1.0, 2, 2, 2), Geometry.SOLID, METAL, held, (lid,))


def driven(quicker):
    """A block that supports bear up against a tool at rest, whose path has a rate all the same."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), 0.2)
    lifted = Prescribed("base", 1, 0.08, Amplitude(scalar(STRAIGHT, quicker)))
    return Scene(block(2.0, 1.0, 4, 3), Geometry.PLANE_STRAIN, METAL, (Support("base", 0), lifted), (tool,))


def beside(quicker):
    """Beside a tool that goes away at its own pace, out of reach."""
    scene = upset(quicker)
    return replace(scene, tools=(*scene.tools, FlatTool((1000.0, 0.0), (-1.0, 0.0), (10.0, 0.0), ("side",), 0.1)))


def idle(quicker):
    """Beside a roll that would turn freely and under a pressure of none, both at an even pace."""
    scene, centre = slid(quicker), (-1.0, 0.5)
    roll = ShapedTool(Circle(centre, 0.5), (0.0, 0.0), ("left",), 0.3, turn=Turn(0.0, centre, driven_by=Moment(0.0)))
    return replace(scene, tools=(*scene.tools, roll), loads=(*scene.loads, Pressure("right", 0.0)))


@cache
def marched(make, quicker, travels=tuple(TRAVELS)):
    ends = clock(quicker)(np.array(travels)).tolist()
    return list(march(make(quicker), Listed(1, ends=tuple(ends)), Control(Newton())))


def forces(steps):
    return np.array([a.tool_forces for a in steps])


SCENES = pytest.mark.parametrize("make", [upset, slid, twisted, driven, beside, idle])


@SCENES
@pytest.mark.parametrize("quicker", [2.0, 0.5, 30.0])
def test_a_change_of_pace_changes_neither_forces_nor_passes(make, quicker):
    """As at a turn of the path, forces differed by up to 1e-4, and 9 to 17 passes went into one increment."""
    even, other = (marched(make, q) for q in (1.0, quicker))
    assert [a.passes for a in other] == [a.passes for a in even]
    expected = forces(even)
    np.testing.assert_allclose(forces(other), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@SCENES
def test_what_is_told_of_an_increment_after_a_change_of_pace_is_what_is_told_without_one(make):
    even, other = (marched(make, q) for q in (1.0, 3.0))
    for a, b in zip(even, other, strict=True):
        assert is_past_yield(b.solved.iterate.increment) == is_past_yield(a.solved.iterate.increment)
        assert error_estimate(b.start, b.solved) == pytest.approx(
            error_estimate(a.start, a.solved), rel=1e-6, abs=1e-12
        )
        assert lag(b.start, b.solved) == pytest.approx(lag(a.start, a.solved), rel=1e-6, abs=1e-12)


def test_a_path_of_many_paces_is_a_straight_one():
    """A path as a table of a smooth clock has: each of its points is a kink."""
    scene, parts = upset(1.0), np.linspace(0.0, 1.0, 11)
    taus = parts**1.5
    path = tuple(zip(taus.tolist(), parts.tolist(), strict=True))
    wound = replace(scene, tools=(replace(scene.tools[0], path=path), *scene.tools[1:]))
    steps = list(march(wound, Listed(1, ends=tuple(taus[1:].tolist())), Control(Newton())))
    even = marched(upset, 1.0, tuple(parts[1:].tolist()))
    assert [a.passes for a in steps] == [a.passes for a in even]
    np.testing.assert_allclose(forces(steps), forces(even), rtol=1e-9)


@pytest.mark.parametrize("make", [upset, slid])
def test_increments_by_accuracy_after_a_change_of_pace_are_those_without_one(make):
    """Where one ends at the same place as there."""
    even, other = (
        list(march(make(q), Schedule(accuracy=1e-3, landings=(HALF,) if q == 1 else ()), Control(Newton())))
        for q in (1.0, 4.0)
    )
    taus = clock(4.0)([a.state.tau for a in even])
    np.testing.assert_allclose([a.state.tau for a in other], taus, rtol=1e-9)
    np.testing.assert_allclose(forces(other), forces(even), rtol=0, atol=1e-8 * np.abs(forces(even)).max())


def test_a_march_resumed_at_a_change_of_pace_goes_on_to_the_last_bit():
    whole = marched(slid, 2.0)
    kink = clock(2.0)(HALF)
    (at,) = (a for a in whole if a.state.tau == kink)
    for before in (at, whole[whole.index(at) + 1]):
        rest = whole[whole.index(before) + 1 :]
        ends = tuple(a.state.tau for a in rest)
        again = list(march(slid(2.0), Listed(1, ends=ends), Control(Newton()), before.course))
        np.testing.assert_array_equal(forces(again), forces(rest))


@pytest.mark.parametrize("length", [2**-27, 2**-31, 2**-37])
def test_what_comes_in_next_to_no_time_is_a_change_of_pace_as_well(length):
    """Kinks next to each other were one, or increments had no digits, without an end; and its courses were refused."""
    path = ((0.0, 0.0), (0.5, 2e-9), (0.5 + length, 0.5), (1.0, 1.0))
    scene = upset(1.0)
    jumps = replace(scene, tools=(replace(scene.tools[0], path=path), *scene.tools[1:]))
    ends = (0.5, 0.5 + length, 0.75, 1.0)
    whole = list(march(jumps, Listed(1, ends=ends), Control(Newton())))
    even = marched(upset, 1.0, (2e-9, 0.5, 0.75, 1.0))
    assert [a.passes for a in whole] == [a.passes for a in even]
    np.testing.assert_allclose(forces(whole), forces(even), rtol=0, atol=1e-9 * np.abs(forces(even)).max())
    again = march(jumps, Listed(1, ends=ends), Control(Newton()), whole[1].course)
    np.testing.assert_array_equal(forces(again), forces(whole[2:]))
    paced = list(march(jumps, Schedule(accuracy=1e-2), Control(Newton())))
    np.testing.assert_allclose(forces(paced)[-1], forces(even)[-1], rtol=0, atol=1e-2 * np.abs(forces(even)).max())


@pytest.mark.parametrize("quicker", [2.0, 0.1])
def test_past_a_turn_of_the_path_the_pace_does_not_matter_either(quicker):
    """Pressed, then slid at another pace: lengths in pseudo-time tell nothing of how much flow goes on there."""

    def turning(kink):
        path = ((0.0, (0.0, 0.0)), (kink, (0.0, 0.5)), (1.0, (0.1, 1.0)))
        tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.1, -0.1), ("top",), 0.05, path)
        held = Support("base", 0), Support("base", 1)
        scene = Scene(block(2.0, 1.0, 6, 4), Geometry.PLANE_STRAIN, METAL, held, (tool,))
        ends = (*np.linspace(0, kink, 11)[1:].tolist(), *np.linspace(kink, 1, 11)[1:3].tolist())
        return list(march(scene, Listed(1, ends=ends), Control(Newton())))

    even, other = turning(0.5), turning(quicker / (1 + quicker))
    assert even[10].solved.response.state is not even[10].start, "no flow was carried on"
    np.testing.assert_allclose(forces(other), forces(even), rtol=0, atol=1e-7 * np.abs(forces(even)).max())


@pytest.mark.parametrize("form", [Newton(), Dissipation()])
def test_a_tool_that_leaves_turns_the_path_however_far_it_goes(form):
    """Beside one that goes on: the flow beneath the other is none that goes on, wherever that is by the end."""

    def squeezed(away):
        pressed, held = ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0 - away / 0.02)), (Support("left", 0),)
        lid = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.02), ("top",), 0.3, pressed)
        bed, slide = (
            FlatTool(point, normal, travel, (boundary,), 0.1)
            for point, normal, travel, boundary in (
                ((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), "base"),
                ((2.0, 0.0), (-1.0, 0.0), (-0.2, 0.0), "right"),
            )
        )
        scene = Scene(block(2.0, 1.0, 4, 3), Geometry.PLANE_STRAIN, METAL, held, (lid, bed, slide))
        *_, last = march(scene, Listed(1, ends=(0.25, 0.5, 0.75)), Control(form))
        return last

    near, far = squeezed(5.0), squeezed(100.0)
    assert near.solved.iterate.increment.past.turns
    assert far.solved.iterate.increment.past.turns
    np.testing.assert_allclose(far.state.peeq, near.state.peeq, rtol=0, atol=1e-6)


def test_half_of_a_body_is_in_reach_of_what_the_whole_is():
    """Beside it something stops that is farther off than ten of the half, and nearer than ten of the whole."""
    stops = FlatTool((16.0, 0.0), (-1.0, 0.0), (0.1, 0.0), ("right",), 0.1, ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)))
    lid = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.01), ("top",), 0.1)
    held = Symmetry("left", 0), Support("base", 1)
    half = Scene(block(1.0, 1.0, 2, 2), Geometry.PLANE_STRAIN, METAL, held, (lid, stops))
    (seen,) = unfolded(half)
    turns = [list(march(scene, Schedule(2)))[-1].solved.iterate.increment.past.turns for scene in (half, seen.scene)]
    assert turns[0] == turns[1]


REST = (0.0, 0.0)


@pytest.mark.parametrize(
    ("moved", "kinks", "quicker"),
    [
        ([(((0, 0.0), (0.5, 1.0), (1, 3.0)), (1.0,))], [0.5], [2.0]),
        ([(((0, 0.0), (0.5, 1.0), (1, 0.0)), (1.0,))], [0.5], [np.nan]),
        ([(((0, 0.0), (0.5, 1.0), (0.75, 1.0), (1, 2.0)), (1.0,))], [0.5, 0.75], [np.nan, np.nan]),
        ([(((0, 0.0), (0.5, 1.0), (1, 3.0)), (1.0,)), (((0, 0.0), (1, 1.0)), (1.0,))], [0.5], [np.nan]),
        ([(((0, 0.0), (0.5, 1.0), (1, 3.0)), (1.0,)), (((0, 0.0), (1, 1.0)), (0.0,))], [0.5], [2.0]),
        ([(((0, 0.0), (0.5, 1.0), (1, 3.0)), (1.0,)), (((0, 1.0), (1, 1.0)), (1.0,))], [0.5], [2.0]),
        ([(((0, 0.0), (0.5, 1.0), (1, 3.0)), (1.0,)), (((0, 0.0), (0.5, -2.0), (1, -6.0)), (9.0,))], [0.5], [2.0]),
        ([(((0, 0.0), (0.3, 1.0), (1, 8.0)), (1.0,)), (((0, 0.0), (0.1 + 0.2, 1.0), (1, 8.0)), (1.0,))], [0.3], [3.0]),
        ([(((0, REST), (0.5, (0.0, 1.0)), (1, (1.0, 2.0))), (1.0, 1.0))], [0.5], [np.nan]),
        ([(((0, REST), (0.5, (0.0, 1.0)), (1, (1.0, 3.0))), (0.0, 1.0))], [0.5], [2.0]),
        ([(((0, REST), (0.5, (1.0, 1.0)), (1, (2.0, 2.0 + 1e-9))), (1.0, 1.0))], [0.5], [np.nan]),
        ([(((0, 1.0), (0.5, 1.0), (1, 2.0)), (1.0,)), (((0, 0.0), (1, 2.0)), (1.0,))], [0.5], [np.nan]),
        ([(((0, 0.0), (1e-13, 1.0), (0.5, 1.0), (1, 2.0)), (1.0,)), (((0, 0.0), (1, 2.0)), (1.0,))], [0.5], [np.nan]),
        (
            [(((0, 0.0), (0.5, 1.0), (0.5 + 2**-31, 2.0), (1, 2.5)), (1.0,))],
            [0.5, 0.5 + 2**-31],
            [2**30, 2**-31 / (1 - 2**-30)],
        ),
        ([(((0, 1.0), (1, 0.0)), (1.0,))], [1e-9], [np.nan]),
        ([(((0, 0.0), (0.5, 1e-11), (1, 1.0)), (1.0,))], [0.5], [np.nan]),
        ([(((0, 0.0), (1, 1.0)), (1.0,))], [], []),
        ([], [], []),
    ],
)
def test_which_kinks_change_the_pace_alone(moved, kinks, quicker):
    found = paces_of(tuple(moved))
    np.testing.assert_allclose(found.kinks, kinks, rtol=1e-14)
    np.testing.assert_allclose(found.quicker, quicker, rtol=1e-11)
    for kink, factor in zip(kinks, quicker, strict=True):
        assert found.is_turn(kink) == np.isnan(factor)
        assert found.factor(kink) == pytest.approx(1.0 if np.isnan(factor) else factor)
        assert not found.is_turn(kink + 1e-3)
        assert found.factor(kink + 1e-3) == 1.0


def test_the_way_since_the_last_turn_is_told_at_the_pace_of_now():
    paces = Paces((0.2, 0.5, 0.75), (np.nan, 2.0, 4.0))
    assert paces.since_turn(0.1, 0.2) == (0.0, 0.2)
    assert paces.since_turn(0.2, 0.5) == (0.2, pytest.approx(0.3))
    assert paces.since_turn(0.6, 0.7) == (0.2, pytest.approx(0.2 + 0.3 / 2))
    assert paces.since_turn(0.75, 1.0) == (0.2, pytest.approx(0.25 + 0.25 / 4 + 0.3 / 8))


def test_an_increment_seen_at_another_pace_is_as_far_back_as_it_would_be():
    paced = Paced(0.5, 0.25, np.array([1.0, -2.0]), np.array([[3.0, 0.5]]))
    found = paced.at_pace(4.0, 1.0)
    assert (found.tau, found.middle) == (1 - 0.5 / 4, 1 - 0.75 / 4)
    np.testing.assert_array_equal(found.velocity, [4.0, -8.0])
    np.testing.assert_array_equal(found.forces, paced.forces)
    assert paced.at_pace(1.0, 1.0) is paced
