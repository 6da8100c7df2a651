"""Round-off of gaps and slips decides nothing where Newton begins."""

import numpy as np
import pytest

from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.scene.scene import Scene
from bipot.schedule import Schedule
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool


def pressed(angle: float) -> Scene:
    """A block between a floor and a lid that a force presses, all of it turned by an ``angle``."""
    c, s = np.cos(angle), np.sin(angle)
    mesh, turn = block(2.0, 1.0, 6, 3), np.array([[c, -s], [s, c]])
    down, up, middle = (tuple((turn @ v).tolist()) for v in ((0.0, -1.0), (0.0, 1.0), (0.0, 1.0)))
    force = Force((150.0 * down[0], 150.0 * down[1]))
    lid = FlatTool(middle, down, (0.0, 0.0), ("top",), 0.2, driven_by=force)
    floor = FlatTool((0.0, 0.0), up, (0.0, 0.0), ("base",), 0.2)
    body = Mesh(mesh.nodes @ turn.T, mesh.elements, mesh.boundaries)
    material = VonMises(Elasticity(70_000.0, 0.33), Linear(100.0, 500.0))
    return Scene(body, Geometry.PLANE_STRAIN, material, (), tools=(lid, floor))


@pytest.mark.parametrize("angle", [0.1, 0.3, 0.7, 1.2, 2.3, 3.0])
def test_passes_do_not_depend_on_the_round_off_of_gaps_at_rest(angle):
    """Gaps of 1e-17 were open contacts, slips of that slid: what contacts alone hold took up to four times as many."""
    passes = [[a.passes for a in march(pressed(by), Schedule(3), Control(Newton(), ()))] for by in (0.0, angle)]
    assert passes[1] == passes[0]
