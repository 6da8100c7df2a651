"""Supports between the axes against closed forms, and against what the stress pushes, summed here."""

import math

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton
from bipot.increment import Limits
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.paths import Amplitude
from bipot.scene.loads import PointForce
from bipot.scene.supports import Prescribed, Support
from studies.independent.element import place
from tests.golden import TIGHT
from tests.inclined import BASE, QUARTER, along, body, flat, sector, turned

EXACT = Control(Newton(), (), Limits(TIGHT))


def last(scene, schedule=None):
    *_, accepted = march(scene, schedule or Schedule(2), EXACT)
    return accepted


@pytest.mark.parametrize("element", [Element.Q4, Element.Q8, Element.T6])
@pytest.mark.parametrize("geometry", [Geometry.PLANE_STRAIN, Geometry.AXISYMMETRIC])
def test_a_sector_between_slants_under_pressure_is_exact(geometry, element):
    """u = -e x has no component along a normal of a plane through the origin, nor such a cone."""
    accepted = last(sector(geometry, element=element))
    young, poisson, pressure = 1000.0, 0.3, 2.0
    ring = geometry is Geometry.AXISYMMETRIC
    strain = pressure * (1 - 2 * poisson) / young * (1.0 if ring else 1 + poisson)
    rest = sector(geometry, element=element).mesh.nodes
    np.testing.assert_allclose(accepted.displacement, -strain * rest, atol=1e-12)
    across = -pressure if ring else -2 * poisson * pressure
    stress = np.broadcast_to([-pressure, -pressure, across, 0.0], accepted.state.stress.shape)
    np.testing.assert_allclose(accepted.state.stress, stress, atol=1e-9)
    for name, degrees, inward in (("base", 20.0, 110.0), ("top", 70.0, -20.0)):
        # 2 pi r ds along a slant from rho = 1 to 2
        area = 2 * math.pi * math.cos(math.radians(degrees)) * 1.5 if ring else 1.0
        total = accepted.reactions[accepted.solved.iterate.increment.system.body.scene.mesh.boundary_nodes(name)]
        np.testing.assert_allclose(total.sum(axis=0), pressure * area * np.array(along(inward)), atol=1e-9)


def internal(scene, accepted):
    """Sum over the integration points of sigma . dN/dx dA (a, 2) at the end, by elements that the library has not."""
    nodes, elements, stress = accepted.state.nodes, scene.mesh.elements, accepted.stress.matrix[..., :2, :2]
    placed = place(nodes, elements, scene.rule.value, axisymmetric=False)
    out = np.zeros(nodes.shape)
    np.add.at(out, elements, np.einsum("eq,eqij,eqaj->eai", placed.volume, stress, placed.slopes))
    return out


LOAD = np.array([30.0, 40.0])
LOADED = 5


def driven():
    """A block pressed aslant by a support that turns back, its left side on a slant, under a point force."""
    path = Amplitude(((0.0, 0.0), (0.6, 1.0), (1.0, 0.7)))
    return body(
        (Support("base", 1), Support("left", along(15.0)), Prescribed("top", along(70.0), -0.06, path)),
        loads=(PointForce(LOADED, tuple(LOAD.tolist())),),
        volume=VolumeChange.AS_IS,
    )


@pytest.fixture(scope="module")
def pressed():
    return tuple(march(driven(), Schedule(6), EXACT))


def taken(scene, force):
    """Of nodal forces (a, d) what supports may take: that along their direction, all where two hold a node."""
    out, sides = np.zeros(force.shape), {s: set(scene.mesh.boundary_nodes(s.boundary).tolist()) for s in scene.supports}
    for support, nodes in sides.items():
        both = sorted(nodes & set().union(*(others for other, others in sides.items() if other is not support)))
        out[sorted(nodes)] = np.outer(force[sorted(nodes)] @ support.along(2), support.along(2))
        out[both] = force[both]
    return out


def test_supports_hold_and_drive_nodes_along_their_direction_and_leave_them_free_across(pressed):
    scene = driven()
    for accepted in pressed:
        asked = (0.0, 0.0, -0.06 * scene.supports[2].amplitude.at(accepted.state.tau))
        for support, value in zip(scene.supports, asked, strict=True):
            moved = accepted.displacement[scene.mesh.boundary_nodes(support.boundary)]
            np.testing.assert_allclose(moved @ support.along(2), value, atol=1e-12)
            x, y = support.along(2)
            assert np.ptp(moved @ (-y, x)) > 1e-3 * abs(accepted.state.tau)


def test_reactions_are_what_the_stress_pushes_along_them_and_nothing_else_is_left(pressed):
    scene = driven()
    for accepted in pressed:
        force = internal(scene, accepted)
        force[LOADED] -= accepted.state.tau * LOAD
        scale = np.abs(force).max()
        np.testing.assert_allclose(force, taken(scene, force), atol=1e-9 * scale)
        np.testing.assert_allclose(accepted.reactions, force, atol=1e-9 * scale)
    assert pressed[-1].peeq.max() > 0.01


def test_their_work_is_that_of_the_mean_reaction_and_becomes_strain_energy_and_heat(pressed):
    work, force, tau = 0.0, 0.0, 0.0
    for accepted in pressed:
        du, end = accepted.state.du, accepted.reactions
        work += float(np.vdot((force + end) / 2, du) + (tau + accepted.state.tau) / 2 * LOAD @ du[LOADED])
        force, tau = end, accepted.state.tau
        assert accepted.energies.work == pytest.approx(work, rel=1e-9)
    energies = pressed[-1].energies
    assert energies.elastic + energies.plastic == pytest.approx(energies.work, rel=0.02)


def test_two_slants_drive_a_node_to_where_both_say():
    """As a whole by (0.3, -0.2): every component of the displacement is driven, none of the body strained."""
    way = np.array([0.3, -0.2])
    directions = [along(20.0), along(65.0), along(-40.0)]
    supports = tuple(Prescribed("base", direction, float(way @ direction)) for direction in directions)
    scene = body(supports, configuration=Configuration.SMALL, loads=(PointForce(3, (0.0, 0.0)),))
    accepted = last(scene, Schedule(3))
    np.testing.assert_allclose(accepted.displacement, np.broadcast_to(way, accepted.displacement.shape), atol=1e-12)
    assert accepted.mises.max() < 1e-6


@pytest.mark.parametrize("direction", [(1.0, 0.0), (-1.0, 0.0), (6e-17, 1.0)])
def test_a_vector_on_an_axis_is_the_axis(direction):
    axis = int(direction[0] == 6e-17)
    sign = 1.0 if max(direction) == 1.0 else -1.0
    rest = tuple(support for support in BASE if support.direction != axis)
    ends = [
        last(body((*rest, Prescribed("base", given, size), Support("top", 1 - axis))))
        for given, size in ((axis, 0.05), (direction, 0.05 * sign))
    ]
    assert not body((Support("base", direction),)).holding.axes.turned
    np.testing.assert_array_equal(ends[0].state.nodes, ends[1].state.nodes)


def test_a_body_that_can_slide_along_a_slant_is_told_so():
    scene = body((Support("base", along(120.0)),), loads=(PointForce(8, (10.0, -5.0)),))
    with pytest.raises(IncrementFailed, match=r"Nothing holds the body against moving along \(0\.866, 0\.5\)"):
        last(scene)


def test_a_tool_is_driven_into_no_node_that_a_slant_holds_against_it():
    scene = turned(body((Support("right", 1), *QUARTER[:1]), (flat(candidates=("right", "top")),)))
    with pytest.raises(IncrementFailed, match=r"tools\[0\] is driven into node .*, which a support holds"):
        last(scene)


def test_a_tool_off_an_axis_by_round_off_slides_no_body_that_friction_holds():
    """Nothing but its friction holds the block along the first axis."""
    tools = [flat(), flat(normal=(6e-17, -1.0))]
    ends = [
        last(body((Support("base", 1),), (tool,)), Schedule(3, first=0.05, settling=1, growth=4.0)) for tool in tools
    ]
    np.testing.assert_allclose(ends[1].tool_forces, ends[0].tool_forces, rtol=1e-9, atol=1e-9)
