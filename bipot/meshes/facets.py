"""Facets of elements, edges in a plane and faces in space: owners, and checks that elements neither overlap there nor
recur."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.errors import require
from bipot.meshes.elements import Element
from bipot.typing import Bools, Ints, read_only


@dataclass(frozen=True)
class Facets:
    """The distinct facets of elements: ``nodes`` (f, n) in the order of an ``element``, edges as end, (middle,) end.

    They run anticlockwise around the element ``owner`` (f,), the first that has them, or seen from outside of it;
    ``shared`` (f,) marks those of two elements. ``number`` (e, m) has the numbers of each element's facets.

    ``crowded`` (n, k) are the nodes of facets of more than two elements, or of two that lie on the same side.
    """

    element: Element
    nodes: Ints
    shared: Bools
    crowded: Ints
    owner: Ints
    number: Ints

    @staticmethod
    def of(elements: Ints, element: Element) -> Facets:
        """The facets of elements (e, k) of a kind; those of neighbours run in opposite directions."""
        m, k = element.facets.shape
        every = elements[:, element.facets].reshape(-1, k)
        _, first, number = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_inverse=True)
        count = np.bincount(number.ravel())
        forward = np.bincount(number.ravel(), weights=np.where(_forward(every[:, element.ends]), 1, -1))
        nodes = every[first]
        crowded = (count > 2) | ((count == 2) & (forward != 0))
        return Facets(element, nodes, count > 1, nodes[crowded], first // m, number.reshape(-1, m))

    @property
    def what(self) -> str:
        """What a facet is called."""
        return "edge" if self.element.dimension == 2 else "face"

    @property
    def one(self) -> str:
        """The same with its article."""
        return "an edge" if self.element.dimension == 2 else "a face"

    @property
    def ends(self) -> Ints:
        """The end nodes (f, 2), or the corners of faces (f, 3 or 4)."""
        return self.nodes[:, self.element.ends]

    def find(self, facets: Ints) -> Ints:
        """Numbers (n,) of facets with the nodes ``facets`` (n, k), all or only ends, in any order; -1 if none."""
        known = self.ends if facets.shape[1] == len(self.element.ends) else self.nodes
        if facets.shape[1] != known.shape[1]:
            return np.full(len(facets), -1)
        # Only facets with all nodes among those given can match: far fewer to sort than there are.
        near = np.flatnonzero(np.isin(known, facets).all(axis=1))
        rows = np.sort(np.vstack([known[near], facets]), axis=1)
        _, place = np.unique(rows, axis=0, return_inverse=True)
        place = place.ravel()
        which = np.full(len(place), -1)
        which[place[: len(near)]] = near
        return which[place[len(near) :]]

    def find_each(self, named: Mapping[str, Ints]) -> dict[str, Ints]:
        """The numbers of facets by name, as :meth:`find`, by one search: most of its time does not depend on how many.

        All have as many nodes.
        """
        if not named:
            return {}
        found = self.find(np.concatenate([*named.values()]))
        ends = np.cumsum([len(facets) for facets in named.values()])[:-1]
        return dict(zip(named, np.split(found, ends), strict=True))

    def run(self, which: Ints, as_given: Ints) -> Ints:
        """Nodes (f, n) of the facets ``which`` (f,): edges run as nodes ``as_given``, faces as in :attr:`nodes`."""
        nodes = self.nodes[which]
        if self.element.dimension == 3:
            return nodes
        middle = nodes[:, 1:-1]
        ends = as_given
        if as_given.shape[1] > 2:
            ends = as_given[(as_given[:, :, None] != middle[:, None]).all(axis=2)].reshape(-1, 2)
        return np.insert(ends, 1, middle.T, axis=1)


def _forward(corners: Ints) -> Bools:
    """Which of its two ways each edge (f, 2) or face (f, n) runs; for the neighbour it runs the other way."""
    if corners.shape[1] == 2:
        return corners[:, 0] < corners[:, 1]
    at, least = np.arange(len(corners)), np.argmin(corners, axis=1)
    after, before = ((least + step) % corners.shape[1] for step in (1, -1))
    return corners[at, after] < corners[at, before]


def edges_of(elements: Ints, element: Element) -> tuple[Ints, Ints]:
    """The distinct edges of elements (e, k) by their ends (s, 2), and the numbers (e, n) of each element's edges.

    >>> edges_of(np.array([[0, 1, 2], [0, 2, 3]]), Element.T3)[0].tolist()
    [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    """
    sides = element.edges[:, [0, -1]]
    ends, number = np.unique(np.sort(elements[:, sides].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    return ends, number.reshape(-1, len(sides))


def require_elements(elements: Ints, count: int) -> None:
    """Require that every element occurs once and has different nodes, and that every node belongs to one."""
    ordered = np.sort(elements, axis=1)
    twice = np.flatnonzero((np.diff(ordered, axis=1) == 0).any(axis=1))
    require(not twice.size, "mesh.elements", f"element {twice[:1].tolist()}", f"of {elements.shape[1]} different nodes")
    _, first = np.unique(ordered, axis=0, return_index=True)
    again = np.setdiff1d(np.arange(len(elements)), first)
    require(not again.size, "mesh.elements", f"element {again[:1].tolist()}", "there once, not a copy of another")
    orphans = np.setdiff1d(np.arange(count), elements)
    require(not orphans.size, "mesh.nodes", f"node {orphans[:1].tolist()}", "a node of an element: leave others out")


def require_facets(facets: Facets, elements: Ints) -> None:
    """Require that every facet has at most two elements, one per side, and every edge its own mid-side node if any."""
    what, way = facets.what, "numbered" if facets.element.dimension == 2 else "of a base numbered"
    crowded = facets.crowded[:1].tolist()
    allowed = f"of one element a side (none overlap, all {way} anticlockwise)"
    require(not crowded, "mesh.elements", f"{what} {crowded}", allowed)
    if not facets.element.quadratic:
        return
    edges = elements[:, facets.element.edges].reshape(-1, 3)
    edges[:, ::2].sort(axis=1)
    middle, count = np.unique(np.unique(edges, axis=0)[:, 1], return_counts=True)
    hanging = np.union1d(middle[count > 1], np.intersect1d(middle, facets.ends))
    require(not hanging.size, "mesh.elements", f"mid-side node {hanging[:1].tolist()}", "on one edge, and no corner")


def boundaries_of(facets: Facets, named: Mapping[str, Ints]) -> dict[str, Ints]:
    """The named facets with their nodes in order; raises SceneError where one is none of these, or there twice."""
    out, what = {}, facets.what
    for name, found in facets.find_each(named).items():
        label, lost = f"mesh boundary {name!r}", np.flatnonzero(found < 0)
        require(not lost.size, label, named[name][lost[:1]].tolist(), f"the nodes of one {what} of an element")
        require(len(np.unique(found)) == len(found), label, f"{facets.one} twice", f"{what}s that differ")
        out[name] = read_only(facets.run(found, named[name]), np.intp)
    return out


def parts_of(facets: Facets) -> Ints:
    """The number (e,) of the connected part of each element; parts that touch only in a corner are apart."""
    # Only making a mesh needs this module, and imports of the library should not load it.
    from scipy.sparse.csgraph import connected_components

    count, sides = facets.number.shape
    owner, facet = np.repeat(np.arange(count), sides), facets.number.ravel()
    # Elements and facets are the vertices of one graph: its links need no product of matrices.
    size = count + len(facets.nodes)
    links = sp.csr_array((np.ones(owner.size), (owner, count + facet)), shape=(size, size))
    _, part = connected_components(links, directed=False)
    return np.asarray(part[:count], dtype=np.intp)
