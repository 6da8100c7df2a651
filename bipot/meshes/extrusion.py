r"""Solids above plane meshes: hexahedra above quadrilaterals, tetrahedra above triangles, layer by layer.

Above a triangle with corners a < b < c stand prisms, each of the three tetrahedra

    a b c c',    a b b' c',    a a' b' c',

with primes at the top. Every upright face is cut from its lower corner of smaller number to its upper corner of larger
number, so neighbours, which have the same numbers, cut it alike.

The middles of edges follow the circle as their ends do. Of the place of a corner a part rho c follows the circle, c
on the unit circle and rho at most the radius. The middle of an edge between corners x_1 and x_2 is then

    x_m = (x_1 + x_2)/2 + rho_m (c_m/|c_m| - c_m),    rho_m and c_m the means of those of the ends,

which is on the circle if both corners are. If arcs were curved on the boundary alone, layers next to it would be the
more distorted the thinner they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.meshes.cells import MeshParts, converted
from bipot.meshes.elements import Element
from bipot.meshes.layout import cells_between, edges_along
from bipot.typing import Floats, Ints

PRISM = np.array([(0, 1, 2, 5), (0, 1, 4, 5), (0, 3, 4, 5)])
"""The tetrahedra of a prism with the corners 0, 1, 2 below and 3, 4, 5 above."""

CORE, BULGE = 0.6, 0.5
"""Half the width of a disc's inner square over the radius; how far its sides are curved, 0 (straight) to 1 (arcs)."""

ROUND_OFF = 1e-14
"""Round-off of the length of a unit vector; the mean of two different ones is shorter by more."""

FLAT = {Element.H8.shape: Element.Q4, Element.T4.shape: Element.T3}
"""The plane elements above which solids of a shape are made."""


class Round(NamedTuple):
    """Plane ``parts`` with nodes (n, 2), and ``arcs`` (n, 3): rho and c of each node (module docstring)."""

    parts: MeshParts
    arcs: Floats


def rounded(base: Round, heights: Floats, element: Element, curved: bool) -> MeshParts:
    """Solids as :func:`extruded`, as an ``element`` of their shape whose middle nodes follow arcs if ``curved``."""
    corners = extruded(base.parts, heights)
    out = converted(corners, element)
    if not curved:
        return out
    arcs = converted(corners._replace(nodes=np.tile(base.arcs, (len(heights), 1))), element).nodes
    rho, c = arcs[:, :1], arcs[:, 1:]
    length = np.linalg.norm(c, axis=1, keepdims=True)
    between = (rho > 0) & (length < 1 - ROUND_OFF)
    nodes = out.nodes.copy()
    nodes[:, :2] += np.where(between, rho * c * (1 / np.where(between, length, 1.0) - 1), 0.0)
    return out._replace(nodes=nodes)


def extruded(base: MeshParts, heights: Floats) -> MeshParts:
    """H8 or T4 between the ``heights`` (n,) above plane Q4 or T3; below and above are boundaries base and top.

    Regions consist of all that stands above their elements.
    """
    count, solid = len(base.nodes), base.element is Element.Q4
    places = np.repeat(np.asarray(heights), count)
    nodes = np.column_stack([np.tile(base.nodes, (len(heights), 1)), places])
    low = count * np.arange(len(heights) - 1)[:, None, None]
    cells = base.elements if solid else np.sort(base.elements, axis=1)
    prisms = np.concatenate([cells + low, cells + low + count], axis=2).reshape(-1, 2 * cells.shape[1])
    elements = prisms if solid else prisms[:, PRISM].reshape(-1, 4)
    if not solid:
        # Those numbered as mirror images are renumbered.
        x = nodes[elements]
        inverted = np.linalg.det(x[:, 1:] - x[:, :1]) < 0
        elements[inverted] = elements[inverted][:, Element.T4.mirrored]
    boundaries = {name: _upright(edges, low, count, solid) for name, edges in base.boundaries.items()}
    boundaries |= {"base": base.elements, "top": base.elements + low.max() + count}
    number = np.arange(len(elements)).reshape(len(heights) - 1, len(cells), -1)
    regions = {name: number[:, members].ravel() for name, members in base.regions.items()}
    return MeshParts(nodes, elements, boundaries, regions)


def _upright(edges: Ints, low: Ints, count: int, solid: bool) -> Ints:
    """Upright faces above the edges (f, 2): quadrilaterals, or triangles that halve them."""
    a, b = (edges if solid else np.sort(edges, axis=1)).T
    if solid:
        return (np.column_stack([a, b, b + count, a + count]) + low).reshape(-1, 4)
    return (np.column_stack([a, b, b + count, a, a + count, b + count]) + low).reshape(-1, 3)


def disc(radius: float, square: int, rings: Floats, quarter: bool, element: Element) -> Round:
    """Q4 or T3 of a disc, or of its ``quarter`` x, y >= 0: a square of ``square`` elements a quarter's side, and rings.

    ``rings`` (m + 1,) go from 0 at the square to 1 at the circle. Boundaries are ``side`` and, of a quarter, ``left``
    and ``front``.
    """
    line = np.linspace(0.0 if quarter else -1.0, 1.0, square * (1 if quarter else 2) + 1)
    inner = np.arange(len(line) ** 2).reshape(len(line), -1)
    core = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    # Around the square, anticlockwise: in a quarter along its far sides, else back to the first.
    far = np.concatenate([inner[-1], inner[-2::-1, -1]])
    around = far if quarter else np.concatenate([far, inner[0, -2::-1], inner[1:, 0]])
    distinct = around if quarter else around[:-1]
    outer = inner.size + np.arange(len(distinct) * (len(rings) - 1)).reshape(-1, len(distinct))
    layers = np.vstack([around, outer if quarter else np.column_stack([outer, outer[:, 0]])])
    near, far = _core(core[distinct]), _circle(core[distinct])
    nodes = np.vstack([_core(core), *((1 - t) * near + t * far for t in rings[1:])]) * radius
    arcs = np.zeros((len(nodes), 3))
    arcs[distinct, 1:] = far
    arcs[inner.size :] = np.vstack([np.column_stack([np.full(len(far), t * radius), far]) for t in rings[1:]])
    cells = np.vstack([cells_between(inner, element), cells_between(layers, element)])
    if not quarter:
        return Round(MeshParts(nodes, cells, edges_along(("side",), (layers[-1],))), arcs)
    front, left = np.append(inner[:-1, 0], layers[:, 0]), np.append(inner[0, :-1], layers[:, -1])
    return Round(MeshParts(nodes, cells, edges_along(("side", "front", "left"), (layers[-1], front, left))), arcs)


def annulus(radii: Floats, count: int, quarter: bool, element: Element) -> Round:
    """Q4 or T3 of a ring between ``radii`` (n + 1,), or of its ``quarter`` x, y >= 0, ``count`` around a quarter.

    Boundaries are ``bore``, ``side`` and, of a quarter, ``front`` and ``left``.
    """
    along = np.linspace(0.0, 2.0, count + 1)
    circle = _circle(np.minimum(np.column_stack([2 - along, along]), 1.0))
    if not quarter:
        first, second = circle[:-1], circle[:-1, ::-1] * (-1, 1)
        circle = np.vstack([first, second, -first, -second])
    number = np.arange(len(radii) * len(circle)).reshape(len(radii), -1)
    nodes = (radii[:, None, None] * circle).reshape(-1, 2)
    arcs = np.column_stack([np.repeat(radii, len(circle)), np.tile(circle, (len(radii), 1))])
    if not quarter:
        number = np.column_stack([number, number[:, 0]])
    sides = {"bore": number[0], "side": number[-1]}
    if quarter:
        sides |= {"front": number[:, 0], "left": number[:, -1]}
    edges = edges_along(tuple(sides), tuple(sides.values()))
    return Round(MeshParts(nodes, cells_between(number, element), edges), arcs)


def _circle(square: Floats) -> Floats:
    """Images on the unit circle of points (n, 2) of the square max(|x|, |y|) = 1, at even angles."""
    x, y = square.T
    upright = np.abs(x) >= np.abs(y)
    angle = np.where(upright, y * np.sign(x), x * np.sign(y)) * np.pi / 4
    along, across = np.cos(angle), np.sin(angle)
    turned = np.stack([along, across], axis=1), np.stack([across, along], axis=1)
    return np.where(upright[:, None], np.sign(x)[:, None] * turned[0], np.sign(y)[:, None] * turned[1])


def _core(square: Floats) -> Floats:
    """Images of points (n, 2) of [-1, 1]^2 in the inner square of a unit disc, whose sides bulge."""
    size = np.abs(square).max(axis=1, keepdims=True)
    on = np.divide(square, size, out=np.full(square.shape, 1.0), where=size > 0)
    return CORE * ((1 - BULGE) * square + BULGE * size * _circle(on))
