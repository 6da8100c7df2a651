"""Folded elements: det J as a polynomial, its bounds against dense sampling, the axis, and what is refused."""

from dataclasses import replace
from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest

from bipot.errors import FoldedAnswer, InvertedElement
from bipot.fem.elements import Quadrature, tabulated, tabulated_at
from bipot.fem.kinematics import gradients
from bipot.fem.orientation import basis, determinant_coefficients, refuse_folded, scaled_jacobians
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder
from bipot.meshes.solids import brick
from bipot.paper import upsetting
from bipot.response import Body, body_space
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.state import rest
from bipot.tools.tool import FlatTool
from tests.sampling import determinants, grid

ELEMENT = np.arange(8)[None]
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5]])


def exact_gradients(xi, eta):
    """d/dxi and d/deta of the eight shape functions on [0, 1]^2, in rational arithmetic, from their usual formulas."""
    s, t = 2 * Fraction(xi) - 1, 2 * Fraction(eta) - 1
    out = []
    for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        # (1 + a s)(1 + b t)(a s + b t - 1) / 4
        out.append((a * (1 + b * t) * (2 * a * s + b * t) / 2, b * (1 + a * s) * (2 * b * t + a * s) / 2))
    for a, b in ((0, -1), (1, 0), (0, 1), (-1, 0)):
        # (1 - s^2)(1 + b t) / 2 and (1 + a s)(1 - t^2) / 2
        out.append((-2 * s * (1 + b * t), (1 - s**2) * b) if a == 0 else (a * (1 - t**2), -2 * t * (1 + a * s)))
    return out


def bernstein(t):
    return [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]


def test_the_coefficients_are_det_J_identically():
    """det J is a sum over pairs of nodes of x_k y_m - x_m y_k times a polynomial, the first node being the origin: each
    pair is compared on a 5 x 5 grid in rational arithmetic, more than the degrees (3, 3) of both sides need."""
    pairs = list(combinations(range(1, 8), 2))
    x = np.zeros((len(pairs), 8, 2))
    for pair, (k, m) in enumerate(pairs):
        x[pair, k, 0] = x[pair, m, 1] = 1
    coefficients = determinant_coefficients(x)[0].reshape(-1, 4, 4)
    D = [[[Fraction(v).limit_denominator(1000) for v in row] for row in one] for one in coefficients]
    for xi, eta in product([Fraction(k, 4) for k in range(5)], repeat=2):
        G, B, C = exact_gradients(xi, eta), bernstein(xi), bernstein(eta)
        assert [sum(row[j] for row in G) for j in range(2)] == [0, 0]
        for pair, (k, m) in enumerate(pairs):
            value = sum(B[i] * C[j] * D[pair][i][j] for i in range(4) for j in range(4))
            assert value == G[k][0] * G[m][1] - G[k][1] * G[m][0]


def test_the_coefficients_keep_constants_and_take_the_corners_values():
    """The weights of every coefficient sum to one; at a corner the coefficient is the value."""
    np.testing.assert_allclose(basis(Element.Q8).from_values.sum(axis=0), 1, rtol=1e-14)
    corners = [0, 3, 12, 15]
    np.testing.assert_allclose(basis(Element.Q8).from_values[:, corners], np.eye(16)[:, corners], atol=1e-15)


def least_by_search(x):
    """The least det J (e,) of elements (e, 8, 2): a grid, refined seven times about its least point."""
    points, width, each = np.broadcast_to(grid(25), (len(x), 625, 2)), 1 / 24, np.arange(len(x))
    for _ in range(8):
        values = determinants(x, points)
        at = points[each, values.argmin(axis=1)]
        points, width = np.clip(at[:, None] + width * (2 * grid(9) - 1), 0, 1), width / 4
    return values.min(axis=1)


def random_elements(count=1500, seed=0):
    """Distorted squares, stretched and turned, some of them folded."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.02, 0.3, (count, 1, 1))
    x = SQUARE + size * rng.uniform(-1, 1, (count, 8, 2))
    stretch = 10.0 ** rng.uniform(-1, 1, (count, 1, 2))
    angle = rng.uniform(0, 2 * np.pi, count)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]]).transpose(2, 0, 1)
    return (stretch * x) @ turn + rng.uniform(-5, 5, (count, 1, 2))


def refusal(x):
    """What is said of one element (8, 2) in plane strain, or an empty string."""
    try:
        refuse_folded({"here": x}, ELEMENT, Geometry.PLANE_STRAIN)
    except InvertedElement as inverted:
        return str(inverted)
    return ""


def test_random_elements_are_decided_as_dense_sampling_decides_them():
    x = random_elements()
    sampled = least_by_search(x) / determinant_coefficients(x)[0].mean(axis=1)
    words = [refusal(element) for element in x]
    refused = np.array([bool(said) for said in words])
    valid = sampled > 1e-6
    assert not (refused & valid).any()
    assert not (~refused & (sampled <= 0)).any()
    assert not any("not known" in said for said in words)
    # Both kinds are met, and coefficients that are not subdivided refuse valid elements.
    plain = determinant_coefficients(x)[0].min(axis=1) > 0
    assert 0.2 < valid.mean() < 0.9
    assert 0.01 < (valid & ~plain).sum() / valid.sum() < 0.2


def test_the_scaled_jacobian_is_a_lower_bound_within_its_tolerance():
    x = random_elements(600, 1)
    mean = determinant_coefficients(x)[0].mean(axis=1)
    x, mean = x[mean > 0], mean[mean > 0]
    sampled, nodes = least_by_search(x) / mean, x.reshape(-1, 2)
    elements = np.arange(len(nodes)).reshape(-1, 8)
    bound = scaled_jacobians(nodes, elements)
    assert (bound <= sampled + 1e-10 * (1 + np.abs(sampled))).all()
    assert (bound >= sampled - 1.01e-3 * np.abs(sampled) - 1e-6).all()
    valid = np.flatnonzero(sampled > 0.05)
    assert bound[valid].min() <= sampled[valid].min() + 1e-10


def test_the_mean_is_the_area():
    x = random_elements(50, 2)
    rule = tabulated(Element.Q8, Quadrature.GAUSS3)
    area = determinants(x, rule.points) @ rule.weights
    np.testing.assert_allclose(determinant_coefficients(x)[0].mean(axis=1), area, rtol=1e-11)


def bent(depth):
    """The lower edge's middle node raised: det J = 1 - 4 depth xi (1 - xi), least along a whole line, 1 - depth."""
    x = SQUARE.copy()
    x[4, 1] += depth
    return x


@pytest.mark.parametrize("left", [0.3, 1e-3, 1e-6])
def test_a_valley_is_decided_on_both_sides_of_zero(left):
    # y = eta + 4 d xi (1 - xi)(1 - eta), x = xi.
    assert not refusal(bent(1 - left))
    assert "is not positive" in refusal(bent(1 + left))
    mean = 1 - 2 / 3 * (1 - left)
    lower = scaled_jacobians(bent(1 - left), ELEMENT).item()
    assert lower == pytest.approx(left / mean, rel=1e-3, abs=1e-6)


def test_what_is_zero_is_refused():
    assert refusal(bent(1.0))
    triangle = SQUARE.copy()
    triangle[[2, 5]] = [[0.5, 0.5], [0.75, 0.25]]
    triangle[6] = (triangle[2] + triangle[3]) / 2
    assert "Jacobian determinant" in refusal(triangle)
    assert refusal(np.zeros((8, 2)))


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("thin", [1.0, 1e-5])
def test_units_and_slivers_are_no_reason_to_refuse(scale, thin):
    c, s = np.cos(0.3), np.sin(0.3)
    assert not refusal(scale * (SQUARE * [1, thin]) @ np.array([[c, s], [-s, c]]))


def test_a_needle_next_to_round_off_is_not_called_negative():
    mesh = brick(1e-6, 1e-6, 1.0, 1, 1, 1)
    with pytest.raises(InvertedElement, match=r"Jacobian determinant 1e-12 is not above its round-off, \d"):
        refuse_folded({"at rest": mesh.nodes}, mesh.elements, Geometry.SOLID)


def test_a_fold_is_named_with_element_place_and_value():
    # x = xi + 4 d xi (1 - xi)(1 - eta): det J = 1 + 4 d at the corner of the second element.
    mesh = block(2.0, 1.0, 2, 1, element=Element.Q8)
    nodes = mesh.nodes.copy()
    worst = int(np.argmax(nodes[mesh.elements][:, :, 0].min(axis=1)))
    middle = np.flatnonzero((np.abs(nodes - [1.5, 0.0]) < 1e-12).all(axis=1))[0]
    nodes[middle, 0] -= 0.3
    words = rf"element {worst} at \(1\.0, 0\.0\), at the end: Jacobian determinant -0\.2 is not positive"
    with pytest.raises(InvertedElement, match=words):
        refuse_folded({"at the start": mesh.nodes, "at the end": nodes}, mesh.elements, Geometry.PLANE_STRAIN)
    # The integration points see nothing of it.
    assert (
        gradients(nodes, mesh.elements, tabulated(Element.Q8, Quadrature.GAUSS2), Geometry.PLANE_STRAIN).volume.min()
        > 0
    )


def test_a_reversed_element_has_no_scaled_jacobian():
    assert scaled_jacobians(SQUARE, ELEMENT[:, [0, 3, 2, 1, 7, 6, 5, 4]]).item() == -np.inf
    assert scaled_jacobians(SQUARE, ELEMENT[:, [0, 3, 2, 1, 7, 6, 5, 4]]).tolist() == [-np.inf]


def axisymmetric(x):
    refuse_folded({"here": x}, ELEMENT, Geometry.AXISYMMETRIC)


@pytest.mark.parametrize("noise", [0.0, 1e-15, -1e-15])
def test_edges_and_corners_on_the_axis_are_admissible(noise):
    axisymmetric(SQUARE - [-noise, 0])
    c = np.sqrt(0.5)
    turned = SQUARE @ np.array([[c, c], [-c, c]])
    axisymmetric(turned - [turned[:, 0].min() + noise, 0])
    mesh = cylinder(1.0, 1.0, 3, 2, element=Element.Q8)
    refuse_folded({"here": mesh.nodes}, mesh.elements, Geometry.AXISYMMETRIC)


def test_an_edge_tangent_to_the_axis_at_its_end_is_admissible():
    x = SQUARE.copy()
    x[[3, 7, 6], 0] = 0.4, 0.1, 0.7
    axisymmetric(x)


@pytest.mark.parametrize(
    ("corner", "middle", "left"), [(0.01, 0.05, 0.5), (0.0, 0.05, 0.5), (0.0, -0.01, 0.0), (0.1, 0.0, 0.1)]
)
def test_a_radius_that_is_not_positive_between_nodes_is_refused(corner, middle, left):
    """The edge xi = 0 crosses the axis; nodes and integration points need not."""
    x = SQUARE.copy()
    x[[1, 2, 5], 0] = 3.0
    x[[0, 7, 3], 0] = corner, middle, left
    x[[4, 6], 0] = (x[[0, 3], 0] + 3) / 2
    assert gradients(x, ELEMENT, tabulated(Element.Q8, Quadrature.GAUSS2), Geometry.AXISYMMETRIC).volume.min() > 0
    refuse_folded({"here": x}, ELEMENT, Geometry.PLANE_STRAIN)
    with pytest.raises(InvertedElement, match=r"element 0 at \(-?0.\d*, 0\.\d+\), here: radius .* is not positive"):
        axisymmetric(x)


def test_a_bore_is_admissible_and_a_body_across_the_axis_is_not():
    axisymmetric(SQUARE - [-1e-3, 0])
    with pytest.raises(InvertedElement, match=r"radius -0\.1 is not positive"):
        axisymmetric(SQUARE - [0.1, 0])


def test_between_the_edges_the_radius_is_never_least():
    """Valid elements with positive radius on their edges have it inside: the sampled least is on the edge."""
    x = random_elements(300, 3)
    points, inside = grid(21), ((grid(21) > 0) & (grid(21) < 1)).all(axis=1)
    values = tabulated_at(Element.Q8, points).values
    checked = 0
    for element in x:
        if not refusal(element):
            r = values @ element[:, 0]
            assert r[~inside].min() < r[inside].min()
            checked += 1
    assert checked > 50


def folding_body(configuration):
    """A plane body of one square with 2 x 2 points."""
    mesh = Mesh(SQUARE, ELEMENT, {"base": np.array([[0, 4, 1]]), "top": np.array([[2, 6, 3]])})
    material = upsetting(mu=0.0).material
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.0)
    supports = (Support("base", 1),)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, material, supports, (tool,), Quadrature.GAUSS2, configuration)
    return Body(scene, body_space(scene))


def moved(body, by):
    """Free displacements that move the lower mid-side node along its edge, from a start where it was moved back."""
    du = np.zeros((8, 2))
    du[4, 0] = by
    return du.ravel()[body.space.free]


def state_of(body, start):
    """At rest, the lower mid-side node moved along its edge by ``start``."""
    nodes = SQUARE.copy()
    nodes[4, 0] += start
    return replace(rest(body.scene, np.zeros(3)), nodes=nodes)


@pytest.mark.parametrize(
    ("configuration", "start", "by", "when"),
    [
        (Configuration.MIDPOINT, 0.0, 0.3, "end"),
        (Configuration.PAPER, 0.0, 0.3, "end"),
        (Configuration.MIDPOINT, 0.34, -0.12, "middle"),
        (Configuration.PAPER, 0.3, -0.2, "start"),
        (Configuration.MIDPOINT, 0.3, -0.2, None),
        (Configuration.PAPER, 0.1, 0.1, None),
    ],
)
def test_an_increment_is_looked_at_where_it_is_posed_and_where_it_ends(configuration, start, by, when):
    body = folding_body(configuration)
    response = body.respond(state_of(body, start), moved(body, by))
    if when is None:
        body.refuse_folded(response)
    else:
        with pytest.raises(FoldedAnswer, match=rf"element 0 at \(1.0, 0.0\), at the {when} of the increment"):
            body.refuse_folded(response)
