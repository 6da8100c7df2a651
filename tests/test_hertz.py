"""Hertz: a rigid cylinder and a rigid sphere on an elastic half-space, against the closed forms.

Of a cylinder, by the force F on a unit of length, a^2 = 4 F R/(pi E*) and p_0^2 = F E*/(pi R); its approach has no
limit in a half-plane. Of a sphere, by its approach d, F = 4/3 E* sqrt(R) d^1.5 and p_0 = 2 E* sqrt(d/R)/pi.
"""

import numpy as np
import pytest

from bipot.elements import Element
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.mesh import block
from bipot.scene import Scene
from bipot.schedule import Schedule
from bipot.supports import Support, Symmetry
from bipot.surfaces import Circle
from bipot.tools import ShapedTool

RADIUS, MODULUS, NU = 1.0, 1e5, 0.3
STAR = MODULUS / (1 - NU**2)


def indented(geometry, size, elements, grading, depth):
    """The last increment, and the places and pressures of its top nodes."""
    mesh = block(size, size, elements, elements, grading=(grading, 1 / grading), element=Element.Q8)
    left = Support("left", 0) if geometry is Geometry.AXISYMMETRIC else Symmetry("left", 0)
    punch = ShapedTool(Circle((0.0, size + RADIUS), RADIUS), (0.0, -depth), ("top",), 0.0)
    scene = Scene(mesh, geometry, Elastic(Elasticity(MODULUS, NU)), (Support("base", 1), left), (punch,))
    last = list(march(scene, Schedule(4), Control(Newton())))[-1]
    nodes = last.solved.iterate.increment.system.candidates.node
    # An open node without a neighbour that carries has no traction.
    return last, last.state.nodes[nodes, 0], np.nan_to_num(last.traction.recovered_pressure)


def test_a_cylinder_on_a_half_plane():
    last, x, pressure = indented(Geometry.PLANE_STRAIN, 1.0, 24, 60.0, 0.004)
    force = -last.tool_force(0)[1]
    peak, a = np.sqrt(force * STAR / np.pi / RADIUS), np.sqrt(4 * force * RADIUS / np.pi / STAR)
    assert pressure.max() == pytest.approx(peak, rel=0.01)
    inside = x < 0.9 * a
    assert inside.sum() > 15
    np.testing.assert_allclose(pressure[inside], peak * np.sqrt(1 - (x[inside] / a) ** 2), atol=0.03 * peak)
    carried = x[pressure > 0].max()
    assert carried == pytest.approx(a, rel=0.05)


def test_a_sphere_on_a_half_space():
    depth = 0.0025
    last, _, pressure = indented(Geometry.AXISYMMETRIC, 8.0, 32, 400.0, depth)
    force = -last.tool_force(0)[1]
    assert force == pytest.approx(4 / 3 * STAR * np.sqrt(RADIUS) * depth**1.5, rel=0.01)
    peak = (6 * force * STAR**2 / np.pi**3 / RADIUS**2) ** (1 / 3)
    assert pressure.max() == pytest.approx(peak, rel=0.01)
