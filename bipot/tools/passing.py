"""Which facets go through each other in an increment, and how deep they are in each other at its end."""

from __future__ import annotations

import numpy as np

from bipot.tensors import norm
from bipot.tools.facing import pieces_of
from bipot.tools.flats import flats, outward
from bipot.tools.plane import area_of, cross
from bipot.tools.polygons import inside, seen, within_reach
from bipot.typing import Floats, Ints

DEPTH = 0.25
"""Depth behind a flat part, over its size, that places may have at which means of gaps vanish."""

THROUGH = 0.75
"""The same over the thickness of the element behind it: beyond its middle the other side is nearer."""


def deep(nodes: Floats, one: Ints, other: Ints, ring: bool) -> float:
    """How deep facets ``one`` (f, n) and ``other`` (g, n) of ``nodes`` (a, d) are in each other; 0 up to :data:`DEPTH`.

    That is over the size of the smaller of two flat parts, a length or the root of an area; ``ring`` is as of
    :func:`~bipot.tools.facing.pieces_of`.
    """
    found, d = pieces_of(nodes, one, other, ring), nodes.shape[1]
    mine, its = (_extents(nodes[flats(of, d)]) ** (1 / (d - 1)) for of in (one, other))
    depth, smaller = -found.lowest, np.minimum(mine[found.one], its[found.other])
    return float(depth[depth > DEPTH * smaller].max(initial=0.0))


def crossed(nodes: Floats, moved: Floats, points: Ints, facets: Ints, volume: Floats) -> tuple[int, list[int]] | None:
    """A node of ``points`` (p,) that goes through a flat part of the ``facets`` (f, n), and the nodes of that part.

    All ``nodes`` (a, d) go straight to where they have ``moved`` (a, d). What goes from the outer side of a flat part,
    in space of its mean plane, to the inner, and is deeper in the end than :data:`DEPTH` of its size, went through it
    where it was in it. So did what is deeper than :data:`THROUGH` of the element behind it, which has the ``volume``
    (f,), in a plane the area.
    """
    d = nodes.shape[1]
    parts = flats(facets, d)
    extent, share = _extents(moved[parts]), len(parts) // len(facets)
    deepest = np.minimum(DEPTH * extent ** (1 / (d - 1)), THROUGH * np.repeat(volume / share, share) / extent)
    found = (_through_edges if d == 2 else _through_faces)(nodes, moved, points, parts, deepest)
    return None if found is None else (found[0], _named(parts[found[1]]))


def _extents(corners: Floats) -> Floats:
    """Lengths (l,) of straights (l, 2, 2), or areas of faces (l, k, 3), seen along their normals."""
    return norm(corners[:, 1] - corners[:, 0]) if corners.shape[2] == 2 else area_of(seen(corners, corners))


def _through_edges(nodes: Floats, moved: Floats, points: Ints, edges: Ints, deepest: Floats) -> tuple[int, int] | None:
    """The node of :func:`crossed` and the number of one of the ``edges`` (l, 2), behind which it may be ``deepest``."""
    x, (a, b) = nodes[points][:, None], nodes[edges].swapaxes(0, 1)
    dx, (da, db) = (moved - nodes)[points][:, None], (moved - nodes)[edges].swapaxes(0, 1)
    # Twice the area between edge and node is quadratic in time.
    e, de, d, dd = b - a, db - da, x - a, dx - da
    area, slope, bend = cross(e, d), cross(de, d) + cross(e, dd), cross(de, dd)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(slope**2 - 4 * area * bend)
        times = np.stack([2 * area / (-slope + root), 2 * area / (-slope - root)])
    best = np.where((times >= 0) & (times <= 1), times, np.inf).min(axis=0)
    p, f = np.nonzero((area < 0) & (area + slope + bend > 0) & np.isfinite(best))
    t = best[p, f][:, None]
    along, away = e[f] + t * de[f], d[p, f] + t * dd[p, f]
    place = np.vecdot(along, away) / np.vecdot(along, along)
    depth = (area + slope + bend)[p, f] / norm((e + de)[f])
    wrong = np.flatnonzero((place >= 0) & (place <= 1) & (depth > deepest[f]))
    return (int(points[p[wrong[0]]]), int(f[wrong[0]])) if wrong.size else None


def _through_faces(nodes: Floats, moved: Floats, points: Ints, faces: Ints, deepest: Floats) -> tuple[int, int] | None:
    """The node of :func:`crossed` and the number of one of the ``faces`` (l, k), behind which it may be ``deepest``."""
    before, after = nodes[faces], moved[faces]
    f, p = _boxes_meet(np.stack([nodes[points], moved[points]], axis=1), np.concatenate([before, after], axis=1))
    p = points[p]
    h, ended = (_height(of[f], x[p]) for of, x in ((before, nodes), (after, moved)))
    through = (h > 0) & (ended < -deepest[f])
    f, p, h, ended = f[through], p[through], h[through], ended[through]
    t = (h / (h - ended))[:, None]
    there = (1 - t[..., None]) * before[f] + t[..., None] * after[f]
    place = seen(there, ((1 - t) * nodes[p] + t * moved[p])[:, None])
    wrong = np.flatnonzero(inside(place, seen(there, there))[:, 0])
    return (int(p[wrong[0]]), int(f[wrong[0]])) if wrong.size else None


def faces_crossed(
    nodes: Floats, moved: Floats, one: Ints, other: Ints, volume: Floats
) -> tuple[list[int], list[int]] | None:
    """A flat of faces ``one`` (f, n) whose middle goes through one of the ``other`` (g, n), and which, as does a node.

    Bars across each other may pass without a node in the other's way. Elements at the latter have the ``volume`` (g,).
    """
    one = flats(one, 3)
    middles = np.vstack([nodes, nodes[one].mean(axis=1)]), np.vstack([moved, moved[one].mean(axis=1)])
    found = crossed(*middles, len(nodes) + np.arange(len(one)), other, volume)
    return None if found is None else (_named(one[found[0] - len(nodes)]), found[1])


def _named(flat: Ints) -> list[int]:
    """The nodes of a flat part (k,), each once."""
    return list(dict.fromkeys(flat.tolist()))


def _boxes_meet(ways: Floats, around: Floats) -> tuple[Ints, Ints]:
    """The faces and the ways (m,) of which boxes around ``around`` (f, n, 3) and ``ways`` (p, 2, 3) meet."""
    middle, centre = ((of.max(axis=1) + of.min(axis=1)) / 2 for of in (ways, around))
    p, f = within_reach(centre, middle, (norm(np.ptp(ways, axis=1)) + norm(np.ptp(around, axis=1)).max()) / 2)
    low, high = around[f].min(axis=1) - ways[p].max(axis=1), ways[p].min(axis=1) - around[f].max(axis=1)
    meet = np.flatnonzero((low <= 0).all(axis=1) & (high <= 0).all(axis=1))
    meet = meet[np.lexsort((p[meet], f[meet]))]
    return f[meet], p[meet]


def _height(faces: Floats, x: Floats) -> Floats:
    """Heights (s,) of x (s, 3) over the mean planes of faces (s, k, 3)."""
    return np.vecdot(x - faces.mean(axis=1), outward(faces))
