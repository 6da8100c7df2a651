"""A point that bears a force is in touch, though a solver leaves it a gap: welds hold there, and energies are the same.

The bound on the law lets gaps of 1e-9 of a body's size and more stand where there is a force.
"""

from dataclasses import replace

import numpy as np
import pytest

from bipot.contact.closeness import closed
from bipot.energy import Energies
from bipot.fem.reduction import Geometry
from bipot.forms import Cache, Newton
from bipot.increment import Limits, advance, solve_increment
from bipot.iterate import Increment
from bipot.marching import march
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.revolved import sphere
from bipot.tools.tool import FlatTool, ShapedTool
from tests.space import RUBBER

WHOLE = sphere((0.5, 0.5, 3.0), 2.0)


def pressed(tool):
    d = len(tool.travel)
    mesh = block(1.0, 1.0, 2, 2) if d == 2 else brick(1.0, 1.0, 1.0, 2, 2, 2)
    held = tuple(Support("base", axis) for axis in range(d))
    return Scene(mesh, Geometry.SOLID if d == 3 else Geometry.PLANE_STRAIN, RUBBER, held, (tool,))


def second_from(first, left):
    """The second increment and its energies, where points that bear a force are ``left`` so far off."""
    bears = first.state.forces[:, 0] > 0
    start = replace(first.state, gap=np.where(bears, left, first.state.gap))
    solved = solve_increment(
        Increment(first.solved.iterate.increment.system, start, 1.0), Newton(), Limits(), Cache(), 0.0
    )
    end = advance(start, solved)
    return end, Energies().after(start, end, solved)


@pytest.mark.parametrize(
    "tool",
    [
        ShapedTool(WHOLE, (0.02, 0.01, -0.04), ("top",), np.inf),
        FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.02, 0.01, -0.04), ("top",), np.inf),
        ShapedTool(Circle((0.5, 3.0), 2.0), (0.02, -0.04), ("top",), np.inf),
    ],
    ids=["ball", "flat", "circle"],
)
def test_a_weld_holds_across_the_gap_that_a_solver_leaves(tool):
    scene = pressed(tool)
    first = next(march(scene, Schedule(2)))
    top = scene.mesh.boundary_nodes("top")
    welded = top[np.abs(first.state.du[top] - np.divide(tool.travel, 2)).max(axis=1) < 1e-9]
    assert welded.size
    second, _ = second_from(first, 1e-8)
    went = np.broadcast_to(np.divide(tool.travel, 2), (len(welded), len(tool.travel)))
    np.testing.assert_allclose(second.du[welded], went, rtol=0, atol=1e-7)


def test_the_work_of_a_curved_tool_does_not_depend_on_the_gap_that_a_solver_leaves():
    scene = pressed(ShapedTool(WHOLE, (0.04, 0.0, -0.04), ("top",), 0.3))
    first = next(march(scene, Schedule(2)))
    done = [second_from(first, left)[1].work for left in (0.0, 1e-8)]
    assert done[1] == pytest.approx(done[0], rel=1e-6)


def test_a_point_apart_that_keeps_what_a_solver_leaves_of_zero_force_is_not_in_touch():
    gap = np.array([0.0, 2e-9, 2e-9, 1e-3, 5e-8])
    r = np.array([[0.0, 0.0], [1.0, 0.0], [1e-12, 0.0], [1e-7, 0.0], [-0.5, 0.1]])
    assert closed(gap, r, 1.0).tolist() == [True, True, False, False, True]
