"""Reference shapes and quadrature, tabulated once from scikit-fem.

The reference square is scikit-fem's [0, 1]^2. Weights sum to its area, one.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Quadrature(Enum):
    """Integration rules on the quadrilateral, by their name on the command line."""

    RADON7 = "radon7"
    GAUSS2 = "gauss2"
    GAUSS3 = "gauss3"


@dataclass(frozen=True)
class Tabulated:
    """Shape functions at the points of a rule: points (q, d), weights (q,), values (q, k), gradients (q, k, d)."""

    points: Floats
    weights: Floats
    values: Floats
    gradients: Floats


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
def quad8(rule: Quadrature) -> Tabulated:
    """Eight-node serendipity quadrilateral at the points of ``rule``."""
    return _tabulate(skfem.ElementQuadS2(), *_rule(rule))


@cache
def line3() -> Tabulated:
    """Three-node line (end, middle, end) with three Gauss points, for traction on edges."""
    points, weights = np.polynomial.legendre.leggauss(3)
    x = (points + 1) / 2
    values = np.column_stack([(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)])
    gradients = np.column_stack([4 * x - 3, 4 - 8 * x, 4 * x - 1])
    return Tabulated(x[:, None], weights / 2, values, gradients[:, :, None])


def _rule(rule: Quadrature) -> tuple[Floats, Floats]:
    """Points (q, 2) and weights (q,) on [0, 1]^2."""
    if rule is Quadrature.RADON7:
        points, weights = radon7()
    else:
        line, weight = np.polynomial.legendre.leggauss({Quadrature.GAUSS2: 2, Quadrature.GAUSS3: 3}[rule])
        points = np.array([(x, y) for x in line for y in line])
        weights = np.outer(weight, weight).ravel()
    return (points + 1) / 2, weights / 4


def _tabulate(element: Any, points: Floats, weights: Floats) -> Tabulated:
    basis = [element.lbasis(points.T, i) for i in range(len(element.doflocs))]
    values = np.column_stack([value for value, _ in basis])
    gradients = np.stack([np.asarray(gradient).T for _, gradient in basis], axis=1)
    return Tabulated(points, weights, values, gradients)
