r"""Boxes fanned out around the corner of their far faces (:class:`~bipot.meshes.layout.Layout`).

Nodes (i, j, k), 0 <= i <= n_x and so on, are those of the inner part, graded such that one more element of each axis
fits in, and once more on the far faces i = n_x, j = n_y or k = n_z. Elements are those between the inner ones and, on
each far face, one layer between an inner node and the far one of the same indices.

Tetrahedra go from the first corner of a hexahedron to its last along three of its edges, one for each order of the
axes: they cut all faces from their first corner to their last, so that neighbours cut them alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot.meshes.cells import MeshParts
from bipot.meshes.elements import Element
from bipot.meshes.layout import cells_between
from bipot.typing import Floats, Ints

CUBE = Element.H8.shape.corners
TETRAHEDRA = np.array([(0, 1, 2, 6), (0, 5, 1, 6), (0, 3, 7, 6), (0, 2, 3, 6), (0, 4, 5, 6), (0, 7, 4, 6)])
"""Of a hexahedron, by its corners, each of positive volume."""

TRIANGLES = np.array([(0, 1, 2), (0, 2, 3)])
"""Of its faces."""


def fanned_box(near: Sequence[Floats], far: Sequence[Floats], names: Sequence[str], element: Element) -> MeshParts:
    """H8 or T4 in three layers around an inner box.

    ``near`` are the ends (n + 1,) of the inner elements along each axis, ``far`` those on the far faces, where the box
    ends; ``names`` of the faces are the near one and the far one, axis by axis.
    """
    shape = tuple(len(ends) for ends in far)
    index = np.indices(shape)
    on_far = (index == np.reshape(shape, (3, 1, 1, 1)) - 1).any(axis=0)
    inner = np.arange(on_far.size).reshape(shape)
    outer = np.full(shape, -1)
    outer[on_far] = on_far.size + np.arange(on_far.sum())
    layers = [np.stack([inner.take(-1, axis), outer.take(-1, axis)], axis) for axis in range(3)]
    cells = np.vstack([_cells(number, element) for number in (inner, *layers)])
    boundaries = {}
    for axis, (close, distant) in enumerate(zip(names[::2], names[1::2], strict=True)):
        through = [inner, *(layer for along, layer in enumerate(layers) if along != axis)]
        boundaries[close] = np.vstack([_faces(number.take(0, axis), element) for number in through])
        boundaries[distant] = _faces(outer.take(-1, axis), element)
    nodes = np.vstack([_places(near, index.reshape(3, -1)), _places(far, index[:, on_far])])
    return MeshParts(nodes, cells, boundaries)


def _places(axes: Sequence[Floats], index: Ints) -> Floats:
    """Nodes (a, 3) of these indices (3, a)."""
    return np.column_stack([ends[at] for ends, at in zip(axes, index, strict=True)])


def _cells(number: Ints, element: Element) -> Ints:
    """Elements between nodes whose ``number`` (n + 1, m + 1, l + 1) runs along the axes."""
    n, m, k = (count - 1 for count in number.shape)
    corners = [number[x : n + x, y : m + y, z : k + z].ravel() for x, y, z in CUBE]
    cells = np.column_stack(corners)
    return cells if element is Element.H8 else cells[:, TETRAHEDRA].reshape(-1, 4)


def _faces(number: Ints, element: Element) -> Ints:
    """Quadrilaterals, or their halves, between nodes whose ``number`` (n + 1, m + 1) runs along the axes."""
    faces = cells_between(number, Element.Q4)
    return faces if element is Element.H8 else faces[:, TRIANGLES].reshape(-1, 3)
