"""Vectors in a plane: turned by a right angle, their cross product, the angle and the lengths between two."""

from __future__ import annotations

import numpy as np

from bipot.tensors import norm
from bipot.typing import Floats


def leftwards(vectors: Floats) -> Floats:
    """Vectors (…, 2) turned by a right angle to the left: from a tangent the normal.

    >>> leftwards(np.array([2.0, 1.0])).tolist()
    [-1.0, 2.0]
    """
    return vectors[..., ::-1] * (-1.0, 1.0)


def cross(a: Floats, b: Floats) -> Floats:
    """a_x b_y - a_y b_x (…)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def area_of(corners: Floats) -> Floats:
    """Areas (p,) of polygons (p, k, 2) with corners in anticlockwise order.

    >>> float(area_of(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 3.0]])))
    3.0
    """
    return np.asarray(cross(corners, np.roll(corners, -1, axis=-2)).sum(axis=-1) / 2)


def farther(start: Floats, by: Floats) -> Floats:
    """|start + by| - |start| (…) of vectors (…, d), without the round-off of either length.

    >>> float(farther(np.array([3.0, 4.0]), np.array([3.0, 4.0])))
    5.0
    """
    end = start + by
    far = norm(start) + norm(end)
    return np.vecdot(start + end, by) / np.where(far > 0, far, 1.0)


def angle_between(start: Floats, end: Floats, by: Floats | None = None) -> Floats:
    """Angle (…) to the left from vectors ``start`` to ``end`` (…, 2), which is ``by`` (…, 2) farther where given.

    >>> float(angle_between(np.array([1.0, 0.0]), np.array([0.0, 2.0]))) == np.pi / 2
    True
    """
    return np.arctan2(cross(start, end if by is None else by), np.vecdot(start, end))
