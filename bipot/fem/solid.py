r"""The ``midpoint`` strain measure of any reduction, by 3 x 3 tensors: formulas in :mod:`bipot.fem.strain`.

A half rotation is a matrix Q_h (..., 3, 3): with spin w (an axial vector) at the middle, Q_h turns by atan(|w|/2) about
w, and Q_h Q_h = (I - W/2)^-1 (I + W/2) is that of Hughes and Winget. In a plane :mod:`bipot.fem.plane` does the same by
closed forms, four times faster.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from bipot.fem.reduction import Reduction, mandel_to_full
from bipot.tensors import contract
from bipot.typing import Floats, read_only

EYE = np.eye(3)

GENERATORS = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    GENERATORS[_a, _c, _b], GENERATORS[_a, _b, _c] = 1.0, -1.0
GENERATORS.flags.writeable = False
"""E_a with E_a v = e_a x v."""

AXIAL = read_only(-GENERATORS.swapaxes(0, 1) / 2, np.float64)
"""Coefficients (3, 3, 3), columns first, of the entries of a skew tensor's axial vector: -E_a / 2."""


def cofactors(J: Floats) -> tuple[Floats, Floats]:
    """J'^-1 det J (..., 3, 3), and det J (...)."""
    out = np.empty(J.shape)
    a, b, c = J[..., 0], J[..., 1], J[..., 2]
    for column, (x, y) in enumerate(((b, c), (c, a), (a, b))):
        for row, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            out[..., row, column] = x[..., i] * y[..., j] - x[..., j] * y[..., i]
    return out, np.vecdot(out[..., 0], a)


def middle(g: Floats, reduction: Reduction) -> tuple[Floats, tuple[Floats, ...]]:
    """g of H (I - H/2)^-1 (..., m), and the quantity that must be positive: det (I - H/2)."""
    H = _spread(g, reduction)
    turned, ratio = cofactors(EYE - H / 2)
    if not ratio.min() > 0:
        return g, (ratio,)
    out = turned.swapaxes(-1, -2) @ H / ratio[..., None, None]
    return contract(out.reshape(*out.shape[:-2], 9), reduction.embedding.T), (ratio,)


def half_rotation(g: Floats, reduction: Reduction) -> Floats:
    """Q_h (..., 3, 3) of the gradient at the middle (..., m)."""
    w = _spin(g, reduction)
    c = 1 / np.sqrt(1 + np.vecdot(w, w) / 4)[..., None, None]
    return c * EYE + c / 2 * _cross(w) + c**2 / (4 * (1 + c)) * w[..., :, None] * w[..., None, :]


def part(half: Floats, points: slice) -> Floats:
    """The half rotations of some points, a slice of their first axis."""
    return half[points]


def turn(tensor: Floats, rotation: Floats) -> Floats:
    """Q t Q' of Mandel tensors (..., s) by Q = ``rotation`` (..., 3, 3)."""
    full = mandel_to_full(tensor.shape[-1])
    T = contract(tensor, full).reshape(*tensor.shape[:-1], 3, 3)
    return contract((rotation @ T @ rotation.swapaxes(-1, -2)).reshape(*T.shape[:-2], 9), full.T)


def twice(half: Floats) -> Floats:
    """The whole rotation Q_h Q_h."""
    return half @ half


def back(rotation: Floats) -> Floats:
    """The inverse of a rotation."""
    return rotation.swapaxes(-1, -2)


def strain_by_gradient(
    reduction: Reduction, middle: Floats, half: Floats, strain: Floats, rotated: Floats, shear: float
) -> Floats:
    """d e / d g (..., s, m): see :func:`bipot.fem.plane.strain_by_gradient`.

    A change dH of the gradient is L dH R at the middle, with L = I - H/2, R = I + H/2 and the H there. The component
    along each symmetric F of the Mandel basis changes by F : Q_h L dH R Q_h'. With p = w/2 the whole rotation spins by
    2 (dp + p x dp) / (1 + p.p), and the half one by (I + Q_h)^-1 = (I - c/(1 + c) P) / 2 times that, c = cos of its
    angle and P v = p x v.
    """
    points, H = middle.shape[:-1], _spread(middle, reduction) / 2
    L, R, s = EYE - H, EYE + H, reduction.mandel
    p = _spin(middle, reduction) / 2
    c = 1 / np.sqrt(1 + np.vecdot(p, p))[..., None, None]
    P = _cross(p)
    whole = c**2 * (EYE + P)
    by_half = (EYE - c / (1 + c) * P) @ whole / 2
    turning = _turn(strain) @ by_half + _turn(rotated / (2 * shear)) @ whole
    # In the order (j, s, i) each product is one of matrices on the last one as it lies in memory.
    out = _between(R @ half.swapaxes(-1, -2), _symmetric(s), half @ L)
    out += turning[..., None, :, :] @ _between(R, AXIAL, L)
    by_column = np.ascontiguousarray(out.swapaxes(-3, -2)).reshape(*points, s, 9)
    return by_column if reduction.dimension == 3 else by_column[..., [3 * j + i for i, j in reduction.entries]]


def _between(left: Floats, tensors: Floats, right: Floats) -> Floats:
    """left t right (..., 3, k, 3), rows first, of tensors t (3, k, 3), rows first too."""
    _, k, _ = tensors.shape
    out = contract(left, tensors.reshape(3, -1)).reshape(*left.shape[:-2], 3 * k, 3) @ right
    return out.reshape(*left.shape[:-2], 3, k, 3)


@cache
def _symmetric(size: int) -> Floats:
    """The symmetric tensors (3, s, 3) of the Mandel basis, rows first."""
    return read_only(mandel_to_full(size).reshape(size, 3, 3).swapaxes(0, 1), np.float64)


def _spread(g: Floats, reduction: Reduction) -> Floats:
    return contract(g, reduction.embedding).reshape(*g.shape[:-1], 3, 3)


def _spin(g: Floats, reduction: Reduction) -> Floats:
    """The axial vector (..., 3) of the skew part."""
    return contract(g, reduction.embedding @ GENERATORS.reshape(3, 9).T / 2)


def _cross(w: Floats) -> Floats:
    """W (..., 3, 3) with W v = w x v."""
    return contract(w, GENERATORS.reshape(3, 9)).reshape(*w.shape[:-1], 3, 3)


def _turn(tensor: Floats) -> Floats:
    """E_a t - t E_a (..., s, 3) of Mandel tensors t for each axis a."""
    return contract(tensor, _turns(tensor.shape[-1])).reshape(*tensor.shape, 3)


@cache
def _turns(size: int) -> Floats:
    """Coefficients (s, 3 s) that make the (s, 3) entries of E_a t - t E_a from a Mandel tensor t."""
    full = mandel_to_full(size)
    T = full.reshape(size, 1, 3, 3)
    out = (GENERATORS @ T - T @ GENERATORS).reshape(size, 3, 9) @ full.T
    return read_only(out.swapaxes(1, 2).reshape(size, 3 * size), np.float64)
