r"""Contact of two boundaries of one mesh: means of the gap between them, and of their relative motion.

Boundaries are polygons through their nodes, with two straight parts of an edge that has a node in the middle. Points p
are the nodes of the boundary that may touch, with the hat functions psi_p that are linear along each of these parts.
Seen along the normal of such a part, a place x of it faces the place y(x) on the other boundary, and

    z_p = sum_k D_pk x_k - sum_l M_pl y_l,    D_pk = int psi_p N_k dA / int psi_p dA,    M_pl likewise with N_l(y(x)),

with the shape functions N of the edges, is the mean vector between them over the part of the boundary that faces the
other one. Integrals are taken piece by piece (:mod:`bipot.tools.pieces`), where neither side has a node within, so that
they are exact: a uniform pressure on the one side is the same on the other, whatever the meshes are. Rows of the
weights (D, -M) sum to zero. With n_p the mean over the same part of the inward normals of the polygon, the gap is
n_p . z_p, and a force r_p acts on the nodes of both sides.

Quadratic edges are the parabolas of their shape functions in the vectors between the sides, and polygons where it is
asked what faces what. On straight edges with centred middle nodes the two are the same. A point at each end alone would
leave them a mode in which the corner of a body sinks into the other side, and slips along its normals would do work.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.tensors import norm, unit
from bipot.tools.pieces import LEAST, edge_shapes, outward, pieces, straights
from bipot.typing import Floats, Ints

CREASE = 0.5
"""Cosine of the largest angle, 60 degrees, by which an edge may turn from its neighbour and share a point with it."""


@dataclass(frozen=True)
class Facing:
    """Points (p,) of a boundary that faces another one: ``weights`` (D, -M) (p, a), inward ``normal`` (p, 2).

    Where a point does not face it, as at ``apart`` (p,), the weights are those of its own node. The ``area`` (p,) is
    int psi_p dA over what faces the other one, of a ring that of a radian.
    """

    weights: sp.csr_matrix
    normal: Floats
    apart: Ints
    area: Floats


@dataclass(frozen=True)
class Sides:
    """Edges ``one`` (f, n) and ``other`` (g, n) that may face each other, which run anticlockwise, nodes of each.

    The ends of the straight parts of the former are the points ``point`` (f (n - 1), 2), at the nodes ``node`` (p,).
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
        ends = straights(one)
        out = outward(nodes[ends])
        # The edge before and after each node, as edges run anticlockwise.
        number, before = np.arange(len(ends)), np.full(len(nodes), -1)
        before[ends[:, 1]] = number
        own = np.where(before[ends[:, 0]] >= 0, before[ends[:, 0]], number)
        smooth = np.vecdot(out, out[own]) >= CREASE
        # A point is named by the edge that begins there, or ends there if none goes on from it.
        begins = np.where(smooth & (own != number), own, -1)
        names = np.empty(ends.shape, np.intp)
        names[:, 1] = len(ends) + number
        names[:, 0] = np.where(begins >= 0, len(ends) + begins, number)
        _, first, point = np.unique(names, return_index=True, return_inverse=True)
        at = ends.ravel()[first]
        order = np.argsort(at, kind="stable")
        return Sides(one, other, np.argsort(order)[point].reshape(ends.shape), at[order])


def facing(nodes: Floats, sides: Sides, ring: bool) -> Facing:
    """The points of the ``sides`` where ``nodes`` (a, 2) are at their present places; ``ring`` as of :func:`pieces`."""
    one, other, node = sides.one, sides.other, sides.node
    found = pieces(nodes, one, other, ring)
    count, size = len(node), len(nodes)
    psi = edge_shapes(found.xi, 2)
    by_own, by_other = found.shapes(one.shape[1], other.shape[1])
    point = sides.point[found.one]
    share = np.einsum("sg,sgp->sp", found.weight, psi)
    area = np.asarray(np.bincount(point.ravel(), share.ravel(), count), np.float64)
    own = np.einsum("sg,sgp,sgk->spk", found.weight, psi, by_own)
    others = -np.einsum("sg,sgp,sgk->spk", found.weight, psi, by_other)
    parts = ((own, one[found.one // (one.shape[1] - 1)]), (others, other[found.other // (other.shape[1] - 1)]))
    entries = [(of, *np.broadcast_arrays(point[:, :, None], at[:, None, :])) for of, at in parts]
    values, rows, columns = (np.concatenate([part[k].ravel() for part in entries]) for k in range(3))
    ends = nodes[straights(one)]
    reach = np.bincount(sides.point.ravel(), np.repeat(norm(ends[:, 1] - ends[:, 0]), 2), count)
    least = LEAST * reach * (nodes[node, 0].max() if ring else 1.0)
    apart = np.flatnonzero(area <= least)
    kept = ~np.isin(rows, apart)
    data = np.concatenate([values[kept] / area[rows[kept]], np.ones(len(apart))])
    place = np.concatenate([rows[kept], apart]), np.concatenate([columns[kept], node[apart]])
    weights = sp.csr_matrix((data, place), shape=(count, size))
    weights.sum_duplicates()
    normal, alone, inward = np.zeros((count, 2)), np.zeros((count, 2)), -outward(ends)
    np.add.at(normal, point, share[..., None] * inward[found.one][:, None])
    # Where nothing is faced, normals are those of all edges.
    np.add.at(alone, sides.point, inward[:, None])
    normal[apart] = alone[apart]
    return Facing(weights, unit(normal), apart, area)
