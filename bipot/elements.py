"""The plane elements a mesh may consist of: one table of what tells them apart.

Nodes are numbered as VTK, Gmsh and Abaqus have them: the corners anticlockwise, then the mid-sides (mid-side ``k`` lies
between corners ``k`` and ``k + 1``), then the centre. The number of nodes tells the element.
"""

from __future__ import annotations

from enum import Enum
from functools import cached_property

import numpy as np

from bipot.typing import Floats, Ints


class Element(Enum):
    """Triangles (T) and quadrilaterals (Q) by their number of nodes."""

    T3 = "t3", 3, 3, "ElementTriP1", "triangle", 5
    T6 = "t6", 3, 6, "ElementTriP2", "triangle6", 22
    Q4 = "q4", 4, 4, "ElementQuad1", "quad", 9
    Q8 = "q8", 4, 8, "ElementQuadS2", "quad8", 23
    Q9 = "q9", 4, 9, "ElementQuad2", "quad9", 28

    corners: int
    nodes: int
    shapes: str
    """The element's name in scikit-fem."""
    cell: str
    """Its name in meshio."""
    vtk: int
    """Its number in VTK."""

    def __new__(cls, value: str, corners: int, nodes: int, shapes: str, cell: str, vtk: int) -> Element:
        """A member by its short name, with the columns of the table."""
        member = object.__new__(cls)
        member._value_ = value
        member.corners, member.nodes, member.shapes, member.cell, member.vtk = corners, nodes, shapes, cell, vtk
        return member

    @staticmethod
    def of(nodes: int) -> Element:
        """The element with so many nodes.

        >>> Element.of(6).name
        'T6'
        """
        return next(element for element in Element if element.nodes == nodes)

    @property
    def quadratic(self) -> bool:
        """Whether edges have a middle node."""
        return self.nodes > self.corners

    @property
    def centred(self) -> bool:
        """Whether there is a node inside."""
        return self.nodes > 2 * self.corners

    @property
    def line(self) -> str:
        """The name of an edge in meshio."""
        return "line3" if self.quadratic else "line"

    @cached_property
    def edges(self) -> Ints:
        """Nodes of the edges (corners, 2) or (corners, 3), end (middle) end, run anticlockwise.

        >>> Element.T6.edges.tolist()
        [[0, 3, 1], [1, 4, 2], [2, 5, 0]]
        """
        start = np.arange(self.corners)
        middle = [start + self.corners] if self.quadratic else []
        return np.column_stack([start, *middle, np.roll(start, -1)])

    @cached_property
    def places(self) -> Floats:
        """The corners (corners, 2) on the reference shape, [0, 1]^2 or its half below the diagonal."""
        square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
        return square if self.corners == 4 else square[[0, 1, 3]]

    @cached_property
    def mirrored(self) -> Ints:
        """The nodes in the order that goes around the other way, from the same first corner.

        >>> Element.Q9.mirrored.tolist()
        [0, 3, 2, 1, 7, 6, 5, 4, 8]
        """
        numbers = np.arange(self.nodes)
        corner, middle = numbers[: self.corners], numbers[self.corners : 2 * self.corners]
        return np.concatenate([corner[:1], corner[:0:-1], middle[::-1], numbers[2 * self.corners :]])
