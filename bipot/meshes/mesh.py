"""Meshes of one kind of element with named boundaries and regions. :mod:`bipot.meshes.sections` and
:mod:`bipot.meshes.solids` make those of simple shapes.

A mesh is a frozen value. Nodes are (a, d), elements (e, k) in the order *corners, mid-sides, centre* of
:class:`~bipot.meshes.elements.Element`, and a boundary is an array of its facets (f, n): in a plane edges as end,
middle, end, or end, end; in space faces with their nodes in the order of plane elements. A region is an array of the
numbers (n,) of its elements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_magnitude, require_type
from bipot.meshes.cells import MeshParts, converted
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.facets import Facets, boundaries_of, parts_of, require_elements, require_facets
from bipot.meshes.files import of_meshio, of_skfem, to_meshio
from bipot.meshes.groups import Numbers
from bipot.meshes.regions import marks_of, regions_of
from bipot.typing import Bools, EqualByNumbers, Floats, FrozenMap, Ints, as_array, max_abs, read_only

PLACES = "numbers of shape (nodes, 2) in a plane, (nodes, 3) in space"

FARTHEST = 1e6
"""Largest distance from the origin over the body's size: errors of shapes by round-off of positions are then below
1e-9."""


@dataclass(frozen=True, eq=False)
class Mesh(EqualByNumbers):
    """Nodes (a, d), elements (e, k), all of one kind, and named boundaries, each an array of facets (f, n).

    All are read-only copies; meshes are equal where all these are. The number of nodes of an element tells its kind.
    Nodes of a facet may be given in any order, such as that of mesh files (end, end, middle), since the elements
    determine it. Edges keep their direction, faces are as seen from outside their element.

    Named ``regions``, as of one material each, are element numbers (n,) in [0, e), kept in ascending order, or
    booleans (e,) that mark the elements. They may overlap, and need not cover the mesh.

    Raises:
        SceneError: a coordinate that is not finite, or lost in round-off because the body is far from the origin; an
            index that is no whole number or outside the node list; an element twice, or with a node twice; a node of
            no element; a mid-side node on two different edges; a facet of more than two elements, or of two on the
            same side; a boundary that is empty, holds a facet twice, or one that is no facet
            of an element; a region that is empty, holds an element twice, or one that is not there.

    >>> Mesh([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)], regions={"core": [0]})
    Mesh(2 T3 elements, 4 nodes; boundaries none; regions core)
    """

    nodes: Floats
    elements: Ints
    boundaries: Mapping[str, Ints] = field(default_factory=dict)
    regions: Mapping[str, Ints] = field(default_factory=dict)

    def __post_init__(self) -> None:
        nodes = as_array(self.nodes, "mesh.nodes")
        numeric = nodes.ndim == 2 and nodes.shape[1] in (2, 3) and nodes.dtype.kind in "fiu"
        require(numeric, "mesh.nodes", f"array {nodes.shape} of {nodes.dtype}", PLACES)
        require(bool(np.isfinite(nodes).all()), "mesh.nodes", "NaN or infinite", "finite")
        require_type(self.boundaries, Mapping, "mesh.boundaries")
        kinds = {element.nodes: element.name for element in elements_of(nodes.shape[1])}
        elements = _connectivity(self.elements, kinds, "mesh.elements", "element", len(nodes))
        require_elements(elements, len(nodes))
        far, size = max_abs(nodes), float(np.ptp(nodes, axis=0).max())
        require_magnitude(size, "mesh.size", LARGEST_LENGTH)
        # Farther from the origin shapes and displacements are lost in round-off.
        allowed = f"within {FARTHEST:g} times the body's size {size:.3g} of the origin"
        require(far <= FARTHEST * size, "mesh.nodes", f"coordinates to {far:.3g}", allowed)
        object.__setattr__(self, "nodes", read_only(nodes, np.float64))
        object.__setattr__(self, "elements", read_only(elements, np.intp))
        require_facets(self._facets, self.elements)
        given = {name: self._given(name, facets) for name, facets in self.boundaries.items()}
        object.__setattr__(self, "boundaries", FrozenMap(boundaries_of(self._facets, given)))
        object.__setattr__(self, "regions", regions_of(self.regions, len(elements)))

    def __repr__(self) -> str:
        """What it consists of, without its arrays.

        >>> from bipot.meshes.sections import block
        >>> block(1.0, 1.0, 2, 2)
        Mesh(4 Q4 elements, 9 nodes; boundaries base, left, right, top)
        """
        counts = f"{len(self.elements)} {self.element.name} elements, {len(self.nodes)} nodes"
        regions = f"; regions {', '.join(sorted(self.regions))}" if self.regions else ""
        return f"Mesh({counts}; boundaries {', '.join(sorted(self.boundaries)) or 'none'}{regions})"

    @classmethod
    def from_skfem(cls, mesh: Any) -> Mesh:
        """A mesh of scikit-fem, of triangles, quadrilaterals, tetrahedra or hexahedra, with boundaries and subdomains.

        Kinds are those of :class:`~bipot.meshes.elements.Element`: MeshTri, MeshTri2, MeshQuad, MeshQuad2, MeshTet,
        MeshTet2 and MeshHex. Its subdomains are regions.

        Raises:
            SceneError: another kind of mesh; a mid-side node that is not between its corners.

        >>> import skfem
        >>> sorted(Mesh.from_skfem(skfem.MeshQuad().refined(1).with_defaults()).boundaries)
        ['bottom', 'left', 'right', 'top']
        """
        return cls(*of_skfem(mesh))

    @classmethod
    def from_meshio(cls, source: Any, *, tag: str | None = None, names: Numbers | None = None) -> Mesh:
        """The mesh of a file that meshio reads (Gmsh, Abaqus, VTK and others), given by its path, or a mesh of meshio.

        Cells are of one kind, which is kept (:meth:`to` converts them): tetrahedra or hexahedra where there are any,
        else triangles or quadrilaterals. Boundaries consist of the lines or faces that bound them. They are named sets
        of these cells; numbers of them in the cell data ``tag`` (by default physical groups of Gmsh), named as in
        ``names``, as in the file, or by the number; and node sets that consist of exactly the nodes of outer facets.
        Regions are sets and numbers of the body's own cells, by the same rules. The number 0 is none. Other sets are
        ignored.

        With ``names`` only these numbers are taken. Where lines or faces and cells of the body have the same number, it
        is that of a boundary; a pair (number, dimension) says of which cells it is, as Gmsh does: {"core": (1, 2)}.

        Raises:
            SceneError: a file that is missing or not readable, meshio that is not installed; no such cells, or of
                several kinds; z coordinates of a plane that differ; nodes in another order; a boundary that bounds no
                cell; an unknown ``tag``, or a number that no line, face or cell has.
        """
        return cls(*of_meshio(source, tag, names))

    def to_meshio(self) -> Any:
        """The mesh as one of meshio, whose ``write`` makes files of it that :meth:`from_meshio` reads.

        Boundaries are cells of lines or faces, numbered from 1 in the order of their names here (files of VTK and XDMF
        keep the numbers only), and sets of nodes. If all nodes of the body, or of a boundary, are on other boundaries
        too, there is one more node, of no cell, because Gmsh's files need a node of each.

        Regions are sets of cells (which Abaqus' files keep), numbered on after the boundaries. A cell has one number:
        regions that share one with an earlier region, or the name with a boundary, are sets only. Where elements that
        follow each other differ in number, a new block of cells begins.

        Raises:
            SceneError: meshio is not installed.
        """
        return to_meshio(self._parts)

    def to(self, element: Element) -> Mesh:
        """The mesh in other elements of the same shape, with mid-sides and centres added or dropped.

        Without mid-sides edges are straight.

        Raises:
            SceneError: the elements are of another shape.

        >>> from bipot.meshes.sections import block
        >>> block(1.0, 1.0, 2, 2).to(Element.Q4).nodes.shape
        (9, 2)
        """
        require_type(element, Element, "element")
        return Mesh(*converted(self._parts, element))

    @property
    def element(self) -> Element:
        """The kind of its elements."""
        return self._parts.element

    @property
    def dimension(self) -> int:
        """Number d of coordinates: 2 in a plane, 3 in space."""
        return self.nodes.shape[1]

    @property
    def _parts(self) -> MeshParts:
        return MeshParts(self.nodes, self.elements, self.boundaries, self.regions)

    @cached_property
    def connected(self) -> Ints:
        """The number (e,) of the part to which each element belongs: elements hang together by common facets."""
        return parts_of(self._facets)

    @cached_property
    def part(self) -> Ints:
        """The number (a,) of the part to which each node belongs."""
        out = np.zeros(len(self.nodes), np.intp)
        out[self.elements] = self.connected[:, None]
        return read_only(out, np.intp)

    @cached_property
    def _facets(self) -> Facets:
        return Facets.of(self.elements, self.element)

    @cached_property
    def _facet_numbers(self) -> dict[str, Ints]:
        """Boundary -> numbers (f,) of its facets."""
        return self._facets.find_each(self.boundaries)

    def _found(self, *names: str) -> Ints:
        """Numbers (f,) of the :meth:`edges` of the named boundaries."""
        self.edges(*names)  # refuses names that are none
        return np.concatenate([self._facet_numbers[name] for name in names])

    def _given(self, name: str, facets: object) -> Ints:
        """The facets of a boundary as node numbers."""
        require_type(name, str, "mesh.boundaries, a name")
        widths = {self._facets.nodes.shape[1]: f"{self._facets.one} of {self.element.name}"}
        return _connectivity(facets, widths, f"mesh boundary {name!r}", self._facets.what, len(self.nodes))

    def require_outer(self, field: str, *names: str) -> None:
        """Refuse named boundaries, those of a ``field``, with a facet between two elements, or one that two have.

        Nothing outside of the body can touch what lies between two elements.
        """
        edges, found, what = self.edges(*names), self._found(*names), self._facets.what
        inner = edges[self._facets.shared[found]][:1].tolist()
        require(not inner, field, names, f"{what}s of one element each; {inner} lies between two")
        require(len(np.unique(found)) == len(found), field, names, f"boundaries without a common {what}")

    @cached_property
    def outline(self) -> Ints:
        """Facets (f, n) of one element each, run anticlockwise around it: the body's whole surface."""
        return self._facets.nodes[~self._facets.shared]

    @cached_property
    def interfaces(self) -> Ints:
        """Facets (f, n) between elements that are not in the same regions, each once."""
        marks, facets = marks_of(self.regions, len(self.elements)), self._facets
        apart = (marks[:, :, None] != marks[:, facets.owner[facets.number]]).any(axis=0)
        return facets.nodes[np.unique(facets.number[apart])]

    @cached_property
    def shared(self) -> Bools:
        """Whether facets (e, m) of elements are another's, too, in the order of :attr:`Element.facets`."""
        return self._facets.shared[self._facets.number]

    def surface(self, name: str) -> tuple[Ints, Ints]:
        """Facets (f, n) of the boundary ``name``, which run anticlockwise around their elements, and these (f,)."""
        found = self._found(name)
        return self._facets.nodes[found], self._facets.owner[found]

    def around(self, *names: str) -> Ints:
        """Facets (f, n) of the named boundaries, which run anticlockwise around their elements, in sequence."""
        return np.concatenate([self.surface(name)[0] for name in names])

    def boundary(self, name: str, field: str = "boundary") -> Ints:
        """Facets (f, n) of the boundary ``name``; raises SceneError naming its ``field`` and the known ones."""
        require_type(name, str, field)
        none = "the mesh, which has none: name edges of it (in space faces)"
        require(name in self.boundaries, field, name, f"one of {sorted(self.boundaries) or none}")
        return self.boundaries[name]

    def region(self, name: str, field: str = "region") -> Ints:
        """Element numbers (n,) of the region ``name``; raises SceneError naming its ``field`` and the known ones."""
        require_type(name, str, field)
        none = "the mesh, which has none: name elements of it"
        require(name in self.regions, field, name, f"one of {sorted(self.regions) or none}")
        return self.regions[name]

    def edges(self, *names: str) -> Ints:
        """Facets (f, n) of the named boundaries, of which there is at least one, in sequence."""
        require(len(names) > 0, "boundaries", names, "at least one name")
        return np.concatenate([self.boundary(name) for name in names])

    def owners(self, *names: str) -> Ints:
        """The elements (f,) of the :meth:`edges` of the named boundaries; of two the first."""
        return self._facets.owner[self._found(*names)]

    def boundary_nodes(self, *names: str) -> Ints:
        """Sorted node numbers on the union of the named boundaries."""
        for name in names:
            require_type(name, str, "boundary")
        if names not in self._on_boundaries:
            self._on_boundaries[names] = read_only(np.unique(self.edges(*names)), np.intp)
        return self._on_boundaries[names]

    @cached_property
    def _on_boundaries(self) -> dict[tuple[str, ...], Ints]:
        """Cache of :meth:`boundary_nodes` by names: every increment needs those of its tools."""
        return {}

    @cached_property
    def size(self) -> float:
        """Largest extent of the mesh along an axis: the body size that scales lengths."""
        return float(np.ptp(self.nodes, axis=0).max())


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
