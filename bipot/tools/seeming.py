"""Gaps that are none: facets through nodes on one curved surface miss it, and each other.

Over an edge of length L with a middle node at the height s, and t along it off its middle, a facet is a parabola, which
turns by a = 4 s/L. It is up to L a^3/16 + 2 s t/L off an arc, and where heights around change by ds, as where a curve
turns from one side to the other, ds/15 more. Of faces twisted by a, flat parts miss as much. If a normal at a corner is
at an angle b to that of the surface, which is a mean over the facets there, the facet is up to L/2 tan(b/2) off the
surface, as a chord is off an arc. Places that face each other on two such sides are off each other along the surface,
by the means' part across their normals, and have gaps of up to a times that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot.tensors import norm, unit
from bipot.tools.facing import Facing, Plane, Sides, facing, in_planes
from bipot.tools.flats import away, normals, outward, parabolic
from bipot.tools.pieces import Near
from bipot.typing import Floats

CHANGE = 1 / 15
"""k' L^3/(72 sqrt 3), by which a parabola misses a curve, is less than this times k' L^3/8, the change of heights."""

SMOOTH = np.sqrt(0.75)
"""Cosine of 30 degrees, of half a crease: a side that is less oblique to a plane continues in its mirror image."""

BLUNT = 0.2
"""Over L, a t from which parabolas may have no direction at their ends."""


def seeming(sides: Sides, ring: bool, planes: Sequence[Plane]) -> Floats:
    """Gaps (p,) of the points of the ``sides`` at rest that are none; 0 where they are gaps.

    That is, where they are no larger than what both sides miss of one surface; ``ring`` is as of :func:`facing`, and
    ``planes`` as of :func:`in_planes`.
    """
    found = facing(sides.nodes, sides, ring, Near.WELDED)
    normal = in_planes(found.normal, sides.nodes[sides.node], planes)
    gap = np.vecdot(normal, means_of(sides.nodes, found))
    return np.where(np.abs(gap) <= missed(sides, found, planes), gap, 0.0)


def means_of(nodes: Floats, found: Facing) -> Floats:
    """The mean vectors z (p, d) between the sides, zero where nothing is faced."""
    means = found.weights @ nodes
    means[found.unfaced] = 0.0
    return means


def missed(sides: Sides, found: Facing, planes: Sequence[Plane] | None) -> Floats:
    """The largest gaps (p,) at rest of points of facets on one surface, by those around the nodes of their means.

    Without ``planes`` they are those of parabolas whose normals are the surface's.
    """
    means = means_of(sides.nodes, found)
    along = norm(means - np.vecdot(found.normal, means)[:, None] * found.normal)
    off, turn = np.zeros((2, len(means)))
    for of in (sides, Sides.of(sides.nodes, sides.other, sides.one)):
        theirs = np.zeros((2, len(sides.nodes)))
        for values, facets in zip(theirs, _misses(of, planes), strict=True):
            np.maximum.at(values, of.one, facets[:, None])
        most = [found.weights.astype(bool).multiply(values).max(axis=1).toarray().ravel() for values in theirs]
        off, turn = off + most[0], np.maximum(turn, most[1])
    return off + along * turn


def _misses(sides: Sides, planes: Sequence[Plane] | None) -> tuple[Floats, Floats]:
    """How far facets (f,) of the one of the sides are off the surface, and the largest a of each."""
    x = parabolic(sides.nodes[sides.one])
    if x.shape[2] == 2:
        start, middle, end = np.moveaxis(x, 1, 0)[:, :, None]
        ends = x[:, ::2]
        # Outward, where the one end is left, and the other.
        normal = away(x)[..., ::-1] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    else:
        start, middle = np.split(x, 2, axis=1)
        end, ends, normal = np.roll(start, -1, axis=1), start, normals(x)
    chord, off, out = end - start, middle - (start + end) / 2, outward(ends)[:, None]
    length, height = norm(chord), np.abs(np.vecdot(off, out))
    beside, longest = np.abs(np.vecdot(off, chord)) / length**2, norm(ends[:, :, None] - ends[:, None]).max(axis=(1, 2))
    smooth = (beside < BLUNT).all(axis=1)
    parted = len(sides.flats) > len(sides.one)
    twist = np.where(smooth & parted, norm(normal - out).max(axis=1), 0.0)
    turn = np.maximum((4 * height / length).max(axis=1), twist)
    miss = longest * turn**3 / 16 + (2 * height * beside).max(axis=1) + CHANGE * _change(sides, np.vecdot(off, out))
    if planes is not None:
        angle = np.where(smooth, _angles(sides, ends, normal, planes), 0.0)
        miss += longest / 2 * np.tan(angle / 2)
    return miss, turn


def _change(sides: Sides, height: Floats) -> Floats:
    """How much the largest heights of facets (f, k) around a node of each differ (f,) at most, or the smallest do."""
    out = np.zeros(len(height))
    for of in (height.max(axis=1), -height.min(axis=1)):
        high, low = np.full((2, len(sides.nodes)), [[-np.inf], [np.inf]])
        np.maximum.at(high, sides.one, of[:, None])
        np.minimum.at(low, sides.one, of[:, None])
        out = np.maximum(out, (high[sides.one] - low[sides.one]).max(axis=1))
    return out


def _angles(sides: Sides, ends: Floats, normal: Floats, planes: Sequence[Plane]) -> Floats:
    """The largest b (f,) of facets with the ``ends`` (f, k, d), which have there each a ``normal`` (f, k, d).

    These have such weights in the mean that it is normal to a circle or sphere through the ends of straight facets.
    """
    ahead, back = (np.roll(ends, by, axis=1) - ends for by in (-1, 1))
    if ends.shape[2] == 2:
        weight = 1 / norm(ahead)
    else:
        weight = norm(np.cross(ahead, back)) / np.vecdot(ahead, ahead) / np.vecdot(back, back)
    count, first = len(ends), sides.one[0, [0, -1]] if ends.shape[2] == 2 else sides.one[0, : ends.shape[1]]
    place = np.argmax(sides.flats.reshape(count, -1)[0] == first[:, None], axis=1)
    point, surface = sides.point.reshape(count, -1)[:, place], np.zeros((len(sides.node), ends.shape[2]))
    np.add.at(surface, point, weight[..., None] * normal)
    surface = unit(surface)
    image = in_planes(surface, sides.nodes[sides.node], planes)
    surface = np.where((np.vecdot(image, surface) > SMOOTH)[:, None], image, surface)
    return 2 * np.arcsin(np.minimum(norm(surface[point] - normal).max(axis=1) / 2, np.sqrt(0.5)))
