"""Strain, rotation and volumes of one increment: closed forms of simple shear, rotation and stretch."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bipot.errors import InvertedElement
from bipot.fem.elements import Quadrature, tabulated
from bipot.fem.plane import turn
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, cylinder
from studies.verification.cases.simple_shear import sheared

SQRT2 = np.sqrt(2.0)


def run(mesh, du, geometry=Geometry.PLANE_STRAIN, configuration=Configuration.MIDPOINT, nodes=None):
    start = mesh.nodes if nodes is None else nodes
    return configuration.measure.increment(start, du, mesh.elements, tabulated(Element.Q8, Quadrature.RADON7), geometry)


def rotate(tensor, angle):
    return turn(tensor, np.array([np.cos(2 * angle), np.sin(2 * angle)]))


@pytest.mark.parametrize(("steps", "s12", "s11"), [(10, 0.841884, 0.459810), (100, 0.841475, 0.459699)])
def test_hughes_winget_table(steps, s12, s11):
    assert sheared(steps) == pytest.approx((s12, s11), abs=6e-7)


def test_simple_shear_converges_with_order_two():
    exact = np.array([np.sin(1.0), 1 - np.cos(1.0)])
    errors = [np.abs(np.array(sheared(n)) - exact).max() for n in (10, 20, 40)]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.05)


@given(st.floats(-3.1, 3.1), st.integers(0, 5))
def test_a_rigid_rotation_returns_the_stress_exactly_rotated(angle, seed):
    mesh = block(2.0, 1.0, 2, 2, element=Element.Q8)
    c, s = np.cos(angle), np.sin(angle)
    Q = np.array([[c, -s], [s, c]])
    stress = np.random.default_rng(seed).normal(size=(4, 7, 4))
    kin = run(mesh, mesh.nodes @ Q.T - mesh.nodes)
    np.testing.assert_allclose(kin.strain, 0.0, atol=1e-12 / max(np.cos(angle / 2), 0.02))
    np.testing.assert_allclose(kin.turned(stress), rotate(stress, angle), atol=1e-12)


def test_rotation_agrees_with_the_matrix_product():
    t = np.array([1.0, -2.0, 0.5, 0.7 * SQRT2])
    T = np.array([[1.0, 0.7], [0.7, -2.0]])
    Q = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    R = Q @ T @ Q.T
    np.testing.assert_allclose(rotate(t, 0.3), [R[0, 0], R[1, 1], 0.5, SQRT2 * R[0, 1]], atol=1e-15)


@pytest.mark.parametrize(
    ("configuration", "factor"),
    [(Configuration.MIDPOINT, lambda e: e / (1 - e / 2)), (Configuration.PAPER, lambda e: e)],
)
def test_homogeneous_upsetting_strain(configuration, factor):
    mesh, e = cylinder(5.0, 5.0, 2, 2, element=Element.Q8), 0.1
    du = mesh.nodes * np.array([e / 2, -e])
    kin = run(mesh, du, Geometry.AXISYMMETRIC, configuration)
    hoop = e / 2 / (1 + e / 4) if configuration is Configuration.MIDPOINT else e / 2
    expected = np.broadcast_to([hoop, -factor(e), hoop, 0.0], kin.strain.shape)
    np.testing.assert_allclose(kin.strain, expected, atol=1e-14)


def test_axisymmetric_volume_is_that_of_the_ring_and_of_the_asked_configuration():
    mesh = cylinder(5.0, 4.0, 3, 2, element=Element.Q8)
    du = mesh.nodes * np.array([0.1, -0.2])
    end = run(mesh, du, Geometry.AXISYMMETRIC).volume.sum()
    start = run(mesh, du, Geometry.AXISYMMETRIC, Configuration.PAPER).volume.sum()
    assert start == pytest.approx(np.pi * 25 * 4)
    assert end == pytest.approx(np.pi * 25 * 4 * 1.21 * 0.8)


def test_B_is_the_derivative_of_the_strain_at_the_end_configuration():
    rng = np.random.default_rng(3)
    mesh = cylinder(2.0, 1.0, 2, 2, element=Element.Q8)
    du = 0.02 * rng.normal(size=mesh.nodes.shape)
    du[mesh.boundary_nodes("axis"), 0] = 0
    kin = run(mesh, du, Geometry.AXISYMMETRIC)
    direction = rng.normal(size=mesh.nodes.shape)
    direction[mesh.boundary_nodes("axis"), 0] = 0
    at_end = run(mesh, direction, Geometry.AXISYMMETRIC, Configuration.PAPER, mesh.nodes + du)
    element = direction[mesh.elements].reshape(len(mesh.elements), -1)
    np.testing.assert_allclose(np.einsum("eqsk,ek->eqs", kin.B, element), at_end.strain, atol=1e-12)


def test_an_inverting_increment_names_the_element_and_the_place():
    mesh = block(2.0, 1.0, 2, 1, element=Element.Q8)
    with pytest.raises(InvertedElement, match=r"element \d at \(.*\): Jacobian determinant"):
        run(mesh, mesh.nodes * np.array([0.0, -1.5]))


def test_an_increment_that_inverts_at_its_middle_is_refused_though_its_end_is_not_folded():
    """With F = diag(-2, -1/2) the gradient at the end is H = diag(3/2, 3), and I - H/2 turns one side over."""
    mesh = block(2.0, 1.0, 2, 1, element=Element.Q8)
    with pytest.raises(InvertedElement, match="at the middle over that at the end"):
        run(mesh, mesh.nodes * np.array([-3.0, -1.5]))


def test_half_a_turn_is_refused_and_nothing_is_divided_by_zero():
    """Halfway, I - H/2 = 0."""
    mesh = block(2.0, 1.0, 2, 1, element=Element.Q8)
    with pytest.raises(InvertedElement, match="at the middle over that at the end"):
        run(mesh, -2 * mesh.nodes)


def test_the_places_of_strain_and_equilibrium():
    mesh = block(2.0, 1.0, 2, 1, element=Element.Q8)
    du = 0.1 * mesh.nodes
    placed = Configuration.MIDPOINT.measure.placements(mesh.nodes, du)
    np.testing.assert_allclose(placed["at the middle of the increment"], 1.05 * mesh.nodes)
    np.testing.assert_allclose(placed["at the end of the increment"], 1.1 * mesh.nodes)
    placed = Configuration.PAPER.measure.placements(mesh.nodes, du)
    np.testing.assert_array_equal(placed["at the start of the increment"], mesh.nodes)


@pytest.mark.parametrize("geometry", [Geometry.PLANE_STRAIN, Geometry.AXISYMMETRIC])
def test_the_volume_before_is_that_of_the_start_to_third_order(geometry):
    """2 tanh(x/2) stands for each logarithm x: volumes are off by the sum of x^3/12."""
    mesh, grown = block(2.0, 1.0, 2, 1, element=Element.Q8), np.array([0.02, 0.03])
    kin = run(mesh, mesh.nodes * grown, geometry)
    start = run(mesh, 0 * mesh.nodes, geometry).volume
    logs = np.log1p(grown if geometry is Geometry.PLANE_STRAIN else grown[[0, 0, 1]])
    np.testing.assert_allclose(kin.volume_before / start - 1, (logs**3).sum() / 12, rtol=0.02)
