r"""Linearisation of an increment's configuration: the consistent element tangent d f / d dU.

In ``midpoint`` the strain (gradient at the middle, turned by half the rotation), the rotation of the stress, B and
the volumes all move with dU. With g = (u_1,1  u_1,2  u_2,1  u_2,2  u_1/r) at the *end* of the increment, f = sum_q
w D' t and t = (s_11, s_12, s_12, s_22, s_33), where D maps an element's displacements to g:

    K_e = sum_q w D' [ J C_alg (d e / d g) + Q ] D,     t = J s,    Q = t x (1, 0, 0, 1, 1) + d(D' t)/dg at fixed t.

With G = du/dx and X = I + G/2 at the middle, d(du/dx)_middle = (I - G/2) dg X, and the hoop strain h there changes by
(1 - h^2/4) times that at the end.
The result is unsymmetric. In ``paper`` nothing moves with dU and K_e is that of (25).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bipot.fem.kinematics import GRADIENT, MANDEL_2D, SQRT2, SYMMETRIC, Kinematics, gradient_operator
from bipot.typing import Floats

COPIED = np.array([0, 3, 3, 1, 2])
"""The Mandel component that each entry of t is a copy of."""


def _rotations() -> Floats:
    """Coefficients (3, 4, 5) of 1, cos 2 theta, sin 2 theta in the rotation of symmetric gradients by theta."""
    out = np.zeros((3, MANDEL_2D, MANDEL_2D))
    out[0, 2, 2] = 1.0
    out[0, :2, :2] = 0.5
    out[1, [0, 1, 0, 1], [0, 1, 1, 0]] = [0.5, 0.5, -0.5, -0.5]
    out[1, 3, 3] = 1.0
    out[2, [3, 1, 3, 0], [0, 3, 1, 3]] = np.array([1.0, 1.0, -1.0, -1.0]) / SQRT2
    return out @ SYMMETRIC


def _moving() -> Floats:
    """Coefficients (4, 5, 5) of the stress in Q: t x (1, 0, 0, 1, 1), and -s_ij in row (i, l), column (l, j)."""
    t = SYMMETRIC
    out = t[:, :, None] * np.array([1.0, 0.0, 0.0, 1.0, 1.0])
    for i in range(2):
        for j in range(2):
            for k in range(2):
                out[:, 2 * i + k, 2 * k + j] -= t[:, 2 * i + j]
    out[:, 4, 4] -= t[:, 4]
    return out


def _transported() -> NDArray[np.intp]:
    """Where the entries (25,) of the 5 x 5 transport are among the products L_ik R_lj, the hoop's entry and zero."""
    out = np.full((GRADIENT, GRADIENT), 17)
    i, j, k, m = np.indices((2, 2, 2, 2))
    out[2 * i + j, 2 * k + m] = 4 * (2 * i + k) + 2 * m + j
    out[4, 4] = 16
    return out.ravel()


UNIT = np.array([1.0, 0.0, 0.0, 1.0])
ROTATIONS, MOVING, TRANSPORTED = _rotations(), _moving(), _transported()
for _table in (UNIT, COPIED, ROTATIONS, MOVING, TRANSPORTED):
    _table.flags.writeable = False


@dataclass(frozen=True)
class Scratch:
    """Memory of :func:`element_tangent`, to be used again: D and Z D (e, q, 5, 2k), K_e (e, 2k, 2k).

    These are the largest arrays of a Newton pass. Asked for anew each time, they cost more than what is done with them.
    """

    D: Floats
    ZD: Floats
    K: Floats

    @staticmethod
    def of(elements: int, points: int, unknowns: int) -> Scratch:
        """For e elements of q points and 2k unknowns."""
        size = (elements, points, GRADIENT, unknowns)
        return Scratch(np.zeros(size), np.empty(size), np.empty((elements, unknowns, unknowns)))


def turn(tensor: Floats) -> Floats:
    """Derivative (..., 4) of rotating Mandel tensors (..., 4) about the third axis, at angle zero.

    >>> turn(np.array([1.0, 0.0, 0.0, 0.0])).round(12)
    array([0.        , 0.        , 0.        , 1.41421356])
    """
    out = np.zeros(tensor.shape)
    out[..., 1] = SQRT2 * tensor[..., 3]
    out[..., 0] = -out[..., 1]
    out[..., 3] = SQRT2 * (tensor[..., 0] - tensor[..., 1])
    return out


def strain_by_gradient(kin: Kinematics, rotated: Floats, shear: float) -> Floats:
    """d e / d g (e, q, 4, 5) of the ``midpoint`` strain, the rotation of the stress counted as strain.

    ``rotated`` (e, q, 4) is R sigma_n R'. Turning it by d theta is the elastic work of the trace-free strain
    turn(rotated) d theta / (2 G), G = ``shear``.
    """
    c, s = np.cos(kin.angle), np.sin(kin.angle)
    turned = np.stack([np.ones_like(c), c, s], axis=-1) @ ROTATIONS.reshape(3, -1)
    out = turned.reshape(*c.shape, MANDEL_2D, GRADIENT)
    # d atan(w/2) = cos^2 dw / 2 with w = (u_2,1 - u_1,2)/2, and cos^2 of half the angle is (1 + c)/2.
    weight = turn(kin.strain + rotated / shear) * ((1 + c) / 8)[..., None]
    out[..., 1] -= weight
    out[..., 2] += weight
    return out @ _transport(kin.middle, kin.hoop)


def element_tangent(
    kin: Kinematics, rotated: Floats, stress: Floats, C: Floats, shear: float, scratch: Scratch
) -> Floats:
    """K_e = d f_e / d dU (e, 2k, 2k) of the ``midpoint`` configuration (module docstring), in ``scratch.K``.

    R sigma_n R' and returned stress (e, q, 4), C_alg (e, q, 4, 4), shear modulus.
    """
    gradient_operator(kin.shape, scratch.D)
    # SYMMETRIC' times it: rows are only copied, the shear one twice.
    Z = (C @ strain_by_gradient(kin, rotated, shear)).take(COPIED, axis=-2)
    Z[..., 1:3, :] /= SQRT2
    Z += moving_gradient(stress)
    Z *= kin.volume[..., None, None]
    np.matmul(Z, scratch.D, out=scratch.ZD)
    e, n, _ = scratch.K.shape
    return np.matmul(scratch.D.reshape(e, -1, n).transpose(0, 2, 1), scratch.ZD.reshape(e, -1, n), out=scratch.K)


def moving_gradient(stress: Floats) -> Floats:
    """Q (e, q, 5, 5): how w D' t changes with the end position at fixed stress (e, q, 4).

    d w = w div, and d N,j = -N,l g_lj puts -s_ij in row (i, l), column (l, j).
    """
    return (stress @ MOVING.reshape(MANDEL_2D, -1)).reshape(*stress.shape[:-1], GRADIENT, GRADIENT)


def _transport(middle: Floats, hoop: Floats) -> Floats:
    """d g_middle / d g_end (..., 5, 5): (I - G/2) dg (I + G/2), and 1 - h^2/4 for the hoop strain."""
    half = middle.reshape(*hoop.shape, 4) / 2
    entries = np.empty((*hoop.shape, 18))
    products = entries[..., :16].reshape(*hoop.shape, 4, 4)
    np.multiply((UNIT - half)[..., :, None], (UNIT + half)[..., None, :], out=products)
    entries[..., 16], entries[..., 17] = 1 - hoop**2 / 4, 0.0
    return entries.take(TRANSPORTED, axis=-1).reshape(*hoop.shape, GRADIENT, GRADIENT)
