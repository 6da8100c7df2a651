r"""How elements fill a rectangle or a box: along its lines, or fanned out around the corner of its far sides.

Far sides are x = x1 and y = y1, in space also z = z1, and their corner is C = (x1, y1). In the meshes of
:mod:`bipot.meshes.sections` and :mod:`bipot.meshes.solids` ``top`` and ``side`` or ``right`` meet there, and ``back``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np

from bipot.errors import require, require_type
from bipot.meshes.cells import Fine, MeshParts, along, converted, counted, require_room
from bipot.meshes.elements import Element, elements_of
from bipot.typing import Floats, Ints

Span = tuple[float, float]
Names = tuple[str, str, str, str]

CUBE = Element.H8.shape.corners
TETRAHEDRA = np.array([(0, 1, 2, 6), (0, 5, 1, 6), (0, 3, 7, 6), (0, 2, 3, 6), (0, 4, 5, 6), (0, 7, 4, 6)])
"""Tetrahedra of a hexahedron by its corners, each of positive volume."""

TRIANGLES = np.array([(0, 1, 2), (0, 2, 3)])
"""Triangles of its faces, and of any quadrilateral."""


class Layout(Enum):
    r"""Layouts of n_x quadrilaterals along the far side y = y1 and n_y along x = x1; triangles are halves of these.

    ``TENSOR``: n_x n_y between lines of constant x and y. One quadrilateral has the corner C, at a right angle.

    ``FANNED``: (n_x + 1) (n_y + 1) - 1 in three blocks that share an inner point X. The near sides have n_x + 1 and
    n_y + 1 edges, their ends u_i and v_j graded as the far sides' x_i and y_j are:

        n_x n_y between the lines x = u_i, y = v_j,           i = 0 .. n_x, j = 0 .. n_y,    X = (u_nx, v_ny),
        n_x between (u_i, v_ny) and (x_i, y1),                i = 0 .. n_x,
        n_y between (u_nx, v_j) and (x1, y_j),                j = 0 .. n_y.

    The layers along the far sides share the edge from X to C, so that the corner has two quadrilaterals, of about 45
    degrees each. It is for a body whose one far side rolls onto the tool that the other one touches: they then lie on
    one line, and a single quadrilateral in the corner would be folded to an angle of 180 degrees, where a quadratic
    one has no positive Jacobian; two have 90 degrees each. Triangles at the corner have the same two angles.

    In space there are n_x n_y n_z hexahedra, fanned besides one layer of n_x n_y, n_x n_z and n_y n_z on the far faces:
    the corner has three instead of one, edges between two far faces two.
    """

    TENSOR = "tensor"
    FANNED = "fanned"

    def count(self, *counts: int) -> int:
        """Number of quadrilaterals, or of hexahedra if there are three ``counts``.

        >>> Layout.TENSOR.count(10, 4), Layout.FANNED.count(10, 4), Layout.FANNED.count(2, 2, 2)
        (40, 54, 20)
        """
        inner = math.prod(counts)
        return inner + (sum(inner // n for n in counts) if self is Layout.FANNED else 0)


def rectangle(
    x: Span,
    y: Span,
    counts: Mapping[str, int],
    grading: Sequence[float | Fine],
    names: Names,
    element: Element,
    layout: Layout,
) -> MeshParts:
    """Elements of [x0, x1] x [y0, y1], its sides x0, x1, y0, y1 called ``names``.

    ``counts`` are those along the far sides, by the names that messages call them; ``grading`` is of the sizes along
    both axes. Triangles halve the quadrilaterals along diagonals that alternate like the squares of a chessboard, block
    by block, such that a fanned corner has two triangles, too.

    Raises:
        SceneError: a count that is none, or more than memory has room for; a grading that is no pair of positive
            numbers or of :class:`~bipot.meshes.cells.Fine`, or leaves no element; another element or layout.
    """
    n = list(counted(**counts).values())
    require(isinstance(grading, tuple | list) and len(grading) == 2, "grading", grading, "a pair, one for each axis")
    require_type(element, Element, "element")
    plane = elements_of(2)
    require(element in plane, "element", element.name, f"one of a plane, of {[flat.name for flat in plane]}")
    require_layout_room(n, element, layout, tuple(counts))
    sides = list(zip((x, y), n, grading, strict=True))
    far = [along(*side, k, how) for side, k, how in sides]
    near = None if layout is Layout.TENSOR else [along(*side, k + 1, how)[:-1] for side, k, how in sides]
    return converted(grid(far, names, element, near), element)


def require_layout_room(counts: Sequence[int], element: Element, layout: Any, fields: Sequence[str]) -> None:
    """Refuse ``counts`` along the sides, called ``fields``, of more elements than memory has room for."""
    require_type(layout, Layout, "layout")
    whole = [int(count) for count in counts]
    require_room(layout.count(*whole), element, dict(zip(fields, whole, strict=True)))


def cells_between(number: Ints, element: Element, parity: int = 0) -> Ints:
    """Quadrilaterals (e, 4) or triangles (2 e, 3) between nodes whose ``number`` (n + 1, m + 1) runs along x and y.

    Triangles are cut from lower left to upper right where the sum of a cell's indices and ``parity`` is even.
    """
    around = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    cells = np.stack(around, axis=-1).reshape(-1, 4)
    if element.corners == 4:
        return cells
    black = (np.indices((number.shape[0] - 1, number.shape[1] - 1)).sum(axis=0).ravel() + parity) % 2 == 0
    cells = np.where(black[:, None], cells, np.roll(cells, 1, axis=1))
    return cells[:, TRIANGLES].reshape(-1, 3)


def edges_along(names: Sequence[str], sides: Sequence[Ints]) -> dict[str, Ints]:
    """Edges (f, 2) by name, from the nodes of each side in sequence."""
    return {name: np.column_stack([side[:-1], side[1:]]) for name, side in zip(names, sides, strict=True)}


def grid(
    far: Sequence[Floats], names: Sequence[str], element: Element, near: Sequence[Floats] | None = None
) -> MeshParts:
    """Elements of straight edges between lines or planes that cross at the ends ``far`` (n + 1,) along each axis.

    With ``near``, those ends (n + 1,) of which one more element of each axis would fit in, the elements at these are an
    inner part, around which layers are fanned out around the corner of its far faces. Nodes (i, j, k), 0 <= i <= n_x
    and so on, exist in the inner part, and those with i = n_x, j = n_y or k = n_z once more on the far faces. Elements
    are between inner nodes and, in one layer at each far face, between inner nodes and far ones of the same indices.

    Tetrahedra go from the first corner of a hexahedron to its last along three of its edges, one for each order of the
    axes: they cut all faces from their first corner to their last, so that neighbours cut them alike. ``names`` of the
    sides or faces are the near one and the far one, axis by axis.
    """
    shape = tuple(len(ends) for ends in far)
    index, d = np.indices(shape), len(shape)
    inner = outer = np.arange(index[0].size).reshape(shape)
    layers, nodes = list[Ints](), _places(far, index.reshape(d, -1))
    if near is not None:
        on_far = (index == np.reshape(shape, (d, *[1] * d)) - 1).any(axis=0)
        outer = np.full(shape, -1)
        outer[on_far] = on_far.size + np.arange(on_far.sum())
        layers = [np.stack([inner.take(-1, axis), outer.take(-1, axis)], axis) for axis in range(d)]
        nodes = np.vstack([_places(near, index.reshape(d, -1)), nodes[on_far.ravel()]])
    cells = np.vstack([_cells(inner, element), *(_cells(layer, element, sum(layer.shape) - 3) for layer in layers)])
    boundaries = {}
    for axis, (close, distant) in enumerate(zip(names[::2], names[1::2], strict=True)):
        through = [inner, *(layer for along, layer in enumerate(layers) if along != axis)]
        boundaries[close] = np.vstack([_faces(number.take(0, axis), element) for number in through])
        boundaries[distant] = _faces(outer.take(-1, axis), element)
    return MeshParts(nodes, cells, boundaries)


def _places(axes: Sequence[Floats], index: Ints) -> Floats:
    """Nodes (a, d) with the indices ``index`` (d, a) along the ``axes``."""
    return np.column_stack([ends[at] for ends, at in zip(axes, index, strict=True)])


def _cells(number: Ints, element: Element, parity: int = 0) -> Ints:
    """Elements between nodes whose ``number`` (n + 1, m + 1) or (n + 1, m + 1, l + 1) runs along the axes."""
    if number.ndim == 2:
        return cells_between(number, element, parity)
    n, m, k = (count - 1 for count in number.shape)
    corners = [number[x : n + x, y : m + y, z : k + z].ravel() for x, y, z in CUBE]
    cells = np.column_stack(corners)
    return cells if element is Element.H8 else cells[:, TETRAHEDRA].reshape(-1, 4)


def _faces(number: Ints, element: Element) -> Ints:
    """Edges, quadrilaterals or halves of these between nodes whose ``number`` (n + 1,) or (n + 1, m + 1) runs along."""
    if number.ndim == 1:
        return np.column_stack([number[:-1], number[1:]])
    faces = cells_between(number, Element.Q4)
    return faces if element is Element.H8 else faces[:, TRIANGLES].reshape(-1, 3)
