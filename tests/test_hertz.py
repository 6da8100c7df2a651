"""Hertz in large deformation: a rigid cylinder and a rigid sphere on an elastic half-space.

In small strain they are cases of the verification suite; here the block turns and strains, by a thousandth.
"""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Configuration, Element, Geometry, Schedule
from studies.verification.case import Watch
from studies.verification.cases import hertz_cylinder, hertz_sphere
from studies.verification.indentation import RADIUS, along, pressed

ELEMENTS = 16


def indented(case, geometry, travel):
    """Force, and the places and pressures of the top nodes."""
    scene = pressed(geometry, travel, case.ELASTIC, 0.0, ELEMENTS, Element.Q8)
    last = Watch().end(replace(scene, configuration=Configuration.MIDPOINT), Schedule(4))
    return -last.tool_force(0)[1], *along(last)[:2]


@pytest.mark.slow
def test_a_cylinder_on_a_half_plane():
    force, x, pressure = indented(hertz_cylinder, Geometry.PLANE_STRAIN, hertz_cylinder.TRAVEL)
    star = hertz_cylinder.STAR
    peak, a = np.sqrt(force * star / np.pi / RADIUS), np.sqrt(4 * force * RADIUS / np.pi / star)
    assert pressure.max() == pytest.approx(peak, rel=0.01)
    inside = x < 0.9 * a
    assert inside.sum() > 15
    np.testing.assert_allclose(pressure[inside], peak * np.sqrt(1 - (x[inside] / a) ** 2), atol=0.03 * peak)
    assert x[pressure > 0].max() == pytest.approx(a, rel=0.05)


@pytest.mark.slow
def test_a_sphere_on_a_half_space():
    force, _, pressure = indented(hertz_sphere, Geometry.AXISYMMETRIC, hertz_sphere.DEPTH)
    exact, _, peak = (asked.reference for asked in hertz_sphere.CASE.asked)
    assert force == pytest.approx(exact, rel=0.01)
    assert pressure.max() == pytest.approx(peak, rel=0.01)
