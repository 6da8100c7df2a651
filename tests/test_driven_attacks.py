"""Attacks on tools that forces press and moments turn: held nodes in their way, centres far off, odd numbers."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bipot.errors import IncrementFailed, SceneError
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.results.description import describe
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.profiles import Profile
from bipot.tools.tool import ShapedTool
from tests.test_driven_rolls import LATE, roller

MIDDLE = 1.0, 1.0


def over_held_nodes(tool: ShapedTool) -> Scene:
    """A block 2 x 1 held at its base and at an edge of its top, to the right of the middle: a tool may touch that."""
    mesh = block(2.0, 1.0, 4, 2)
    x = mesh.nodes[mesh.boundary("top"), 0]
    edge = mesh.boundary("top")[(x.min(axis=1) >= 1.0) & (x.max(axis=1) <= 1.5)]
    mesh = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "part": edge})
    held = tuple(Support(name, k) for name in ("base", "part") for k in (0, 1))
    return Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1e3, 0.3)), held, (tool,))


def off_tools(accepted, tool=0) -> float:
    """The least gap of the tool's nodes, from where they are and how the tool is placed."""
    scene, pose = accepted.scene, accepted.tool_pose(tool)
    return float(scene.tools[tool].distance(accepted.state.nodes[scene.mesh.boundary_nodes("top")], pose).min())


def test_an_eccentric_roll_comes_down_on_a_held_node_and_not_into_it():
    """At rest its bottom is above the node, and no turn goes along the normal there: as if it never did."""
    turn = Turn(0.0, (1.0, 1.5), driven_by=Moment(1.0))
    scene = over_held_nodes(ShapedTool(Circle((1.0, 2.01), 1.0), (0.0, 0.0), ("top",), 0.2, turn=turn))
    (found,) = march(scene, Schedule(1), Control(Tangent(), ()))
    assert abs(off_tools(found)) < 1e-9
    np.testing.assert_allclose(found.tool_moment(0), 1.0, rtol=1e-6)
    # Exactly as far as the roll turns until the middle of the top is on it: |C + Q e - X| = R.
    theta = found.tool_pose(0)[2]
    bottom = np.array([1.0 - 0.51 * math.sin(theta), 1.5 + 0.51 * math.cos(theta)])
    np.testing.assert_allclose(np.linalg.norm(bottom - MIDDLE), 1.0, atol=1e-9)


def test_a_die_that_a_force_drives_aside_is_stopped_by_a_held_node():
    """Beside a step of it the node is nearest to a flat, along which the force goes."""
    step = Profile(((4.0, 0.99), (1.8, 0.99), (1.6, 1.1), (-4.0, 1.1)), 0.05)
    tool = ShapedTool(step, (0.0, 0.0), ("top",), 0.1, driven_by=Force((-1.0, 0.0)))
    mesh = block(1.5, 1.0, 3, 2)
    right = np.flatnonzero((mesh.nodes == (1.5, 1.0)).all(axis=1))
    edge = mesh.boundary("top")[np.isin(mesh.boundary("top"), right).any(axis=1)]
    mesh = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "part": edge})
    held = tuple(Support(name, k) for name in ("base", "part") for k in (0, 1))
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1e3, 0.3)), held, (tool,))
    *_, found = march(scene, Schedule(1), Control(Tangent(), (Dissipation(),)))
    assert -1e-9 < off_tools(found) < 1e-6
    np.testing.assert_allclose(found.tool_forces[0, 0], -1.0, rtol=1e-6)


@pytest.mark.parametrize("far", [1e8, 1e11])
def test_a_roll_on_a_long_arm_goes_on_from_a_state(far):
    """Seen from its centre a place has the round-off of the arm, which no gap may have."""
    scene = roller(0.0)
    swung = replace(scene.tools[0], turn=Turn(0.0, (0.9, far), driven_by=Moment(0.5 * far, LATE)))
    scene, schedule, control = replace(scene, tools=(swung,)), Schedule(4), Control(Newton(), (Tangent(),))
    whole = list(march(scene, schedule, control))
    # An arm so long goes straight aside, by the force M / far.
    np.testing.assert_allclose(whole[-1].tool_forces[0, 0], 0.5, rtol=1e-6)
    for accepted in whole:
        np.testing.assert_allclose(off_tools(accepted), accepted.state.gap.min(), atol=1e-13)
    assert next(march(scene, schedule, control, whole[1].state)).state.tau > whole[1].state.tau


def test_a_moment_does_not_spin_a_roll_that_is_yet_to_be_pressed():
    """That no friction holds it before says nothing of why an increment fails in which a force presses it."""
    turn = Turn(0.0, (0.9, 1.5), driven_by=Moment(0.8))
    crushed = roller(travel=(0.0, 0.0), driven_by=Force((0.0, -1e5)), turn=turn)
    with pytest.raises(IncrementFailed) as caught:
        next(march(crushed, Schedule(1), Control(Tangent(), (), cuts=0)))
    assert "spins" not in str(caught.value)


def test_numbers_of_other_types_are_plain_ones_or_refused_in_words():
    odd: Any = np.array(1)
    with pytest.raises(SceneError, match=r"support\.direction = array\(1\)"):
        Support("base", odd)
    with pytest.raises(SceneError, match=r"force\.vector = array\(1\)"):
        Force(odd)
    one: Any = np.int64(1)
    assert type(Support("base", one).direction) is int
    with pytest.raises(SceneError, match=r"turn\.centre = 1e\+50: must be of a magnitude"):
        Turn(0.0, (1e50, 0.0))
    with pytest.raises(SceneError, match=r"turn\.angle.* = 10000000\.0: must be of at most 1e\+06 radians"):
        Turn(1e7, (0.0, 0.0))
    assert Turn(1e-8, (0.0, 0.0)).at(1.0) == 1e-8
    assert describe(roller(0.8))["supports"][0]["direction"] == 1


def test_a_moment_on_a_roll_in_the_air_is_told_that_nothing_holds_it():
    aloft = roller(0.8, travel=(0.0, 0.0))
    aloft = replace(aloft, tools=(replace(aloft.tools[0], surface=Circle((0.9, 1.6), 1.0)),))
    with pytest.raises(IncrementFailed, match=r"tools\[0\] touches nothing that would hold its moment of"):
        list(march(aloft, Schedule(4), Control(Newton(), (Tangent(),), cuts=0)))


@pytest.mark.parametrize(("beside", "words"), [(30.0, "meets none of its candidates on its way"), (0.5, "")])
def test_a_tool_that_a_force_drives_past_the_body_is_told(beside, words):
    ball = Circle((beside, 6.1), 5.0)
    past = ShapedTool(ball, (0.0, 0.0), ("top",), 0.1, driven_by=Force((0.0, -1e-3)))
    supports = tuple(Support("base", d) for d in range(2))
    scene = Scene(block(1.0, 1.0, 2, 2), Geometry.PLANE_STRAIN, Elastic(Elasticity(1.0, 0.3)), supports, (past,))
    steps = march(scene, Schedule(2), Control(Newton(), (Tangent(),), cuts=0))
    if words:
        with pytest.raises(IncrementFailed, match=words):
            next(steps)
    else:
        assert next(steps).tool_forces[0, 1] < 0
