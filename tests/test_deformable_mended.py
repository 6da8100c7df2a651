"""Contact at deformable tools that slide off an end, and of thin parts whose whole outlines may touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Circle,
    Control,
    DeformableTool,
    Elastic,
    Elasticity,
    Force,
    Geometry,
    IncrementFailed,
    Linear,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Turn,
    VonMises,
    block,
    march,
    together,
)
from bipot.meshes.mesh import Mesh

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 1000.0))
SIDES = ("base", "right", "top", "left")


def _stacked(height: float, low: tuple[int, int], up: tuple[int, int]) -> Mesh:
    """Two blocks of unit width and this height, one on the other, with these numbers of elements."""
    upper = block(1.0, height, *up)
    raised = replace(upper, nodes=upper.nodes + np.array([0.0, height]))
    return together({"low": block(1.0, height, *low), "up": raised})


def test_points_that_slide_off_an_end_do_no_work_across_the_way_to_nothing() -> None:
    held = Support("low/base", 1), Support("low/base", 0), Prescribed("up/top", 1, -0.02), Prescribed("up/top", 0, 0.3)
    tools = (DeformableTool(("low/top",), ("up/base",), 0.3),)
    scene = Scene(_stacked(1.0, (3, 2), (5, 2)), Geometry.PLANE_STRAIN, STEEL, held, tools)
    *_, last = march(scene, Schedule(10), Control(Newton()))
    assert abs(last.energies.energy_error) < 0.01


@pytest.mark.parametrize("height", [0.05, 1.0])
def test_parts_of_one_element_may_touch_with_their_whole_outlines(height: float) -> None:
    mesh, elastic = _stacked(height, (4, 1), (5, 1)), Elastic(Elasticity(210e3, 0.3))
    pressed = Prescribed("up/top", 1, -0.1 * height)
    held = Support("low/base", 1), Support("low/base", 0), pressed, Support("up/left", 0)
    forces = []
    for low, up in ((("top",), ("base",)), (SIDES, SIDES)):
        tool = DeformableTool(tuple(f"low/{side}" for side in low), tuple(f"up/{side}" for side in up), 0.2)
        *_, last = march(Scene(mesh, Geometry.PLANE_STRAIN, elastic, held, (tool,)), Schedule(2), Control(Newton()))
        forces.append(last.tool_forces[0])
    np.testing.assert_allclose(*forces, rtol=1e-9)


def test_a_march_goes_on_from_an_accepted_state_to_the_last_bit() -> None:
    held = Support("low/base", 1), Support("low/base", 0), Prescribed("up/top", 1, -0.02), Prescribed("up/top", 0, 0.1)
    tools = (DeformableTool(("low/top",), ("up/base",), 0.3),)
    scene = Scene(_stacked(1.0, (3, 2), (5, 2)), Geometry.PLANE_STRAIN, STEEL, held, tools)
    whole = list(march(scene, Schedule(4), Control(Newton())))
    rest = list(march(scene, Schedule(4), Control(Newton()), whole[1].course))
    np.testing.assert_array_equal(rest[-1].state.nodes, whole[-1].state.nodes)


@pytest.mark.parametrize("driven", [False, True])
def test_a_roll_presses_a_part_that_presses_another(driven: bool) -> None:
    held = Support("low/base", 1), Support("low/base", 0), Support("up/left", 0), Prescribed("up/left", 1, -0.02)
    between = DeformableTool(("low/top",), ("up/base",), 0.2)
    roll = ShapedTool(Circle((0.5, 2.5), 0.5), (0.0, -0.05), ("up/top",), 0.3, turn=Turn(0.1, (0.5, 2.5)))
    if driven:
        roll = replace(roll, travel=(0.0, 0.0), driven_by=Force((0.0, -60.0)))
    forces = []
    for tools in ((between, roll), (roll, between)):
        scene = Scene(_stacked(1.0, (3, 2), (5, 2)), Geometry.PLANE_STRAIN, STEEL, held, tools)
        *_, last = march(scene, Schedule(4), Control(Newton()))
        forces.append(last.tool_forces[np.argsort([tool is roll for tool in tools])])
        np.testing.assert_allclose(last.reactions.sum(axis=0), -forces[-1][1], rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(*forces, rtol=1e-5, atol=1e-4)


def test_thin_strips_do_not_pass_each_other_in_one_increment() -> None:
    """Behind the other side of a strip nothing is faced, so that the one above was taken through it."""
    strip = block(2.0, 0.03, 3, 1), block(1.0, 0.03, 4, 1)
    mesh = together({"low": strip[0], "up": replace(strip[1], nodes=strip[1].nodes + np.array([0.5, 0.63]))})
    held = [Support(f"low/{end}", k) for end in ("left", "right") for k in range(2)]
    held += [Support(f"up/{end}", 0) for end in ("left", "right")]
    driven = (Prescribed(f"up/{end}", 1, -1.5) for end in ("left", "right"))
    tool = DeformableTool(tuple(f"low/{s}" for s in SIDES), tuple(f"up/{s}" for s in SIDES), 0.2)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(210e3, 0.3)), (*held, *driven), (tool,))
    with pytest.raises(IncrementFailed, match=r"sides of tools\[0\]|goes through"):
        list(march(scene, Schedule(1)))


def test_of_a_slip_that_ends_on_another_part_what_is_in_the_air_is_no_friction() -> None:
    """Nine tenths of the way are a gap: of one increment half of the slip counted, of many what is in touch."""
    mesh = _stacked(1.0, (3, 2), (5, 2))
    mesh = replace(mesh, nodes=mesh.nodes + np.where(mesh.part[:, None] == mesh.part.max(), [0.0, 0.009], 0.0))
    held = Support("low/base", 1), Support("low/base", 0), Prescribed("up/top", 1, -0.01), Prescribed("up/top", 0, 0.1)
    tools = (DeformableTool(("low/top",), ("up/base",), 0.3),)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(210e3, 0.3)), held, tools)
    once, often = (list(march(scene, Schedule(n), Control(Newton())))[-1].energies.friction for n in (1, 20))
    assert once == pytest.approx(often, rel=0.25)
