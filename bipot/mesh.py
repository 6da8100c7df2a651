"""Meshes with named boundaries: eight-node quadrilaterals on rectangles, made with scikit-fem.

A mesh is a frozen value. Nodes are (a, d), elements (e, 8) in the order *four corners, four mid-sides* (mid-side
``k`` lies between corners ``k`` and ``k + 1``), and a boundary is an array of edges (f, 3): end, middle, end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from bipot.errors import (
    LARGEST_LENGTH,
    require,
    require_count,
    require_magnitude,
    require_number,
    require_positive,
    require_type,
)
from bipot.facets import ON_EDGE, Facets, require_facets
from bipot.frozen import FrozenMap
from bipot.mesh_files import of_meshio, of_skfem
from bipot.typing import Floats, Ints, as_array, read_only

NODES = 8

Grading = tuple[float, float]
"""Size of the last element over that of the first along each axis; sizes grow by one factor from each to the next."""

UNIFORM = (1.0, 1.0)
SMALLEST = 1e-8

PLANE = "numbers of shape (nodes, 2): contact and orientation are known in a plane"
UNBOUNDED = ": eight-node quadrilaterals, the element whose orientation is bounded all over (fem/orientation.py)"

FARTHEST = 1e6
"""From the origin, over the body's size: what round-off of positions takes from shapes is then below 1e-9."""


@dataclass(frozen=True)
class Mesh:
    """Nodes (a, d), elements (e, 8) and named boundaries, each an array of edges (f, 3).

    All are read-only copies. Boundary edges may be given in the order of mesh files too (end, end, middle): which node
    is the middle the elements say.

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
        elements = _connectivity(self.elements, NODES, "mesh.elements", "element", len(nodes), UNBOUNDED)
        _require_elements(elements, len(nodes))
        object.__setattr__(self, "nodes", read_only(nodes, np.float64))
        object.__setattr__(self, "elements", read_only(elements, np.intp))
        require_facets(self._facets)
        _require_one_part(elements)
        boundaries = {name: self._ordered(name, edges) for name, edges in self.boundaries.items()}
        object.__setattr__(self, "boundaries", FrozenMap(boundaries))

    @classmethod
    def from_skfem(cls, mesh: Any) -> Mesh:
        """A MeshQuad2 of scikit-fem (its ninth node dropped) or a MeshQuad (straight), with its named boundaries.

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

        Cells are quadrilaterals of four (mid-sides are added), eight or nine nodes (the ninth is dropped). Boundaries
        are named sets of line cells; numbers of line cells in the cell data ``tag`` (by default physical groups of
        Gmsh), called as in ``names``, the file, or by the number; and node sets that are nodes of outer edges,
        none left over. Other sets are left out.

        Raises:
            SceneError: a file that is missing or not readable, meshio that is not installed; no quadrilaterals, cells
                of several kinds or of three dimensions; z coordinates that differ; nodes in another order; a
                boundary that is no edge of a cell; an unknown ``tag``, or a number that no line has.
        """
        return cls(*of_meshio(source, tag, names))

    @cached_property
    def _facets(self) -> Facets:
        return Facets.of(self.elements)

    def _ordered(self, name: str, edges: Ints) -> Ints:
        """The edges of a boundary as end, middle, end."""
        require_type(name, str, "mesh.boundaries, a name")
        label = f"mesh boundary {name!r}"
        edges = _connectivity(edges, ON_EDGE, label, "edge", len(self.nodes))
        found = self._facets.find(edges)
        lost = np.flatnonzero(found < 0)
        require(not lost.size, label, edges[lost[:1]].tolist(), "three nodes of one edge of an element")
        require(len(np.unique(found)) == len(found), label, "an edge twice", "edges that differ")
        middle = self._facets.nodes[found, 1]
        ends = edges[edges != middle[:, None]].reshape(-1, 2)
        return read_only(np.column_stack([ends[:, 0], middle, ends[:, 1]]), np.intp)

    def inner_edges(self, *names: str) -> Ints:
        """Edges (f, 3) of the named boundaries that lie between two elements: nothing outside can touch them."""
        edges = self.edges(*names)
        return edges[self._facets.shared[self._facets.find(edges)]]

    def surface(self, name: str) -> tuple[Ints, Ints]:
        """Edges (f, 3) of the boundary ``name``, run anticlockwise around their elements, and these (f,)."""
        found = self._facets.find(self.boundary(name))
        return self._facets.nodes[found], self._facets.owner[found]

    def boundary(self, name: str) -> Ints:
        """Edges (f, 3) of the boundary ``name``; raises SceneError naming the known ones."""
        require(name in self.boundaries, "boundary", name, f"one of {sorted(self.boundaries)}")
        return self.boundaries[name]

    def edges(self, *names: str) -> Ints:
        """Edges (f, 3) of the named boundaries, one after the other."""
        return np.concatenate([self.boundary(name) for name in names])

    def boundary_nodes(self, *names: str) -> Ints:
        """Sorted node numbers on the union of the named boundaries."""
        return np.unique(self.edges(*names))

    @cached_property
    def size(self) -> float:
        """Largest extent of the mesh along an axis: the body size that scales lengths."""
        return float(np.ptp(self.nodes, axis=0).max())


def cylinder(radius: float, height: float, n_r: int, n_z: int, grading: Grading = UNIFORM) -> Mesh:
    """Meridian half-section [0, radius] x [0, height] with boundaries axis, base, top, side; ``grading`` of r, z.

    >>> cylinder(5.0, 5.0, 2, 2).elements.shape
    (4, 8)
    """
    require_positive(radius=radius, height=height)
    return _rectangle((0.0, radius), (0.0, height), (n_r, n_z), grading, ("axis", "side", "base", "top"))


def block(width: float, height: float, n_x: int, n_y: int, grading: Grading = UNIFORM) -> Mesh:
    """Rectangle [0, width] x [0, height] with boundaries left, right, base, top; ``grading`` of x, y.

    >>> block(7.0, 1.0, 3, 1, grading=(4.0, 1.0)).boundary("base")[:, 1].size
    3
    """
    require_positive(width=width, height=height)
    return _rectangle((0.0, width), (0.0, height), (n_x, n_y), grading, ("left", "right", "base", "top"))


def ring(inner: float, outer: float, height: float, n_r: int, n_z: int, grading: Grading = UNIFORM) -> Mesh:
    """Meridian section [inner, outer] x [0, height] with boundaries bore, side, base, top; ``grading`` of r, z."""
    require_positive(inner=inner, height=height)
    require_number(outer, "outer")
    require(inner < outer < np.inf, "outer", outer, f"finite and > inner = {inner}")
    return _rectangle((inner, outer), (0.0, height), (n_r, n_z), grading, ("bore", "side", "base", "top"))


def _rectangle(
    x: tuple[float, float],
    y: tuple[float, float],
    counts: tuple[int, int],
    grading: Grading,
    names: tuple[str, str, str, str],
) -> Mesh:
    """Tensor mesh of Q8; ``names`` are those of the sides x0, x1, y0, y1."""
    for count, axis in zip(counts, ("first", "second"), strict=True):
        require_count(count, f"elements along the {axis} axis")
    require(isinstance(grading, tuple | list) and len(grading) == 2, "grading", grading, "a pair, one for each axis")
    along = [_graded(*side, n, ratio) for side, n, ratio in zip((x, y), counts, grading, strict=True)]
    # scikit-fem takes long to import, and a mesh given by its arrays needs none of it.
    import skfem

    quads = skfem.MeshQuad.init_tensor(*along)
    corners, ends = quads.p.T, quads.facets.T
    middle = corners[ends].mean(axis=1)
    # scikit-fem numbers a tensor mesh's quads clockwise: reversed, the first reference axis is the first of space.
    elements = np.hstack([quads.t.T[:, [0, 3, 2, 1]], len(corners) + quads.t2f.T[:, ::-1]])
    edges = np.insert(ends, 1, len(corners) + np.arange(len(ends)), axis=1)
    sides = zip(names, (0, 0, 1, 1), (*x, *y), strict=True)
    boundaries = {name: edges[middle[:, axis] == at] for name, axis, at in sides}
    return Mesh(np.vstack([corners, middle]), elements.astype(np.intp), boundaries)


def _graded(start: float, end: float, count: int, ratio: float) -> Floats:
    """Ends (count + 1,) of elements whose sizes grow by one factor, the last ``ratio`` times the first."""
    require_positive(grading=ratio)
    ends = np.linspace(start, end, count + 1)
    if ratio != 1 and count > 1:
        # Of the largest size, so that no ratio is too large for a number.
        sizes = float(ratio) ** (np.arange(count) / (count - 1) - (ratio > 1))
        ends[1:-1] = start + (end - start) * np.cumsum(sizes / sizes.sum())[:-1]
        apart = bool((np.diff(ends) > SMALLEST * (end - start)).all())
        require(apart, "grading", ratio, f"such that no element is smaller than {SMALLEST:g} of the side")
    return ends


def _require_near(nodes: Floats) -> None:
    """Positions far from the origin lose shapes and displacements to their round-off."""
    if not len(nodes):
        return
    far, size = float(np.abs(nodes).max()), float(np.ptp(nodes, axis=0).max())
    require_magnitude(size, "mesh.size", LARGEST_LENGTH)
    allowed = f"within {FARTHEST:g} times the body's size {size:.3g} of the origin"
    require(far <= FARTHEST * size, "mesh.nodes", f"coordinates to {far:.3g}", allowed)


def _connectivity(given: object, width: int, field: str, what: str, count: int, why: str = "") -> Ints:
    """Node numbers (n, ``width``) as intp, checked to be whole and in [0, count)."""
    array = as_array(given, field)
    require(array.size > 0, field, "empty", f"at least one {what}")
    require(array.dtype.kind in "iu", f"{field} node index", f"of type {array.dtype}", "a whole number")
    require(array.ndim == 2 and array.shape[1] == width, field, f"shape {array.shape}", f"of shape (n, {width})" + why)
    outside = array[(array < 0) | (array >= count)]
    require(not outside.size, f"{field} node index", outside[:1].tolist(), f"in [0, {count})")
    return array.astype(np.intp)


def _require_elements(elements: Ints, count: int) -> None:
    """Every element is there once and has eight different nodes; every node belongs to one."""
    ordered = np.sort(elements, axis=1)
    twice = np.flatnonzero((np.diff(ordered, axis=1) == 0).any(axis=1))
    require(not twice.size, "mesh.elements", f"element {twice[:1].tolist()}", "of eight different nodes")
    _, first = np.unique(ordered, axis=0, return_index=True)
    again = np.setdiff1d(np.arange(len(elements)), first)
    require(not again.size, "mesh.elements", f"element {again[:1].tolist()}", "there once, not a copy of another")
    orphans = np.setdiff1d(np.arange(count), elements)
    require(not orphans.size, "mesh.nodes", f"node {orphans[:1].tolist()}", "a node of an element: leave others out")


def _require_one_part(elements: Ints) -> None:
    """Edges lead from the first element to every other: parts that touch in a corner, or not at all, move alone."""
    # Only the making of a mesh asks for it: what merely imports the library need not load it.
    from scipy.sparse.csgraph import connected_components

    middle = elements[:, 4:]
    owner = np.repeat(np.arange(len(elements)), 4)
    links = sp.coo_array((np.ones(owner.size), (owner, middle.ravel())), shape=(len(elements), int(middle.max()) + 1))
    _, part = connected_components(links @ links.T, directed=False)
    apart = np.flatnonzero(part != part[0])[:1]
    lonely = f"one body: element {apart.max(initial=0)} shares no edge with those that hang together with element 0"
    require(not apart.size, "mesh.elements", "in parts", lonely)
