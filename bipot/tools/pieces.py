"""Pieces of two boundaries in a plane that face each other.

Edges are polygons through their nodes (:mod:`bipot.tools.flats`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.tensors import norm
from bipot.tools.flats import edge_shapes, flats, outward
from bipot.tools.plane import cross
from bipot.typing import Bools, Floats, Ints

FACES = -0.1
"""Largest product of the outward normals of two flat parts that face each other."""

LEAST = 1e-9
"""Over the length or area of a flat part, a piece no larger than this is none."""


class Pieces(NamedTuple):
    """Pieces (s,) of ``one`` flat part of facets (s,) that face pieces of the ``other`` (s,).

    Parts are numbered as by :func:`bipot.tools.flats.flats`. The hat functions of the one at integration points are
    ``mine`` (s, g, k), those of the other ``its`` (s, g, l), and the weights in int dA ``weight`` (s, g). The least gap
    of each piece is ``lowest`` (s,).
    """

    one: Ints
    other: Ints
    mine: Floats
    its: Floats
    weight: Floats
    lowest: Floats


def pieces(nodes: Floats, one: Ints, other: Ints, ring: bool) -> Pieces:
    """The pieces of edges ``one`` (f, n) and ``other`` (g, n) of ``nodes`` (a, 2) that face each other.

    On a meridian, which is that of a ``ring``, dA has the radius. Integrals of hat functions times shape functions are
    exact. Of several pieces that face the same place the nearest counts; one that is farther behind the edge than both
    edges are long does not, nor one behind the other side of a thin part.
    """
    count, x = one.shape[1], nodes[flats(one, 2)]
    spans = _spans(x, nodes[flats(other, 2)])
    places, weights = np.polynomial.legendre.leggauss(count)
    xi, eta = (at[:, :1] + np.diff(at) * (places + 1) / 2 for at in (spans.xi, spans.eta))
    weight = np.diff(spans.xi) * weights / 2 * norm(x[:, 1] - x[:, 0])[spans.one, None]
    if ring:
        weight *= _on(x[spans.one], xi)[..., 0]
    return Pieces(spans.one, spans.other, edge_shapes(xi, 2), edge_shapes(eta, 2), weight, spans.gap.min(axis=1))


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


def _on(edges: Floats, s: Floats) -> Floats:
    """Points (s, g, 2) at s (s, g) of edges (s, 2, 2)."""
    return edges[:, None, 0] + s[..., None] * (edges[:, None, 1] - edges[:, None, 0])
