"""Meshes of bodies in space: blocks, cylinders and rings, whole or cut by planes of symmetry."""

from __future__ import annotations

import numpy as np

from bipot.errors import require, require_number, require_positive, require_type
from bipot.meshes.cells import converted, counted, graded, require_room, require_sides
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.extrusion import FLAT, annulus, disc, extruded, rounded
from bipot.meshes.layout import Layout, grid, rectangle, require_layout_room
from bipot.meshes.mesh import Mesh

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
    layout: Layout = Layout.TENSOR,
) -> Mesh:
    """Block [0, width] x [0, depth] x [0, height], its boundaries left, right; front, back; base, top, axis by axis.

    ``grading`` is of x, y, z; ``layout`` says how elements meet in the corner of right, back and top
    (:class:`~bipot.meshes.layout.Layout`). Of tetrahedra six make a hexahedron.

    Raises:
        SceneError: a size or a count that is none, more elements than memory has room for, a plane element.

    >>> brick(7.0, 2.0, 1.0, 3, 2, 1).elements.shape
    (6, 8)
    >>> sorted(brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.T10).boundaries)
    ['back', 'base', 'front', 'left', 'right', 'top']
    """
    require_sides(width=width, depth=depth, height=height)
    counts = counted(n_x=n_x, n_y=n_y, n_z=n_z)
    n_x, n_y, n_z = counts.values()
    _require_solid(element, grading, 3)
    require_layout_room((n_x, n_y, n_z), element, layout, tuple(counts))
    names = "left", "right", "front", "back"
    if layout is Layout.FANNED:
        sides = list(zip((width, depth, height), counts.values(), grading, strict=True))
        far = [graded(0.0, length, n, ratio) for length, n, ratio in sides]
        near = [graded(0.0, length, n + 1, ratio)[:-1] for length, n, ratio in sides]
        corners = Element.H8 if element.shape.cube else Element.T4
        return Mesh(*converted(grid(far, (*names, "base", "top"), corners, near), element))
    sides = (0.0, width), (0.0, depth)
    flat = rectangle(*sides, {"n_x": n_x, "n_y": n_y}, grading[:2], names, FLAT[element.shape], layout)
    return Mesh(*converted(extruded(flat, graded(0.0, height, n_z, grading[2])), element))


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
    inscribed: bool = True,
) -> Mesh:
    """Cylinder around the third axis, its quarter x, y >= 0 or the whole, with boundaries base, top and side.

    A square around the axis has ``n_square`` elements along each side in a quarter, so that 2 ``n_square`` segments
    make a quarter of the circle; ``n_r`` rings are around it, graded as the first of the ``grading`` says, the second
    being that of z. A quarter also has the boundaries left, x = 0, and front, y = 0. If ``curved``, middle nodes of
    quadratic elements are on the circle too, and those of inner rings follow it; otherwise it is straight between
    corners. If ``inscribed``, nodes of the side are at the ``radius``, else a little farther out, so that the volume is
    the cylinder's.

    Raises:
        SceneError: a size or a count that is none, more elements than memory has room for, a plane element.

    >>> cylinder_3d(5.0, 5.0, 2, 1, 3).elements.shape
    (24, 8)
    """
    require_sides(radius=radius, height=height)
    counts = counted(n_square=n_square, n_r=n_r, n_z=n_z)
    n_square, n_r, n_z = counts.values()
    _require_solid(element, grading, 2, quarter=quarter, curved=curved, inscribed=inscribed)
    a_quarter = n_square * (n_square + 2 * n_r) * n_z
    require_room(a_quarter * (1 if quarter else 4), element, counts)
    arcs = curved and element.quadratic
    outer = float(radius) * (1.0 if inscribed else _widened(2 * n_square, arcs))
    flat = disc(outer, n_square, graded(0.0, 1.0, n_r, grading[0]), quarter, FLAT[element.shape])
    return Mesh(*rounded(flat, graded(0.0, height, n_z, grading[1]), element, arcs))


def ring_3d(
    inner: float,
    outer: float,
    height: float,
    n_around: int,
    n_r: int,
    n_z: int,
    grading: Gradings = (1.0, 1.0),
    element: Element = Element.H8,
    *,
    quarter: bool = True,
    curved: bool = True,
    inscribed: bool = True,
) -> Mesh:
    """Ring around the third axis, its quarter x, y >= 0 or the whole, with boundaries bore, side, base and top.

    A quarter also has the boundaries left, x = 0, and front, y = 0. ``n_around`` elements make a quarter of the circle;
    ``grading`` is of the radius and of z. ``curved`` and ``inscribed`` are those of :func:`cylinder_3d`, of both
    circles.

    Raises:
        SceneError: a size or a count that is none, an inner radius that is not the smaller one, more elements than
            memory has room for, a plane element.

    >>> mesh = ring_3d(3.0, 6.0, 2.0, 6, 3, 2)
    >>> mesh.elements.shape, sorted(mesh.boundaries)
    ((36, 8), ['base', 'bore', 'front', 'left', 'side', 'top'])
    """
    require_positive(inner=inner, outer=outer)
    require(inner < outer, "inner", inner, f"< outer = {outer}")
    require_sides(**{"outer - inner": outer - inner, "height": height})
    counts = counted(n_around=n_around, n_r=n_r, n_z=n_z)
    n_around, n_r, n_z = counts.values()
    _require_solid(element, grading, 2, quarter=quarter, curved=curved, inscribed=inscribed)
    require_room(n_around * n_r * n_z * (1 if quarter else 4), element, counts)
    arcs = curved and element.quadratic
    wider = 1.0 if inscribed else _widened(n_around, arcs)
    bore, side = float(inner) * wider, float(outer) * wider
    flat = annulus(graded(bore, side, n_r, grading[0]), n_around, quarter, FLAT[element.shape])
    return Mesh(*rounded(flat, graded(0.0, height, n_z, grading[1]), element, arcs))


def _widened(count: int, arcs: bool) -> float:
    """Factor of the radius with which ``count`` chords in a quarter, or parabolic arcs on them, have the circle's area.

    >>> round(_widened(1, arcs=False) ** 2 * 2, 12)  # the square in a circle
    3.14159265359
    """
    half = np.pi / 4 / count
    area = np.cos(half) + (4 / 3 * (1 - np.cos(half)) if arcs else 0.0)
    return float(np.sqrt(half / (np.sin(half) * area)))


def _require_solid(element: Element, grading: Gradings, axes: int, **choices: bool) -> None:
    for name, value in choices.items():
        require_type(value, bool, name)
    require_type(element, Element, "element")
    solids = elements_of(3)
    require(element in solids, "element", element.name, f"one of space, of {[solid.name for solid in solids]}")
    pairs = isinstance(grading, tuple | list) and len(grading) == axes
    require(pairs, "grading", grading, f"{axes} numbers, one for each axis")
    for ratio in grading:
        require_number(ratio, "grading")
