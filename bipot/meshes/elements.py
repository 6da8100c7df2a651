"""The elements of which a mesh may consist, in a plane and in space, in one table.

Nodes are numbered as in VTK, meshio and Abaqus: the corners, then the mid-sides, edge by edge, then the centre.
The corners of a plane element run anticlockwise, and mid-side ``k`` lies between corners ``k`` and ``k + 1``. The
corners of a brick run around its base, then around its top, and so do its mid-sides, with those of the upright edges
last. The number of nodes and the dimension identify the element.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cache, cached_property

import numpy as np

from bipot.typing import Floats, Ints

Numbers = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Shape:
    """Corners of a reference shape in [0, 1]^d; ``edges``, and in space ``faces``, by the numbers of their corners.

    Faces run anticlockwise as seen from outside. A ``cube`` has quadrilateral faces, other shapes triangles.
    """

    corners: Numbers
    edges: Numbers
    faces: Numbers
    cube: bool


TRIANGLE = Shape(((0, 0), (1, 0), (0, 1)), ((0, 1), (1, 2), (2, 0)), (), False)
SQUARE = Shape(((0, 0), (1, 0), (1, 1), (0, 1)), ((0, 1), (1, 2), (2, 3), (3, 0)), (), True)
TETRAHEDRON = Shape(
    ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    False,
)
CUBE = Shape(
    ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
    ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    True,
)


class Element(Enum):
    """Triangles and tetrahedra (T), quadrilaterals (Q) and hexahedra (H) by their number of nodes."""

    T3 = "t3", TRIANGLE, 3, "ElementTriP1", "triangle", 5
    T6 = "t6", TRIANGLE, 6, "ElementTriP2", "triangle6", 22
    Q4 = "q4", SQUARE, 4, "ElementQuad1", "quad", 9
    Q8 = "q8", SQUARE, 8, "ElementQuadS2", "quad8", 23
    Q9 = "q9", SQUARE, 9, "ElementQuad2", "quad9", 28
    T4 = "t4", TETRAHEDRON, 4, "ElementTetP1", "tetra", 10
    T10 = "t10", TETRAHEDRON, 10, "ElementTetP2", "tetra10", 24
    H8 = "h8", CUBE, 8, "ElementHex1", "hexahedron", 12
    H20 = "h20", CUBE, 20, "ElementHexS2", "hexahedron20", 25

    shape: Shape
    nodes: int
    shapes: str
    """The element's name in scikit-fem."""
    cell: str
    """Its name in meshio."""
    vtk: int
    """Its number in VTK."""

    def __new__(cls, value: str, shape: Shape, nodes: int, shapes: str, cell: str, vtk: int) -> Element:
        """A member by its short name, with the columns of the table."""
        member = object.__new__(cls)
        member._value_ = value
        member.shape, member.nodes, member.shapes, member.cell, member.vtk = shape, nodes, shapes, cell, vtk
        return member

    @staticmethod
    def of(nodes: int, dimension: int = 2) -> Element:
        """The element with so many nodes in a plane or in space.

        >>> Element.of(6).name, Element.of(8, 3).name
        ('T6', 'H8')
        """
        return next(element for element in elements_of(dimension) if element.nodes == nodes)

    @property
    def dimension(self) -> int:
        """Number d of coordinates of a node."""
        return len(self.shape.corners[0])

    @property
    def corners(self) -> int:
        """Number of corners."""
        return len(self.shape.corners)

    @property
    def quadratic(self) -> bool:
        """Whether edges have a middle node."""
        return self.nodes > self.corners

    @property
    def centred(self) -> bool:
        """Whether there is a node inside."""
        return self.nodes > self.corners + len(self.shape.edges)

    @cached_property
    def edges(self) -> Ints:
        """Nodes of the edges (n, 2) or (n, 3), end (middle) end; in a plane run anticlockwise.

        >>> Element.T6.edges.tolist()
        [[0, 3, 1], [1, 4, 2], [2, 5, 0]]
        """
        ends = np.array(self.shape.edges)
        middle = self.corners + np.arange(len(ends))
        return np.insert(ends, 1, middle, axis=1) if self.quadratic else ends

    @cached_property
    def facets(self) -> Ints:
        """Nodes (n, m) of the facets: edges in a plane, faces in space, as plane elements.

        >>> Element.H20.facets[1].tolist()
        [4, 5, 6, 7, 12, 13, 14, 15]
        """
        if self.dimension == 2:
            return self.edges
        faces = np.array(self.shape.faces)
        if not self.quadratic:
            return faces
        number = {frozenset(ends): self.corners + k for k, ends in enumerate(self.shape.edges)}
        middle = [[number[frozenset(side)] for side in zip(f, np.roll(f, -1), strict=True)] for f in faces.tolist()]
        return np.hstack([faces, middle])

    @cached_property
    def opposite(self) -> Ints | None:
        """Numbers (d, 2) of the facets of a square or cube across each axis, the lower first; None for other shapes.

        >>> Element.H8.opposite.tolist()
        [[5, 3], [2, 4], [0, 1]]
        """
        if not self.shape.cube:
            return None
        middle = self.places[np.array(self.shape.faces or self.shape.edges)].mean(axis=1)
        return np.array([[int(np.argmin(way)), int(np.argmax(way))] for way in middle.T])

    @cached_property
    def ends(self) -> Ints:
        """The columns of :attr:`facets` that are corners: the ends of an edge, or the corners of a face."""
        return np.flatnonzero((self.facets < self.corners).all(axis=0))

    @property
    def facet(self) -> str:
        """The name of its facets in meshio."""
        if self.dimension == 2:
            return "line3" if self.quadratic else "line"
        return Element.of(self.facets.shape[1]).cell

    @cached_property
    def places(self) -> Floats:
        """The corners (corners, d) on the reference shape, [0, 1]^d or its part below the diagonal."""
        return np.array(self.shape.corners, dtype=np.float64)

    @cached_property
    def every_place(self) -> Floats:
        """All nodes (nodes, d) on the reference shape."""
        middle = self.places[np.array(self.shape.edges)].mean(axis=1)
        return np.vstack([self.places, middle, self.places.mean(axis=0)])[: self.nodes]

    def grid(self, count: int) -> Floats:
        """Places (p, d) spread evenly over the reference shape, ``count`` along each edge; exact if that is 2^k + 1."""
        line = np.linspace(0.0, 1.0, count)
        places = np.stack(np.meshgrid(*[line] * self.dimension), axis=-1).reshape(-1, self.dimension)
        return places if self.shape.cube else places[places.sum(axis=1) <= 1]

    @cached_property
    def mirrored(self) -> Ints:
        """The nodes in the order of the mirror image, from the same first corner: in a plane the other way around.

        >>> Element.Q9.mirrored.tolist()
        [0, 3, 2, 1, 7, 6, 5, 4, 8]
        """
        other = self.every_place.copy()
        other[:, :2] = other[:, 1::-1]
        return same_places(other, self.every_place)

    @cached_property
    def around(self) -> Ints:
        """The d neighbours (corners, d) of each corner along edges, ordered such that they span a positive volume."""
        ends = np.array(self.shape.edges)
        out = np.empty((self.corners, self.dimension), dtype=np.intp)
        for corner in range(self.corners):
            near = ends[(ends == corner).any(axis=1)]
            out[corner] = near[near != corner]
            if np.linalg.det(self.places[out[corner]] - self.places[corner]) < 0:
                out[corner, :2] = out[corner, 1::-1]
        return out


@cache
def elements_of(dimension: int) -> tuple[Element, ...]:
    """The elements of a plane, or of space."""
    return tuple(element for element in Element if element.dimension == dimension)


def same_places(of: Floats, among: Floats) -> Ints:
    """Numbers (a,) of the places ``of`` (a, d) among the places ``among`` (b, d).

    >>> same_places(np.array([[0.5, 1.0]]), Element.Q8.every_place).tolist()
    [6]
    """
    return np.argmin(np.abs(of[:, None] - among).sum(axis=2), axis=1)
