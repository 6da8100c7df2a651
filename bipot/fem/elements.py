"""Reference shapes and quadrature, tabulated once from scikit-fem.

The reference square is scikit-fem's [0, 1]^2, the triangle its half below the diagonal. Weights sum to its area, one
or a half.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from bipot.elements import Element
from bipot.typing import Floats, read_only


class Quadrature(Enum):
    """Integration rules, by their name on the command line: of the quadrilateral, and of the triangle."""

    RADON7 = "radon7"
    GAUSS2 = "gauss2"
    GAUSS3 = "gauss3"
    TRIANGLE1 = "triangle1"
    TRIANGLE3 = "triangle3"
    TRIANGLE7 = "triangle7"


RULES = {
    Element.T3: (Quadrature.TRIANGLE1, Quadrature.TRIANGLE3, Quadrature.TRIANGLE7),
    Element.T6: (Quadrature.TRIANGLE3, Quadrature.TRIANGLE7),
    Element.Q4: (Quadrature.GAUSS2, Quadrature.RADON7, Quadrature.GAUSS3),
    Element.Q8: (Quadrature.RADON7, Quadrature.GAUSS2, Quadrature.GAUSS3),
    Element.Q9: (Quadrature.GAUSS3, Quadrature.RADON7),
}
"""The rules of an element, its own first: the paper's for Q8, else the least that leaves no motion without strain.

One point would leave such motions of T6, and 2 x 2 of Q9, that go through a whole mesh; the one of Q8 does not.
"""


@dataclass(frozen=True)
class Reference:
    """Shape functions at the points of a rule: points (q, d), weights (q,), values (q, k), gradients (q, k, d)."""

    points: Floats
    weights: Floats
    values: Floats
    gradients: Floats

    @staticmethod
    def of(element: Any, points: Floats, weights: Floats, order: Sequence[int] = ()) -> Reference:
        """Any element of scikit-fem at points (q, d), its nodes in ``order`` where that is another than its own."""
        basis = [element.lbasis(points.T, i) for i in order or range(len(element.doflocs))]
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


def gauss(count: int) -> tuple[Floats, Floats]:
    """Gauss' rule of ``count`` points along either axis of [-1, 1]^2: points (q, 2), weights (q,)."""
    line, weight = np.polynomial.legendre.leggauss(count)
    return np.array([(x, y) for x in line for y in line]), np.outer(weight, weight).ravel()


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


RULE: dict[Quadrature, Callable[[], tuple[Floats, Floats]]] = {
    Quadrature.RADON7: radon7,
    Quadrature.GAUSS2: lambda: gauss(2),
    Quadrature.GAUSS3: lambda: gauss(3),
    Quadrature.TRIANGLE1: lambda: triangle(1),
    Quadrature.TRIANGLE3: lambda: triangle(3),
    Quadrature.TRIANGLE7: lambda: triangle(7),
}


@cache
def tabulated(element: Element, rule: Quadrature) -> Reference:
    """The element at the points of a rule of its shape."""
    points, weights = RULE[rule]()
    if element.corners == 4:
        points, weights = (points + 1) / 2, weights / 4
    return Reference.of(_shapes(element), points, weights)


def tabulated_at(element: Element, points: Floats) -> Reference:
    """The element at points (q, 2), all of the same weight."""
    return Reference.of(_shapes(element), points, np.full(len(points), 1 / len(points)))


@cache
def node_places(element: Element) -> Floats:
    """The nodes (k, 2) of the element on its reference shape."""
    return read_only(_shapes(element).doflocs, np.float64)


@cache
def line(nodes: int) -> Reference:
    """Line of two nodes or three (end, middle, end) with three Gauss points, for traction on edges."""
    # scikit-fem takes long to import and is asked once: where an element is tabulated.
    import skfem

    points, weights = np.polynomial.legendre.leggauss(3)
    element, order = {2: (skfem.ElementLineP1, (0, 1)), 3: (skfem.ElementLineP2, (0, 2, 1))}[nodes]
    return Reference.of(element(), (points[:, None] + 1) / 2, weights / 2, order)


def _shapes(element: Element) -> Any:
    import skfem

    return getattr(skfem, element.shapes)()
