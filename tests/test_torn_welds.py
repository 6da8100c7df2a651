"""Welds that supports tear: on tools of any shape, however these move."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bipot.control.control import Control
from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.iterate import Increment
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import march
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tensors import norm
from bipot.tools.circle import Circle
from bipot.tools.deformable import AnyTool
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool

SOFT, CORNER = Elastic(Elasticity(1.0, 0.3)), (0.0, 1.0)


def lid(across: float = 0.0, turn: Turn | None = None) -> ShapedTool:
    """A welded plane on the top, which goes across or turns."""
    return ShapedTool(Plane((0.0, 1.0), (0.0, -1.0)), (across, 0.0), ("top",), np.inf, turn=turn)


def wheel(across: float = 0.0, turn: Turn | None = None) -> ShapedTool:
    """A welded roll on the left end of the top."""
    return ShapedTool(Circle((0.0, 3.0), 2.0), (across, 0.0), ("top",), np.inf, turn=turn)


def scene(tool: AnyTool, *walls: Support) -> Scene:
    return Scene(block(1.0, 1.0, 3, 2), Geometry.PLANE_STRAIN, SOFT, walls, (tool,))


def torn(asked: Scene) -> Any:
    """The place at rest of the node that the increment to the end of the path tears off, None if there is none."""
    system = system_of(asked)
    node = Increment(system, system.rest(), 1.0).torn
    return None if node is None else tuple(asked.mesh.nodes[node].tolist())


@pytest.mark.parametrize("held", [(0,), (0, 1)], ids=["along", "fast"])
@pytest.mark.parametrize(
    "tool",
    [lid(0.02), lid(turn=Turn(0.05, (0.0, 3.0))), wheel(0.02), wheel(turn=Turn(0.05, (0.0, 3.0)))],
    ids=["lid across", "lid turned", "roll across", "roll turned"],
)
def test_a_corner_that_a_wall_holds_does_not_go_along_with_its_tool(tool, held):
    assert torn(scene(tool, *(Support("left", axis) for axis in held))) == CORNER


@pytest.mark.parametrize("make", [lid, wheel])
def test_what_is_driven_as_the_tool_turns_is_not_torn(make):
    """The tool turns by theta about a point above the corner at 2, which goes by (2 sin theta, 2 (1 - cos theta))."""
    theta = 0.05
    tool = make(turn=Turn(theta, (0.0, 3.0)))
    x, y = 2 * float(np.sin(theta)), 2 * (1 - float(np.cos(theta)))
    assert torn(scene(tool, Prescribed("left", 0, x), Prescribed("left", 1, y))) is None
    assert torn(scene(tool, Prescribed("left", 0, x))) is None
    assert torn(scene(tool, Prescribed("left", 0, 1.001 * x))) == CORNER


def test_a_corner_about_which_the_tool_turns_is_not_torn():
    assert torn(scene(lid(turn=Turn(0.05, CORNER)), Support("left", 0), Support("left", 1))) is None


def test_where_a_moment_turns_the_tool_it_may_stay_at_the_wall():
    free = Turn(0.0, (0.0, 3.0), driven_by=Moment(0.1))
    assert torn(scene(wheel(turn=free), Support("left", 0))) is None


@pytest.mark.parametrize(
    "tool",
    [
        FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), np.inf, driven_by=Force((5.0, 0.0))),
        wheel(turn=Turn(0.0, (0.0, 3.0), driven_by=Moment(1.0))),
    ],
    ids=["lid", "roll"],
)
def test_a_weld_that_only_a_corner_held_fast_would_feel_is_refused(tool):
    """The corner takes all of the force, or moment, but has no unknown and no row: the tool went on without it."""
    asked = scene(tool, Support("left", 0), Support("left", 1))
    assert torn(asked) == CORNER
    with pytest.raises(IncrementFailed, match="cannot go with the tool that it is welded to"):
        list(march(asked, Schedule(2), Control(Newton(), (), cuts=0)))


@pytest.mark.parametrize("free", [Force((0.0, -5.0)), Force((3.0, -5.0))], ids=["down", "obliquely"])
def test_a_corner_held_fast_that_a_force_presses_holds_the_tool(free):
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), np.inf, driven_by=free)
    *_, end = march(scene(tool, Support("left", 0), Support("left", 1)), Schedule(2))
    np.testing.assert_allclose(end.tool_pose(0), 0.0, atol=1e-12)
    np.testing.assert_allclose(end.tool_force(0) @ free.direction, free.size, rtol=1e-6)


def test_in_space_a_welded_lid_that_turns_about_its_normal_is_torn_off_a_wall():
    turn = Turn(0.05, (0.5, 0.5, 1.0), axis=(0.0, 0.0, 1.0))
    tool = ShapedTool(Plane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)), (0.0, 0.0, 0.0), ("top",), np.inf, turn=turn)
    mesh = brick(1.0, 1.0, 1.0, 2, 1, 1)
    asked = Scene(mesh, Geometry.SOLID, SOFT, (Support("left", 0), Support("base", 2)), (tool,))
    found = torn(asked)
    assert found is not None
    assert norm(np.array(found)[[0, 2]] - CORNER) < 1e-12


def test_a_march_names_it():
    pause = Amplitude(((0.0, 0.0), (0.4, 0.0), (1.0, 1.0)))
    pressed = (0.0, 0.0), (0.4, 1.0), (1.0, 1.0)
    tool = ShapedTool(
        Circle((0.0, 3.0), 2.0), (0.0, -0.02), ("top",), np.inf, pressed, turn=Turn(0.05, (0.0, 3.0), pause)
    )
    walls = Support("base", 1), Support("left", 0)
    with pytest.raises(IncrementFailed, match="cannot go with the tool that it is welded to"):
        list(march(scene(tool, *walls), Schedule(2, landings=(0.4,))))
