"""Reference shapes and quadrature, tabulated once from scikit-fem.

The reference square or cube is scikit-fem's [0, 1]^d, triangle and tetrahedron are the part of it below the diagonal.
Weights sum to the measure of the shape: one, a half, a sixth.
"""

from __future__ import annotations

from collections.abc import Iterable
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


GAUSS = {Quadrature.GAUSS2: 2, Quadrature.GAUSS3: 3}
"""Points of Gauss' rules along each axis."""

ORBITS: dict[Quadrature, tuple[tuple[int, float, float], ...]] = {
    Quadrature.TRIANGLE1: ((0, 1 / 3, 1 / 2),),
    Quadrature.TRIANGLE3: ((1, 1 / 6, 1 / 6),),
    Quadrature.TRIANGLE7: (
        (0, 1 / 3, 9 / 80),
        *((1, (6 + s * 15**0.5) / 21, (155 + s * 15**0.5) / 2400) for s in (-1, 1)),
    ),
    Quadrature.TETRAHEDRON1: ((0, 1 / 4, 1 / 6),),
    Quadrature.TETRAHEDRON4: ((1, (5 - 5**0.5) / 20, 1 / 24),),
    Quadrature.TETRAHEDRON14: (
        (1, 0.31088591926330060980, 0.018781320953002641800),
        (1, 0.092735250310891226402, 0.012248840519393658257),
        (2, 0.454496295874350350508, 0.0070910034628469110730),
    ),
}
"""Symmetric rules of degree 1, 2 and 5, those of degree 5 by Radon (1948) and Walkington (2000), as orbits (n, a, w).

An orbit has the points of the weight w of which all barycentric coordinates but n are a, and those n one number."""


def simplex(dimension: int, rule: Quadrature) -> tuple[Floats, Floats]:
    """The points (q, d) and weights (q,) of the orbits of a rule for triangles or tetrahedra.

    >>> points, weights = simplex(3, Quadrature.TETRAHEDRON4)
    >>> float((weights @ points[:, 0] ** 2).round(15)) == round(1 / 60, 15)
    True
    """
    corners = range(dimension + 1)
    points, weights = list[Floats](), list[float]()
    for n, a, weight in ORBITS[rule]:
        # In the order that files of runs have.
        for chosen in combinations(corners if dimension == 3 else corners[::-1], n):
            points.append(np.where(np.isin(corners, chosen), (1 - (dimension + 1 - n) * a) / max(n, 1), a)[:-1])
            weights.append(weight)
    return np.array(points), np.array(weights)


@cache
def tabulated(element: Element, rule: Quadrature) -> Reference:
    """The element at the points of a rule of its shape."""
    d = element.dimension
    if not element.shape.cube:
        return _reference(element, *simplex(d, rule))
    return _on_cube(element, *(radon7() if rule is Quadrature.RADON7 else gauss((GAUSS[rule],) * d)))


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
