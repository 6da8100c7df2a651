"""Recovered tractions: closed forms of the mass matrix, manufactured pressures, sign and cone, a bent path."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bipot.certificate import Bounds
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.fem.surface import facet_mass
from bipot.forms import Tangent
from bipot.increment import Limits
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.traction import nodal_tractions, tractions
from studies.recovered import consistent_tractions, edge_tractions
from tests.scenes import PLANES

EXACT = Control(Tangent(), limits=Limits(Bounds(equilibrium=1e-11)))


def test_mass_of_a_straight_edge_is_the_textbook_matrix():
    x = np.array([[1.0, 2.0], [2.5, 4.0], [4.0, 6.0]])
    length = np.sqrt(25.0)
    textbook = length / 30 * np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]])
    np.testing.assert_allclose(facet_mass(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN)[0], textbook, atol=1e-14)


@pytest.mark.parametrize(("inner", "outer"), [(0.0, 0.5), (1.0, 3.0)])
def test_mass_of_a_ring_sums_to_its_area(inner, outer):
    x = np.array([[inner, 1.0], [(inner + outer) / 2, 1.0], [outer, 1.0]])
    mass = facet_mass(x, np.array([[0, 1, 2]]), Geometry.AXISYMMETRIC)[0]
    assert mass.sum() == pytest.approx(np.pi * (outer**2 - inner**2), rel=1e-14)
    if inner == 0.0:
        assert abs(mass[0].sum()) < 1e-15
        assert np.linalg.cond(mass) < 100


def test_mass_of_a_cylindrical_edge_is_its_lateral_area():
    x = np.array([[2.0, 0.0], [2.0, 0.5], [2.0, 1.0]])
    assert facet_mass(x, np.array([[0, 1, 2]]), Geometry.AXISYMMETRIC).sum() == pytest.approx(4 * np.pi, rel=1e-14)


def nodal_forces(radius, values, order=12):
    """Consistent forces of a function of r on the ring edges of nodes ``radius``, by a rule of its own."""
    points, weights = np.polynomial.legendre.leggauss(order)
    out = np.zeros(len(radius))
    for i in range(0, len(radius) - 1, 2):
        a, b = radius[i], radius[i + 2]
        r, w = (a + b) / 2 + (b - a) / 2 * points, (b - a) / 2 * weights
        for k in range(3):
            others = [radius[i + m] for m in range(3) if m != k]
            shape = (r - others[0]) * (r - others[1])
            shape = shape / ((radius[i + k] - others[0]) * (radius[i + k] - others[1]))
            out[i + k] += np.sum(w * 2 * np.pi * r * shape * values(r))
    return out


def test_the_consistent_mass_gives_quadratic_tractions_back_at_every_node():
    system = system_of(upsetting(mu=0.3, elements=3))
    candidates, nodes = system.candidates, system.body.scene.mesh.nodes
    top = np.isin(candidates.node, system.body.scene.mesh.boundary_nodes("top"))
    line = np.flatnonzero(top)[np.argsort(nodes[candidates.node[top], 0])]
    radius = nodes[candidates.node[line], 0]
    pressure, shear = lambda r: 300 + 20 * r - 4 * r**2, lambda r: 30 * r - r**2
    r = np.zeros((len(candidates.node), 2))
    r[line, 0], r[line, 1] = nodal_forces(radius, pressure), nodal_forces(radius, shear)
    # The axis is held along the punch: its share is the support's, and the answer may not depend on it.
    r[line[0], 1] = 0.0
    p, tau = consistent_tractions(candidates, nodes, r, top)
    np.testing.assert_allclose(p[line], pressure(radius), rtol=1e-12)
    np.testing.assert_allclose(tau[line], shear(radius), rtol=1e-12, atol=1e-12)
    assert np.isnan(p[~top]).all()
    assert np.isnan(tau[~top]).all()


def test_edges_have_the_mean_of_their_nodes_shares():
    x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    found = edge_tractions(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN, np.array([[1.0], [4.0], [1.0]]))
    np.testing.assert_allclose(found, [[6.0]], rtol=1e-12)


def line_of(ends):
    """Nodes (2 f + 1, 2) and edges (f, 3) of a straight line with these end nodes."""
    ends = np.asarray(ends, dtype=float)
    x = np.empty(2 * len(ends) - 1)
    x[::2], x[1::2] = ends, (ends[1:] + ends[:-1]) / 2
    first = np.arange(0, len(x) - 1, 2)
    return np.column_stack([x, np.zeros_like(x)]), np.column_stack([first, first + 1, first + 2])


def test_an_edge_with_one_closed_node_is_off_the_line():
    system = system_of(upsetting(mu=0.3, elements=3))
    candidates, nodes = system.candidates, system.body.scene.mesh.nodes
    x, z = nodes[candidates.node].T
    closed = (z == z.max()) & (x < 5 / 3 + 1e-9)
    r = np.column_stack([closed.astype(float), np.zeros(len(x))])
    for recover in (tractions, consistent_tractions):
        p, tau = recover(candidates, nodes, r, closed)
        np.testing.assert_array_equal(np.isnan(p), ~closed)
        np.testing.assert_array_equal(np.isnan(tau), ~closed)
        assert np.isnan(recover(candidates, nodes, r, np.zeros_like(closed))[0]).all()


@pytest.mark.parametrize("geometry", PLANES)
def test_a_uniform_traction_comes_back_exactly_on_uneven_edges_and_at_the_axis(geometry):
    nodes, edges = line_of([0.0, 0.2, 0.7, 0.9, 2.0])
    forces = facet_mass(nodes, edges, geometry).sum(axis=2)
    r = np.zeros((len(nodes), 2))
    np.add.at(r, edges, forces[..., None] * np.array([3.0, -0.5]))
    np.testing.assert_allclose(nodal_tractions(nodes, edges, geometry, r), np.tile([3.0, -0.5], (9, 1)), rtol=1e-13)
    np.testing.assert_allclose(edge_tractions(nodes, edges, geometry, r), np.tile([3.0, -0.5], (4, 1)), rtol=1e-13)


def test_a_linear_traction_comes_back_exactly_on_equal_plane_edges():
    nodes, edges = line_of(np.linspace(0.0, 3.0, 7))
    r = np.zeros((len(nodes), 1))
    mass = facet_mass(nodes, edges, Geometry.PLANE_STRAIN)
    np.add.at(r, edges, np.einsum("fij,fj->fi", mass, 2 + 5 * nodes[edges, 0])[..., None])
    found = nodal_tractions(nodes, edges, Geometry.PLANE_STRAIN, r)
    np.testing.assert_allclose(found[:, 0], 2 + 5 * nodes[:, 0], rtol=1e-13)


def test_on_a_ring_nodal_tractions_are_of_order_two_off_the_axis_and_one_at_it():
    errors = []
    for count in (8, 16, 32):
        radius = np.linspace(0.0, 5.0, 2 * count + 1)
        nodes, edges = line_of(radius[::2])
        r = nodal_forces(radius, lambda at: 300 + 20 * at - 4 * at**2)
        found = nodal_tractions(nodes, edges, Geometry.AXISYMMETRIC, r[:, None])[:, 0]
        error = np.abs(found - (300 + 20 * radius - 4 * radius**2))
        errors.append((error[0], error[radius >= 1.25].max()))
    axis, off = np.log2(np.divide(errors[:-1], errors[1:])).T
    np.testing.assert_allclose(axis, 1.0, atol=0.15)
    np.testing.assert_allclose(off, 2.0, atol=0.15)


def test_a_jump_between_two_edges_shows_by_five_sixths():
    nodes, edges = line_of([0.0, 1.0, 2.0])
    r = np.zeros((5, 1))
    np.add.at(r, edges, np.array([[1.0], [7.0]])[:, None] * np.array([1, 4, 1])[None, :, None] / 6)
    means = edge_tractions(nodes, edges, Geometry.PLANE_STRAIN, r)[:, 0]
    assert means[1] - means[0] == pytest.approx(5.0, rel=1e-14)


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 10_000), geometry=st.sampled_from(PLANES))
def test_forces_in_the_cone_give_tractions_in_the_cone_and_edge_means_their_resultant(seed, geometry):
    """Whatever the edges: uneven, curved, with mid-side nodes off the middle, from the axis or a bore."""
    rng = np.random.default_rng(seed)
    bore = rng.choice([0.0, 0.01, 1.0])
    nodes, edges = line_of(bore + np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 2.0, 5))]))
    nodes[edges[:, 1]] += rng.uniform(-0.04, 0.04, (5, 2))
    mu = 0.3
    p = rng.exponential(size=len(nodes)) * rng.integers(0, 2, len(nodes))
    r = np.column_stack([p, mu * p * rng.uniform(-1, 1, len(nodes))])
    means = edge_tractions(nodes, edges, geometry, r)
    area = facet_mass(nodes, edges, geometry).sum(axis=(1, 2))
    np.testing.assert_allclose(area @ means, r.sum(axis=0), rtol=1e-12, atol=1e-12)
    for found in (nodal_tractions(nodes, edges, geometry, r), means):
        assert (found[:, 0] >= 0).all()
        assert (np.abs(found[:, 1]) <= mu * found[:, 0] * (1 + 1e-12)).all()


@pytest.mark.parametrize("configuration", list(Configuration))
def test_frictionless_homogeneous_upsetting_has_uniform_pressure(configuration):
    scene = upsetting(mu=0.0, elements=3, configuration=configuration)
    *_, last = march(scene, Schedule(10), EXACT)
    system = system_of(scene)
    result = last.traction
    on_line = ~np.isnan(result.recovered_pressure)
    top = np.isin(system.candidates.node, scene.mesh.boundary_nodes("top"))
    np.testing.assert_array_equal(on_line, top)
    np.testing.assert_allclose(result.recovered_pressure[on_line], 300.0, rtol=1e-6)
    np.testing.assert_array_equal(result.recovered_shear[on_line], 0.0)
