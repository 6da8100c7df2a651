"""Meshes of one kind of plane element with named boundaries, and those of rectangles.

A mesh is a frozen value. Nodes are (a, d), elements (e, k) in the order *corners, mid-sides, centre* of
:class:`~bipot.elements.Element`, and a boundary is an array of edges (f, n): end, middle, end, or end, end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from bipot.cells import Parts, converted
from bipot.elements import Element
from bipot.errors import (
    LARGEST_LENGTH,
    require,
    require_magnitude,
    require_number,
    require_positive,
    require_type,
)
from bipot.facets import Facets, require_facets, require_one_part
from bipot.frozen import FrozenMap
from bipot.layout import Layout, rectangle
from bipot.mesh_files import of_meshio, of_skfem, to_meshio
from bipot.typing import Floats, Ints, as_array, read_only

Grading = tuple[float, float]
"""Size of the last element over that of the first along each axis; sizes grow by one factor from each to the next."""

UNIFORM = (1.0, 1.0)

PLANE = "numbers of shape (nodes, 2): contact and orientation are known in a plane"
KINDS = {element.nodes: element.name for element in Element}
"""Elements by how many nodes they have."""

FARTHEST = 1e6
"""From the origin, over the body's size: what round-off of positions takes from shapes is then below 1e-9."""


@dataclass(frozen=True)
class Mesh:
    """Nodes (a, d), elements (e, k), all of one kind, and named boundaries, each an array of edges (f, n).

    All are read-only copies. How many nodes an element has tells its kind. Three nodes of an edge may be given in the
    order of mesh files too (end, end, middle): which is the middle the elements say.

    Raises:
        SceneError: a coordinate that is not finite, or lost in round-off because the body is far from the origin; an
            index that is no whole number or outside the node list; an element twice, or with a node twice; a node of
            no element; a mid-side node on two different edges; an edge of more than two elements, or of two on the
            same side; parts that share no edge; a boundary that is empty, holds an edge twice, or one that is no edge
            of an element.
    """

    nodes: Floats
    elements: Ints
    boundaries: Mapping[str, Ints] = field(default_factory=dict)

    def __post_init__(self) -> None:
        nodes = as_array(self.nodes, "mesh.nodes")
        numeric = nodes.ndim == 2 and nodes.shape[1] == 2 and nodes.dtype.kind in "fiu"
        require(numeric, "mesh.nodes", f"array {nodes.shape} of {nodes.dtype}", PLANE)
        require(bool(np.isfinite(nodes).all()), "mesh.nodes", "NaN or infinite", "finite")
        _require_near(nodes)
        require_type(self.boundaries, Mapping, "mesh.boundaries")
        elements = _connectivity(self.elements, KINDS, "mesh.elements", "element", len(nodes))
        _require_elements(elements, len(nodes))
        object.__setattr__(self, "nodes", read_only(nodes, np.float64))
        object.__setattr__(self, "elements", read_only(elements, np.intp))
        require_facets(self._facets)
        require_one_part(self._facets)
        boundaries = {name: self._ordered(name, edges) for name, edges in self.boundaries.items()}
        object.__setattr__(self, "boundaries", FrozenMap(boundaries))

    @classmethod
    def from_skfem(cls, mesh: Any) -> Mesh:
        """A MeshTri, MeshTri2, MeshQuad or MeshQuad2 of scikit-fem (T3, T6, Q4, Q9) with its named boundaries.

        Raises:
            SceneError: another kind of mesh; a mid-side node that is not between its corners.

        >>> import skfem
        >>> sorted(Mesh.from_skfem(skfem.MeshQuad().refined(1).with_defaults()).boundaries)
        ['bottom', 'left', 'right', 'top']
        """
        return cls(*of_skfem(mesh))

    @classmethod
    def from_meshio(cls, source: Any, *, tag: str | None = None, names: Mapping[str, int] | None = None) -> Mesh:
        """A mesh file (Gmsh, Abaqus, VTK and what else meshio reads), given by its path, or a mesh of meshio.

        Cells are triangles or quadrilaterals of one kind, and stay what they are (:meth:`to` makes others). Boundaries
        are named sets of line cells; numbers of line cells in the cell data ``tag`` (by default physical groups of
        Gmsh), called as in ``names``, the file, or by the number; and node sets that are nodes of outer edges,
        none left over. Other sets are left out.

        Raises:
            SceneError: a file that is missing or not readable, meshio that is not installed; no cells of the plane,
                cells of several kinds or of three dimensions; z coordinates that differ; nodes in another order; a
                boundary that is no edge of a cell; an unknown ``tag``, or a number that no line has.
        """
        return cls(*of_meshio(source, tag, names))

    def to_meshio(self) -> Any:
        """The mesh as one of meshio, whose ``write`` makes files of it that :meth:`from_meshio` reads.

        Boundaries are line cells, numbered from 1 in the order of their names here (``names`` of VTK files, which keep
        numbers alone), and sets of nodes.

        Raises:
            SceneError: meshio is not installed.
        """
        return to_meshio(self._parts)

    def to(self, element: Element) -> Mesh:
        """The mesh in other elements of the same shape: mid-sides and centres added where asked for, or dropped.

        Without mid-sides edges are straight.

        Raises:
            SceneError: triangles are asked for quadrilaterals, or quadrilaterals for triangles.

        >>> block(1.0, 1.0, 2, 2).to(Element.Q4).nodes.shape
        (9, 2)
        """
        require_type(element, Element, "element")
        return Mesh(*converted(self._parts, element))

    @property
    def element(self) -> Element:
        """What its elements are."""
        return Element.of(self.elements.shape[1])

    @property
    def _parts(self) -> Parts:
        return Parts(self.nodes, self.elements, self.boundaries)

    @cached_property
    def _facets(self) -> Facets:
        return Facets.of(self.elements)

    def _ordered(self, name: str, edges: Ints) -> Ints:
        """The edges of a boundary as end, middle, end, or end, end."""
        require_type(name, str, "mesh.boundaries, a name")
        label = f"mesh boundary {name!r}"
        width = self._facets.nodes.shape[1]
        edges = _connectivity(edges, {width: f"an edge of {self.element.name}"}, label, "edge", len(self.nodes))
        found = self._facets.find(edges)
        lost = np.flatnonzero(found < 0)
        require(not lost.size, label, edges[lost[:1]].tolist(), "the nodes of one edge of an element")
        require(len(np.unique(found)) == len(found), label, "an edge twice", "edges that differ")
        middle = self._facets.nodes[found, 1:-1]
        ends = edges[(edges[:, :, None] != middle[:, None]).all(axis=2)].reshape(-1, 2)
        return read_only(np.insert(ends, 1, middle.T, axis=1), np.intp)

    def inner_edges(self, *names: str) -> Ints:
        """Edges (f, n) of the named boundaries that lie between two elements: nothing outside can touch them."""
        edges = self.edges(*names)
        return edges[self._facets.shared[self._facets.find(edges)]]

    @cached_property
    def outline(self) -> Ints:
        """Edges (f, n) of one element each, run anticlockwise around it: the body's whole surface."""
        return self._facets.nodes[~self._facets.shared]

    def surface(self, name: str) -> tuple[Ints, Ints]:
        """Edges (f, n) of the boundary ``name``, run anticlockwise around their elements, and these (f,)."""
        found = self._facets.find(self.boundary(name))
        return self._facets.nodes[found], self._facets.owner[found]

    def boundary(self, name: str) -> Ints:
        """Edges (f, n) of the boundary ``name``; raises SceneError naming the known ones."""
        require(name in self.boundaries, "boundary", name, f"one of {sorted(self.boundaries)}")
        return self.boundaries[name]

    def edges(self, *names: str) -> Ints:
        """Edges (f, n) of the named boundaries, one after the other."""
        return np.concatenate([self.boundary(name) for name in names])

    def owners(self, *names: str) -> Ints:
        """The elements (f,) that have the :meth:`edges` of the named boundaries, the first one of two."""
        return self._facets.owner[self._facets.find(self.edges(*names))]

    def boundary_nodes(self, *names: str) -> Ints:
        """Sorted node numbers on the union of the named boundaries."""
        return np.unique(self.edges(*names))

    @cached_property
    def size(self) -> float:
        """Largest extent of the mesh along an axis: the body size that scales lengths."""
        return float(np.ptp(self.nodes, axis=0).max())


def cylinder(
    radius: float,
    height: float,
    n_r: int,
    n_z: int,
    grading: Grading = UNIFORM,
    element: Element = Element.Q4,
    layout: Layout = Layout.TENSOR,
) -> Mesh:
    """Meridian half-section [0, radius] x [0, height] with boundaries axis, base, top, side; ``grading`` of r, z.

    ``layout`` says how elements meet in the corner of top and side (:class:`~bipot.layout.Layout`).

    >>> cylinder(5.0, 5.0, 2, 2).elements.shape
    (4, 4)
    """
    require_positive(radius=radius, height=height)
    return Mesh(
        *rectangle((0.0, radius), (0.0, height), (n_r, n_z), grading, ("axis", "side", "base", "top"), element, layout)
    )


def block(
    width: float,
    height: float,
    n_x: int,
    n_y: int,
    grading: Grading = UNIFORM,
    element: Element = Element.Q4,
    layout: Layout = Layout.TENSOR,
) -> Mesh:
    """Rectangle [0, width] x [0, height] with boundaries left, right, base, top; ``grading`` of x, y.

    ``layout`` says how elements meet in the corner of top and right (:class:`~bipot.layout.Layout`). Of triangles two
    make a quadrilateral, halved along diagonals that alternate like the squares of a chessboard.

    >>> block(7.0, 1.0, 3, 1, grading=(4.0, 1.0)).boundary("base")[:, 1].size
    3
    >>> block(7.0, 1.0, 3, 1, element=Element.T6).elements.shape
    (6, 6)
    """
    require_positive(width=width, height=height)
    return Mesh(
        *rectangle((0.0, width), (0.0, height), (n_x, n_y), grading, ("left", "right", "base", "top"), element, layout)
    )


def ring(
    inner: float,
    outer: float,
    height: float,
    n_r: int,
    n_z: int,
    grading: Grading = UNIFORM,
    element: Element = Element.Q4,
    layout: Layout = Layout.TENSOR,
) -> Mesh:
    """Meridian section [inner, outer] x [0, height] with boundaries bore, side, base, top; ``grading`` of r, z.

    ``layout`` says how elements meet in the corner of top and side (:class:`~bipot.layout.Layout`).
    """
    require_positive(inner=inner, height=height)
    require_number(outer, "outer")
    require(inner < outer < np.inf, "outer", outer, f"finite and > inner = {inner}")
    return Mesh(
        *rectangle((inner, outer), (0.0, height), (n_r, n_z), grading, ("bore", "side", "base", "top"), element, layout)
    )


def _require_near(nodes: Floats) -> None:
    """Positions far from the origin lose shapes and displacements to their round-off."""
    if not len(nodes):
        return
    far, size = float(np.abs(nodes).max()), float(np.ptp(nodes, axis=0).max())
    require_magnitude(size, "mesh.size", LARGEST_LENGTH)
    allowed = f"within {FARTHEST:g} times the body's size {size:.3g} of the origin"
    require(far <= FARTHEST * size, "mesh.nodes", f"coordinates to {far:.3g}", allowed)


def _connectivity(given: object, widths: Mapping[int, str], field: str, what: str, count: int) -> Ints:
    """Node numbers (n, one of the ``widths``) as intp, checked to be whole and in [0, count)."""
    array = as_array(given, field)
    require(array.size > 0, field, "empty", f"at least one {what}")
    require(array.dtype.kind in "iu", f"{field} node index", f"of type {array.dtype}", "a whole number")
    allowed = "of shape " + ", ".join(f"(n, {width}): {name}" for width, name in widths.items())
    require(array.ndim == 2 and array.shape[1] in widths, field, f"shape {array.shape}", allowed)
    outside = array[(array < 0) | (array >= count)]
    require(not outside.size, f"{field} node index", outside[:1].tolist(), f"in [0, {count})")
    return array.astype(np.intp)


def _require_elements(elements: Ints, count: int) -> None:
    """Every element is there once and has different nodes; every node belongs to one."""
    ordered = np.sort(elements, axis=1)
    twice = np.flatnonzero((np.diff(ordered, axis=1) == 0).any(axis=1))
    require(not twice.size, "mesh.elements", f"element {twice[:1].tolist()}", f"of {elements.shape[1]} different nodes")
    _, first = np.unique(ordered, axis=0, return_index=True)
    again = np.setdiff1d(np.arange(len(elements)), first)
    require(not again.size, "mesh.elements", f"element {again[:1].tolist()}", "there once, not a copy of another")
    orphans = np.setdiff1d(np.arange(count), elements)
    require(not orphans.size, "mesh.nodes", f"node {orphans[:1].tolist()}", "a node of an element: leave others out")
