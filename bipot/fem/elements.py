"""Reference shapes and quadrature, tabulated once from scikit-fem.

The reference square or cube is scikit-fem's [0, 1]^d, triangle and tetrahedron are the part of it below the diagonal.
Weights sum to the measure of the shape: one, a half, a sixth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from functools import cache
from itertools import combinations, product
from math import prod
from typing import Any

import numpy as np

from bipot.meshes.elements import Element, same_places
from bipot.typing import Floats


class Quadrature(Enum):
    """Integration rules, by their name on the command line: of squares and cubes, triangles, tetrahedra."""

    RADON7 = "radon7"
    GAUSS2 = "gauss2"
    GAUSS3 = "gauss3"
    TRIANGLE1 = "triangle1"
    TRIANGLE3 = "triangle3"
    TRIANGLE7 = "triangle7"
    TETRAHEDRON1 = "tetrahedron1"
    TETRAHEDRON4 = "tetrahedron4"
    TETRAHEDRON14 = "tetrahedron14"


RULES = {
    Element.T3: (Quadrature.TRIANGLE1, Quadrature.TRIANGLE3, Quadrature.TRIANGLE7),
    Element.T6: (Quadrature.TRIANGLE3, Quadrature.TRIANGLE7),
    Element.Q4: (Quadrature.GAUSS2, Quadrature.RADON7, Quadrature.GAUSS3),
    Element.Q8: (Quadrature.RADON7, Quadrature.GAUSS2, Quadrature.GAUSS3),
    Element.Q9: (Quadrature.GAUSS3, Quadrature.RADON7),
    Element.T4: (Quadrature.TETRAHEDRON1, Quadrature.TETRAHEDRON4, Quadrature.TETRAHEDRON14),
    Element.T10: (Quadrature.TETRAHEDRON4, Quadrature.TETRAHEDRON14),
    Element.H8: (Quadrature.GAUSS2, Quadrature.GAUSS3),
    Element.H20: (Quadrature.GAUSS2, Quadrature.GAUSS3),
}
"""The rules of an element, its default first: the paper's for Q8, else the smallest without motions free of strain.

One point for T6 and 2 x 2 for Q9 leave such motions of a whole mesh. The one that 2 x 2 leaves a Q8, and the six that
eight points leave an H20, exist for a single element only.
"""


@dataclass(frozen=True)
class Reference:
    """Shape functions at the points of a rule: points (q, d), weights (q,), values (q, k), gradients (q, k, d)."""

    points: Floats
    weights: Floats
    values: Floats
    gradients: Floats

    @staticmethod
    def of(element: Any, points: Floats, weights: Floats, order: Iterable[int] = ()) -> Reference:
        """Any element of scikit-fem at points (q, d), with its nodes in ``order``, by default scikit-fem's."""
        basis = [element.lbasis(points.T, i) for i in tuple(order) or range(len(element.doflocs))]
        values = np.column_stack([value for value, _ in basis])
        gradients = np.stack([np.asarray(gradient).T for _, gradient in basis], axis=1)
        return Reference(points, weights, values, gradients)


def radon7() -> tuple[Floats, Floats]:
    r"""The seven-point rule of degree 5 (Radon 1948; Stroud C2:5-1) on [-1, 1]^2: points (7, 2), weights (7,).

    (0, 0): 8/7; (0, +-sqrt(14/15)): 20/63; (+-sqrt(3/5), +-sqrt(1/3)): 5/9. It is not symmetric in x <-> y;
    the pair on an axis of the square lies along the *second* reference coordinate (z in a cylinder mesh).
    """
    a, b, c = np.sqrt(14 / 15), np.sqrt(3 / 5), np.sqrt(1 / 3)
    points = np.array([(0, 0), (0, a), (0, -a), (b, c), (b, -c), (-b, c), (-b, -c)])
    weights = np.array([8 / 7] + 2 * [20 / 63] + 4 * [5 / 9])
    return points, weights


def gauss(counts: Iterable[int]) -> tuple[Floats, Floats]:
    """Gauss' rule with ``counts`` of points along the axes of [-1, 1]^d: points (q, d), weights (q,)."""
    points, weights = zip(*(np.polynomial.legendre.leggauss(count) for count in counts), strict=True)
    return np.array(list(product(*points))), np.array([prod(factors) for factors in product(*weights)])


def triangle(count: int) -> tuple[Floats, Floats]:
    r"""Symmetric rules of degree 1, 2 and 5 with ``count`` = 1, 3 and 7 points (q, 2); weights (q,) sum to a half.

    The middle; the three points half-way from it to the corners; Radon's (1948), with s = sqrt(15): the middle, 9/40,
    and six points (a, a), (a, 1 - 2 a), (1 - 2 a, a), a = (6 -+ s)/21, (155 -+ s)/1200 of the area each.

    >>> float((lambda points, weights: weights @ points[:, 0] ** 2)(*triangle(3)).round(15)) == round(1 / 12, 15)
    True
    """
    s = np.sqrt(15)
    orbits = {1: (), 3: ((1 / 6, 1 / 3),), 7: tuple(((6 + k * s) / 21, (155 + k * s) / 1200) for k in (-1, 1))}[count]
    middle = [] if count == 3 else [(1 / 3, 1 / 3)]
    points = [point for a, _ in orbits for point in ((a, a), (a, 1 - 2 * a), (1 - 2 * a, a))]
    weights = [1 - 3 * sum(weight for _, weight in orbits)] * len(middle) + [w for _, w in orbits for _ in range(3)]
    return np.array(middle + points), np.array(weights) / 2


def tetrahedron(count: int) -> tuple[Floats, Floats]:
    r"""Symmetric rules of degree 1, 2 and 5 with ``count`` = 1, 4 and 14 points (q, 3); weights (q,) sum to a sixth.

    The middle; four points (a, a, a) and those with one a made 1 - 3 a, a = (5 - sqrt(5))/20; Walkington's (2000): two
    such orbits, and the six points with two coordinates of a and the others, the fourth included, of 1/2 - a.

    >>> float((lambda points, weights: weights @ points[:, 0] ** 2)(*tetrahedron(4)).round(15)) == round(1 / 60, 15)
    True
    """
    if count == 1:
        return np.full((1, 3), 1 / 4), np.full(1, 1 / 6)
    corners, edges = {4: ((((5 - np.sqrt(5)) / 20, 1 / 24),), ()), 14: WALKINGTON}[count]
    one, two = (np.array([[k in chosen for k in range(4)] for chosen in combinations(range(4), n)]) for n in (1, 2))
    orbits = [np.where(one, 1 - 3 * a, a) for a, _ in corners] + [np.where(two, a, 1 / 2 - a) for a, _ in edges]
    weights = [weight for _, weight in (*corners, *edges)]
    return np.concatenate(orbits)[:, :3], np.repeat(weights, [len(points) for points in orbits])


WALKINGTON = (
    ((0.31088591926330060980, 0.018781320953002641800), (0.092735250310891226402, 0.012248840519393658257)),
    ((0.045503704125649649492, 0.0070910034628469110730),),
)
"""Coordinates and weights of the orbits of Walkington's rule: points on lines to corners, and to mid-sides."""

RULE: dict[Quadrature, Callable[[int], tuple[Floats, Floats]]] = {
    Quadrature.RADON7: lambda _: radon7(),
    Quadrature.GAUSS2: lambda dimension: gauss((2,) * dimension),
    Quadrature.GAUSS3: lambda dimension: gauss((3,) * dimension),
    Quadrature.TRIANGLE1: lambda _: triangle(1),
    Quadrature.TRIANGLE3: lambda _: triangle(3),
    Quadrature.TRIANGLE7: lambda _: triangle(7),
    Quadrature.TETRAHEDRON1: lambda _: tetrahedron(1),
    Quadrature.TETRAHEDRON4: lambda _: tetrahedron(4),
    Quadrature.TETRAHEDRON14: lambda _: tetrahedron(14),
}
"""Points and weights of each rule, given the dimension."""


@cache
def tabulated(element: Element, rule: Quadrature) -> Reference:
    """The element at the points of a rule of its shape."""
    points, weights = RULE[rule](element.dimension)
    return _on_cube(element, points, weights) if element.shape.cube else _reference(element, points, weights)


@cache
def tabulated_along(element: Element, counts: tuple[int, ...]) -> Reference:
    """A square or cube at the points of Gauss' rule with ``counts`` along the axes."""
    return _on_cube(element, *gauss(counts))


def tabulated_at(element: Element, points: Floats) -> Reference:
    """The element at points (q, d), all of the same weight."""
    return _reference(element, points, np.full(len(points), 1 / len(points)))


@cache
def facet(nodes: int, dimension: int) -> Reference:
    """The facet of elements of ``dimension`` d, an edge or a face with that number of ``nodes``, with its richest rule.

    For a square face this is Gauss' rule of three points along both axes, for a triangle that of degree five.
    """
    if dimension == 2:
        return tabulated_line(nodes)
    face = Element.of(nodes)
    return tabulated(face, Quadrature.GAUSS3 if face.shape.cube else Quadrature.TRIANGLE7)


@cache
def tabulated_line(nodes: int) -> Reference:
    """Line of two nodes or three (end, middle, end) with three Gauss points, for traction on edges."""
    # scikit-fem takes long to import and is used once: where an element is tabulated.
    import skfem

    points, weights = np.polynomial.legendre.leggauss(3)
    element, order = {2: (skfem.ElementLineP1, (0, 1)), 3: (skfem.ElementLineP2, (0, 2, 1))}[nodes]
    return Reference.of(element(), (points[:, None] + 1) / 2, weights / 2, order)


def _on_cube(element: Element, points: Floats, weights: Floats) -> Reference:
    """A square or cube at the points of a rule for [-1, 1]^d."""
    return _reference(element, (points + 1) / 2, weights / 2**element.dimension)


def _reference(element: Element, points: Floats, weights: Floats) -> Reference:
    import skfem

    shapes = getattr(skfem, element.shapes)()
    return Reference.of(shapes, points, weights, same_places(element.every_place, np.asarray(shapes.doflocs)).tolist())
