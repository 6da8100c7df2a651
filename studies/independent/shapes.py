r"""Shapes and rules of elements written a second time, for the fuzz study's recomputation: nothing of the library.

On the square [-1, 1]^2, corners (-1, -1), (1, -1), (1, 1), (-1, 1), then the mid-sides in the same turn. Of eight nodes

    N_c = (1 + a)(1 + b)(a + b - 1)/4 with a = xi xi_c, b = eta eta_c,
    N_m = (1 - xi^2)(1 + b)/2 on eta = +-1,    N_m = (1 - eta^2)(1 + a)/2 on xi = +-1.

With four and nine they are products of Lagrange's polynomials. On the triangle of (0, 0), (1, 0), (0, 1), with its
coordinates L: N_c = L_c, or L_c (2 L_c - 1) and N_m = 4 L_a L_b between corners a and b.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
MIDDLES = np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
NINE = np.vstack([CORNERS, MIDDLES, [(0.0, 0.0)]])


def shape_functions(points: Floats, nodes: int) -> tuple[Floats, Floats]:
    """Values (q, k) and derivatives (q, k, 2) at ``points`` (q, 2) of the element with k = ``nodes``.

    >>> values, slopes = shape_functions(np.array([[0.3, -0.2]]), 8)
    >>> round(float(values.sum()), 12), np.abs(slopes.sum(axis=1)).max() < 1e-15
    (1.0, np.True_)
    """
    return {3: _triangle, 6: _triangle, 4: _products, 8: _serendipity, 9: _products}[nodes](points, nodes)


def _triangle(points: Floats, nodes: int) -> tuple[Floats, Floats]:
    L = np.column_stack([1 - points.sum(axis=1), points])
    d = np.array([(-1.0, -1.0), (1.0, 0.0), (0.0, 1.0)])
    if nodes == 3:
        return L, np.broadcast_to(d, (len(points), 3, 2))
    M = L[:, [1, 2, 0]]
    slopes = (4 * L - 1)[:, :, None] * d, 4 * (M[:, :, None] * d + L[:, :, None] * d[[1, 2, 0]])
    return np.hstack([L * (2 * L - 1), 4 * L * M]), np.concatenate(slopes, axis=1)


def _products(points: Floats, nodes: int) -> tuple[Floats, Floats]:
    at = np.array([-1.0, 1.0]) if nodes == 4 else np.array([-1.0, 0.0, 1.0])
    which = np.searchsorted(at, NINE[:nodes])
    along = [_lagrange(points[:, axis], at) for axis in range(2)]
    (x, dx), (y, dy) = ((N[:, k], slope[:, k]) for (N, slope), k in zip(along, which.T, strict=True))
    return x * y, np.stack([dx * y, x * dy], axis=-1)


def _lagrange(x: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Values and derivatives (q, n) of the polynomials that are one at one of the n points and zero at the others."""
    basis = [np.poly1d(np.delete(at, k), r=True) / np.prod(at[k] - np.delete(at, k)) for k in range(len(at))]
    return np.column_stack([p(x) for p in basis]), np.column_stack([p.deriv()(x) for p in basis])


def _serendipity(points: Floats, _: int) -> tuple[Floats, Floats]:
    values, slopes = np.empty((len(points), 8)), np.empty((len(points), 8, 2))
    xi, eta = points.T
    for k, (x, y) in enumerate(CORNERS):
        a, b = xi * x, eta * y
        values[:, k] = (1 + a) * (1 + b) * (a + b - 1) / 4
        slopes[:, k, 0] = x * (1 + b) * (2 * a + b) / 4
        slopes[:, k, 1] = y * (1 + a) * (a + 2 * b) / 4
    for k, (x, y) in enumerate(MIDDLES, 4):
        if x == 0:
            values[:, k] = (1 - xi**2) * (1 + eta * y) / 2
            slopes[:, k, 0], slopes[:, k, 1] = -xi * (1 + eta * y), y * (1 - xi**2) / 2
        else:
            values[:, k] = (1 - eta**2) * (1 + xi * x) / 2
            slopes[:, k, 0], slopes[:, k, 1] = x * (1 - eta**2) / 2, -eta * (1 + xi * x)
    return values, slopes


def rule(name: str) -> tuple[Floats, Floats]:
    """Points (q, 2) and weights (q,) of a rule of the library, in the order stresses are stored in."""
    if name.startswith("triangle"):
        return _on_triangle(name)
    if name == "radon7":
        a, b, c = np.sqrt(14 / 15), np.sqrt(3 / 5), np.sqrt(1 / 3)
        points = [(0, 0), (0, a), (0, -a), (b, c), (b, -c), (-b, c), (-b, -c)]
        return np.array(points), np.array([8 / 7, 20 / 63, 20 / 63, 5 / 9, 5 / 9, 5 / 9, 5 / 9])
    if name == "gauss2":
        line, weight = np.array([-1, 1]) / np.sqrt(3), np.ones(2)
    elif name == "gauss3":
        line, weight = np.array([-1, 0, 1]) * np.sqrt(3 / 5), np.array([5, 8, 5]) / 9
    else:
        raise ValueError(f"unknown rule {name!r}")
    return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2), np.outer(weight, weight).ravel()


def _on_triangle(name: str) -> tuple[Floats, Floats]:
    if name == "triangle1":
        return np.array([(1 / 3, 1 / 3)]), np.array([0.5])
    if name == "triangle3":
        return np.array([(1, 1), (1, 4), (4, 1)]) / 6, np.full(3, 1 / 6)
    if name != "triangle7":
        raise ValueError(f"unknown rule {name!r}")
    a, b = 0.10128650732345633, 0.47014206410511505
    points = [(1 / 3, 1 / 3), (a, a), (a, 1 - 2 * a), (1 - 2 * a, a), (b, b), (b, 1 - 2 * b), (1 - 2 * b, b)]
    weights = [0.1125, *[0.06296959027241358] * 3, *[0.06619707639425308] * 3]
    return np.array(points), np.array(weights)


def line(s: Floats, nodes: int) -> tuple[Floats, Floats]:
    """Values and derivatives (n, q) on an edge of two or three ``nodes``, end, middle, end, at s (q,) from -1 to 1."""
    if nodes == 2:
        return np.stack([1 - s, 1 + s]) / 2, np.stack([0 * s - 0.5, 0 * s + 0.5])
    return np.stack([s * (s - 1) / 2, 1 - s**2, s * (s + 1) / 2]), np.stack([s - 0.5, -2 * s, s + 0.5])


def dense(nodes: int, count: int) -> Floats:
    """Points (q, 2) all over the element, corners and sides included, ``count`` along either axis."""
    line = np.linspace(-1, 1, count)
    square = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    if nodes not in (3, 6):
        return square
    half = (square + 1) / 2
    return half[half.sum(axis=1) <= 1 + 1e-9]
