"""The edges of eight-node quadrilaterals: which there are, whose they are, and that no two elements overlap there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.errors import require
from bipot.typing import Bools, Ints

ON_EDGE = 3


@dataclass(frozen=True)
class Facets:
    """The different edges of elements: ``nodes`` (f, 3) as end, middle, end, ``shared`` (f,) by two elements.

    They run anticlockwise around the element ``owner`` (f,), the first that has them.

    ``crowded`` are edges of more than two elements, or of two that lie on the same side.
    """

    nodes: Ints
    shared: Bools
    crowded: Ints
    owner: Ints

    @staticmethod
    def of(elements: Ints) -> Facets:
        """The edges of elements (e, 8): those of an element run anticlockwise, so neighbours run opposite ways."""
        every = np.stack([elements[:, :4], elements[:, 4:], np.roll(elements[:, :4], -1, axis=1)], axis=2)
        every = every.reshape(-1, ON_EDGE)
        _, first, place = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_inverse=True)
        count = np.bincount(place.ravel())
        forward = np.bincount(place.ravel(), weights=np.where(every[:, 0] < every[:, 2], 1, -1))
        nodes = every[first]
        return Facets(nodes, count > 1, nodes[(count > 2) | ((count == 2) & (forward != 0))], first // 4)

    def find(self, edges: Ints) -> Ints:
        """Which facet has the three nodes of each edge (f, 3), in whatever order; -1 if none."""
        # A mid-side node is on one edge only, so it tells which.
        which = np.full(int(max(self.nodes.max(), edges.max())) + 1, -1, dtype=np.intp)
        which[self.nodes[:, 1]] = np.arange(len(self.nodes))
        found = which[edges].max(axis=1)
        same = (np.sort(edges, axis=1) == np.sort(self.nodes[found], axis=1)).all(axis=1)
        return np.where(same & (found >= 0), found, -1)


def require_facets(facets: Facets) -> None:
    """Every edge has at most two elements, one a side, and its own mid-side node."""
    crowded = facets.crowded[:1].tolist()
    allowed = "of one element a side (none overlap, all numbered anticlockwise)"
    require(not crowded, "mesh.elements", f"edge {crowded}", allowed)
    middle, count = np.unique(facets.nodes[:, 1], return_counts=True)
    hanging = np.union1d(middle[count > 1], np.intersect1d(middle, facets.nodes[:, [0, 2]]))
    require(not hanging.size, "mesh.elements", f"mid-side node {hanging[:1].tolist()}", "on one edge, and no corner")
