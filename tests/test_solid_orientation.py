"""Orientation of whole elements in space: coefficients, subdivision, and random elements against dense sampling."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from bipot.errors import InvertedElement, SceneError
from bipot.fem.elements import tabulated_at
from bipot.fem.orientation import basis, determinant_coefficients, refuse_folded, scaled_jacobians
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from tests.solids import SOLIDS, curved, turned

FOLDING = [element for element in SOLIDS if element is not Element.T4]


def grid_of(element, count):
    """Points (p, 3) of the element's shape, its corners among them."""
    points = np.array(list(product(np.linspace(0, 1, count), repeat=3)))
    return points if element.shape.cube else points[points.sum(axis=1) <= 1 + 1e-12]


def determinants_of(element, x, points):
    slopes = tabulated_at(element, points).gradients
    return np.linalg.det(np.einsum("qka,eki->eqia", slopes, x))


def random_elements(element, count, seed=0):
    """Distorted reference shapes, stretched, turned and moved, some of them folded."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.02, 0.3, (count, 1, 1)) * (1 if element.quadratic else 2)
    x = element.every_place + size * rng.uniform(-1, 1, (count, element.nodes, 3))
    stretch = 10.0 ** rng.uniform(-1, 1, (count, 1, 3))
    Q = turned((1.0, 2.0, -1.0), 0.7)
    return (stretch * x) @ Q.T + rng.uniform(-5, 5, (count, 1, 3))


def refusal(x):
    """The words that refuse one element, none where it is accepted."""
    try:
        refuse_folded({"here": x}, np.arange(len(x))[None], Geometry.SOLID)
    except InvertedElement as inverted:
        return str(inverted)
    return ""


@pytest.mark.parametrize("element", SOLIDS)
def test_coefficients_are_those_of_the_determinant_over_the_element_and_over_its_parts(element):
    """They make the values anywhere, are bounds of them, and those of a part make the values there."""
    x, form = random_elements(element, 20), basis(element)
    D, _ = determinant_coefficients(x)
    scale = np.abs(D).max(axis=1, keepdims=True)
    np.testing.assert_allclose(form.parts.sum(axis=2), 1, rtol=0, atol=0)
    np.testing.assert_allclose(np.abs(np.linalg.det(form.turns)).sum(), 1.0, rtol=1e-14)
    at = np.linalg.inv(form.from_values)
    for part, turn, shift in zip(form.parts, form.turns, form.shifts, strict=True):
        sampled = determinants_of(element, x, form.grid @ turn.T + shift)
        np.testing.assert_allclose(D @ part.T @ at / scale, sampled / scale, atol=1e-10)
        assert (D.min(axis=1) <= sampled.min(axis=1) + 1e-10 * scale[:, 0]).all()
        assert (D.max(axis=1) >= sampled.max(axis=1) - 1e-10 * scale[:, 0]).all()
    corners = determinants_of(element, x, form.grid[form.corners])
    np.testing.assert_allclose(D[:, form.corners] / scale, corners / scale, atol=1e-10)


@pytest.mark.parametrize("element", FOLDING)
def test_random_elements_are_decided_as_dense_sampling_decides_them(element):
    x = random_elements(element, 150)
    mean = determinant_coefficients(x)[0].mean(axis=1)
    x, mean = x[mean > 0], mean[mean > 0]
    sampled = determinants_of(element, x, grid_of(element, 13)).min(axis=1) / mean
    words = [refusal(one) for one in x]
    refused = np.array([bool(said) for said in words])
    bound = scaled_jacobians(x.reshape(-1, 3), np.arange(x.size // 3).reshape(-1, element.nodes))
    # A grid is no search: what is refused may be folded between its points, by as much as the bound says.
    assert (bound[refused] <= 1.1e-3).all()
    assert (bound <= sampled + 1e-9 * (1 + np.abs(sampled))).all()
    assert not (~refused & (sampled <= 0)).any()
    assert not (refused & (sampled > 0.1)).any()
    assert not any("not known" in said for said in words)
    assert 0.1 < refused.mean() < 0.95


def test_a_tetrahedron_is_folded_where_its_volume_is_not_positive():
    x = random_elements(Element.T4, 200)
    volume = determinants_of(Element.T4, x, np.array([[0.2, 0.2, 0.2]]))[:, 0]
    assert [bool(refusal(one)) for one in x] == (volume <= 0).tolist()
    assert 0 < (volume <= 0).sum() < 200


def test_a_hexahedron_that_is_positive_at_all_corners_may_be_folded():
    """Where neither they nor points of integration know of it."""
    x = Element.H8.places + 0.75 * np.random.default_rng(3).uniform(-1, 1, (1500, 8, 3))
    x = x[determinants_of(Element.H8, x, Element.H8.places).min(axis=1) > 0]
    found = [one for one in x if refusal(one)]
    assert 0 < len(found) < len(x)
    assert all(determinants_of(Element.H8, one[None], grid_of(Element.H8, 21)).min() < 1e-2 for one in found)


@pytest.mark.parametrize("element", SOLIDS)
def test_a_fold_is_placed_and_a_scene_refuses_it_by_name(element):
    mesh = curved(element)
    material = VonMises(Elasticity(210.0, 0.3), Perfect(0.3))
    Scene(mesh, Geometry.SOLID, material, ())
    with pytest.raises(SceneError, match=r"element \d+ at \(.*, at rest: Jacobian determinant -"):
        Scene(Mesh(mesh.nodes * (1, 1, -1), mesh.elements), Geometry.SOLID, material, ())
    x = element.every_place.copy()
    x[0] = 0.9
    assert "here: Jacobian determinant -" in refusal(x)


def brick_with(**moved):
    """The unit cube with nodes, by their numbers, at other places."""
    x = np.array(Element.H8.shape.corners, dtype=float)
    for node, place in moved.items():
        x[int(node.removeprefix("n"))] = place
    return x


STRAIGHT = {
    "a corner with three faces in a plane": brick_with(n6=(2 / 3, 2 / 3, 2 / 3)),
    "an edge with two": brick_with(n1=(2.0, 0.0, 1.0), n2=(2.0, 1.0, 1.0)),
    "a corner with one edge in the plane of a face": brick_with(n1=(2.0, 0.0, 1.0)),
}


@pytest.mark.parametrize("x", STRAIGHT.values(), ids=STRAIGHT)
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_bricks_whose_faces_lie_on_one_plane_are_no_folds_where_they_may(x, scale):
    """As where a corner, or an edge, of a block has rolled onto a flat tool; the rest of det J is positive."""
    nodes = scale * x @ turned((1.0, 2.0, 3.0), 0.7).T
    values = determinants_of(Element.H8, x[None], grid_of(Element.H8, 21))
    assert np.isclose(values.min(), 0.0, atol=1e-14)
    assert np.sort(values.ravel())[21] > 0
    refuse_folded({"now": nodes}, np.arange(8)[None], Geometry.SOLID, straight=True)
    with pytest.raises(InvertedElement, match="Jacobian determinant"):
        refuse_folded({"now": nodes}, np.arange(8)[None], Geometry.SOLID)


@pytest.mark.parametrize(
    "x",
    [
        brick_with(n6=(0.66, 0.66, 0.66)),
        brick_with(n1=(2.0, 0.0, 1.001), n2=(2.0, 1.0, 1.001)),
        brick_with(n1=(2.0, 0.0, 1.0), n2=(2.0, 1.0, 1.001)),
        brick_with(n4=(0.0, 0.5, 1.0), n5=(1.0, 0.5, 1.0), n6=(1.0, 0.5, 1.0), n7=(0.0, 0.5, 1.0)),
    ],
    ids=["corner beyond the plane", "edge beyond it", "one end of it", "collapsed face"],
)
def test_more_than_straight_is_a_fold_of_a_brick(x):
    with pytest.raises(InvertedElement, match="Jacobian determinant"):
        refuse_folded({"now": x}, np.arange(8)[None], Geometry.SOLID, straight=True)
