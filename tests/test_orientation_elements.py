"""Orientation of every plane element: coefficients, decisions against dense sampling, scaled Jacobians, the axis."""

import numpy as np
import pytest

from bipot.fem.elements import tabulated_at
from bipot.fem.orientation import basis, determinant_coefficients, scaled_jacobians
from bipot.fem.reduction import Geometry
from bipot.meshes.elements import Element, elements_of
from tests.sampling import determinants_of, grid, refusal, triangle_grid

OTHERS = (Element.T3, Element.T6, Element.Q4, Element.Q9)
FOLDING = (Element.T6, Element.Q4, Element.Q9)


def places(element):
    """The nodes (k, 2) of the reference shape."""
    middle = (element.places + np.roll(element.places, -1, axis=0)) / 2
    return np.vstack([element.places, middle, element.places.mean(axis=0)])[: element.nodes]


def points_of(element, count=41):
    return grid(count) if element.corners == 4 else triangle_grid(count)


def random_elements(element, count=1500, seed=0):
    """Distorted reference shapes, stretched and turned, some of them folded."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.02, 0.3, (count, 1, 1)) * (2 if element in (Element.Q4, Element.T3) else 1)
    x = places(element) + size * rng.uniform(-1, 1, (count, element.nodes, 2))
    stretch = 10.0 ** rng.uniform(-1, 1, (count, 1, 2))
    c, s = np.cos(angle := rng.uniform(0, 2 * np.pi, count)), np.sin(angle)
    return (stretch * x) @ np.array([[c, -s], [s, c]]).transpose(2, 0, 1) + rng.uniform(-5, 5, (count, 1, 2))


def least_by_search(element, x):
    """The least det J (e,): a grid, refined about its least point, within the shape."""
    found = np.empty(len(x))
    for k, one in enumerate(x):
        points, width = points_of(element, 65), 1 / 64
        for _ in range(7):
            values = determinants_of(element, one[None], points)[0]
            best = points[values.argmin()]
            points = np.clip(best + width * (2 * grid(9) - 1), 0, 1)
            if element.corners == 3:
                points = points[points.sum(axis=1) <= 1]
                points = np.vstack([points, best])
            width /= 4
        found[k] = determinants_of(element, one[None], points)[0].min()
    return found


@pytest.mark.parametrize("element", elements_of(2))
def test_coefficients_keep_constants_take_corner_values_and_their_parts_are_those_of_the_halves(element):
    form = basis(element)
    np.testing.assert_allclose(form.from_values.sum(axis=0), 1, rtol=1e-14)
    own = np.eye(len(form.grid))
    np.testing.assert_allclose(form.from_values[:, form.corners], own[:, form.corners], atol=1e-15)
    np.testing.assert_allclose(form.parts.sum(axis=2), 1, rtol=0, atol=0)
    values = np.random.default_rng(0).normal(size=(7, len(form.grid)))
    at = np.linalg.inv(form.from_values)
    for part, turn, shift in zip(form.parts, form.turns, form.shifts, strict=True):
        # A part's coefficients give the values of the whole on the part's grid.
        found = values @ form.from_values @ part.T @ at
        halved = form.grid @ turn.T + shift
        np.testing.assert_allclose(found, values @ interpolation(form, halved), atol=1e-12)


def interpolation(form, points):
    """What takes values on the grid to those at ``points`` (c, p), by monomials of the same degrees."""
    side = np.unique(form.grid[:, 0]).size
    powers = [(i, j) for i in range(side) for j in range(side)]
    powers = powers if len(form.grid) == side**2 else [(i, j) for i, j in powers if i + j < side]
    at, to = (np.array([p[:, 0] ** i * p[:, 1] ** j for i, j in powers]) for p in (form.grid, points))
    return np.linalg.solve(at, to)


@pytest.mark.parametrize("element", OTHERS)
def test_coefficients_are_those_of_the_determinant_and_their_mean_its_mean(element):
    x = random_elements(element, 60)
    form, points = basis(element), points_of(element, 12)
    D, _ = determinant_coefficients(x)
    sampled = determinants_of(element, x, points)
    values = determinants_of(element, x, form.grid)
    scale = np.abs(D).max(axis=1, keepdims=True)
    np.testing.assert_allclose(D / scale, values @ form.from_values / scale, atol=1e-11)
    np.testing.assert_allclose(sampled / scale, values @ interpolation(form, points) / scale, atol=1e-11)
    assert (D.min(axis=1) <= sampled.min(axis=1) + 1e-11 * scale[:, 0]).all()
    assert (D.max(axis=1) >= sampled.max(axis=1) - 1e-11 * scale[:, 0]).all()


@pytest.mark.slow
@pytest.mark.parametrize("element", FOLDING)
def test_random_elements_are_decided_as_dense_sampling_decides_them(element):
    x = random_elements(element, 600)
    D, _ = determinant_coefficients(x)
    sampled = least_by_search(element, x) / D.mean(axis=1)
    words = [refusal(one) for one in x]
    refused = np.array([bool(said) for said in words])
    valid = (sampled > 1e-6) & (D.mean(axis=1) > 0)
    assert not (refused & valid).any()
    assert not (~refused & (sampled <= 0)).any()
    assert not any("not known" in said for said in words)
    assert 0.1 < valid.mean() < 0.98


@pytest.mark.parametrize("element", FOLDING)
def test_the_scaled_jacobian_is_a_lower_bound_within_its_tolerance(element):
    x = random_elements(element, 300, 1)
    mean = determinant_coefficients(x)[0].mean(axis=1)
    x, mean = x[mean > 0], mean[mean > 0]
    sampled = least_by_search(element, x) / mean
    bound = scaled_jacobians(x.reshape(-1, 2), np.arange(x.size // 2).reshape(-1, element.nodes))
    assert (bound <= sampled + 1e-9 * (1 + np.abs(sampled))).all()
    assert (bound >= sampled - 1.1e-3 * np.abs(sampled) - 1e-5).all()


def test_a_triangle_is_folded_where_its_area_is_not_positive():
    x = random_elements(Element.T3, 300)
    area = determinants_of(Element.T3, x, np.array([[0.3, 0.3]]))[:, 0]
    assert [bool(refusal(one)) for one in x] == (area <= 0).tolist()
    assert 0 < (area <= 0).sum() < 300
    assert scaled_jacobians(x[area > 0][0], np.arange(3)[None]) == pytest.approx(1)


def test_subdivision_decides_what_plain_coefficients_refuse():
    for element in (Element.T6, Element.Q9):
        x = random_elements(element, 2000, 5)
        accepted = np.array([not refusal(one) for one in x])
        plain = determinant_coefficients(x)[0].min(axis=1) > 0
        assert (plain <= accepted).all()
        assert (accepted & ~plain).any()


@pytest.mark.parametrize("element", elements_of(2))
def test_a_fold_is_placed_where_the_determinant_is_least(element):
    """The first corner goes through the opposite side."""
    x = places(element).astype(float)
    x[0] = [0.9, 0.9]
    words = refusal(x)
    assert "here: Jacobian determinant -" in words


@pytest.mark.parametrize("element", elements_of(2))
def test_the_axis_may_hold_corners_and_edges_but_no_body_reaches_across(element):
    x = places(element).astype(float)
    assert not refusal(x, Geometry.AXISYMMETRIC)
    assert not refusal(x - [-0.5, 0.0], Geometry.AXISYMMETRIC)
    assert "radius -0.1 is not positive" in refusal(x - [0.1, 0.0], Geometry.AXISYMMETRIC)
    c = np.sqrt(0.5)
    turned = x @ np.array([[c, c], [-c, c]])
    assert not refusal(turned - [turned[:, 0].min(), 0.0], Geometry.AXISYMMETRIC)


@pytest.mark.parametrize("element", [Element.T6, Element.Q8, Element.Q9])
def test_a_curved_edge_may_not_cross_the_axis_between_its_nodes(element):
    x = places(element).astype(float)
    sides = element.edges.tolist()
    left = next(edge for edge in sides if (x[edge, 0] == 0).all())
    x[:, 0] *= 3
    x[left, 0] = 0.01, 0.05, 0.5
    for edge in sides:
        if edge != left:
            x[edge[1]] = x[[edge[0], edge[2]]].mean(axis=0)
    assert not refusal(x)
    assert "radius" in refusal(x, Geometry.AXISYMMETRIC)


@pytest.mark.parametrize("element", elements_of(2))
def test_between_the_edges_the_radius_is_never_least(element):
    x, points = random_elements(element, 300, 3), points_of(element, 21)
    ends = points if element.corners == 4 else np.column_stack([points, 1 - points.sum(axis=1)])
    outer = (np.abs(ends) < 1e-12).any(axis=1) | ((np.abs(ends - 1) < 1e-12).any(axis=1) & (element.corners == 4))
    values, checked = tabulated_at(element, points).values, 0
    for one in x:
        if not refusal(one):
            r = values @ one[:, 0]
            assert r[outer].min() < r[~outer].min()
            checked += 1
    assert checked > 50
