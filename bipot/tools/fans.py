"""Fans of facets that continue into each other at a node, each of which has one point of contact there.

In space two faces continue into each other at the ends of an edge that they share. Where more than two edges in a plane
meet in a node, or more than two faces in an edge, as where parts of the body touch, none continues.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from bipot.typing import Floats, Ints

CREASE = 0.5 - 1e-9
"""Cosine of the largest angle by which a facet may turn from its neighbour and share a point with it.

It is 60 degrees, which wedges and hexagons have, and the round-off of places.
"""


def fans(node: Ints, one: Ints, other: Ints, cosine: Floats) -> tuple[Ints, Ints]:
    """Points (…) of the places at ``node`` (…), numbered in the order of their nodes, and these (p,).

    The m places ``one`` (l,) and the ``other`` (l,) are those of neighbours at one node, between which the boundary
    turns by an angle of this ``cosine`` (l,): they have one point if it is no crease.

    >>> point, at = fans(np.array([[5, 7], [7, 8]]), np.array([1]), np.array([2]), np.array([0.9]))
    >>> point.tolist(), at.tolist()
    ([[0, 1], [1, 2]], [5, 7, 8])
    """
    # Imported here because only scenes with means, or of parts, need it.
    from scipy.sparse.csgraph import connected_components

    links = sp.coo_array((cosine >= CREASE, (one, other)), shape=(node.size, node.size))
    links.eliminate_zeros()
    _, part = connected_components(links, directed=False)
    _, first = np.unique(part, return_index=True)
    at = node.ravel()[first]
    order = np.argsort(at, kind="stable")
    return np.argsort(order)[part].reshape(node.shape), at[order]


def beside(faces: Ints) -> tuple[Ints, Ints]:
    """The places (l,) and (l,), numbers in faces (f, k), at the ends of edges that two of the faces share.

    Corners of a face that are one are such places, too.

    >>> [place.tolist() for place in beside(np.array([[0, 1, 2], [2, 1, 3]]))]
    [[1, 2], [4, 3]]
    """
    place = np.arange(faces.size)
    after = np.roll(place.reshape(faces.shape), -1, axis=1).ravel()
    ends = faces.ravel()[np.column_stack([place, after])]
    same = ends[:, 0] == ends[:, 1]
    edge, one = np.flatnonzero(~same), np.flatnonzero(same)
    a, b = (edge[of] for of in twice(np.sort(ends[edge], axis=1)))
    # Neighbours run along their common edge in opposite directions: one begins where the other ends.
    return np.concatenate([a, after[a], one]), np.concatenate([after[b], b, after[one]])


def twice(keys: Ints) -> tuple[Ints, Ints]:
    """Where each row of the ``keys`` (m, k) that is there exactly twice is first (p,), and again (p,)."""
    _, key, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    order, first = np.argsort(key.ravel(), kind="stable"), (np.cumsum(count) - count)[count == 2]
    return order[first], order[first + 1]
