"""Meshes of rectangles: sections of blocks in plane strain, half-sections of cylinders and rings on a meridian."""

from __future__ import annotations

import numpy as np

from bipot.errors import require, require_number, require_positive
from bipot.meshes.cells import Fine, require_sides
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout, rectangle
from bipot.meshes.mesh import Mesh

Grading = tuple[float | Fine, float | Fine]
"""Size of the last element over that of the first along each axis; sizes grow by one factor from each to the next.

Or :class:`~bipot.meshes.cells.Fine`, of one size along the last part of an axis.
"""

UNIFORM = (1.0, 1.0)


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

    ``layout`` says how elements meet in the corner of top and side (:class:`~bipot.meshes.layout.Layout`).

    >>> cylinder(5.0, 5.0, 2, 2).elements.shape
    (4, 4)
    """
    require_sides(radius=radius, height=height)
    counts, names = {"n_r": n_r, "n_z": n_z}, ("axis", "side", "base", "top")
    return Mesh(*rectangle((0.0, radius), (0.0, height), counts, grading, names, element, layout))


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

    ``layout`` says how elements meet in the corner of top and right (:class:`~bipot.meshes.layout.Layout`). Triangles
    halve quadrilaterals along diagonals that alternate like the squares of a chessboard.

    >>> block(7.0, 1.0, 3, 1, grading=(4.0, 1.0)).boundary("base")[:, 1].size
    3
    >>> block(7.0, 1.0, 3, 1, element=Element.T6).elements.shape
    (6, 6)
    """
    require_sides(width=width, height=height)
    counts, names = {"n_x": n_x, "n_y": n_y}, ("left", "right", "base", "top")
    return Mesh(*rectangle((0.0, width), (0.0, height), counts, grading, names, element, layout))


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

    ``layout`` says how elements meet in the corner of top and side (:class:`~bipot.meshes.layout.Layout`).
    """
    require_positive(inner=inner)
    require_number(outer, "outer")
    require(inner < outer < np.inf, "outer", outer, f"finite and > inner = {inner}")
    require_sides(**{"outer - inner": outer - inner, "height": height})
    counts, names = {"n_r": n_r, "n_z": n_z}, ("bore", "side", "base", "top")
    return Mesh(*rectangle((inner, outer), (0.0, height), counts, grading, names, element, layout))
