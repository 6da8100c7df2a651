"""Tractions on the contact line: closed forms of the mass matrix, manufactured pressures, the homogeneous cylinder."""

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.export import increment_traction
from bipot.fem.kinematics import Configuration, Geometry
from bipot.forms import Backend, Tangent
from bipot.increment import Limits
from bipot.laws.coulomb import Status
from bipot.march import Control, Schedule, march, system_of
from bipot.scene import upsetting
from bipot.traction import FORCE_TOLERANCE, SLIP_TOLERANCE, edge_mass, edge_means, line_tractions, traction

EXACT = Control(Tangent(backend=Backend.CLARABEL), limits=Limits(Bounds(equilibrium=1e-11)))
FAST = Control(Tangent(backend=Backend.CLARABEL))


def test_mass_of_a_straight_edge_is_the_textbook_matrix():
    x = np.array([[1.0, 2.0], [2.5, 4.0], [4.0, 6.0]])
    length = np.sqrt(25.0)
    textbook = length / 30 * np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]])
    np.testing.assert_allclose(edge_mass(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN)[0], textbook, atol=1e-14)


@pytest.mark.parametrize(("inner", "outer"), [(0.0, 0.5), (1.0, 3.0)])
def test_mass_of_a_ring_sums_to_its_area(inner, outer):
    x = np.array([[inner, 1.0], [(inner + outer) / 2, 1.0], [outer, 1.0]])
    mass = edge_mass(x, np.array([[0, 1, 2]]), Geometry.AXISYMMETRIC)[0]
    assert mass.sum() == pytest.approx(np.pi * (outer**2 - inner**2), rel=1e-14)
    if inner == 0.0:
        assert abs(mass[0].sum()) < 1e-15
        assert np.linalg.cond(mass) < 100


def test_mass_of_a_cylindrical_edge_is_its_lateral_area():
    x = np.array([[2.0, 0.0], [2.0, 0.5], [2.0, 1.0]])
    assert edge_mass(x, np.array([[0, 1, 2]]), Geometry.AXISYMMETRIC).sum() == pytest.approx(4 * np.pi, rel=1e-14)


def test_edge_means_ignore_what_alternates_inside_an_edge():
    x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    edges = np.array([[0, 1, 2]])
    linear, alternating = np.array([1.0, 2.0, 3.0]), np.array([2.0, -1.0, 2.0])
    assert edge_means(x, edges, Geometry.PLANE_STRAIN, linear)[0] == pytest.approx(2.0, rel=1e-14)
    assert edge_means(x, edges, Geometry.PLANE_STRAIN, alternating)[0] == pytest.approx(0.0, abs=1e-15)


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


def test_quadratic_tractions_come_back_at_every_node():
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
    p, tau = line_tractions(candidates, nodes, r, top)
    np.testing.assert_allclose(p[line], pressure(radius), rtol=1e-12)
    np.testing.assert_allclose(tau[line], shear(radius), rtol=1e-12, atol=1e-12)
    assert np.isnan(p[~top]).all()
    assert np.isnan(tau[~top]).all()


def test_an_edge_with_one_closed_node_is_off_the_line():
    system = system_of(upsetting(mu=0.3, elements=3))
    candidates, nodes = system.candidates, system.body.scene.mesh.nodes
    x, z = nodes[candidates.node].T
    closed = (z == z.max()) & (x < 5 / 3 + 1e-9)
    r = np.column_stack([closed.astype(float), np.zeros(len(x))])
    p, _ = line_tractions(candidates, nodes, r, closed)
    np.testing.assert_array_equal(np.isnan(p), ~closed)
    assert np.isnan(line_tractions(candidates, nodes, r, np.zeros_like(closed))[0]).all()


@pytest.mark.parametrize("configuration", list(Configuration))
def test_frictionless_homogeneous_upsetting_has_uniform_pressure(configuration):
    scene = upsetting(mu=0.0, elements=3, configuration=configuration)
    *_, last = march(scene, Schedule(10), EXACT)
    system = system_of(scene)
    result = increment_traction(system, last)
    on_line = ~np.isnan(result.pressure)
    top = np.isin(system.candidates.node, scene.mesh.boundary_nodes("top"))
    np.testing.assert_array_equal(on_line, top)
    np.testing.assert_allclose(result.pressure[on_line], 300.0, rtol=1e-6)
    np.testing.assert_array_equal(result.shear[on_line], 0.0)


@pytest.fixture(scope="module")
def sticky():
    """An increment at mu = 0.3 with sticking, slipping and open candidates, and its system."""
    scene = upsetting(mu=0.3, elements=4, reduction=0.2)
    *_, last = march(scene, Schedule(4, first=0.005), FAST)
    return system_of(scene), last


def test_status_agrees_with_forces_and_motion(sticky):
    system, last = sticky
    result = increment_traction(system, last)
    motion, r = last.solved.rows.motion(last.solved.response.x), last.solved.r
    is_ = {s: result.status == s for s in Status}
    assert is_[Status.STICK].any()
    assert is_[Status.SLIP].any()
    assert is_[Status.OPEN].any()
    assert not is_[Status.UNDECIDED].any()
    np.testing.assert_allclose(np.abs(r[is_[Status.SLIP], 1]), 0.3 * r[is_[Status.SLIP], 0], rtol=1e-6)
    assert (r[is_[Status.SLIP], 1] * motion[is_[Status.SLIP], 1] < 0).all()
    assert (np.abs(r[is_[Status.STICK], 1]) < 0.3 * r[is_[Status.STICK], 0]).all()
    assert (motion[is_[Status.OPEN], 0] > 0).all()
    assert (np.linalg.norm(r[is_[Status.OPEN]], axis=1) <= result.force_tol).all()


def test_thresholds_are_relative_and_kept_beside_the_data(sticky):
    system, last = sticky
    solved, dtau = last.solved, last.state.tau - last.start.tau
    result = increment_traction(system, last)
    assert result.force_tol == FORCE_TOLERANCE * np.linalg.norm(solved.r, axis=1).max()
    assert result.slip_tol == pytest.approx(SLIP_TOLERANCE * 0.2 * 5 * dtau, rel=1e-14)
    larger = traction(system.candidates, solved.rows, solved.response.x, last.state.nodes, 1e3 * solved.r, dtau)
    np.testing.assert_array_equal(larger.status, result.status)
    np.testing.assert_allclose(larger.pressure, 1e3 * result.pressure, rtol=1e-12)


def test_tractions_carry_the_punch_force(sticky):
    system, last = sticky
    scene, nodes = system.body.scene, last.state.nodes
    result = increment_traction(system, last)
    p = np.full(len(nodes), np.nan)
    p[system.candidates.node] = result.pressure
    edges = np.concatenate([scene.mesh.boundary("top"), scene.mesh.boundary("side")])
    edges = edges[~np.isnan(p[edges]).any(axis=1)]
    area = edge_mass(nodes, edges, scene.geometry).sum(axis=(1, 2))
    total = np.sum(area * edge_means(nodes, edges, scene.geometry, p))
    assert total == pytest.approx(last.solved.r[:, 0].sum(), rel=1e-12)
