"""Pieces of two boundaries of a mesh that face each other, which edges go through each other, and how deep they are.

Edges are polygons through their nodes: one straight part, or two if they have a node in the middle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.tensors import norm, unit
from bipot.tools.plane import cross
from bipot.typing import Bools, Floats, Ints

FACES = -0.1
"""Largest product of the outward normals of two edges that face each other."""

LEAST = 1e-9
"""Over the length of an edge, a piece no longer than this is none."""

DEPTH = 0.25
"""Depth behind an edge, over its length, that places may have at which means of gaps vanish."""

THROUGH = 0.75
"""The same over the thickness of the element behind an edge: beyond its middle the other side is nearer."""


class Pieces(NamedTuple):
    """Pieces (s,) of ``one`` straight part of edges (s,) that face pieces of the ``other`` (s,).

    Parts are numbered as by :func:`straights`. ``xi`` and ``eta`` (s, g) are the places of integration points on both
    parts, from 0 to 1, ``weight`` (s, g) their weights in int dA, and ``lowest`` (s,) the least gap of each piece.
    """

    one: Ints
    other: Ints
    xi: Floats
    eta: Floats
    weight: Floats
    lowest: Floats

    def shapes(self, one: int, other: int) -> tuple[Floats, Floats]:
        """Shape functions (s, g, n) there of the edges, which have ``one`` and the ``other`` number n of nodes."""
        places = (self.one, self.xi, one - 1), (self.other, self.eta, other - 1)
        mine, its = ((number[:, None] % parts + at) / parts for number, at, parts in places)
        return edge_shapes(mine, one), edge_shapes(its, other)


def edge_shapes(s: Floats, count: int) -> Floats:
    """Shape functions (…, n) at s (…) in [0, 1] of an edge of n = ``count`` nodes, from end to end.

    >>> edge_shapes(np.array([0.5, 0.25]), 3).tolist()
    [[0.0, 1.0, 0.0], [0.375, 0.75, -0.125]]
    """
    shapes = [1 - s, s] if count == 2 else [(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)]
    return np.stack(shapes, axis=-1)


def edge_slopes(s: Floats, count: int) -> Floats:
    """Derivatives (…, n) by s of :func:`edge_shapes`.

    >>> edge_slopes(np.array([0.5]), 3).tolist()
    [[-1.0, 0.0, 1.0]]
    """
    one = np.ones_like(s)
    slopes = [-one, one] if count == 2 else [4 * s - 3, 4 - 8 * s, 4 * s - 1]
    return np.stack(slopes, axis=-1)


def straights(edges: Ints) -> Ints:
    """The straight parts (f (n - 1), 2) of edges (f, n), one edge after the other.

    >>> straights(np.array([[3, 4, 5]])).tolist()
    [[3, 4], [4, 5]]
    """
    return np.stack([edges[:, :-1], edges[:, 1:]], axis=-1).reshape(-1, 2)


def outward(edges: Floats) -> Floats:
    """Outward unit normals (f, 2) of straight edges (f, 2, 2) that run anticlockwise around their elements."""
    along = unit(edges[:, 1] - edges[:, 0])
    return np.stack([along[:, 1], -along[:, 0]], axis=1)


def pieces(nodes: Floats, one: Ints, other: Ints, ring: bool) -> Pieces:
    """The pieces of edges ``one`` (f, n) and ``other`` (g, n) of ``nodes`` (a, 2) that face each other.

    On a meridian, which is that of a ``ring``, dA has the radius. Integrals of hat functions times shape functions are
    exact. Of several pieces that face the same place the nearest counts; one that is farther behind the edge than both
    edges are long does not, nor one behind the other side of a thin part.
    """
    count, x = one.shape[1], nodes[straights(one)]
    spans = _spans(x, nodes[straights(other)])
    places, weights = np.polynomial.legendre.leggauss(count)
    xi, eta = (at[:, :1] + np.diff(at) * (places + 1) / 2 for at in (spans.xi, spans.eta))
    weight = np.diff(spans.xi) * weights / 2 * norm(x[:, 1] - x[:, 0])[spans.one, None]
    if ring:
        weight *= _on(x[spans.one], xi)[..., 0]
    return Pieces(spans.one, spans.other, xi, eta, weight, spans.gap.min(axis=1))


class Spans(NamedTuple):
    """Parts (s,) of ``one`` straight edge (s,) at ``xi`` (s, 2), before those at ``eta`` (s, 2) of the ``other`` (s,).

    The ``gap`` (s, 2) at their ends is linear between them.
    """

    one: Ints
    other: Ints
    xi: Floats
    eta: Floats
    gap: Floats


def _spans(one: Floats, other: Floats) -> Spans:
    """Those of straight edges ``one`` (f, 2, 2) and ``other`` (g, 2, 2)."""
    out, length = outward(one), norm(one[:, 1] - one[:, 0])
    i, j = np.nonzero(out @ outward(other).T < FACES)
    along = (one[i, 1] - one[i, 0]) / length[i, None] ** 2
    ends = np.vecdot(other[j] - one[i, None, 0], along[:, None])
    heights = np.vecdot(other[j] - one[i, None, 0], out[i, None])
    low, high = np.maximum(ends.min(axis=1), 0.0), np.minimum(ends.max(axis=1), 1.0)
    deepest = heights.min(axis=1) + length[i] + norm(other[j, 1] - other[j, 0])
    kept = np.flatnonzero((high > low) & (deepest > 0))
    middle = ((low + high)[kept] / 2)[:, None]
    depth = -(heights[kept, :1] + (middle - ends[kept, :1]) * (np.diff(heights[kept]) / np.diff(ends[kept])))[:, 0]
    kept = kept[~_through(one, out, i[kept], _on(one[i[kept]], middle)[:, 0], depth)]
    shown, low, high = Heights(i[kept], low[kept], high[kept], ends[kept], heights[kept]).nearest()
    i, j, ends, heights = (of[kept][shown] for of in (i, j, ends, heights))
    xi = np.stack([low, high], axis=1)
    eta = (xi - ends[:, :1]) / np.diff(ends)
    return Spans(i, j, xi, eta, heights[:, :1] + eta * np.diff(heights))


def _through(one: Floats, out: Floats, i: Ints, x: Floats, depth: Floats) -> Bools:
    """Whether others of the edges ``one`` (f, 2, 2) lie before the ``depth`` (s,) behind x (s, 2) on the edges i (s,).

    The edges have the outward normals ``out`` (f, 2); others are those through which one leaves the part there.
    """
    hidden = np.zeros(len(i), dtype=bool)
    deep = np.flatnonzero(depth > 0)
    if not deep.size:
        return hidden
    inward, start, along = -out[i[deep], None], one[None, :, 0] - x[deep, None], one[None, :, 1] - one[None, :, 0]
    side = cross(inward, along)
    with np.errstate(divide="ignore", invalid="ignore"):
        far, place = cross(start, along) / side, cross(start, inward) / side
    beyond = out[i[deep]] @ out.T < 0
    hidden[deep] = (beyond & (far > 0) & (far < depth[deep, None]) & (place >= 0) & (place <= 1)).any(axis=1)
    return hidden


class Heights(NamedTuple):
    """Pieces (s,) before an ``edge`` (s,), ``low`` to ``high``, that rise between ``heights`` (s, 2) at ``ends``."""

    edge: Ints
    low: Floats
    high: Floats
    ends: Floats
    heights: Floats

    def at(self, some: Ints, place: Floats) -> Floats:
        """Heights (n, m) of ``some`` (n,) of them at a ``place`` (m,), inf beside them."""
        start, end = self.ends[some].T[..., None]
        low, high = self.heights[some].T[..., None]
        inside = (self.low[some, None] < place) & (place < self.high[some, None])
        return np.where(inside, low + (high - low) / (end - start) * (place - start), np.inf)

    def nearest(self) -> tuple[Ints, Floats, Floats]:
        """The numbers (t,) of pieces, without what others hide, and their new bounds.

        Where several are before one place, the lowest in the middle between two of all bounds is kept there.
        """
        order = np.lexsort((self.low, self.edge))
        edge, low, high = self.edge[order], self.low[order], self.high[order]
        crowded = np.isin(self.edge, edge[1:][(edge[1:] == edge[:-1]) & (low[1:] < high[:-1] - LEAST)])
        alone = np.flatnonzero(~crowded)
        kept, begin, end = [alone], [self.low[alone]], [self.high[alone]]
        for one in np.unique(self.edge[crowded]):
            mine = np.flatnonzero(self.edge == one)
            bounds = np.unique([self.low[mine], self.high[mine]])
            height = self.at(mine, (bounds[1:] + bounds[:-1]) / 2)
            met = np.isfinite(height).any(axis=0)
            kept.append(mine[np.argmin(height, axis=0)[met]])
            begin.append(bounds[:-1][met])
            end.append(bounds[1:][met])
        return np.concatenate(kept), np.concatenate(begin), np.concatenate(end)


def crossed(
    nodes: Floats, moved: Floats, points: Ints, edges: Ints, volume: Floats | None = None
) -> tuple[int, list[int]] | None:
    """A node of ``points`` (p,) that goes through one of the ``edges`` (f, n), and which, by its nodes.

    All ``nodes`` (a, 2) go straight to where they have ``moved`` (a, 2). Edges run anticlockwise. What goes from the
    outer side of one to the inner, and is deeper in the end than :data:`DEPTH` of its length, went through it. So did
    what is deeper than :data:`THROUGH` of the element behind it, where its area ``volume`` (f,) is given.
    """
    parts, edges = edges.shape[1] - 1, straights(edges)
    x, (a, b) = nodes[points][:, None], nodes[edges].swapaxes(0, 1)
    dx, (da, db) = (moved - nodes)[points][:, None], (moved - nodes)[edges].swapaxes(0, 1)
    # Twice the area between edge and node is quadratic in time.
    e, de, d, dd = b - a, db - da, x - a, dx - da
    area, slope, bend = cross(e, d), cross(de, d) + cross(e, dd), cross(de, dd)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(slope**2 - 4 * area * bend)
        times = np.stack([2 * area / (-slope + root), 2 * area / (-slope - root)])
    best = np.where((times >= 0) & (times <= 1), times, np.inf).min(axis=0)
    through = (area < 0) & (area + slope + bend > 0) & np.isfinite(best)
    if not through.any():
        return None
    p, f = np.nonzero(through)
    t = best[p, f][:, None]
    along, away = (e + 0)[f] + t * de[f], d[p, f] + t * dd[p, f]
    place = np.vecdot(along, away) / np.vecdot(along, along)
    ended = (e + de)[f]
    depth = (area + slope + bend)[p, f] / norm(ended)
    deepest = DEPTH * norm(ended)
    if volume is not None:
        deepest = np.minimum(deepest, THROUGH * np.repeat(volume, parts)[f] / (parts * norm(ended)))
    wrong = np.flatnonzero((place >= 0) & (place <= 1) & (depth > deepest))
    return (int(points[p[wrong[0]]]), edges[f[wrong[0]]].tolist()) if wrong.size else None


def deep(nodes: Floats, one: Ints, other: Ints, ring: bool) -> float:
    """How deep edges ``one`` (f, n) and ``other`` (g, n), anticlockwise, are in each other; 0 up to :data:`DEPTH`.

    That is over the length of the shorter of two straight parts, of ``nodes`` (a, 2).
    """
    found = pieces(nodes, one, other, ring)
    mine, its = (norm(np.diff(nodes[straights(edges)], axis=1))[:, 0] for edges in (one, other))
    depth, shorter = -found.lowest, np.minimum(mine[found.one], its[found.other])
    return float(depth[depth > DEPTH * shorter].max(initial=0.0))


def _on(edges: Floats, s: Floats) -> Floats:
    """Points (s, g, 2) at s (s, g) of edges (s, 2, 2)."""
    return edges[:, None, 0] + s[..., None] * (edges[:, None, 1] - edges[:, None, 0])
