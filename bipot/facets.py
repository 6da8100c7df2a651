"""The edges of plane elements: which there are, whose they are, and that no two elements overlap there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.elements import Element
from bipot.errors import require
from bipot.typing import Bools, Ints


@dataclass(frozen=True)
class Facets:
    """The different edges of elements: ``nodes`` (f, n) as end, middle, end, or end, end of elements without mid-sides.

    They run anticlockwise around the element ``owner`` (f,), the first that has them; ``shared`` (f,) are those of two
    elements. ``number`` (e, corners) says which facet every edge of an element is.

    ``crowded`` are edges of more than two elements, or of two that lie on the same side.
    """

    nodes: Ints
    shared: Bools
    crowded: Ints
    owner: Ints
    number: Ints

    @staticmethod
    def of(elements: Ints) -> Facets:
        """The edges of elements (e, k): those of an element run anticlockwise, so neighbours run opposite ways."""
        edges = Element.of(elements.shape[1]).edges
        every = elements[:, edges].reshape(-1, edges.shape[1])
        _, first, place = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_inverse=True)
        number = place.reshape(-1, len(edges))
        count = np.bincount(number.ravel())
        forward = np.bincount(number.ravel(), weights=np.where(every[:, 0] < every[:, -1], 1, -1))
        nodes = every[first]
        crowded = (count > 2) | ((count == 2) & (forward != 0))
        return Facets(nodes, count > 1, nodes[crowded], first // len(edges), number)

    @property
    def ends(self) -> Ints:
        """The end nodes (f, 2)."""
        return self.nodes[:, [0, -1]]

    def find(self, edges: Ints) -> Ints:
        """Which facet has all nodes of each edge, or its two ends (f, 2), in whatever order; -1 if none."""
        own = self.ends if edges.shape[1] == 2 else self.nodes
        if edges.shape[1] != own.shape[1]:
            return np.full(len(edges), -1)
        # Only facets whose nodes are all asked for can be meant: far fewer to sort than there are.
        near = np.flatnonzero(np.isin(own, edges).all(axis=1))
        rows = np.sort(np.vstack([own[near], edges]), axis=1)
        _, place = np.unique(rows, axis=0, return_inverse=True)
        place = place.ravel()
        which = np.full(len(place), -1)
        which[place[: len(near)]] = near
        return which[place[len(near) :]]


def require_facets(facets: Facets) -> None:
    """Every edge has at most two elements, one a side, and its own mid-side node if any."""
    crowded = facets.crowded[:1].tolist()
    allowed = "of one element a side (none overlap, all numbered anticlockwise)"
    require(not crowded, "mesh.elements", f"edge {crowded}", allowed)
    middle, count = np.unique(facets.nodes[:, 1:-1], return_counts=True)
    hanging = np.union1d(middle[count > 1], np.intersect1d(middle, facets.ends))
    require(not hanging.size, "mesh.elements", f"mid-side node {hanging[:1].tolist()}", "on one edge, and no corner")


def require_one_part(facets: Facets) -> None:
    """Edges lead from the first element to every other: parts that touch in a corner, or not at all, move alone."""
    # Only the making of a mesh asks for it: what merely imports the library need not load it.
    from scipy.sparse.csgraph import connected_components

    count, sides = facets.number.shape
    owner, edge = np.repeat(np.arange(count), sides), facets.number.ravel()
    links = sp.coo_array((np.ones(owner.size), (owner, edge)), shape=(count, len(facets.nodes)))
    _, part = connected_components(links @ links.T, directed=False)
    apart = np.flatnonzero(part != part[0])[:1]
    lonely = f"one body: element {apart.max(initial=0)} shares no edge with those that hang together with element 0"
    require(not apart.size, "mesh.elements", "in parts", lonely)
