"""A straight angle between two edges on a flat tool is no fold of an increment's end, but one at rest."""

import re

import numpy as np
import pytest

from bipot.errors import InvertedElement, SceneError
from bipot.fem.orientation import STRAIGHT, determinant_coefficients, refuse_folded
from bipot.fem.reduction import Geometry
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.scene.supports import Support
from tests.sampling import refusal
from tests.scenes import scene

ANGLES = (0.0, 0.5 * STRAIGHT, -0.5 * STRAIGHT, 0.99 * STRAIGHT, -0.99 * STRAIGHT)


def dented(corner):
    """A unit square whose third corner is moved in until det J there is ``corner`` of its mean."""
    # det J is 1, c, 2 c - 1, c at the corners, c in the mean.
    c = 1 / (2 - corner)
    x = np.array([[0.0, 0.0], [1.0, 0.0], [c, c], [0.0, 1.0]])
    D, _ = determinant_coefficients(x[None])
    assert np.sort(D[0])[0] / D.mean() == pytest.approx(corner, rel=1e-6, abs=1e-15)
    return x


def with_middles(x, element):
    """The same straight edges with mid-side nodes, and a centre, where the element has them."""
    middles = (x + np.roll(x, -1, axis=0)) / 2
    return np.vstack([x, middles, x.mean(axis=0)])[: element.nodes]


@pytest.mark.parametrize("corner", ANGLES)
@pytest.mark.parametrize("first", range(4))
def test_one_straight_corner_is_no_fold_where_it_may_be(corner, first):
    x = np.roll(dented(corner), first, axis=0)
    assert refusal(x, straight=True) == ""
    assert bool(refusal(x)) == (corner <= 0)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_units_do_not_tell_what_is_straight(scale):
    assert refusal(scale * dented(-0.9 * STRAIGHT), straight=True) == ""
    assert "Jacobian determinant -" in refusal(scale * dented(-10 * STRAIGHT), straight=True)


@pytest.mark.parametrize("corner", [-1.1 * STRAIGHT, -1e-8, -1e-3])
def test_more_than_straight_is_a_fold(corner):
    assert re.match(r"element 0 at \(0\.[45].*, here: Jacobian determinant -", refusal(dented(corner), straight=True))


@pytest.mark.parametrize("apart", [0.0, -1e-10])
def test_an_element_with_two_straight_corners_is_folded(apart):
    """Its first two nodes are one, or have changed their places by less than is told from zero."""
    x = np.array([[0.0, 0.0], [apart, 0.0], [1.0, 1.0], [-1.0, 1.0]])
    D, _ = determinant_coefficients(x[None])
    assert (np.abs(D) < STRAIGHT * D.mean()).sum() == 2
    assert "is not positive" in refusal(x, straight=True)


def test_a_straight_corner_does_not_excuse_another_element():
    """Each of two elements may have one; where a third is folded, that is the one which is named."""
    straight, folded = dented(0.0), dented(-0.1)
    aside = np.array([2.0, 0.0])
    nodes = np.concatenate([straight, straight + aside, folded + 2 * aside])
    elements = np.arange(12).reshape(3, 4)
    refuse_folded({"here": nodes}, elements[:2], Geometry.PLANE_STRAIN, straight=True)
    with pytest.raises(InvertedElement, match="element 2 at"):
        refuse_folded({"here": nodes}, elements, Geometry.PLANE_STRAIN, straight=True)


@pytest.mark.parametrize("element", [Element.Q8, Element.Q9])
def test_elements_with_middle_nodes_may_have_none(element):
    """A flat tool does not straighten a curved edge: nothing makes such a corner but a fold."""
    assert refusal(with_middles(dented(0.5), element), straight=True) == ""
    assert "is not positive" in refusal(with_middles(dented(0.0), element), straight=True)


def test_at_rest_none_may_be_straight():
    mesh = Mesh(dented(0.0), np.arange(4)[None], {"base": np.array([[0, 1]]), "left": np.array([[0, 3]])})
    with pytest.raises(SceneError, match="at rest: Jacobian determinant"):
        scene(mesh=mesh, tools=(), supports=(Support("base", 1), Support("left", 0)))
