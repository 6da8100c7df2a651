"""Polygons in a plane, written a second time for the fuzz study: what two have in common, cuts, middles and areas."""

from __future__ import annotations

import numpy as np

from studies.independent.data import Floats


def clipped(one: Floats, other: Floats) -> Floats:
    """What two convex polygons (k, 2) and (l, 2) have in common, all anticlockwise: corners (v, 2), none if nothing.

    >>> square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    >>> assert area_of(clipped(square, square + 0.5)) == 0.25
    """
    out = list(one)
    for start, end in zip(other, np.roll(other, -1, axis=0), strict=True):
        out = kept(out, [-float(cross(end - start, x - start)) for x in out])
    return np.array(out).reshape(-1, 2)


def kept(polygon: list[Floats], above: list[float]) -> list[Floats]:
    """The corners of a convex polygon with those where ``above`` is positive cut off.

    >>> [x.tolist() for x in kept([np.array([0.0]), np.array([1.0])], [-1.0, 3.0])]
    [[0.25], [0.0], [0.25]]
    """
    out = list[Floats]()
    for k, (x, h) in enumerate(zip(polygon, above, strict=True)):
        before, there = polygon[k - 1], above[k - 1]
        if (h > 0) != (there > 0):
            out.append(before + there / (there - h) * (x - before))
        if h <= 0:
            out.append(x)
    return out


def centroid(polygon: Floats) -> Floats:
    """The middle (2,) of the area of a polygon (v, 2)."""
    x = polygon - polygon[0]
    after = np.roll(x, -1, axis=0)
    twice = cross(x, after)
    return polygon[0] + twice @ (x + after) / (3 * twice.sum())


def cross(a: Floats, b: Floats) -> Floats:
    """a_x b_y - a_y b_x (…) of vectors (…, 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def area_of(polygon: Floats) -> float:
    """The area of a polygon (v, 2) whose corners run anticlockwise."""
    return float(cross(polygon, np.roll(polygon, -1, axis=0)).sum() / 2)
