r"""The ``midpoint`` strain measure of any reduction, by 3 x 3 tensors: formulas in :mod:`bipot.fem.strain`.

A half rotation is a matrix Q_h (..., 3, 3): with spin w (an axial vector) at the middle, Q_h turns by atan(|w|/2) about
w, and Q_h Q_h = (I - W/2)^-1 (I + W/2) is that of Hughes and Winget. In a plane :mod:`bipot.fem.plane` does the same by
closed forms, four times faster.
"""

from __future__ import annotations

import numpy as np

from bipot.fem.reduction import Reduction, mandel_to_full
from bipot.typing import Floats

EYE = np.eye(3)

GENERATORS = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    GENERATORS[_a, _c, _b], GENERATORS[_a, _b, _c] = 1.0, -1.0
GENERATORS.flags.writeable = False
"""E_a with E_a v = e_a x v."""


def cofactors(J: Floats) -> tuple[Floats, Floats]:
    """J'^-1 det J (..., 3, 3), and det J (...)."""
    columns = [np.cross(J[..., (i + 1) % 3], J[..., (i + 2) % 3]) for i in range(3)]
    return np.stack(columns, axis=-1), np.vecdot(columns[0], J[..., 0])


def middle(g: Floats, reduction: Reduction) -> tuple[Floats, tuple[Floats, ...]]:
    """g of H (I - H/2)^-1 (..., m), and what has to be positive: det (I - H/2)."""
    H = _spread(g, reduction)
    left = EYE - H / 2
    ratio = np.linalg.det(left)
    if not ratio.min() > 0:
        return g, (ratio,)
    out = np.linalg.solve(left, H)
    return out.reshape(*out.shape[:-2], 9) @ reduction.embedding.T, (ratio,)


def half_rotation(g: Floats, reduction: Reduction) -> Floats:
    """Q_h (..., 3, 3) of the gradient at the middle (..., m)."""
    w = _spin(g, reduction)
    c = 1 / np.sqrt(1 + np.vecdot(w, w) / 4)[..., None, None]
    return c * EYE + c / 2 * _cross(w) + c**2 / (4 * (1 + c)) * w[..., :, None] * w[..., None, :]


def turn_half(tensor: Floats, half: Floats) -> Floats:
    """Q_h t Q_h' of Mandel tensors (..., s)."""
    full = mandel_to_full(tensor.shape[-1])
    T = (tensor @ full).reshape(*tensor.shape[:-1], 3, 3)
    return (half @ T @ half.swapaxes(-1, -2)).reshape(*T.shape[:-2], 9) @ full.T


def turn_whole(tensor: Floats, half: Floats) -> Floats:
    """Q t Q' of Mandel tensors (..., s), Q = Q_h Q_h."""
    return turn_half(tensor, half @ half)


def strain_by_gradient(
    reduction: Reduction, middle: Floats, half: Floats, strain: Floats, rotated: Floats, shear: float
) -> Floats:
    """d e / d g (..., s, m): see :func:`bipot.fem.plane.strain_by_gradient`.

    With p = w/2 the whole rotation spins by 2 (dp + p x dp) / (1 + p.p), and the half one by (I + Q_h)^-1 times that.
    """
    full = mandel_to_full(reduction.mandel)
    kron = np.einsum("...ik,...jl->...ijkl", half, half).reshape(*half.shape[:-2], 9, 9)
    p = _spin(middle, reduction) / 2
    whole = (EYE + _cross(p)) / (1 + np.vecdot(p, p))[..., None, None]
    turning = _turn(strain, full) @ np.linalg.solve(EYE + half, whole) + _turn(rotated, full) @ whole / (2 * shear)
    out = full @ kron @ full.T @ reduction.symmetric + turning @ _axial(reduction).T
    return out @ _transport(middle, reduction)


def _transport(middle: Floats, reduction: Reduction) -> Floats:
    """d g_middle / d g_end (..., m, m): (I - H/2) dH (I + H/2), H that of the middle."""
    H = _spread(middle, reduction) / 2
    i, j = np.array(reduction.entries).T
    return (EYE - H)[..., i[:, None], i] * (EYE + H)[..., j, j[:, None]]


def _spread(g: Floats, reduction: Reduction) -> Floats:
    return (g @ reduction.embedding).reshape(*g.shape[:-1], 3, 3)


def _axial(reduction: Reduction) -> Floats:
    """What takes g to the axial vector of its skew part (m, 3)."""
    return reduction.embedding @ GENERATORS.reshape(3, 9).T / 2


def _spin(g: Floats, reduction: Reduction) -> Floats:
    return g @ _axial(reduction)


def _cross(w: Floats) -> Floats:
    """W (..., 3, 3) with W v = w x v."""
    return (w @ GENERATORS.reshape(3, 9)).reshape(*w.shape[:-1], 3, 3)


def _turn(tensor: Floats, full: Floats) -> Floats:
    """E_a t - t E_a (..., s, 3) for each axis."""
    T = (tensor @ full).reshape(*tensor.shape[:-1], 1, 3, 3)
    out = GENERATORS @ T - T @ GENERATORS
    return (out.reshape(*out.shape[:-2], 9) @ full.T).swapaxes(-1, -2)
