r"""Contact of two boundaries of one mesh: means of the gap between them, and of their relative motion.

Points p are the nodes of the boundary that may touch, with the hat functions psi_p = N_p of its straight edges. Seen
along the normal of such an edge, a place x of it faces the place y(x) on an edge of the other boundary, and

    z_p = sum_k D_pk x_k - sum_l M_pl y_l,    D_pk = int psi_p N_k dA / int psi_p dA,    M_pl likewise with N_l(y(x)),

is the mean vector between them over the part of the boundary that faces the other one. Integrals are taken piece by
piece, where neither side has a node within, so that they are exact: a uniform pressure on the one side is the same on
the other, whatever the meshes are. Rows of the weights (D, -M) sum to zero. With n_p the mean over the same part of the
inward normals of the edges, the gap is n_p . z_p, and a force r_p acts on the nodes of both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from bipot.tensors import norm, unit
from bipot.tools.plane import cross
from bipot.typing import Bools, Floats, Ints

FACES = -0.1
"""Largest product of the outward normals of two edges that face each other."""

CREASE = 0.5
"""Cosine of the largest angle, 60 degrees, by which an edge may turn from its neighbour and share a point with it."""

LEAST = 1e-9
"""A point of which the part of its edges that faces the other boundary is no longer than this faces nothing."""

DEPTH = 0.25
"""Depth behind an edge, over its length, that places may have at which means of gaps vanish."""

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0) / 2 + 0.5
"""Places in [0, 1] of a rule with equal weights, exact for cubic functions: of r psi_p N_k."""


class Pieces(NamedTuple):
    """Pieces (s,) of ``one`` edge (s,) that face pieces of the ``other`` (s,).

    ``xi`` and ``eta`` (s, g) are the places of integration points on both edges, from 0 to 1, ``gap`` (s, g) there, and
    ``weight`` (s, g) that in int dA.
    """

    one: Ints
    other: Ints
    xi: Floats
    eta: Floats
    gap: Floats
    weight: Floats

    @property
    def lowest(self) -> Floats:
        """The least gap (s,) of each piece, along which it is linear: at one of its ends."""
        return self.gap.mean(axis=1) - np.sqrt(3.0) / 2 * np.abs(self.gap[:, 1] - self.gap[:, 0])


def outward(edges: Floats) -> Floats:
    """Outward unit normals (f, 2) of straight edges (f, 2, 2) that run anticlockwise around their elements."""
    along = unit(edges[:, 1] - edges[:, 0])
    return np.stack([along[:, 1], -along[:, 0]], axis=1)


def pieces(one: Floats, other: Floats, ring: bool) -> Pieces:
    """The pieces of edges ``one`` (f, 2, 2) and ``other`` (g, 2, 2) that face each other; ``ring`` of a meridian.

    Of several that face the same place the nearest counts; a piece that is farther behind the edge than both edges are
    long does not, nor one behind the other side of a thin part.
    """
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
    xi = low[:, None] + (high - low)[:, None] * GAUSS
    eta = (xi - ends[:, :1]) / (ends[:, 1:] - ends[:, :1])
    gap = heights[:, :1] + eta * (heights[:, 1:] - heights[:, :1])
    radius = _on(one[i], xi)[..., 0] if ring else np.ones_like(xi)
    return Pieces(i, j, xi, eta, gap, ((high - low) * length[i] / 2)[:, None] * radius)


def _through(one: Floats, out: Floats, i: Ints, x: Floats, depth: Floats) -> Bools:
    """Whether others of the edges ``one`` (f, 2, 2) lie before the ``depth`` (s,) behind x (s, 2) on the edges i (s,).

    The edges have the outward normals ``out`` (f, 2); others are those on the other side of the part.
    """
    hidden = np.zeros(len(i), dtype=bool)
    deep = np.flatnonzero(depth > 0)
    if not deep.size:
        return hidden
    inward, start, along = -out[i[deep], None], one[None, :, 0] - x[deep, None], one[None, :, 1] - one[None, :, 0]
    side = cross(inward, along)
    with np.errstate(divide="ignore", invalid="ignore"):
        far, place = cross(start, along) / side, cross(start, inward) / side
    opposite = out[i[deep]] @ out.T < FACES
    hidden[deep] = (opposite & (far > 0) & (far < depth[deep, None]) & (place >= 0) & (place <= 1)).any(axis=1)
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


def crossed(nodes: Floats, moved: Floats, points: Ints, edges: Ints) -> tuple[int, list[int]] | None:
    """A node of ``points`` (p,) that goes through one of the ``edges`` (f, 2), and that edge, by numbers of nodes.

    All ``nodes`` (a, 2) go straight to where they have ``moved`` (a, 2). Edges run anticlockwise. What goes from the
    outer side of one to the inner, and is deeper in the end than :data:`DEPTH` of its length, went through it.
    """
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
    wrong = np.flatnonzero((place >= 0) & (place <= 1) & (depth > DEPTH * norm(ended)))
    return (int(points[p[wrong[0]]]), edges[f[wrong[0]]].tolist()) if wrong.size else None


def deep(nodes: Floats, one: Ints, other: Ints, ring: bool) -> float:
    """How deep edges ``one`` (f, 2) and ``other`` (g, 2), anticlockwise, are in each other; 0 up to :data:`DEPTH`.

    That is over the length of the shorter of two edges, of ``nodes`` (a, 2).
    """
    found = pieces(nodes[one], nodes[other], ring)
    lengths = [
        norm(nodes[edges[:, 1]] - nodes[edges[:, 0]])[k] for edges, k in ((one, found.one), (other, found.other))
    ]
    depth = -found.lowest
    return float(depth[depth > DEPTH * np.minimum(*lengths)].max(initial=0.0))


def _on(edges: Floats, s: Floats) -> Floats:
    """Points (s, g, 2) at s (s, g) of edges (s, 2, 2)."""
    return edges[:, None, 0] + s[..., None] * (edges[:, None, 1] - edges[:, None, 0])


@dataclass(frozen=True)
class Facing:
    """Points (p,) of a boundary that faces another one: ``weights`` (D, -M) (p, a), inward ``normal`` (p, 2).

    Where a point does not face it, as at ``apart`` (p,), the weights are those of its own node.
    """

    weights: sp.csr_matrix
    normal: Floats
    apart: Ints


@dataclass(frozen=True)
class Sides:
    """Edges ``one`` (f, 2) and ``other`` (g, 2) that may face each other, which run anticlockwise, nodes of each.

    The ends of the former are the points ``point`` (f, 2), at the nodes ``node`` (p,).
    """

    one: Ints
    other: Ints
    point: Ints
    node: Ints

    @staticmethod
    def of(nodes: Floats, one: Ints, other: Ints) -> Sides:
        """With one point a node, or two where the boundary at ``nodes`` (a, 2) turns by more than 60 degrees.

        So it does at the corner of a body, of which one side may touch and the other be far off.
        """
        out = outward(nodes[one])
        # The edge before and after each node, as edges run anticlockwise.
        number, before = np.arange(len(one)), np.full(len(nodes), -1)
        before[one[:, 1]] = number
        own = np.where(before[one[:, 0]] >= 0, before[one[:, 0]], number)
        smooth = np.vecdot(out, out[own]) >= CREASE
        # A point is named by the edge that begins there, or ends there if none goes on from it.
        begins = np.where(smooth & (own != number), own, -1)
        names = np.empty(one.shape, np.intp)
        names[:, 1] = len(one) + number
        names[:, 0] = np.where(begins >= 0, len(one) + begins, number)
        _, first, point = np.unique(names, return_index=True, return_inverse=True)
        at = one.ravel()[first]
        order = np.argsort(at, kind="stable")
        return Sides(one, other, np.argsort(order)[point].reshape(one.shape), at[order])


def facing(nodes: Floats, sides: Sides, ring: bool) -> Facing:
    """The points of the ``sides`` where ``nodes`` (a, 2) are at their present places; ``ring`` as of :func:`pieces`."""
    one, other, node = sides.one, sides.other, sides.node
    found = pieces(nodes[one], nodes[other], ring)
    count, size = len(node), len(nodes)
    psi, by_other = (np.stack([1 - s, s], axis=-1) for s in (found.xi, found.eta))
    point = sides.point[found.one]
    share = np.einsum("sg,sgp->sp", found.weight, psi)
    area = np.bincount(point.ravel(), share.ravel(), count)
    own = np.einsum("sg,sgp,sgk->spk", found.weight, psi, psi)
    others = -np.einsum("sg,sgp,sgk->spk", found.weight, psi, by_other)
    parts = ((own, one[found.one]), (others, other[found.other]))
    entries = [(of, *np.broadcast_arrays(point[:, :, None], at[:, None, :])) for of, at in parts]
    values, rows, columns = (np.concatenate([part[k].ravel() for part in entries]) for k in range(3))
    ends = nodes[one]
    reach = np.bincount(sides.point.ravel(), np.repeat(norm(ends[:, 1] - ends[:, 0]), 2), count)
    least = LEAST * reach * (nodes[node, 0].max() if ring else 1.0)
    apart = np.flatnonzero(area <= least)
    kept = ~np.isin(rows, apart)
    data = np.concatenate([values[kept] / area[rows[kept]], np.ones(len(apart))])
    place = np.concatenate([rows[kept], apart]), np.concatenate([columns[kept], node[apart]])
    weights = sp.csr_matrix((data, place), shape=(count, size))
    weights.sum_duplicates()
    normal = np.zeros((count, 2))
    # Where nothing is faced, normals are those of all edges.
    every = point.ravel(), -np.repeat(outward(ends)[found.one], 2, axis=0) * share.ravel()[:, None]
    np.add.at(normal, *every)
    alone = np.zeros((count, 2))
    np.add.at(alone, sides.point.ravel(), -np.repeat(outward(ends), 2, axis=0))
    normal[apart] = alone[apart]
    return Facing(weights, unit(normal), apart)
