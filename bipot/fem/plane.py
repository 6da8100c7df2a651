r"""The ``midpoint`` strain measure in a plane, by closed forms: formulas in :mod:`bipot.fem.strain`.

Rotating a Mandel tensor about the third axis follows Mohr's circle, by twice the angle. A half rotation by theta is
therefore stored as (cos 2 theta, sin 2 theta) (2, ...): with tan theta = w/2 no transcendental function is needed.
"""

from __future__ import annotations

import numpy as np

from bipot.fem.reduction import SQRT2, Geometry, Reduction
from bipot.typing import Floats, read_only

UNIT = read_only(np.eye(2), np.float64)
MANDEL = 4


def _rotations() -> Floats:
    """Coefficients (4 5, 3) of 1, cos 2 theta, sin 2 theta in the rotation of symmetric gradients by theta."""
    out = np.zeros((3, MANDEL, MANDEL))
    out[0, 2, 2] = 1.0
    out[0, :2, :2] = 0.5
    out[1, [0, 1, 0, 1], [0, 1, 1, 0]] = [0.5, 0.5, -0.5, -0.5]
    out[1, 3, 3] = 1.0
    out[2, [3, 1, 3, 0], [0, 3, 1, 3]] = np.array([1.0, 1.0, -1.0, -1.0]) / SQRT2
    return read_only(
        np.ascontiguousarray((out @ Geometry.AXISYMMETRIC.reduction.symmetric).reshape(3, -1).T), np.float64
    )


ROTATIONS = _rotations()


def cofactors(J: Floats) -> tuple[Floats, Floats]:
    """J'^-1 det J (..., 2, 2), laid out in memory as J, and det J (...)."""
    out = np.empty_like(J)
    out[..., 0, 0], out[..., 1, 1] = J[..., 1, 1], J[..., 0, 0]
    np.negative(J[..., 1, 0], out=out[..., 0, 1])
    np.negative(J[..., 0, 1], out=out[..., 1, 0])
    return out, J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]


def middle(g: Floats, reduction: Reduction) -> tuple[Floats, tuple[Floats, ...]]:
    """g of H (I - H/2)^-1 (..., m), and the quantities that must be positive: det (I - H/2), and 1 - h/2 for the hoop.

    Cayley-Hamilton: G (I - G/2)^-1 = (G - det G / 2 I) / det (I - G/2).
    """
    half = (g[..., 0] * g[..., 3] - g[..., 1] * g[..., 2]) / 2
    ratio = 1 - (g[..., 0] + g[..., 3]) / 2 + half / 2
    positive = (ratio, 1 - g[..., 4] / 2) if reduction.ring else (ratio,)
    if not all(of.min() > 0 for of in positive):
        return g, positive
    out = g.copy()
    out[..., 0] -= half
    out[..., 3] -= half
    out[..., :4] /= ratio[..., None]
    if reduction.ring:
        out[..., 4] /= positive[-1]
    return out, positive


def half_rotation(g: Floats, reduction: Reduction) -> Floats:
    """(cos 2 theta, sin 2 theta) (2, ...), tan theta = w/2, of the gradient at the middle (..., m)."""
    t = (g[..., 1] - g[..., 2]) / 4
    square = t * t
    return np.stack([1 - square, 2 * t]) / (1 + square)


def turn(tensor: Floats, rotation: Floats) -> Floats:
    """Mandel tensors (..., 4) turned by theta, with ``rotation`` = (cos 2 theta, sin 2 theta) (2, ...).

    >>> turn(np.array([1.0, 0.0, 0.0, 0.0]), np.array([-1.0, 0.0])).round(12)
    array([0., 1., 0., 0.])
    """
    c, s = rotation
    a, b, m = tensor[..., 0], tensor[..., 1], tensor[..., 3]
    mean, apart = (a + b) / 2, (a - b) / 2
    across = c * apart - (s / SQRT2) * m
    out = np.empty(tensor.shape)
    out[..., 0] = mean + across
    out[..., 1] = mean - across
    out[..., 2] = tensor[..., 2]
    out[..., 3] = (SQRT2 * s) * apart + c * m
    return out


def twice(half: Floats) -> Floats:
    """The rotation by 2 theta from that by theta, both as (cos, sin) of twice their angle."""
    c, s = half
    return np.stack([c * c - s * s, 2 * c * s])


def back(rotation: Floats) -> Floats:
    """The inverse of a rotation."""
    c, s = rotation
    return np.stack([c, -s])


def strain_by_gradient(
    reduction: Reduction, middle: Floats, half: Floats, strain: Floats, rotated: Floats, shear: Floats
) -> Floats:
    """d e / d g (..., 4, m) of the strain e by g at the end, the rotation of the stress counted as strain.

    ``rotated`` (..., 4) is R sigma_n R'. Turning it by an angle changes the stress as the trace-free elastic strain
    d rotated/d angle / (2 ``shear``) does. A change dG at the end is (I - G/2) dG (I + G/2) at the middle, with the G
    there, and of the hoop strain (1 - h^2/4) dh.
    """
    # With components first in memory each formula is one of whole vectors, not of small matrices at points.
    c, s = half.reshape(2, -1)
    e, g = _by_component(strain + rotated / shear), _by_component(middle) / 2
    out = (ROTATIONS @ np.stack([np.ones_like(c), c, s])).reshape(MANDEL, 5, -1)
    # d atan(w/2) = cos^2 dw / 2 with w = (u_2,1 - u_1,2)/2, and cos^2 of half the angle is (1 + c)/2.
    weight = (1 + c) * (SQRT2 / 8)
    sheared, apart = weight * e[3], weight * (e[0] - e[1])
    for row, change in ((0, -sheared), (1, sheared), (3, apart)):
        out[row, 1] += change
        out[row, 2] -= change
    # Column by column, g has G transposed: these are (I - G/2)' and (I + G/2)'.
    G = g[:4].reshape(2, 2, -1)
    left, right = UNIT[..., None] - G, UNIT[..., None] + G
    plane = out[:, :4].reshape(MANDEL, 2, 2, -1)
    plane = plane[:, :, None, 0] * left[:, 0] + plane[:, :, None, 1] * left[:, 1]
    plane = plane[:, 0, None] * right[0, :, None] + plane[:, 1, None] * right[1, :, None]
    out[:, :4] = plane.reshape(MANDEL, 4, -1)
    if reduction.ring:
        out[:, 4] *= 1 - g[4] ** 2
    m = len(reduction.entries)
    return np.ascontiguousarray(out[:, :m].transpose(2, 0, 1)).reshape(*middle.shape[:-1], MANDEL, m)


def _by_component(vectors: Floats) -> Floats:
    """Vectors (..., m) at p points as (m, p)."""
    return np.ascontiguousarray(vectors.reshape(-1, vectors.shape[-1]).T)
