"""The cylinder of the paper, drawn anew on the way, tends to the force of refined meshes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bipot import Control, Element, FlatTool, Newton, Schedule, cylinder, march, transferred, upsetting
from studies.accuracy.limits import Limit
from studies.tables import read_rows

LIMITS = Path(__file__).parents[1] / "docs" / "results" / "limits.csv"
MU, FINE, NEWTON, ELEMENTS = 0.1, Schedule(accuracy=3e-4), Control(Newton()), 10
HALF, DRAWN, END, OFF = 5.0, 3.75, 2.75, 0.002


def stage(mesh, height, to):
    """The punch goes from one half height to another, and off the body."""
    path = (0.0, 0.0), (0.9, 1.0), (1.0, 1.0 - 0.05 / (height - to))
    punch = FlatTool((0.0, height), (0.0, -1.0), (0.0, to - height), ("top", "side"), MU, path)
    scene = upsetting(mu=MU, elements=ELEMENTS, element=Element.Q4, volume=None)
    return replace(scene, mesh=mesh, tools=(punch,))


def drawn(mesh, nodes):
    """A grid inside the body's side, as high as its rim: of the top nothing is left out but what springs back."""
    side = nodes[mesh.boundary_nodes("side")]
    r, z = side[np.argsort(side[:, 1])].T
    grid = cylinder(1.0, 1.0, ELEMENTS, ELEMENTS)
    height = z[-1] * grid.nodes[:, 1]
    return replace(grid, nodes=np.column_stack([grid.nodes[:, 0] * np.interp(height, z, r), height]))


def test_a_cylinder_drawn_anew_ends_with_the_force_of_refined_meshes():
    first = stage(cylinder(HALF, HALF, ELEMENTS, ELEMENTS), HALF, DRAWN)
    *_, lifted = march(first, FINE, NEWTON)
    mesh = drawn(first.mesh, lifted.state.nodes)
    second = stage(mesh, mesh.nodes[:, 1].max() + OFF, END)
    found = transferred(lifted.state, first, second, NEWTON)
    steps = list(march(second, FINE, NEWTON, found.state))
    force = max(-step.tool_force(0)[1] for step in steps)
    assert min(step.state.nodes[:, 1].max() for step in steps) == pytest.approx(END, abs=1e-9)
    (limit,) = (
        one.value for one in read_rows(LIMITS, Limit) if (one.mu, one.reduction, one.quantity) == (MU, 0.45, "force_N")
    )
    assert force == pytest.approx(limit, rel=2e-3)
