r"""Whether a body penetrates itself or its mirror image, since contact is posed with tools only.

For each node on the surface, a point x :data:`BENEATH` it in its element is checked. It must not be in another element
that shares no facet with any of the node's elements. It is in an element with the map x(xi) if the solution xi of

    x(xi) = x,    found by Newton's method for the few points in the box around the element,

is in the reference shape. Points beneath the surface are not in a part of the body that their own only touches or
slides along. A node is in the mirror image if it is past the plane. Overlapping neighbours across a facet are found by
the orientation (:mod:`bipot.fem.orientation`). The flanks of a notch, which share only its tip, are checked like other
parts. Surfaces that cross between nodes, without a node in the other part, are not detected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from bipot.errors import require
from bipot.fem.elements import tabulated_at
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.scene.symmetry import PLANAR, Mirror
from bipot.tensors import norm
from bipot.typing import Bools, Floats, Ints, einsum, read_only

DRIFT = 1e-12
"""Relative drift by round-off, over some thousand increments, of nodes off the plane in which they are held."""

BENEATH = 1e-3
"""Fraction of the way from a node to the middle of its element, on the reference shape: of thin curved elements the
mean of all nodes may be outside."""

FACING = 0.25
"""The same on the sides of deformable tools, where the law is posed in means and nodes may be in the other side."""

ROUND_OFF = 1e-9
"""Round-off of places in the reference shape, and of places over an element's size."""

GENERIC = np.array([1.0, np.sqrt(2), np.sqrt(3)])
"""A direction that no mesh has: few points at different places are at one place along it."""

STEPS = 20
"""Steps of Newton's method; in an element that is not folded a few suffice."""


class Through(NamedTuple):
    """What penetrates what, in ``words``: a ``node`` an ``element``, or, if that is None, a plane of symmetry."""

    words: str
    node: int
    element: int | None


@dataclass(frozen=True)
class Itself:
    """Nodes on the ``surface`` (s,) of a mesh, an element ``own`` (s,) of each, and sorted keys ``near`` (p,).

    The keys list a node's elements and their neighbours across facets: the key of surface[i] and element e is i times
    the number of elements, plus e. ``mirrors`` are planes beyond which the body continues, and ``beside`` (m,), 1 or
    -1, the side of each on which the modelled part is. The places beneath the surface are means of the nodes of their
    elements, with weights ``beneath`` (s, k); those that are ``met`` (s,) are beneath sides of deformable tools.
    """

    mesh: Mesh
    surface: Ints
    own: Ints
    near: Ints
    mirrors: Sequence[Mirror]
    beside: Floats
    beneath: Floats
    met: Bools

    @staticmethod
    def of(mesh: Mesh, mirrors: Sequence[Mirror], facing: Ints | None = None) -> Itself:
        """Prepare the test for the ``mesh`` of a body at rest, with nodes ``facing`` (n,) each other in contact."""
        # Imported here because nothing else in this module needs it.
        import scipy.sparse as sp

        count, width = mesh.elements.shape
        rows = np.repeat(np.arange(count), width)
        has = sp.csr_array((np.ones(rows.size), (rows, mesh.elements.ravel())), shape=(count, len(mesh.nodes)))
        surface = np.unique(mesh.outline)
        _, first = np.unique(mesh.elements, return_index=True)
        # From a node to its elements, and from these to elements that share a facet with one of them.
        shared = has @ has.T
        shared.data = (shared.data >= mesh.element.facets.shape[1]).astype(np.float64)
        shared.eliminate_zeros()
        near = (has[:, surface].T @ shared).tocoo()
        side = np.array([np.sign(plane.side(mesh.nodes).sum()) for plane in mirrors])
        keys = np.sort(near.row.astype(np.intp) * count + near.col)
        met = np.isin(surface, np.empty(0) if facing is None else facing)
        deep, shallow = (_beneath(mesh.element, depth)[first[surface] % width] for depth in (FACING, BENEATH))
        beneath = np.where(met[:, None], deep, shallow)
        return Itself(mesh, surface, first[surface] // width, keys, mirrors, side, beneath, met)

    def require_apart(self) -> None:
        """Refuse a body that penetrates itself at rest, or has two surface nodes at one place."""
        x, tolerance = self.mesh.nodes[self.surface], PLANAR * self.mesh.size
        along = x @ GENERIC[: x.shape[1]]
        one, other = _within(along, along - tolerance, along + tolerance)
        same = (one < other) & (norm(x[one] - x[other]) <= tolerance) & ~(self.met[one] & self.met[other])
        same = np.flatnonzero(same)[:1]
        twice = self.surface[np.append(one[same], other[same])]
        parted = len({*self.mesh.part[twice].tolist()}) > 1
        contact = "let the boundaries that meet there be surface and candidates of a deformable tool"
        crack = "merge them, or open a crack between them, whose faces know no contact"
        what = f"different places on the surface: {contact if parted else crack}"
        require(not twice.size, "mesh.nodes", f"nodes {twice.tolist()} at one place", what)
        through = self.through(self.mesh.nodes)
        found = through and through.words
        require(found is None, "mesh", found, "a body no part of which is in another, or beyond a plane of symmetry")

    def through(self, nodes: Floats) -> Through | None:
        """What penetrates what at the positions ``nodes`` (a, d); None if nothing does."""
        for plane, beside in zip(self.mirrors, self.beside, strict=True):
            past = -beside * plane.side(nodes[self.surface])
            # Far from the origin places drift off the plane by their round-off, increment by increment.
            if past.max() > plane.roundoff + DRIFT * np.abs(nodes).max():
                node = self.surface[np.argmax(past)]
                words = f"node {node} is {past.max():.2g} past {plane.words}, in the body's own mirror image"
                return Through(words, int(node), None)
        x = (self.beneath[:, None] @ nodes[self.mesh.elements[self.own]])[:, 0]
        number, element = self._boxed(nodes, x)
        if not number.size:
            return None
        inside = _inside(self.mesh.element, nodes[self.mesh.elements[element]], x[number])
        if not inside.any():
            return None
        node, within = int(self.surface[number[np.argmax(inside)]]), int(element[np.argmax(inside)])
        return Through(f"node {node} is in element {within}", node, within)

    def _boxed(self, nodes: Floats, x: Floats) -> tuple[Ints, Ints]:
        """Which of the points x (s, d) are in the box of which element (p,), neighbours of their nodes excluded."""
        corners = nodes.take(self._by_corner, axis=0)
        low, high = corners.min(axis=0), corners.max(axis=0)
        # Pairs by the first axis come from sorted places; few are left to be tested along the others.
        element, number = _within(x[:, 0], low[:, 0], high[:, 0])
        for axis in range(x.shape[1]):
            seen = x[number, axis]
            boxed = (seen >= low[element, axis]) & (seen <= high[element, axis])
            number, element = number[boxed], element[boxed]
        key = number * len(self.mesh.elements) + element
        apart = self.near[np.searchsorted(self.near, key) % len(self.near)] != key
        return number[apart], element[apart]

    @cached_property
    def _by_corner(self) -> Ints:
        """The mesh's elements (k, e), node by node, so that minima over nodes are taken of whole vectors."""
        return np.ascontiguousarray(self.mesh.elements.T)


@cache
def _beneath(element: Element, depth: float) -> Floats:
    """Shape functions (k, k) at places at a ``depth`` as of :data:`BENEATH` beneath each node."""
    places = element.every_place
    return read_only(tabulated_at(element, places + depth * (element.places.mean(axis=0) - places)).values, np.float64)


def _within(values: Floats, low: Floats, high: Floats) -> tuple[Ints, Ints]:
    """All pairs (p,) of an interval, from ``low`` to ``high``, and a value in it, by their numbers.

    >>> [pair.tolist() for pair in _within(np.array([2.0, 1.0, 5.0]), np.array([0.0, 4.0]), np.array([3.0, 6.0]))]
    [[0, 0, 1], [1, 0, 2]]
    """
    order = np.argsort(values)
    first, last = np.searchsorted(values[order], low), np.searchsorted(values[order], high, side="right")
    counts = np.maximum(last - first, 0)
    interval = np.repeat(np.arange(len(counts)), counts)
    return interval, order[np.arange(len(interval)) - np.repeat(np.cumsum(counts) - counts - first, counts)]


def _inside(element: Element, corners: Floats, x: Floats) -> Bools:
    """Which of the points x (p, d) are inside elements whose nodes are at ``corners`` (p, k, d)."""
    middle = np.array(element.shape.corners).mean(axis=0)
    xi, across = np.tile(middle, (len(x), 1)), np.ptp(corners, axis=1).max(axis=1)
    off = np.zeros_like(x)
    for _ in range(STEPS):
        at = tabulated_at(element, xi)
        off = x - einsum("pk,pkd->pd", at.values, corners)
        slope = corners.transpose(0, 2, 1) @ at.gradients
        singular = np.abs(np.linalg.det(slope)) < 1e-300
        slope[singular] = np.eye(x.shape[1])
        # Clipped because a point far off the reference shape is not inside, and its iteration would diverge.
        xi = np.clip(xi + np.linalg.solve(slope, off[..., None])[..., 0], -1.0, 2.0)
    inner = np.concatenate([xi, 1 - (xi if element.shape.cube else xi.sum(axis=1, keepdims=True))], axis=1).min(axis=1)
    return (norm(off) < ROUND_OFF * across) & (inner > -ROUND_OFF)
