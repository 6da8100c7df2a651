"""Shaped tools in space that come into a body between its nodes, or go through it, are refused."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Force
from bipot.tools.profiles import Profile, wedge
from bipot.tools.revolved import Revolved, cone, roll, sphere
from bipot.tools.tool import ShapedTool
from tests.space import RUBBER, dented

UP = (0.0, 0.0, 1.0)


def test_tools_that_come_in_between_nodes_of_a_face_are_refused():
    scene = dented(elements=2, material=RUBBER)
    held = tuple(Support("base", d) for d in range(3))
    deep = replace(scene, supports=held)
    for surface in (sphere((0.25, 0.25, 1.0 + 0.16), 0.15), cone((0.25, 0.25, 1.01), UP, 10.0, 5.0)):
        tool = ShapedTool(surface, (0.0, 0.0, -0.3), ("top",), 0.1)
        with pytest.raises(Exception, match=r"tools\[0\] comes into the body between nodes"):
            list(march(replace(deep, tools=(tool,)), Schedule(4), Control(Newton(), cuts=1)))
        inside = ShapedTool(replace(surface, point=(0.25, 0.25, 0.8)), (0.0, 0.0, -0.3), ("top",), 0.1)
        with pytest.raises(Exception, match=r"tools\[0\].surface = .*a part of it is behind nodes"):
            replace(deep, tools=(inside,))
    thin = Revolved(Profile(((1.0, 1.1), (1.0, 1.0), (-1.0, 1.0), (-1.0, 1.1)), 0.02, True), (0.5, 0.5, 1.0), UP)
    with pytest.raises(Exception, match=r"tools\[0\].surface = .*thick or more"):
        replace(deep, tools=(ShapedTool(thin, (0.0, 0.0, -0.3), ("top",), 0.1),))


@pytest.mark.parametrize("beside", [0.01, 0.04, 0.1])
def test_a_small_sphere_is_no_deeper_between_the_points_that_are_checked(beside):
    radius, at = 0.0627, (0.25, 0.25 - beside)
    ball = ShapedTool(sphere((*at, 1.0 + radius), radius), (0.0, 0.0, -radius), ("top",), 0.1)
    scene = replace(dented(elements=2, material=RUBBER), supports=tuple(Support("base", d) for d in range(3)))
    reached = [0.0]
    with pytest.raises(IncrementFailed, match="comes into the body between nodes"):
        reached.extend(a.state.tau * radius for a in march(replace(scene, tools=(ball,)), Schedule(20)))
    # A quarter of its thickness, as the face stays as it is: nothing is touched.
    assert max(reached) <= radius / 2


def test_what_is_refused_is_said_whatever_a_form_after_it_finds():
    """Newton solves the increment, in which nothing is touched; the program after it does not and knows no reason."""
    steel = VonMises(Elasticity(1000.0, 0.3), Linear(10.0, 50.0))
    scene = dented(roll((0.25, 0.5, 1.1), (0.0, 1.0, 0.0), 0.1), (0.0, 0.0, -0.1), elements=2, material=steel)
    scene = replace(scene, supports=tuple(Support("base", d) for d in range(3)))
    with pytest.raises(IncrementFailed, match=r"tools\[0\] comes into the body between nodes .* Refine the boundary"):
        list(march(scene, Schedule(5), Control(Newton())))


def test_a_sphere_does_not_go_through_a_block_in_one_increment():
    """Its path leads right through; whoever marches has to stop at it."""
    scene = dented(elements=2, material=RUBBER)
    ball = ShapedTool(sphere((0.5, 0.5, 1.6), 0.6), (0.0, 0.0, -4.0), ("top",), 0.1)
    held = tuple(Support("base", d) for d in range(3))
    with pytest.raises(Exception, match="tau = 0"):
        list(march(replace(scene, supports=held, tools=(ball,)), Schedule(1), Control(Newton(), cuts=2)))


def sharp(surface, travel):
    """A block of large faces under a sharp tool that comes down between their nodes."""
    steel = VonMises(Elasticity(70e3, 0.3), Perfect(100.0))
    held = tuple(Support("base", d) for d in range(3))
    tool = ShapedTool(surface, (0.0, 0.0, -travel), ("top",), mu=0.3)
    return Scene(brick(12.0, 12.0, 12.0, 2, 2, 2), Geometry.SOLID, steel, held, (tool,))


def deepest(scene, increments):
    """The travel reached before the tool is refused, with no force on the way."""
    reached = [0.0]

    def go():
        for accepted in march(scene, Schedule(increments), Control(Newton(), (), cuts=4)):
            assert not accepted.tool_force(0).any()
            reached.append(accepted.state.tau)

    with pytest.raises(IncrementFailed, match="comes into the body between nodes"):
        go()
    return reached[-1] * abs(scene.tools[0].travel[2])


@pytest.mark.parametrize("height", [0.0, 0.3, 0.7])
def test_a_tip_is_seen_wherever_heights_along_its_axis_count_from(height):
    """Its gap to itself is round-off, of either sign."""
    axis = np.array([0.3, 0.2, 1.0]) / np.linalg.norm([0.3, 0.2, 1.0])
    point = tuple(np.array([3.3, 3.1, 12.5]) - height * axis)
    scene = sharp(Revolved(wedge((0.0, height), 5.0, 10.0), point, tuple(axis)), 3.5)
    # Half a unit off, and a quarter of a tool's thickness deep at most.
    assert deepest(scene, 28) < 0.5 + 0.25 * scene.tools[0].face.tips().thickness + 0.2


def test_an_edge_around_the_axis_is_seen_between_the_points_of_faces():
    blade = Revolved(wedge((3.0, 0.0), 8.0, 12.0), (6.1, 6.2, 12.1), (0.0, 0.0, 1.0))
    scene = sharp(blade, 3.0)
    assert deepest(scene, 60) < 0.1 + 0.25 * blade.tips().thickness + 0.1


def test_a_ball_does_not_fly_through_a_body_in_one_increment():
    steel = VonMises(Elasticity(70e3, 0.3), Perfect(100.0))
    held = tuple(Support("base", d) for d in range(3))
    ball = ShapedTool(sphere((-48.72, 0.5, 0.75), 0.15), (100.0, 0.0, 0.0), ("left", "right"), mu=0.1)
    scene = Scene(brick(1.0, 1.0, 1.0, 1, 1, 2), Geometry.SOLID, steel, held, (ball,))
    with pytest.raises(IncrementFailed, match="comes into the body between nodes"):
        list(march(scene, Schedule(1), Control(Newton(), (), cuts=4)))


@pytest.mark.slow
def test_iterates_that_run_away_are_tried_shorter():
    """A plate so thin that next to nothing holds the tool at first: the sinkage is that of plane strain."""
    thin, steel, go = 1e-5, VonMises(Elasticity(70e3, 0.33), Perfect(100.0)), Schedule(2)
    held = Support("base", 2), Support("base", 0), Support("front", 1), Support("back", 1)
    surface, force = roll((2.0, 0.0, 6.0), (0.0, 1.0, 0.0), 4.0), Force((0.0, 0.0, -100 * thin))
    tool = ShapedTool(surface, (-0.4, 0.0, 0.0), ("top",), mu=0.0, driven_by=force)
    solid = Scene(brick(4.0, thin, 2.0, 4, 1, 2), Geometry.SOLID, steel, held, (tool,))
    circle = ShapedTool(Circle((2.0, 6.0), 4.0), (-0.4, 0.0), ("top",), mu=0.0, driven_by=Force((0.0, -100.0)))
    plane = Scene(
        block(4.0, 2.0, 4, 2), Geometry.PLANE_STRAIN, steel, (Support("base", 0), Support("base", 1)), (circle,)
    )
    sunk = [list(march(scene, go))[-1].tool_pose(0)[axis] for scene, axis in ((solid, 2), (plane, 1))]
    assert sunk[0] == pytest.approx(sunk[1], rel=1e-4)
    assert sunk[0] < -0.01
