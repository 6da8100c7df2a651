r"""The ``midpoint`` strain measure of any reduction, by 3 x 3 tensors: formulas in :mod:`bipot.fem.strain`.

A half rotation is a matrix Q_h (3, 3, ...): with spin w (an axial vector) at the middle, Q_h turns by atan(|w|/2) about
w, and Q_h Q_h = (I - W/2)^-1 (I + W/2) is that of Hughes and Winget. In a plane :mod:`bipot.fem.plane` does the same by
closed forms. In both, components come first in memory: a product of small matrices at all points is one of whole
vectors for each pair of entries, which is faster than one at each point.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from bipot.fem.reduction import COMPONENTS, SQRT2, Reduction, mandel_to_full
from bipot.typing import Floats, einsum, read_only

UNIT = read_only(np.eye(3)[..., None], np.float64)

GENERATORS = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    GENERATORS[_a, _c, _b], GENERATORS[_a, _b, _c] = 1.0, -1.0
GENERATORS.flags.writeable = False
"""E_a with E_a v = e_a x v."""

_SHEARS = read_only(np.transpose(COMPONENTS[3:]), np.intp)
_ABOUT = read_only([2, 0, 1], np.intp)
"""Rows and columns of the shears of a Mandel vector, and the axes about which the same entries spin, negative."""


def cofactors(J: Floats) -> tuple[Floats, Floats]:
    """J'^-1 det J (..., 3, 3), laid out in memory as J, and det J (...)."""
    out = np.empty_like(J)
    a, b, c = J[..., 0], J[..., 1], J[..., 2]
    for column, (x, y) in enumerate(((b, c), (c, a), (a, b))):
        for row, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            out[..., row, column] = x[..., i] * y[..., j] - x[..., j] * y[..., i]
    return out, np.vecdot(out[..., 0], a)


def middle(g: Floats, reduction: Reduction) -> tuple[Floats, tuple[Floats, ...]]:
    """g of H (I - H/2)^-1 (..., m), and the quantity that must be positive: det (I - H/2)."""
    H = _matrices(g, reduction.embedding)
    turned, ratio = cofactors((UNIT - H / 2).transpose(2, 0, 1))
    positive = (ratio.reshape(g.shape[:-1]),)
    if not ratio.min() > 0:
        return g, positive
    return _vectors(einsum("nji,jkn->ikn", turned, H) / ratio, reduction.embedding.T, g.shape), positive


def half_rotation(g: Floats, reduction: Reduction) -> Floats:
    """Q_h (3, 3, ...) of the gradient at the middle (..., m)."""
    w = _spin(g, reduction)
    c = 1 / np.sqrt(1 + _square(w) / 4)
    Q = c * UNIT + c / 2 * _cross(w) + c**2 / (4 * (1 + c)) * w[:, None] * w
    return Q.reshape(3, 3, *g.shape[:-1])


def turn(tensor: Floats, rotation: Floats) -> Floats:
    """Q t Q' of Mandel tensors (..., s) by Q = ``rotation`` (3, 3, ...)."""
    full, Q = mandel_to_full(tensor.shape[-1]), rotation.reshape(3, 3, -1)
    return _vectors(_times(_times(Q, _matrices(tensor, full)), back(Q)), full.T, tensor.shape)


def twice(half: Floats) -> Floats:
    """The whole rotation Q_h Q_h."""
    return _times(half, half)


def back(rotation: Floats) -> Floats:
    """The inverse of a rotation."""
    return rotation.swapaxes(0, 1)


def strain_by_gradient(
    reduction: Reduction, middle: Floats, half: Floats, strain: Floats, rotated: Floats, shear: Floats
) -> Floats:
    """d e / d g (..., s, m): see :func:`bipot.fem.plane.strain_by_gradient`.

    A change dH of the gradient is L dH R at the middle, with L = I - H/2, R = I + H/2 and the H there, and M = Q_h L dH
    R Q_h' turned with the strain, which changes by the symmetric part of M. With p = w/2 the whole rotation spins by
    2 (dp + p x dp) / (1 + p.p), and the half one by (I + Q_h)^-1 = (I - c/(1 + c) P) / 2 times that, c = cos of its
    angle and P v = p x v. As Q_h is made of P, the spins are S m and (S - c^2/(1 + c) P) m / 2 by the axial vector m of
    M, with S = c I - c^3/(1 + c) p p'.
    """
    s, H, Q = reduction.mandel, _matrices(middle, reduction.embedding) / 2, half.reshape(3, 3, -1)
    p = _spin(middle, reduction) / 2
    c = 1 / np.sqrt(1 + _square(p))
    turning = _times(_turn(strain / 2 + rotated / (2 * shear)), c * UNIT - c**3 / (1 + c) * p[:, None] * p)
    turning -= c**2 / (2 * (1 + c)) * _times(_turn(strain), _cross(p))
    # The entries of M are products of L turned and of R' turned, in the order of g: columns of dH first.
    left, across, out = _times(Q, UNIT - H), _times(Q, back(UNIT + H)), np.empty((s, *H.shape))
    np.multiply(across[:, :, None], left[:, None], out=out[:3])
    left, (rows, columns) = left / SQRT2, _SHEARS[:, : s - 3]
    one, other = across[columns][:, :, None] * left[rows][:, None], across[rows][:, :, None] * left[columns][:, None]
    np.add(one, other, out=out[3:])
    out += einsum("san,ajin->sjin", turning[:, _ABOUT[: s - 3]] / SQRT2, other - one)
    by_point = np.ascontiguousarray(out.reshape(9 * s, -1).T).reshape(*middle.shape[:-1], s, 9)
    return by_point if reduction.dimension == 3 else by_point[..., [3 * j + i for i, j in reduction.entries]]


def _times(left: Floats, right: Floats) -> Floats:
    """Products of small matrices (a, 3, ...) and (3, b, ...) at all points."""
    return einsum("ij...,jk...->ik...", left, right)


def _square(w: Floats) -> Floats:
    """w.w (n,) of vectors (3, n)."""
    return einsum("an,an->n", w, w)


def _contract(t: Floats, table: Floats) -> Floats:
    """t table (m, n) of (..., s) at n points and (s, m)."""
    return table.T @ t.reshape(-1, t.shape[-1]).T


def _matrices(t: Floats, table: Floats) -> Floats:
    """Tensors (3, 3, n) of vectors (..., s) at n points, by their tensors (s, 9)."""
    return _contract(t, table).reshape(3, 3, -1)


def _vectors(tensors: Floats, table: Floats, shape: tuple[int, ...]) -> Floats:
    """Vectors of a ``shape`` (..., s) of tensors (3, 3, n) at n points."""
    return (tensors.reshape(9, -1).T @ table).reshape(shape)


def _spin(g: Floats, reduction: Reduction) -> Floats:
    """The axial vector (3, n) of the skew part."""
    return _contract(g, reduction.embedding @ GENERATORS.reshape(3, 9).T / 2)


def _cross(w: Floats) -> Floats:
    """W (3, 3, n) with W v = w x v."""
    return (GENERATORS.reshape(3, 9).T @ w).reshape(3, 3, -1)


def _turn(tensor: Floats) -> Floats:
    """E_a t - t E_a (s, 3, n) of Mandel tensors t (..., s) for each axis a."""
    return _contract(tensor, _turns(tensor.shape[-1])).reshape(tensor.shape[-1], 3, -1)


@cache
def _turns(size: int) -> Floats:
    """Coefficients (s, 3 s) that make the (s, 3) entries of E_a t - t E_a from a Mandel tensor t."""
    full = mandel_to_full(size)
    T = full.reshape(size, 1, 3, 3)
    out = (GENERATORS @ T - T @ GENERATORS).reshape(size, 3, 9) @ full.T
    return read_only(out.swapaxes(1, 2).reshape(size, 3 * size), np.float64)
