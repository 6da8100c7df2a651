"""Increments by accuracy of a tool that begins off the body: what it goes through the air strains nothing."""

from dataclasses import replace
from itertools import islice, pairwise, takewhile

import numpy as np
import pytest

from bipot import handed_on
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule, march
from bipot.meshes.sections import block, cylinder
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.tool import FlatTool, ShapedTool
from bipot.yielding import is_past_yield, through_air
from studies.accuracy.paced import CONTROL

ACCURACY, PRESSED = 1e-4, 0.1
MATERIAL = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 300.0))


def pressed(gap: float, pace: float = 1.0) -> Scene:
    """A cylinder beneath a tool that begins by the ``gap`` above it, and goes a third of that so many times as fast."""
    third = gap / 3 / (PRESSED + gap)
    path = ((0.0, 0.0), (third / pace, third), (1.0, 1.0)) if gap else ((0.0, 0.0), (1.0, 1.0))
    tool = FlatTool((0.0, 1.0 + gap), (0.0, -1.0), (0.0, -PRESSED - gap), ("top",), 0.3, path)
    held = Symmetry("base", 1), Support("axis", 0)
    return Scene(cylinder(1.0, 1.0, 4, 4), Geometry.AXISYMMETRIC, MATERIAL, held, (tool,))


def sinks(scene: Scene, gap: float, accuracy: float = ACCURACY, count: int = 3) -> np.ndarray:
    """How far the tool of a ``scene``, which begins by the ``gap`` above it, is in the body after increments."""
    steps = islice(march(scene, Schedule(accuracy=accuracy), CONTROL), count + 2)
    sunk = [-gap - scene.travel(0.0, step.state.tau)[0, 1] for step in steps]
    return np.array([depth for depth in sunk if depth > 1e-6][:count])


@pytest.mark.parametrize("pace", [1.0, 1.5])
def test_a_tool_that_comes_through_the_air_presses_in_the_increments_of_one_that_touches(pace):
    """The way was counted as strain: yielding began in an increment judged as past it, off by 9 times the accuracy.

    With a change of pace on the way, it was followed in five times the increments of one that touches.
    """
    np.testing.assert_allclose(sinks(pressed(0.05, pace), 0.05), sinks(pressed(0.0), 0.0), rtol=1e-3)


def test_a_curved_tool_that_comes_through_the_air_does_so_too():
    """It was in the body by a sixth of its way when it first touched."""
    held = Symmetry("base", 1), Symmetry("left", 0)

    def dented(gap: float) -> Scene:
        tool = ShapedTool(Circle((0.0, 3.0 + gap), 2.0), (0.0, -PRESSED - gap), ("top",), 0.2)
        return Scene(block(1.0, 1.0, 3, 3), Geometry.PLANE_STRAIN, MATERIAL, held, (tool,))

    np.testing.assert_allclose(sinks(dented(0.1), 0.1, 1e-3, 2), sinks(dented(0.0), 0.0, 1e-3, 2), rtol=1e-2)


LIFTED = ((0.0, 0.0), (0.3, (0.0, 0.5)), (0.5, (0.0, -0.5)), (1.0, (1.0, 1.0)))


@pytest.mark.parametrize(("gap", "path"), [(0.05, ((0.0, 0.0), (1.0, 1.0))), (0.0, LIFTED)], ids=["at rest", "lifted"])
def test_what_a_tool_slides_in_the_air_does_not_rub(gap, path):
    """Beneath a flat one slips are those of whole increments: the force was off by 58 to 340 times the accuracy."""
    held = Support("base", 0), Support("base", 1)
    tool = FlatTool((0.0, 1.0 + gap), (0.0, -1.0), (0.1, -PRESSED - gap), ("top",), 0.1, path)
    scene, accuracy = Scene(block(1.0, 1.0, 4, 4), Geometry.PLANE_STRAIN, MATERIAL, held, (tool,)), 1e-3
    steps = list(march(scene, Schedule(accuracy=accuracy), CONTROL))
    ends = [0.0, *(step.state.tau for step in steps)]
    parts = tuple(float(tau) for a, b in pairwise(ends) for tau in np.linspace(a, b, 9)[1:])
    fine = {step.state.tau: step.tool_force(0) for step in march(scene, Schedule(1, landings=parts[:-1]), CONTROL)}
    off = [abs(step.tool_force(0) - fine[step.state.tau])[1] for step in steps]
    assert max(off) < 3 * accuracy * max(abs(force[1]) for force in fine.values())


def test_a_way_through_the_air_that_is_cut_goes_on_to_where_a_tool_touches():
    """A roll turns by more than one increment may: the rest went into the body, off by 86 times what was asked."""
    held, gap, centre = (Support("base", 0), Support("base", 1)), 0.5, (2.5, 0.5)
    tool = FlatTool((0.0, 1.0 + gap), (0.0, -1.0), (0.1, -0.02 - gap), ("top",), 0.1)
    roll = ShapedTool(Circle(centre, 0.5), (0.0, 0.0), ("right",), 0.1, turn=Turn(1.0, centre))
    scene = Scene(block(1.0, 1.0, 2, 2), Geometry.PLANE_STRAIN, MATERIAL, held, (tool, roll))
    first, second, third = islice(march(scene, Schedule(accuracy=1e-3), CONTROL), 3)
    assert first.cuts == 1
    assert second.state.tau == pytest.approx(gap / (0.02 + gap), abs=1e-6)
    assert not second.state.forces.any()
    assert third.state.forces.any()


def test_a_curved_tool_that_goes_on_out_of_reach_is_seen_to_touch_beside_a_flat_one():
    """It was looked for where the way of the flat one ends, and met where halving had taken it, in the body."""
    held = Support("base", 0), Support("base", 1)
    over = ShapedTool(Circle((-1.0, 1.48), 0.5), (30.0, 0.0), ("top", "left", "right"), 0.1)
    above = FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.1)
    scene = Scene(block(1.0, 1.0, 2, 2), Geometry.PLANE_STRAIN, MATERIAL, held, (over, above))
    first = next(march(scene, Schedule(accuracy=1e-3), CONTROL))
    touched = 1.0 - np.sqrt(0.5**2 - 0.48**2)
    assert first.state.tau == pytest.approx(touched / 30, abs=1e-6)
    assert first.cuts == 0


def test_the_half_of_a_first_increment_is_that_of_what_strains_the_body():
    """One tool rests on it, with a force, while another comes through the air."""
    held, gap, turn = (Symmetry("base", 1), Symmetry("left", 0)), 0.05, 0.5
    top = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.0, ((0.0, 0.0), (turn, 1.0), (1.0, 1.0)))
    wide = 1.11 + gap
    side = FlatTool((wide, 0.0), (-1.0, 0.0), (-0.2 - gap, 0.0), ("right",), 0.0, ((0.0, 0.0), (turn, 0.0), (1.0, 1.0)))
    scene = Scene(block(1.0, 1.0, 2, 2), Geometry.PLANE_STRAIN, MATERIAL, held, (top, side))
    *_, before, step = takewhile(lambda step: step.start.tau <= turn, march(scene, Schedule(accuracy=1e-3), CONTROL))
    increment = step.solved.iterate.increment
    assert before.state.tau == turn
    assert increment.in_halves
    touched = turn + through_air(increment)
    assert turn < touched < step.state.tau
    parts = (*np.linspace(turn, touched, 2)[1:], *np.linspace(touched, step.state.tau, 33)[1:])
    landings = tuple(map(float, parts))
    fine = list(islice(march(scene, Schedule(1, landings=landings), CONTROL, before.course), len(parts)))
    assert step.tool_force(1)[0] == pytest.approx(fine[-1].tool_force(1)[0], rel=1e-3)


def test_a_body_that_another_march_has_left_is_not_where_its_mesh_is():
    """It bulges beyond the mesh, up to the next tool, which has gone through no air."""
    held = Symmetry("base", 1), Symmetry("left", 0)
    path = (0.0, 0.0), (0.9, 1.0), (1.0, 0.8)
    down = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.2), ("top",), 0.0, path)
    scene = Scene(block(1.0, 1.0, 2, 2), Geometry.PLANE_STRAIN, MATERIAL, held, (down,))
    *_, last = march(scene, Schedule(10), CONTROL)
    aside = FlatTool((float(last.state.nodes[:, 0].max()), 0.0), (-1.0, 0.0), (-0.2, 0.0), ("right",), 0.0)
    scene = replace(scene, tools=(aside,))
    steps = list(march(scene, Schedule(5), CONTROL, handed_on(last.state, scene)))
    assert all(is_past_yield(step.solved.iterate.increment) for step in steps)
