"""Element quality: closed forms of rectangles, rhombi, moved mid-sides, folded corners and edges."""

import numpy as np
import pytest

from bipot.fem.elements import RULES, tabulated
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.layout import Layout
from bipot.meshes.sections import cylinder
from studies.quality import jacobians, quality, stretch_ratios

ELEMENT = np.arange(8)[None]
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5]])


def test_a_square_mesh_is_perfect():
    mesh = cylinder(5.0, 5.0, 3, 3, element=Element.Q8)
    worth = quality(mesh.nodes, mesh.elements)
    np.testing.assert_allclose([worth.jacobian, worth.aspect], 1.0, rtol=1e-12)


@pytest.mark.parametrize("ratio", [0.2, 3.0])
def test_a_rectangle_has_its_aspect(ratio):
    worth = quality(SQUARE * [1.0, ratio], ELEMENT)
    assert worth.aspect[0] == pytest.approx(max(ratio, 1 / ratio), rel=1e-12)
    assert worth.jacobian[0] == pytest.approx(1.0, rel=1e-12)


def test_shear_counts_in_the_aspect_and_not_in_the_jacobian():
    shear = 1.5
    worth = quality(SQUARE @ np.array([[1.0, 0.0], [shear, 1.0]]), ELEMENT)
    assert worth.jacobian[0] == pytest.approx(1.0, rel=1e-12)
    # Stretches of simple shear: exp(+-asinh(shear/2)).
    assert worth.aspect[0] == pytest.approx(np.exp(2 * np.arcsinh(shear / 2)), rel=1e-12)


def test_a_mid_side_moved_along_its_edge_shrinks_one_corner():
    # x = xi + 4 d xi (1 - xi)(1 - eta): det J at the origin is 1 + 4 d; its mean over the square stays 1.
    d = -0.2
    x = SQUARE.copy()
    x[4, 0] += d
    worth = quality(x, ELEMENT)
    assert worth.jacobian[0] == pytest.approx(1 + 4 * d, rel=1e-12)
    assert worth.aspect[0] == pytest.approx(1 / (1 + 4 * d), rel=1e-12)


def test_a_folded_corner_is_negative():
    x = SQUARE.copy()
    x[4, 0] -= 0.3
    assert quality(x, ELEMENT).jacobian[0] < 0


def test_a_fold_between_corners_and_points_is_negative():
    # The lower edge is a parabola b(xi) with b(0.3) = 1.05, the upper one y = 1: det J = 1 - b.
    def b(xi):
        return 1.05 * (1 - ((xi - 0.3) / 0.3) ** 2)

    x = SQUARE.copy()
    x[[0, 4, 1], 1] = b(np.array([0.0, 0.5, 1.0]))
    x[5, 1] = (1 + b(1.0)) / 2
    area = 1 - 1.05 * (1 - (0.7**3 + 0.3**3) / 3 / 0.3**2)
    assert quality(x, ELEMENT).jacobian[0] == pytest.approx(-0.05 / area, rel=1e-3)


def terms(points):
    """Monomials that span det J of an eight-node element."""
    powers = [(i, j) for i in range(4) for j in range(4) if i + j <= 4]
    return np.column_stack([points[:, 0] ** i * points[:, 1] ** j for i, j in powers])


def test_corners_agree_with_the_shape_functions():
    x = SQUARE + np.random.default_rng(0).uniform(-0.1, 0.1, SQUARE.shape)
    points = np.concatenate([tabulated(Element.Q8, rule).points for rule in RULES[Element.Q8]])
    gradients = np.concatenate([tabulated(Element.Q8, rule).gradients for rule in RULES[Element.Q8]])
    values = np.linalg.det(np.einsum("ka,qkb->qab", x, gradients))
    coefficients = np.linalg.lstsq(terms(points), values, rcond=None)[0]
    np.testing.assert_allclose(terms(points) @ coefficients, values, rtol=1e-10)
    corners = terms(SQUARE[:4]) @ coefficients
    np.testing.assert_allclose(np.linalg.det(jacobians(x[None]))[0, :4], corners, rtol=1e-9)


@pytest.mark.parametrize("element", elements_of(2))
@pytest.mark.parametrize("layout", [Layout.TENSOR, Layout.FANNED])
def test_stretch_is_of_the_body_whatever_its_elements(element, layout):
    mesh = cylinder(5.0, 5.0, 4, 4, element=element, layout=layout)
    worth = stretch_ratios(mesh.nodes * [1.2, 0.4], mesh.elements, mesh.nodes)
    np.testing.assert_allclose(worth, 3.0, rtol=1e-9)


def test_a_straight_angle_leaves_the_stretch_finite():
    x = SQUARE[:4].copy()
    x[2] = [0.5, 0.5]
    worth = stretch_ratios(x, ELEMENT[:, :4], SQUARE)
    assert quality(x, ELEMENT[:, :4]).jacobian[0] == pytest.approx(0.0, abs=1e-12)
    assert 1.5 < worth[0] < 20
