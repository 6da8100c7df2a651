"""Meshes of bodies in space: blocks and cylinders, whole or cut by planes of symmetry."""

from __future__ import annotations

import numpy as np

from bipot.cells import Parts, converted, graded, require_room
from bipot.elements import Element, elements_of
from bipot.errors import require, require_count, require_positive, require_type
from bipot.extrusion import FLAT, disc, extruded
from bipot.layout import Layout, rectangle
from bipot.mesh import Mesh

Gradings = tuple[float, ...]
"""Size of the last element over that of the first, axis by axis; sizes grow by one factor from each to the next."""


def brick(
    width: float,
    depth: float,
    height: float,
    n_x: int,
    n_y: int,
    n_z: int,
    grading: Gradings = (1.0, 1.0, 1.0),
    element: Element = Element.H8,
) -> Mesh:
    """Block [0, width] x [0, depth] x [0, height], its boundaries left, right; front, back; base, top, axis by axis.

    ``grading`` is of x, y, z. Of tetrahedra six make a hexahedron.

    Raises:
        SceneError: a size or a count that is none, more elements than memory has room for, a plane element.

    >>> brick(7.0, 2.0, 1.0, 3, 2, 1).elements.shape
    (6, 8)
    >>> sorted(brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.T10).boundaries)
    ['back', 'base', 'front', 'left', 'right', 'top']
    """
    require_positive(width=width, depth=depth, height=height)
    counts = {"n_x": n_x, "n_y": n_y, "n_z": n_z}
    for name, count in counts.items():
        require_count(count, name)
    _require_solid(element, grading, 3)
    largest = max(counts, key=lambda name: counts[name])
    require_room(int(n_x) * int(n_y) * int(n_z), element, largest, counts[largest])
    names = "left", "right", "front", "back"
    sides = (0.0, width), (0.0, depth)
    flat = rectangle(*sides, (n_x, n_y), grading[:2], names, FLAT[element.shape], Layout.TENSOR)
    return Mesh(*converted(extruded(flat, graded(0.0, height, n_z, grading[2]), ("base", "top")), element))


def cylinder_3d(
    radius: float,
    height: float,
    n_square: int,
    n_r: int,
    n_z: int,
    grading: Gradings = (1.0, 1.0),
    element: Element = Element.H8,
    *,
    quarter: bool = True,
    curved: bool = True,
) -> Mesh:
    """Cylinder around the third axis, its quarter x, y >= 0 or the whole, with boundaries base, top and side.

    A square around the axis has ``n_square`` elements along each side in a quarter, so that 2 ``n_square`` segments
    make a quarter of the circle; ``n_r`` rings are around it, graded as the first of the ``grading`` says, the second
    being that of z. A quarter has the boundaries left, x = 0, and front, y = 0, besides. Middle nodes of quadratic
    elements are on the circle too where it is ``curved``; between nodes of others it is straight.

    Raises:
        SceneError: a size or a count that is none, more elements than memory has room for, a plane element.

    >>> cylinder_3d(5.0, 5.0, 2, 1, 3).elements.shape
    (24, 8)
    """
    require_positive(radius=radius, height=height)
    counts = {"n_square": n_square, "n_r": n_r, "n_z": n_z}
    for name, count in counts.items():
        require_count(count, name)
    for name, value in {"quarter": quarter, "curved": curved}.items():
        require_type(value, bool, name)
    _require_solid(element, grading, 2)
    a_quarter = int(n_square) * (int(n_square) + 2 * int(n_r)) * int(n_z)
    largest = max(counts, key=lambda name: counts[name])
    require_room(a_quarter * (1 if quarter else 4), element, largest, counts[largest])
    flat = disc(radius, n_square, graded(0.0, 1.0, n_r, grading[0]), quarter, FLAT[element.shape])
    parts = converted(extruded(flat, graded(0.0, height, n_z, grading[1]), ("base", "top")), element)
    return Mesh(*(_rounded(parts, radius) if curved else parts))


def _rounded(parts: Parts, radius: float) -> Parts:
    """The parts with all nodes of the side on the circle."""
    nodes, side = parts.nodes.copy(), np.unique(parts.boundaries["side"])
    nodes[side, :2] *= radius / np.linalg.norm(nodes[side, :2], axis=1, keepdims=True)
    return parts._replace(nodes=nodes)


def _require_solid(element: Element, grading: Gradings, axes: int) -> None:
    require_type(element, Element, "element")
    solids = elements_of(3)
    require(element in solids, "element", element.name, f"one of space, of {[solid.name for solid in solids]}")
    pairs = isinstance(grading, tuple | list) and len(grading) == axes
    require(pairs, "grading", grading, f"{axes} numbers, one for each axis")
