"""Gaps that are none: facets through nodes on one curved surface miss it, and each other.

An edge of length L with a middle node at the height s is a parabola, which turns by a = 4 s/L. It is up to s a^2/8 off
the surface, twice what it is off an arc. Places that face each other on two such sides are off each other along the
surface, by the means' part across their normals, and have gaps of up to a times that. An edge or face without middle
nodes whose normal is at an angle b to that of the surface at its nodes is up to L b/4 off the surface, as a chord is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from bipot.tensors import norm, unit
from bipot.tools.facing import Facing, Sides, facing
from bipot.tools.flats import FLATS, outward
from bipot.tools.surfaces import across
from bipot.typing import Bools, Floats, Vector


class Plane(Protocol):
    """A plane of symmetry."""

    @property
    def normal(self) -> Vector:
        """Unit normal."""
        ...

    def holds(self, points: Floats) -> Bools:
        """Which places ``points`` (n, d) are in it (n,)."""
        ...


def in_planes(normals: Floats, x: Floats, planes: Sequence[Plane]) -> Floats:
    """Unit ``normals`` (p, d) at x (p, d), in the ``planes`` of symmetry that hold x."""
    out = normals.copy()
    for plane in planes:
        there = plane.holds(x)
        out[there] = across(out[there], plane.normal)
    return unit(out)


def seeming(sides: Sides, ring: bool, planes: Sequence[Plane]) -> Floats:
    """Gaps (p,) of the points of the ``sides`` at rest that are none; 0 where they are gaps.

    That is, where they are no larger than what both sides miss of one surface; ``ring`` is as of :func:`facing`, and
    ``planes`` as of :func:`in_planes`.
    """
    found = facing(sides.nodes, sides, ring)
    normal = in_planes(found.normal, sides.nodes[sides.node], planes)
    gap = np.vecdot(normal, means_of(sides.nodes, found))
    return np.where(np.abs(gap) <= missed(sides, found) + chords(sides), gap, 0.0)


def means_of(nodes: Floats, found: Facing) -> Floats:
    """The mean vectors z (p, d) between the sides, zero where nothing is faced."""
    means = found.weights @ nodes
    means[found.unfaced] = 0.0
    return means


def missed(sides: Sides, found: Facing) -> Floats:
    """The largest gaps (p,) at rest of parabolas on one surface, as of quadratic elements; zero on others."""
    means = means_of(sides.nodes, found)
    along = norm(means - np.vecdot(found.normal, means)[:, None] * found.normal)
    heights, turns = np.transpose([_bent(sides.nodes[side]) for side in (sides.one, sides.other)])
    return along * turns.max() + (heights * turns**2).sum() / 8


def _bent(facets: Floats) -> tuple[float, float]:
    """The largest height s of middle nodes of edges of facets (f, n, d), and the largest 4 s/L."""
    if facets.shape[1:] == (3, 2):
        start, middle, end = np.moveaxis(facets, 1, 0)
    elif facets.shape[1] in FLATS:
        start, middle = np.split(facets, 2, axis=1)
        end = np.roll(start, -1, axis=1)
    else:
        return 0.0, 0.0
    height, length = norm(middle - (start + end) / 2), norm(end - start)
    return float(height.max()), float((4 * height / length).max())


def chords(sides: Sides) -> float:
    """The largest gap at rest of facets without middle nodes on one surface, zero of others."""
    if sides.flats.shape != sides.one.shape:
        return 0.0
    return sum(_chord(of) for of in (sides, Sides.of(sides.nodes, sides.other, sides.one)))


def _chord(sides: Sides) -> float:
    """The largest L b/4 on the one of the sides: L is the longest edge or diagonal of a facet."""
    ends = sides.nodes[sides.flats]
    out = outward(ends)
    surface = np.zeros((len(sides.node), ends.shape[2]))
    np.add.at(surface, sides.point, out[:, None])
    angle = norm(unit(surface)[sides.point] - out[:, None]).max(axis=1)
    longest = norm(ends[:, :, None] - ends[:, None]).max(axis=(1, 2))
    return float((longest * angle).max() / 4)
