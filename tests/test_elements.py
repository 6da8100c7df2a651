"""Quadrature: all monomials of the rule's degree on the square, exactly; and shape functions."""

import numpy as np
import pytest
import skfem

from bipot.fem.elements import Quadrature, Reference, radon7, tabulated, tabulated_line
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.marching import Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool
from studies.verification.cases.seven_points import integral, moment
from tests.curved import STEEL


@pytest.mark.parametrize(("i", "j"), [(i, j) for i in range(6) for j in range(6 - i)])
def test_radon_integrates_the_21_monomials_of_degree_five(i, j):
    assert integral(i, j) == pytest.approx(moment(i, j), abs=1e-15)


def test_radon_first_failures():
    assert integral(6, 0) == pytest.approx(12 / 25)
    assert integral(0, 6) != pytest.approx(moment(0, 6))
    assert integral(2, 4) != pytest.approx(moment(2, 4))


def test_radon_is_not_symmetric_and_its_axis_pair_lies_along_the_second_axis():
    points, _ = radon7()
    assert np.sum((points[:, 0] == 0) & (points[:, 1] != 0)) == 2
    assert np.sum((points[:, 1] == 0) & (points[:, 0] != 0)) == 0


@pytest.mark.parametrize(("rule", "points"), [(Quadrature.RADON7, 7), (Quadrature.GAUSS2, 4), (Quadrature.GAUSS3, 9)])
def test_shapes_are_a_partition_of_unity(rule, points):
    table = tabulated(Element.Q8, rule)
    assert table.values.shape == (points, 8)
    np.testing.assert_allclose(table.values.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(table.gradients.sum(axis=1), 0.0, atol=1e-14)
    assert table.weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    "element", [skfem.ElementQuad1(), skfem.ElementQuad2(), skfem.ElementTriP2(), skfem.ElementHexS2()]
)
def test_any_element_of_scikit_fem_is_tabulated(element):
    """Values and gradients at its own nodes: one at its node, and the identity where the coordinates are nodal."""
    nodes = np.asarray(element.doflocs)
    table = Reference.of(element, nodes, np.ones(len(nodes)))
    np.testing.assert_allclose(table.values, np.eye(len(nodes)), atol=1e-14)
    jacobians = np.einsum("ka,qkb->qab", nodes, table.gradients)
    np.testing.assert_allclose(jacobians, np.broadcast_to(np.eye(nodes.shape[1]), jacobians.shape), atol=1e-13)


@pytest.mark.parametrize("configuration", Configuration)
@pytest.mark.parametrize("element", [skfem.ElementQuad1(), skfem.ElementQuad2(), skfem.ElementTriP2()])
def test_kinematics_of_other_plane_elements_are_those_of_the_motion(element, configuration):
    """A homogeneous stretch with shear has the strain of Q8's points at every point of any element."""
    points, weights = np.array([[0.2, 0.3], [0.5, 0.1]]), np.array([0.25, 0.25])
    gradient = np.array([[0.1, 0.03], [0.02, -0.08]])
    found = []
    for shape in (element, skfem.ElementQuadS2()):
        x = np.asarray(shape.doflocs, dtype=float) + np.array([1.0, 0.0])
        cells, reference = np.arange(len(x))[None], Reference.of(shape, points, weights)
        found.append(configuration.measure.increment(x, x @ gradient.T, cells, reference, Geometry.AXISYMMETRIC))
    np.testing.assert_allclose(found[0].strain, found[1].strain, atol=1e-14)
    np.testing.assert_allclose(found[0].volume, found[1].volume, rtol=1e-13)


def test_line_reproduces_quadratics():
    table, nodes = tabulated_line(3), np.array([0.0, 0.5, 1.0])
    x = table.points[:, 0]
    np.testing.assert_allclose(table.values @ nodes**2, x**2, atol=1e-15)
    np.testing.assert_allclose(table.gradients[:, :, 0] @ nodes**2, 2 * x, atol=1e-14)


@pytest.mark.parametrize(("rule", "least", "most"), [(Quadrature.RADON7, 1e-4, 1.0), (Quadrature.GAUSS3, 0.0, 1e-8)])
def test_the_first_corner_matters_to_radons_rule_alone(rule, least, most):
    """A pressed block with every element numbered from its second corner instead of the first."""
    mesh = block(2.0, 1.0, 2, 2, element=Element.Q8)
    again = Mesh(mesh.nodes, mesh.elements[:, [1, 2, 3, 0, 5, 6, 7, 4]], mesh.boundaries)
    press = FlatTool((0.0, 1.0), (0.0, -1.0), (0.02, -0.04), ("top",), 0.2)
    held = (Support("base", 0), Support("base", 1))
    force = []
    for given in (mesh, again):
        pressed = Scene(given, Geometry.PLANE_STRAIN, STEEL, held, (press,), quadrature=rule)
        *_, last = march(pressed, Schedule(4, first=0.01, settling=1, growth=4.0))
        force.append(last.tool_force(0))
    assert least <= np.abs(force[1] - force[0]).max() / np.abs(force[0]).max() <= most
