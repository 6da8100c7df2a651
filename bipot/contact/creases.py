r"""Which facets of a boundary continue into each other at their ends, and where a mean around such an end stops.

A mean stops where the boundary turns by more than :data:`CREASE`. At a corner of the body with one side on the tool and
the other going up, each side has its own point. So have a side and its mirror image beyond a plane of symmetry where
they form a crease, and all facets where parts of the body meet (at one node in a plane, along one edge in space). In
space two faces continue into each other at a node if they share an edge there; a fan of such faces has one point.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from bipot.tensors import norm
from bipot.typing import Bools, Floats, Ints, Vector

CREASE = 0.5
"""Cosine of the largest angle, 60 degrees, by which a facet may turn from its neighbour and share a point with it."""


def ends_of(nodes: Floats, facets: Ints, ends: Ints) -> tuple[Ints, Ints]:
    """Points (f, k) at the ``ends`` (k,) of quadratic facets (f, n), and their nodes (p,), sorted."""
    if nodes.shape[1] == 2:
        return _on_lines(facets[:, ends], _away(nodes, facets))
    return _on_faces(facets[:, ends], _normals(nodes, facets, len(ends)))


def beyond(nodes: Floats, facets: Ints, inside: Bools, normal: Vector) -> Bools:
    """Whether ends (f, k) of quadratic ``facets`` continue into their mirror images in a plane of symmetry.

    The nodes ``inside`` (a,) are in the plane, which has the unit ``normal``. In space a face continues across an edge
    in the plane; the mirror image of a face with a single corner there is no neighbour.
    """
    s = np.array(normal)
    # Of an edge w and its mirror image w . w' = 1 - 2 (s . w)^2, and so it is of the normals of a face and its own.
    if nodes.shape[1] == 2:
        return np.asarray(2 * (_away(nodes, facets) @ s) ** 2 - 1 >= CREASE)
    count = facets.shape[1] // 2
    corner = inside[facets[:, :count]]
    along = corner & (np.roll(corner, 1, axis=1) | np.roll(corner, -1, axis=1))
    return np.asarray(along & (1 - 2 * (_normals(nodes, facets, count) @ s) ** 2 >= CREASE))


def _on_lines(ends: Ints, away: Floats) -> tuple[Ints, Ints]:
    """Points at the ``ends`` (f, 2) of edges with the directions ``away`` (f, 2, 2) from them.

    There is one where two edges continue or one ends, and one for each edge at a crease and where more than two meet.
    """
    node, inverse, count = np.unique(ends, return_inverse=True, return_counts=True)
    order = np.argsort(inverse.ravel(), kind="stable")
    first = np.cumsum(count) - count
    way = away.reshape(-1, 2)[order]
    second = np.minimum(first + 1, len(order) - 1)
    # Edges that go straight on leave their node in opposite directions; of three or more none goes on.
    split = (count > 2) | (count == 2) & (-np.vecdot(way[first], way[second]) < CREASE)
    parts = np.where(split, count, 1)
    own = np.repeat(split, count) * (np.arange(len(order)) - np.repeat(first, count))
    number = np.repeat(np.cumsum(parts) - parts, count) + own
    edges = np.empty(len(order), dtype=np.intp)
    edges[order] = number
    return edges.reshape(-1, 2), np.repeat(node, parts)


def _on_faces(corners: Ints, normal: Floats) -> tuple[Ints, Ints]:
    """Points at the ``corners`` (f, k) of faces with unit normals (f, k, 3) there: one for each fan of faces."""
    # Only scenes with means on faces ask for it: what merely imports the library need not load it.
    from scipy.sparse.csgraph import connected_components

    place = np.arange(corners.size).reshape(corners.shape)
    begin, end = place.ravel(), np.roll(place, -1, axis=1).ravel()
    sides = np.sort(corners.ravel()[np.column_stack([begin, end])], axis=1)
    _, side, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    first = (np.cumsum(count) - count)[count == 2]
    order = np.argsort(side.ravel(), kind="stable")
    a, b = order[first], order[first + 1]
    # Neighbours run opposite ways around: one begins where the other ends.
    one, other = np.concatenate([begin[a], end[a]]), np.concatenate([end[b], begin[b]])
    flat = normal.reshape(-1, 3)
    on = np.vecdot(flat[one], flat[other]) >= CREASE
    links = sp.coo_array((np.ones(on.sum()), (one[on], other[on])), shape=(corners.size, corners.size))
    _, part = connected_components(links, directed=False)
    _, found = np.unique(part, return_index=True)
    node = corners.ravel()[found]
    rank = np.argsort(node, kind="stable")
    number = np.argsort(rank)[part]
    return number.reshape(corners.shape), node[rank]


def _away(nodes: Floats, lines: Ints) -> Floats:
    """Unit vectors (f, 2, d) along which quadratic edges (f, 3), parabolas, go from their ends."""
    x = nodes[lines]
    return _units(np.stack([_leaving(x[:, 0], x[:, 1], x[:, 2]), _leaving(x[:, 2], x[:, 1], x[:, 0])], axis=1))


def _normals(nodes: Floats, faces: Ints, count: int) -> Floats:
    """Unit normals (f, k, 3) of quadratic faces (f, 2 k) at their ``count`` corners, by the edges that leave these."""
    corner, middle = nodes[faces[:, :count]], nodes[faces[:, count:]]
    ahead = _leaving(corner, middle, np.roll(corner, -1, axis=1))
    back = _leaving(corner, np.roll(middle, 1, axis=1), np.roll(corner, 1, axis=1))
    return _units(np.cross(ahead, back))


def _leaving(x: Floats, middle: Floats, end: Floats) -> Floats:
    """Derivatives (..., d) at ``x`` of parabolas through their ``middle`` to their ``end``."""
    return 4 * middle - 3 * x - end


def _units(vectors: Floats) -> Floats:
    return vectors / norm(vectors)[..., None]
