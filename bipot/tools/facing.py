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
from bipot.typing import Floats, Ints

FACES = -0.1
"""Largest product of the outward normals of two edges that face each other."""

CREASE = 0.5
"""Cosine of the largest angle, 60 degrees, by which an edge may turn from its neighbour and share a point with it."""

LEAST = 1e-9
"""A point of which the part of its edges that faces the other boundary is no longer than this faces nothing."""

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


def outward(edges: Floats) -> Floats:
    """Outward unit normals (f, 2) of straight edges (f, 2, 2) that run anticlockwise around their elements."""
    along = unit(edges[:, 1] - edges[:, 0])
    return np.stack([along[:, 1], -along[:, 0]], axis=1)


def pieces(one: Floats, other: Floats, ring: bool) -> Pieces:
    """The pieces of edges ``one`` (f, 2, 2) and ``other`` (g, 2, 2) that face each other; ``ring`` of a meridian.

    A piece that is farther behind the edge than both edges are long does not count.
    """
    length, other_length = norm(one[:, 1] - one[:, 0]), norm(other[:, 1] - other[:, 0])
    along = (one[:, 1] - one[:, 0]) / length[:, None]
    i, j = np.nonzero(outward(one) @ outward(other).T < FACES)
    start = one[i, 0]
    ends = np.vecdot(other[j] - start[:, None], along[i, None]) / length[i, None]
    low, high = np.maximum(ends.min(axis=1), 0.0), np.minimum(ends.max(axis=1), 1.0)
    kept = high > low
    i, j, ends, low, high = i[kept], j[kept], ends[kept], low[kept], high[kept]
    xi = low[:, None] + (high - low)[:, None] * GAUSS
    eta = (xi - ends[:, :1]) / (ends[:, 1:] - ends[:, :1])
    here, there = _on(one[i], xi), _on(other[j], eta)
    gap = np.vecdot(there - here, outward(one)[i, None])
    kept = gap.min(axis=1) > -(length[i] + other_length[j])
    weight = ((high - low) * length[i] / 2)[:, None] * (here[..., 0] if ring else np.ones_like(xi))
    return Pieces(i[kept], j[kept], xi[kept], eta[kept], gap[kept], weight[kept])


def _on(edges: Floats, s: Floats) -> Floats:
    """Points (s, g, 2) at s (s, g) of edges (s, 2, 2)."""
    return edges[:, None, 0] + s[..., None] * (edges[:, None, 1] - edges[:, None, 0])


@dataclass(frozen=True)
class Facing:
    """Points (p,) of a boundary that faces another one: ``weights`` (D, -M) (p, a), inward ``normal`` (p, 2).

    Where a point does not face it, as at ``apart`` (p,), the weights are those of its own node. ``depth`` is the largest
    penetration.
    """

    weights: sp.csr_matrix
    normal: Floats
    apart: Ints
    depth: float


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
        """With one point a node, or two where the boundary at the places ``nodes`` (a, 2) turns by more than 60 degrees.

        So it does at the corner of a body, of which one side may touch and the other be far off.
        """
        out = outward(nodes[one])
        # The edge before and after each node, as edges run anticlockwise.
        before = {int(end): k for k, (_, end) in enumerate(one)}
        own = [before.get(int(start), k) for k, (start, _) in enumerate(one)]
        smooth = np.vecdot(out, out[own]) >= CREASE
        # A point is named by the edge that begins there, or ends there if none goes on from it.
        begins = np.where(smooth & (np.array(own) != np.arange(len(one))), own, -1)
        names = np.empty(one.shape, np.intp)
        names[:, 1] = len(one) + np.arange(len(one))
        names[:, 0] = np.where(begins >= 0, len(one) + begins, np.arange(len(one)))
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
    return Facing(weights, unit(normal), apart, max(0.0, -float(found.gap.min(initial=0.0))))
