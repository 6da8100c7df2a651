"""Reference shapes and quadrature, tabulated once from scikit-fem.

The reference square is scikit-fem's [0, 1]^2. Weights sum to its area, one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from bipot.typing import Floats


class Quadrature(Enum):
    """Integration rules on the quadrilateral, by their name on the command line."""

    RADON7 = "radon7"
    GAUSS2 = "gauss2"
    GAUSS3 = "gauss3"


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


@cache
def quad8(rule: Quadrature) -> Reference:
    """Eight-node serendipity quadrilateral at the points of ``rule``."""
    if rule is Quadrature.RADON7:
        points, weights = radon7()
    else:
        line, weight = np.polynomial.legendre.leggauss({Quadrature.GAUSS2: 2, Quadrature.GAUSS3: 3}[rule])
        points = np.array([(x, y) for x in line for y in line])
        weights = np.outer(weight, weight).ravel()
    return replace(quad8_at((points + 1) / 2), weights=weights / 4)


def quad8_at(points: Floats) -> Reference:
    """Eight-node serendipity quadrilateral at points (q, 2), all of the same weight."""
    # scikit-fem takes long to import and is asked once: where an element is tabulated.
    import skfem

    return Reference.of(skfem.ElementQuadS2(), points, np.full(len(points), 1 / len(points)))


@cache
def line3() -> Reference:
    """Three-node line (end, middle, end) with three Gauss points, for traction on edges."""
    import skfem

    points, weights = np.polynomial.legendre.leggauss(3)
    return Reference.of(skfem.ElementLineP2(), (points[:, None] + 1) / 2, weights / 2, (0, 2, 1))
