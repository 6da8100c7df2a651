"""Energy where points come before deformable tools, and leave them, by sliding past an end of these."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Amplitude,
    Control,
    DeformableTool,
    Element,
    Geometry,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    Support,
    block,
    brick,
    march,
    together,
)
from tests.deformable import ELASTIC, shifted

MU = 0.3
PRESSED, DRAGGED = Amplitude(((0.0, 0.0), (0.2, 1.0), (1.0, 1.0))), Amplitude(((0.0, 0.0), (0.2, 0.0), (1.0, 1.0)))


def dragged(element, *, long):
    """A block pressed onto a longer one and dragged along it; its face, or the ``long`` one, has the candidates."""
    if element is Element.H8:
        low, up = brick(3.0, 1.5, 0.5, 7, 3, 1), shifted(brick(1.0, 1.0, 0.5, 2, 2, 1), 0.3, 0.25, 0.5)
    else:
        low = block(4.0, 1.0, 13, 1, element=element)
        up = shifted(block(1.0, 0.5, 3, 1, element=element), 0.5, 1.0)
    mesh, across = together({"low": low, "up": up}), low.dimension - 1
    supports = (
        *(Support("low/base", axis) for axis in range(low.dimension)),
        *(Support("up/top", axis) for axis in range(1, across)),
        Prescribed("up/top", across, -0.002, PRESSED),
        Prescribed("up/top", 0, 0.8, DRAGGED),
    )
    surface, candidates = (("up/base",), ("low/top",)) if long else (("low/top",), ("up/base",))
    tool = DeformableTool(surface, candidates, MU)
    geometry = Geometry.SOLID if low.dimension == 3 else Geometry.PLANE_STRAIN
    return Scene(mesh, geometry, ELASTIC, supports, (tool,))


@pytest.mark.parametrize("element", [Element.Q4, pytest.param(Element.H8, marks=pytest.mark.slow)])
def test_work_is_dissipated_whichever_side_has_the_candidates(element):
    """Nearly all of it is friction, mu times the pressing force times the way.

    A tenth of it was missing, and a twentieth while the gap of a rounded end counted as air.
    """
    for long in (False, True):
        gone, way = 0.0, 0.0
        scene = dragged(element, long=long)
        steps = list(march(scene, Schedule(8), Control(Newton(), ())))
        for step in steps:
            moved = step.displacement[scene.mesh.boundary_nodes("up/top"), 0].mean()
            gone, way = gone + MU * abs(step.tool_forces[0, -1]) * (moved - way), moved
        energies = steps[-1].energies
        assert energies.friction == pytest.approx(gone, rel=0.015 if long else 0.005)
        assert abs(energies.energy_error) < 2e-3


def test_what_lands_from_the_air_slips_there_only_where_it_is_in_touch():
    """An arc that leans away was not faced at the start, and its way through the air counted as friction: ten times."""
    low, up = block(3.0, 0.5, 8, 2), block(1.0, 0.5, 6, 2)
    x, y = up.nodes.T
    arc = replace(up, nodes=np.stack([x + 1.0, y + 0.8 + 0.1 * (2 * x - 1) ** 2 * (1 - 2 * y)], axis=1))
    supports = (
        *(Support("low/base", axis) for axis in (0, 1)),
        Prescribed("up/top", 0, 0.1),
        Prescribed("up/top", 1, -0.31),
    )
    tool = DeformableTool(("low/top",), ("up/base",), MU)
    scene = Scene(together({"low": low, "up": arc}), Geometry.PLANE_STRAIN, ELASTIC, supports, (tool,))
    long, short = (list(march(scene, Schedule(n), Control(Newton(), ())))[-1].energies for n in (1, 4))
    assert long.friction == pytest.approx(short.friction, rel=0.15)
    assert abs(long.energy_error) < 5e-3


@pytest.mark.parametrize("degrees", [45, 62])
def test_a_wedge_that_is_dragged_over_a_floor_is_held_back(degrees):
    """Of its flanks only the feet are faced; the normals there were those of the flanks, and the rear one pushed on."""
    low, up = block(3.0, 0.5, 8, 2), block(1.0, 0.5, 4, 2)
    x, y = up.nodes.T
    steep = np.tan(np.radians(degrees))
    wedge = np.stack([x + 0.8, 0.5 + y + steep * (np.abs(x - 0.5) * (1 - 2 * y) + y)], axis=1)
    supports = (
        *(Support("low/base", axis) for axis in (0, 1)),
        Prescribed("up/top", 0, 0.3),
        Prescribed("up/top", 1, -0.02),
    )
    tool = DeformableTool(("low/top",), ("up/base",), MU)
    mesh = together({"low": low, "up": replace(up, nodes=wedge)})
    scene = Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, supports, (tool,))
    *_, last = march(scene, Schedule(8), Control(Newton(), ()))
    along, across = last.tool_force(0)
    assert along == pytest.approx(-MU * across, rel=0.05)
    assert abs(last.energies.energy_error) < 0.01
