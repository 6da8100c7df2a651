"""Two deformable bodies: short forms of what studies.verification runs at length."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Bounds, Control, DeformableTool, Limits, Newton, Schedule, march
from studies.verification.case import Watch
from studies.verification.cases import contact_patch, curved_beams, hertz_two_bodies
from studies.verification.two_bodies import borne, half_width

EXACT = Control(Newton(), (), Limits(bounds=Bounds(equilibrium=1e-13)))


@pytest.mark.parametrize("mu", contact_patch.FRICTION)
@pytest.mark.parametrize("slope", contact_patch.SLOPES.values(), ids=contact_patch.SLOPES)
def test_the_patch_test_is_passed_to_round_off(slope, mu):
    *_, last = march(contact_patch.blocks(slope, 4, mu), Schedule(contact_patch.INCREMENTS), EXACT)
    traction = borne(last).traction / contact_patch.closed_pressure()
    np.testing.assert_allclose(traction, np.tile([1.0, 0.0], (len(traction), 1)), atol=1e-11)


def test_either_side_may_have_the_candidates():
    one = hertz_two_bodies.pressed(16, 0.0)
    (tool,) = one.tools
    other = replace(one, tools=(DeformableTool(tool.candidates, tool.surface, tool.mu),))
    forces = [Watch().end(scene, Schedule(2)).tool_force(0)[1] for scene in (one, other)]
    assert forces[0] == pytest.approx(-forces[1], rel=1e-3)


def test_curved_beams_come_near_to_the_published_force_on_a_coarse_mesh():
    scene = curved_beams.beams(24)
    ends = scene.mesh.boundary_nodes("high/base", "high/top")
    travel, force = [0.0], [0.0]
    for accepted in march(scene, Schedule(63), Control(Newton())):
        travel.append(curved_beams.TRAVEL * accepted.state.tau)
        force.append(float(accepted.reactions[ends, 1].sum()))
        if travel[-1] > 5.54:
            break
    assert np.interp(5.54, travel, np.abs(force)) == pytest.approx(curved_beams.FORCES[5.54], rel=0.07)


@pytest.mark.parametrize("size", [0.1, 0.2])
def test_the_half_width_of_what_a_linear_pressure_stands_for(size):
    """Of a triangle of forces on points -1, 0 and 1 times the size: its mean x^2 is that of p linear between them."""
    x = size * np.arange(-2, 3)
    pressure = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
    fine = np.linspace(x[0], x[-1], 40001)
    exact = np.average(fine**2, weights=np.interp(fine, x, pressure))
    assert half_width(x, pressure * size, size) == pytest.approx(2 * np.sqrt(exact), rel=1e-6)
