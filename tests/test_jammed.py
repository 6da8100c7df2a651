"""Nodes between two tools that come together: where friction leaves them no way, the failure says so."""

from typing import Any

import numpy as np
import pytest

from bipot.checks.jammed import jammed
from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.iterate import Increment
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Turn
from bipot.tools.tool import FlatTool, ShapedTool

SOFT = VonMises(Elasticity(1e3, 0.3), Linear(10.0, 10.0))
NODE = 15
"""The corner that both tools have."""


def pressed(mu: tuple[float, float], slope: float = 0.0, lid: Any = None, wall: Any = None) -> Scene:
    """A block, its far side leaning out by an angle, under a lid that comes down and beside a wall that comes in."""
    mesh = block(1.0, 1.0, 3, 3, element=Element.Q4)
    nodes = mesh.nodes.copy()
    nodes[:, 0] *= 1 + np.tan(slope) * nodes[:, 1]
    inward = (-float(np.cos(slope)), float(np.sin(slope)))
    above = {"travel": (0.0, -0.02), **(lid or {})}
    beside = {"travel": (-0.02, 0.0), **(wall or {})}
    tools = (
        FlatTool((0.0, 1.0), (0.0, -1.0), candidates=("top",), mu=mu[0], **above),
        FlatTool((1.0, 0.0), inward, candidates=("right",), mu=mu[1], **beside),
    )
    held = Support("base", 1), Support("left", 0)
    return Scene(Mesh(nodes, mesh.elements, mesh.boundaries), Geometry.PLANE_STRAIN, SOFT, held, tools)


def words(asked: Scene) -> str | None:
    """What a march says at its end, None where it comes through."""
    try:
        list(march(asked, Schedule(2), Control(cuts=1)))
    except IncrementFailed as failed:
        return str(failed)
    return None


@pytest.mark.parametrize("mu", [(1.2, 1.2), (2.0, 0.6)])
def test_a_node_between_a_lid_and_a_wall_that_both_hold_it_is_named(mu):
    """It takes (mu_1 r_1 - r_2, mu_2 r_2 - r_1) of normal forces r on both: inward for no r where mu_1 mu_2 >= 1."""
    said = words(pressed(mu))
    assert said is not None
    assert f"Node {NODE} is jammed between tools[0] and tools[1]" in said
    assert "less than 90 degrees" in said


@pytest.mark.parametrize(("mu", "slope"), [((1.2, 0.8), 0.0), ((2.0, 0.45), 0.0), ((0.55, 0.55), np.pi / 6)])
def test_just_below_the_march_comes_through(mu, slope):
    assert words(pressed(mu, slope)) is None


@pytest.mark.parametrize("mu", [0.6, 0.9])
def test_between_walls_that_lean_the_angle_counts(mu):
    """A corner of 60 degrees: friction of 30 degrees on both, mu = 0.577, holds what is between them."""
    said = words(pressed((mu, mu), slope=np.pi / 6))
    assert said is not None
    assert "less than 60 degrees" in said


@pytest.mark.parametrize(("mu", "tools"), [((np.inf, 0.0), (0, 1)), ((0.1, np.inf), (1, 0))])
def test_a_weld_that_takes_a_node_into_another_tool_is_named(mu, tools):
    """Whatever the friction of the other, by half of the way in half of the time."""
    said = words(pressed(mu))
    assert said is not None
    assert f"Node {NODE} is welded to tools[{tools[0]}], which takes it" in said
    assert f"deep into tools[{tools[1]}]: give the former friction" in said


def test_a_weld_that_takes_a_node_along_another_tool_is_not_blamed():
    assert words(pressed((np.inf, 0.1), wall={"travel": (0.0, 0.0)})) is None


def test_the_advice_is_followed():
    eased = pressed((1.2, 1.2), lid={"mu_at": {NODE: 0.5}})
    assert words(eased) is None


def test_a_brick_is_told_as_well():
    mesh = brick(1.0, 1.0, 1.0, 2, 1, 2)
    lid = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.02), ("top",), 1.5)
    wall = FlatTool((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (-0.02, 0.0, 0.0), ("right",), 1.5)
    held = Support("base", 2), Support("left", 0), Support("front", 1)
    said = words(Scene(mesh, Geometry.SOLID, SOFT, held, (lid, wall)))
    assert said is not None
    assert "is jammed between tools[0] and tools[1]" in said


@pytest.mark.parametrize(
    "changes",
    [{"wall": {"travel": (0.0, 0.0)}}, {"wall": {"travel": (0.0, 0.0), "driven_by": Force((-1e-3, 0.0))}}],
    ids=["at rest", "driven"],
)
def test_tools_that_leave_the_node_a_way_are_not_blamed(changes):
    said = words(pressed((1.2, 1.2), **changes))
    assert said is None or "jammed" not in said


@pytest.mark.parametrize(
    ("lid", "wall", "is_jam"),
    [
        ((0.0, -0.02), (-0.02, 0.0), True),
        ((0.01, -0.02), (0.0, 0.0), True),
        ((0.0, -0.02), (0.0, 0.0), False),
        ((0.0, -0.02), (0.0, -0.02), False),
        ((0.0, 0.02), (-0.02, 0.0), False),
        ((0.0, -0.02), (0.02, 0.0), False),
        ((-0.02, 0.0), (-0.02, 0.0), False),
    ],
)
def test_each_must_come_nearer_to_what_sticks_to_the_other(lid, wall, is_jam):
    system = system_of(pressed((1.2, 1.2), lid={"travel": lid}, wall={"travel": wall}))
    assert (jammed(Increment(system, system.rest(), 1.0)) is not None) == is_jam


SLOPE = 0.5


def sloping(mu: float, dimension: int = 2, goes: float = 0.0) -> Scene:
    """A block under a lid that slopes up to a wall, which holds the block along, and comes nearer to that."""
    mesh = block(1.0, 1.0, 3, 3, element=Element.Q4) if dimension == 2 else brick(1.0, 1.0, 1.0, 2, 1, 2)
    x = mesh.nodes.copy()
    x[:, -1] *= 1 + np.tan(SLOPE) * x[:, 0]
    across = (0.0,) * (dimension - 2)
    normal = (float(np.sin(SLOPE)), *across, -float(np.cos(SLOPE)))
    lid = FlatTool((0.0, *across, 1.0), normal, (0.02, *across, 0.0), ("top",), mu)
    wall = Prescribed("right", 0, goes) if goes else Support("right", 0)
    held = Support("base", dimension - 1), wall, *[Support("front", 1)] * (dimension - 2)
    flat = Geometry.PLANE_STRAIN if dimension == 2 else Geometry.SOLID
    return Scene(Mesh(x, mesh.elements, mesh.boundaries), flat, SOFT, held, (lid,))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("part", [0.97, 1.03])
def test_a_node_between_a_tool_and_its_support_is_named(part, dimension):
    """Of r (sin a, -cos a) and friction, what is across the support is upward, the way out, where mu is below cot a."""
    said = words(sloping(part / np.tan(SLOPE), dimension))
    assert (said is None) == (part < 1)
    if said is not None:
        assert "is jammed between tools[0] and what holds it" in said
        assert f"less than {1 / np.tan(SLOPE):.4g}" in said


def test_a_support_that_goes_along_with_the_tool_jams_nothing():
    assert words(sloping(1.5 / np.tan(SLOPE), goes=0.02)) is None


@pytest.mark.parametrize("part", [0.97, 1.03])
def test_a_node_between_a_tool_and_its_mirror_image_is_named(part):
    """Two jaws of a groove close on the point of a body of which a half is modelled."""
    mesh, slope = block(1.0, 1.0, 3, 3, element=Element.Q4), 0.3
    x = mesh.nodes.copy()
    x[:, 1] += np.tan(slope) * x[:, 0] * (1 - x[:, 1])
    up = (-float(np.sin(slope)), float(np.cos(slope)))
    jaw = FlatTool((0.0, 0.0), up, (-0.03, 0.0), ("base",), float(part / np.tan(slope)))
    lid = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), 0.0)
    half = Mesh(x, mesh.elements, mesh.boundaries)
    said = words(Scene(half, Geometry.PLANE_STRAIN, SOFT, (Symmetry("left", 0),), (jaw, lid)))
    assert (said is None) == (part < 1)
    assert said is None or "Node 0 is jammed between tools[0] and what holds it" in said


RADIUS, ACROSS = 1.2, 0.6
"""A roll, and how far its axis is from the wall: at the wall its surface rises by cot a = sqrt(R^2 - c^2) / c."""
STEEP = float(np.sqrt(RADIUS**2 - ACROSS**2) / ACROSS)


def rolled(mu: float) -> Scene:
    """A block beside a wall, into which a roll is pressed and then turns: metal rises between wall and roll."""
    centre, down = (ACROSS, 1.0 + RADIUS), 0.95 * (RADIUS - float(np.sqrt(RADIUS**2 - ACROSS**2)))
    turn = Turn(-0.1, centre, Amplitude(((0.0, 0.0), (0.4, 0.0), (1.0, 1.0))))
    path = (0.0, 0.0), (0.4, 1.0), (1.0, 1.0)
    roll = ShapedTool(Circle(centre, RADIUS), (0.0, -down), ("top",), mu, path, turn=turn)
    held = Support("base", 1), Support("left", 0)
    return Scene(block(1.0, 1.0, 3, 1), Geometry.PLANE_STRAIN, SOFT, held, (roll,))


def test_a_node_that_its_body_brings_to_the_tool_is_named():
    """Of r (-sin a, -cos a) and friction mu r (-cos a, sin a), what is along the wall is downward below mu = cot a.

    The roll turns in place, so it would not reach a body that rests.
    """
    steps = list(march(rolled(0.97 * STEEP), Schedule(8, landings=(0.4,))))
    landed = next(k for k, step in enumerate(steps) if step.state.forces[0].any())
    before, end = steps[landed - 1].state, steps[landed].state.tau
    less, more = (jammed(Increment(system_of(rolled(part * STEEP)), before, end)) for part in (0.97, 1.03))
    assert before.gap[0] > 1e-3
    assert less is None
    assert more is not None
    assert "is jammed between tools[0] and what holds it" in more
