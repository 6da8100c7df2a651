"""Hexahedra and tetrahedra: rules, patches, rigid turns, tangents and pressures against differences."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import factorial

import numpy as np
import pytest

from bipot.fem.assembly import element_force, element_stiffness, rigid_motions, space
from bipot.fem.elements import RULES, Quadrature, facet, tabulated, tabulated_at
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VOLUMES, VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.fem.surface import facet_mass, outward_area, outward_area_by_nodes
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.response import Body, body_space
from bipot.scene.loads import Loading, Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.state import rest
from tests.solids import COMBINATIONS, SOLIDS, curved, distorted, turned

SOLID = Geometry.SOLID
STEEL = VonMises(Elasticity(210.0, 0.3), Linear(0.3, 0.5))
ELASTIC = STEEL.elasticity
WALLS = (Support("left", 0), Support("front", 1), Support("base", 2))
NO_SUPPORT = np.empty(0, dtype=np.intp)
STABLE = [(element, volume) for element in SOLIDS for volume in VOLUMES[element]]


@pytest.mark.parametrize(("element", "rule"), COMBINATIONS)
def test_shapes_are_a_partition_of_unity_and_weights_the_volume(element, rule):
    table = tabulated(element, rule)
    assert table.values.shape == (len(table.weights), element.nodes)
    np.testing.assert_allclose(table.values.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(table.gradients.sum(axis=1), 0.0, atol=1e-13)
    assert table.weights.sum() == pytest.approx(1.0 if element.shape.cube else 1 / 6, rel=1e-14)
    assert table.weights.min() > 0


@pytest.mark.parametrize("element", Element)
def test_nodes_are_where_the_table_says(element):
    np.testing.assert_allclose(tabulated_at(element, element.every_place).values, np.eye(element.nodes), atol=1e-14)


@pytest.mark.parametrize(("rule", "degree"), list(zip(RULES[Element.T4], (1, 2, 5), strict=True)))
def test_tetrahedron_rules_integrate_the_monomials_of_their_degree(rule, degree):
    table = tabulated(Element.T4, rule)
    for powers in product(range(degree + 1), repeat=3):
        if sum(powers) <= degree:
            exact = np.prod([factorial(k) for k in powers]) / factorial(sum(powers) + 3)
            assert table.weights @ np.prod(table.points**powers, axis=1) == pytest.approx(exact, rel=1e-12)
    n = degree + 1
    exact = factorial(n) / factorial(n + 3)
    assert table.weights @ table.points[:, 0] ** n != pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(("element", "rule"), COMBINATIONS)
def test_patch_a_linear_field_gives_constant_stress_and_no_inner_force(element, rule):
    mesh = distorted(element)
    space_ = space(mesh, SOLID, rule, NO_SUPPORT)
    du = mesh.nodes @ np.array([[1e-3, 2e-4, 1e-4], [-3e-4, 5e-4, 0.0], [2e-4, 1e-4, -7e-4]]).T
    kin = Configuration.PAPER.measure.increment(mesh.nodes, du, mesh.elements, space_.reference, SOLID)
    stress = kin.strain @ ELASTIC.stiffness(6)
    np.testing.assert_allclose(stress, np.broadcast_to(stress[0, 0], stress.shape), atol=1e-11)
    f = space_.nodal(element_force(kin, stress))
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.boundary_nodes(*mesh.boundaries))
    assert inner.size
    np.testing.assert_allclose(f[inner], 0.0, atol=1e-12 * np.abs(f).max())


@pytest.mark.parametrize(("element", "rule"), COMBINATIONS)
def test_no_motion_but_rigid_ones_is_without_strain(element, rule):
    """But six of H20 with 2 x 2 x 2 points, which neighbours do not share."""
    mesh = curved(element)
    B = gradients(mesh.nodes, mesh.elements, tabulated(element, rule), SOLID).B
    free = 3 * element.nodes - np.linalg.matrix_rank(B.reshape(len(B), -1, 3 * element.nodes), tol=1e-9)
    assert set(free.tolist()) == {12 if (element, rule) == (Element.H20, Quadrature.GAUSS2) else 6}
    space_ = space(mesh, SOLID, rule, NO_SUPPORT)
    placed = gradients(mesh.nodes, mesh.elements, space_.reference, SOLID)
    K = space_.matrix(element_stiffness(placed, ELASTIC.stiffness(6))).toarray()
    values = np.linalg.eigvalsh(K)
    assert (values < 1e-9 * values[-1]).sum() == 6
    motions = rigid_motions(mesh.nodes, space_.free, SOLID)
    np.testing.assert_allclose(K @ motions, 0.0, atol=1e-12 * values[-1])


@pytest.mark.parametrize("element", SOLIDS)
def test_a_rigid_turn_strains_nothing_and_turns_what_there_is(element):
    mesh, Q = curved(element), turned((1.0, -2.0, 0.5), 0.9)
    du = mesh.nodes @ Q.T - mesh.nodes + [0.3, -0.2, 0.1]
    table = tabulated(element, RULES[element][0])
    kin = Configuration.MIDPOINT.measure.increment(mesh.nodes, du, mesh.elements, table, SOLID)
    np.testing.assert_allclose(kin.strain, 0.0, atol=1e-13)
    pull = np.zeros((*kin.strain.shape[:2], 6))
    pull[..., 0] = 1.0
    e, r = Q[:, 0], np.sqrt(2)
    along = [e[0] ** 2, e[1] ** 2, e[2] ** 2, r * e[0] * e[1], r * e[1] * e[2], r * e[2] * e[0]]
    np.testing.assert_allclose(kin.turned(pull), np.broadcast_to(along, pull.shape), atol=1e-13)


def differences(function, x, direction, step):
    """The derivative along a direction, by Richardson's rule on central differences."""
    one, two = ((function(x + k * step * direction) - function(x - k * step * direction)) / (2 * k) for k in (1, 2))
    return (4 * one - two) / (3 * step)


@pytest.mark.parametrize("configuration", Configuration)
@pytest.mark.parametrize(("element", "volume"), STABLE)
def test_the_tangent_is_the_derivative_of_the_internal_forces(element, volume, configuration):
    scene = Scene(curved(element), SOLID, STEEL, WALLS, configuration=configuration, volume=volume)
    body, rng = Body(scene, body_space(scene)), np.random.default_rng(2)
    state = rest(scene, np.zeros(0))
    state = replace(state, stress=0.1 * rng.normal(size=state.stress.shape))
    n = body.space.size
    x, direction = 4e-3 * rng.normal(size=n), rng.uniform(-1, 1, n)
    assert body.respond(state, x).returned.plastic.any()
    expected = differences(lambda x: body.respond(state, x).internal, x, direction, 1e-6)
    found = body.space.matrix(body.tangent(body.respond(state, x))) @ direction
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("element", SOLIDS)
def test_faces_close_the_body_and_carry_its_area(element):
    """Area vectors sum to zero, and by the divergence theorem their moments are three volumes; flat faces are exact."""
    mesh = curved(element)
    area = outward_area(mesh.nodes, mesh.outline, SOLID)
    np.testing.assert_allclose(area.sum(axis=(0, 1)), 0.0, atol=1e-13)
    table = tabulated(element, Quadrature.GAUSS3 if element.shape.cube else RULES[element][-1])
    volume = gradients(mesh.nodes, mesh.elements, table, SOLID).volume.sum()
    np.testing.assert_allclose(np.vecdot(mesh.nodes[mesh.outline], area).sum(), 3 * volume, rtol=1e-12)
    flat = brick(2.0, 3.0, 4.0, 2, 1, 2, element=element)
    mass = facet_mass(flat.nodes, flat.boundary("top"), SOLID)
    assert mass.sum() == pytest.approx(6.0, rel=1e-13)
    np.testing.assert_allclose(np.linalg.eigvalsh(mass).min(axis=1) > 0, True)
    around = facet(flat.outline.shape[1], 3)
    assert around.weights.sum() == pytest.approx(1.0 if element.shape.cube else 0.5, rel=1e-14)


@pytest.mark.parametrize("element", SOLIDS)
def test_the_pressure_s_stiffness_is_its_derivative(element):
    mesh = curved(element)
    faces, rng = mesh.outline, np.random.default_rng(1)
    slopes, direction = outward_area_by_nodes(mesh.nodes, faces, SOLID), rng.uniform(-1, 1, mesh.nodes.shape)
    found = (slopes @ direction[faces].reshape(len(faces), -1, 1))[..., 0]
    expected = differences(lambda x: outward_area(x, faces, SOLID).reshape(len(faces), -1), mesh.nodes, direction, 1e-4)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())
    space_ = space(mesh, SOLID, RULES[element][0], NO_SUPPORT)
    loading = Loading(space_, [Pressure("top", 3.0, Amplitude(((0.0, 0.0), (1.0, 2.0)))), Pressure("left", -1.0)])
    K = np.zeros((len(mesh.elements), *[3 * element.nodes] * 2))
    loading.add_stiffness(K, mesh.nodes, 0.5)
    expected = -differences(lambda x: loading.forces(x, 0.5).ravel(), mesh.nodes, direction, 1e-4)
    np.testing.assert_allclose(space_.matrix(K) @ direction.ravel(), expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize(("element", "volume", "constraints"), [
    (Element.H8, VolumeChange.P0, 1),
    (Element.H8, VolumeChange.AS_IS, 8),
    (Element.H20, VolumeChange.P1, 4),
    (Element.H20, VolumeChange.P0, 1),
    (Element.H20, VolumeChange.AS_IS, 8),
    (Element.T10, VolumeChange.P0, 1),
    (Element.T10, VolumeChange.AS_IS, 4),
    (Element.T4, VolumeChange.AS_IS, 1),
])  # fmt: skip
def test_an_element_puts_so_many_constraints_on_its_volume(element, volume, constraints):
    mesh = curved(element)
    scene = Scene(mesh, SOLID, STEEL, WALLS, volume=volume)
    body = Body(scene, body_space(scene))
    placed = gradients(mesh.nodes, mesh.elements, body.space.reference, SOLID, body.projection)
    ranks = np.linalg.matrix_rank(placed.B[:, :, :3].sum(axis=2), tol=1e-9)
    assert set(ranks.tolist()) == {constraints}
