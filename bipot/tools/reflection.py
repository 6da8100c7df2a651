"""Mirror images of points in a plane normal . x = position, and what of a vector lies in such a plane."""

from __future__ import annotations

import numpy as np

from bipot.typing import Floats, Vector


def reflected(point: Vector, normal: Vector, position: float) -> Vector:
    """The mirror image of a point in the plane normal . x = position, of a unit normal.

    >>> reflected((3.0, 1.0), (1.0, 0.0), 0.5)
    (-2.0, 1.0)
    """
    return tuple(imaged(np.array(point), normal, position).tolist())


def imaged(points: Floats, normal: Vector, position: float) -> Floats:
    """Those of points (…, d)."""
    return points + 2 * np.asarray(position - points @ np.array(normal))[..., None] * normal


def across(vectors: Floats, normal: Floats | Vector) -> Floats:
    """The part of vectors (…, d) at a right angle to the unit normal (d,)."""
    return vectors - np.asarray(vectors @ np.asarray(normal))[..., None] * normal
