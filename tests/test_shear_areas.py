"""What belongs to contact points of the area of edges: against quadrature, never negative, and only where edges lie."""

import numpy as np
import pytest

from bipot.contact.sampling import nodal_areas
from bipot.contact.shear import LIES, lying, strength
from bipot.fem.reduction import Geometry
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, ring
from tests.scenes import PLANES


def by_quadrature(x, geometry, count=12):
    """int N_k dA (3,) of an edge through x (3, 2), by ``count`` Gauss points along the parabola."""
    out = np.zeros(3)
    for at, weight in zip(*np.polynomial.legendre.leggauss(count), strict=True):
        s = (at + 1) / 2
        shape = np.array([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)])
        slope = np.array([4 * s - 3, 4 - 8 * s, 4 * s - 1])
        around = 2 * np.pi * (shape @ x)[0] if geometry is Geometry.AXISYMMETRIC else 1.0
        out += weight / 2 * np.hypot(*(slope @ x)) * around * shape
    return out


@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("bent", [0.0, 0.05])
def test_shares_are_the_integrals_of_the_shape_functions(geometry, bent):
    mesh = ring(0.5, 2.0, 1.0, 3, 2, element=Element.Q8)
    lines = mesh.edges("top", "bore")
    x, y = mesh.nodes.T
    nodes = np.column_stack([x + bent * y**2, y + bent * np.sin(3 * x)])
    found = nodal_areas(nodes, lines, geometry)
    exact = np.array([by_quadrature(nodes[line], geometry) for line in lines])
    assert found.min() > 0
    # Three points integrate straight edges exactly.
    np.testing.assert_allclose(found, exact, rtol=1e-13 if not bent else 1e-3)


def test_an_edge_at_the_axis_and_one_with_its_middle_out_of_place():
    """The axis node has no share; a share that would be negative is none, and the area stays the edge's."""
    x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [0.28, 0.0], [2.0, 0.0]])
    np.testing.assert_allclose(
        nodal_areas(x, np.array([[0, 1, 2]]), Geometry.AXISYMMETRIC), np.pi * np.array([[0, 2, 1]]) / 3, atol=1e-15
    )
    bad = np.array([[0, 3, 2]])
    exact = by_quadrature(x[bad[0]], Geometry.AXISYMMETRIC)
    assert exact.min() < -0.01
    found = nodal_areas(x, bad, Geometry.AXISYMMETRIC)[0]
    assert found.min() == 0
    assert found.sum() == pytest.approx(exact.sum(), rel=1e-12)
    np.testing.assert_allclose(found[found > 0] / exact[found > 0], found.sum() / np.maximum(exact, 0).sum())


def test_an_edge_counts_as_far_as_it_lies_on_the_tool():
    x = np.array([[0.0, 0.0], [2.0, 0.0]]) * np.ones((6, 1, 1))
    gap = np.array([[0, 0], [0, LIES], [0.5 * LIES, 0], [0, 2 * LIES], [-0.1, -0.2], [2.0, 0.0]])
    np.testing.assert_allclose(lying(x, gap, np.arange(2)), [1.0, 0.5, 0.75, 0.0, 1.0, 0.0])


def test_of_three_points_the_farthest_counts():
    """Over the chord, whichever of them is nearest."""
    x = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]) * np.ones((200, 1, 1))
    gap = np.random.default_rng(1).uniform(-0.3, 0.7, (200, 3))
    found = lying(x, gap, np.array([0, 2]))
    np.testing.assert_allclose(found, np.clip(1 - gap.max(axis=1) / (LIES * 2), 0, 1), atol=1e-14)
    assert 0.2 < (found > 0).mean() < 0.9


@pytest.mark.parametrize("depth", [0.01, 1.0, 100.0])
def test_how_deep_a_face_is_does_not_matter_to_how_it_leaves_across(depth):
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, depth], [0.0, depth]])
    x = np.concatenate([corners, (corners + np.roll(corners, -1, axis=0)) / 2])
    gap = 0.1 * x[:, 0] ** 2
    for count in (4, 8):
        found = lying(x[None, :count], gap[None, :count], np.arange(4))
        np.testing.assert_allclose(found, 1 - 0.1 / LIES, atol=1e-14)


def test_the_strength_of_an_element_is_its_mean_over_the_volume():
    mesh = block(1.0, 1.0, 1, 1)
    k = strength(np.array([[300.0, 600.0], [100.0, 100.0]]), np.array([[3.0, 1.0], [2.0, 5.0]]))
    np.testing.assert_allclose(k, np.array([375.0, 100.0]) / np.sqrt(3))
    np.testing.assert_array_equal(mesh.owners("top", "left"), [0, 0])


@pytest.mark.parametrize("geometry", PLANES)
def test_an_edge_of_no_length_carries_nothing_and_warns_of_nothing(geometry):
    """As trial iterates may have one: warnings are errors here."""
    x = np.zeros((3, 2))
    assert not nodal_areas(x, np.arange(3)[None], geometry).any()
    np.testing.assert_array_equal(lying(x[None], np.array([[0.0, 0.1, 0.0]]), np.array([0, 2])), [0.0])
