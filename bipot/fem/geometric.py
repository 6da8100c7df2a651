r"""Linearisation of an increment's configuration: the consistent element tangent d f / d dU.

In ``midpoint`` the strain (gradient at the middle, turned by half the rotation), the rotation of the stress, B and
the volumes all move with dU. With g = (u_1,1  u_1,2  u_2,1  u_2,2  u_1/r) at the *end* of the increment, f = sum_q
w D' t and t = (s_11, s_12, s_12, s_22, s_33), where D maps an element's displacements to g:

    K_e = sum_q w D' [ J C_alg (d e / d g) + Q ] D,     t = J s,    Q = t x (1, 0, 0, 1, 1) + d(D' t)/dg at fixed t.

The middle needs no gradients of its own: with G = du/dx and X = I + G/2 at the middle,
d(du/dx)_middle = (I - G/2) dg X, and the hoop strain h there changes by (1 - h^2/4) times that at the end.
The result is unsymmetric. In ``paper`` nothing moves with dU and K_e is that of (25).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bipot.fem.kinematics import MANDEL_2D, SQRT2, Kinematics

Floats = NDArray[np.float64]

GRADIENT = 5
"""Entries of g."""

SYMMETRIC = np.zeros((MANDEL_2D, GRADIENT))
SYMMETRIC[0, 0] = SYMMETRIC[1, 3] = SYMMETRIC[2, 4] = 1.0
SYMMETRIC[3, 1:3] = 1 / SQRT2
SYMMETRIC.flags.writeable = False

DIVERGENCE = np.array([1.0, 0.0, 0.0, 1.0, 1.0])
DIVERGENCE.flags.writeable = False


def gradient_operator(B: Floats) -> Floats:
    """D (e, q, 5, 2k) from B (e, q, 4, 2k), whose entries it rearranges."""
    e, q, _, n = B.shape
    D = np.zeros((e, q, GRADIENT, n))
    D[:, :, 0, 0::2] = D[:, :, 2, 1::2] = B[:, :, 0, 0::2]
    D[:, :, 1, 0::2] = D[:, :, 3, 1::2] = B[:, :, 1, 1::2]
    D[:, :, 4, 0::2] = B[:, :, 2, 0::2]
    return D


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


def strain_by_gradient(kin: Kinematics, g: Floats, rotated: Floats, shear: float) -> Floats:
    """d e / d g (e, q, 4, 5) of the ``midpoint`` strain, the rotation of the stress counted as strain.

    ``g`` (e, q, 5) is that of the increment itself, ``rotated`` (e, q, 4) is R sigma_n R'. Turning it by d theta is
    the elastic work of the trace-free strain turn(rotated) d theta / (2 G), G = ``shear``.
    """
    middle, hoop = _middle(g)
    half = kin.angle / 2
    # d atan(w/2) = cos^2 dw / 2 with w = (u_2,1 - u_1,2)/2.
    out = _rotation(half) @ SYMMETRIC
    weight = (turn(kin.strain) + turn(rotated) / shear) * (np.cos(half) ** 2 / 4)[..., None]
    out[..., 1] -= weight
    out[..., 2] += weight
    return out @ _transport(middle, hoop)


def element_tangent(kin: Kinematics, du: Floats, rotated: Floats, stress: Floats, C: Floats, shear: float) -> Floats:
    """K_e = d f_e / d dU (e, 2k, 2k) of the ``midpoint`` configuration (module docstring).

    Element displacements ``du`` (e, 2k), R sigma_n R' and returned stress (e, q, 4), C_alg (e, q, 4, 4), shear modulus.
    """
    D = gradient_operator(kin.B)
    e, _, _, n = D.shape
    g = (D.reshape(e, -1, n) @ du[:, :, None]).reshape(D.shape[:3])
    Z = SYMMETRIC.T @ (C @ strain_by_gradient(kin, g, rotated, shear))
    Z += moving_gradient(stress)
    Z *= kin.volume[..., None, None]
    return D.reshape(e, -1, n).transpose(0, 2, 1) @ (Z @ D).reshape(e, -1, n)


def moving_gradient(stress: Floats) -> Floats:
    """Q (e, q, 5, 5): how w D' t changes with the end position at fixed stress (e, q, 4).

    d w = w div, and d N,j = -N,l g_lj puts -s_ij in row (i, l), column (l, j).
    """
    t = stress @ SYMMETRIC
    Q = t[..., :, None] * DIVERGENCE
    Q[..., 0, 0] -= t[..., 0]
    Q[..., 0, 1] -= t[..., 1]
    Q[..., 1, 2] -= t[..., 0]
    Q[..., 1, 3] -= t[..., 1]
    Q[..., 2, 0] -= t[..., 1]
    Q[..., 2, 1] -= t[..., 3]
    Q[..., 3, 2] -= t[..., 1]
    Q[..., 3, 3] -= t[..., 3]
    Q[..., 4, 4] -= t[..., 4]
    return Q


def _middle(g: Floats) -> tuple[Floats, Floats]:
    """du/dx (e, q, 2, 2) and hoop strain (e, q) at the middle: G (I - G/2)^-1 and h / (1 - h/2) of those at the end."""
    a, b, c, d = (g[..., i] for i in range(4))
    # Cayley-Hamilton: G (I - G/2)^-1 = (G - det G / 2 I) / (1 - tr G / 2 + det G / 4).
    determinant = a * d - b * c
    out = g[..., :4].reshape(*g.shape[:-1], 2, 2).copy()
    out[..., 0, 0] -= determinant / 2
    out[..., 1, 1] -= determinant / 2
    out /= (1 - (a + d) / 2 + determinant / 4)[..., None, None]
    return out, g[..., 4] / (1 - g[..., 4] / 2)


def _rotation(angle: Floats) -> Floats:
    """The matrix (..., 4, 4) of ``rotate`` on Mandel vectors."""
    c, s = np.cos(2 * angle), np.sin(2 * angle)
    out = np.zeros((*angle.shape, MANDEL_2D, MANDEL_2D))
    out[..., 0, 0] = out[..., 1, 1] = (1 + c) / 2
    out[..., 0, 1] = out[..., 1, 0] = (1 - c) / 2
    out[..., 2, 2] = 1.0
    out[..., 3, 3] = c
    out[..., 3, 0] = out[..., 1, 3] = s / SQRT2
    out[..., 3, 1] = out[..., 0, 3] = -s / SQRT2
    return out


def _transport(middle: Floats, hoop: Floats) -> Floats:
    """d g_middle / d g_end (..., 5, 5): (I - G/2) dg (I + G/2), and 1 - h^2/4 for the hoop strain."""
    left, right = np.eye(2) - middle / 2, np.eye(2) + middle / 2
    out = np.zeros((*hoop.shape, GRADIENT, GRADIENT))
    product = np.einsum("...ik,...lj->...ijkl", left, right)
    out[..., :4, :4] = product.reshape(*hoop.shape, 4, 4)
    out[..., 4, 4] = 1 - hoop**2 / 4
    return out
