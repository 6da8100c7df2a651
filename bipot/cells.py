"""Cells of one kind made into those of another: rectangles of a tensor mesh, triangles, mid-sides, centres."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bipot.elements import Element
from bipot.errors import require, require_positive
from bipot.facets import Facets
from bipot.machine import require_memory
from bipot.typing import Floats, Ints

CENTRE = np.array([-0.25] * 4 + [0.5] * 4)
"""The centre of an eight-node quadrilateral from its nodes."""

SMALLEST = 1e-8
"""Of the side, which no element of a graded mesh may be smaller than."""


class Parts(NamedTuple):
    """Nodes (a, 2), elements (e, k) and edges (f, n) by the boundary's name: what a mesh is made of."""

    nodes: Floats
    elements: Ints
    boundaries: Mapping[str, Ints]


def tensor(x: Floats, y: Floats, names: tuple[str, str, str, str], element: Element) -> Parts:
    """The rectangle between the lines ``x`` (n + 1,) and ``y`` (m + 1,), its sides x0, x1, y0, y1 called ``names``.

    Triangles halve the rectangles along diagonals that alternate like the squares of a chessboard.
    """
    number = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    nodes = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    around = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    cells = np.stack(around, axis=-1).reshape(-1, 4)
    if element.corners == 3:
        black = np.indices((len(x) - 1, len(y) - 1)).sum(axis=0).ravel() % 2 == 0
        cells = np.where(black[:, None], cells, np.roll(cells, 1, axis=1))
        cells = cells[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    along = (number[0], number[-1], number[:, 0], number[:, -1])
    ends = {name: np.column_stack([side[:-1], side[1:]]) for name, side in zip(names, along, strict=True)}
    return converted(Parts(nodes, cells, ends), element)


def require_room(counts: tuple[int, int], element: Element, fields: tuple[str, str]) -> None:
    """Refuse ``counts`` of rectangles along two axes, called ``fields``, that are more than memory has room for.

    Raises:
        SceneError: naming the larger of the two.
    """
    # In a large mesh a rectangle has one corner, two mid-sides and a centre of its own; two triangles have four nodes.
    own = 1 if not element.quadratic else 3 if element.corners == 4 and not element.centred else 4
    first, second = (int(count) for count in counts)
    require_memory(own * first * second, fields[second > first], max(first, second))


def graded(start: float, end: float, count: int, ratio: float) -> Floats:
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


def converted(parts: Parts, element: Element) -> Parts:
    """The same shape in other elements: mid-sides (of straight edges) and centres are added where asked, or dropped.

    Raises:
        SceneError: triangles are asked for quadrilaterals, or quadrilaterals for triangles.
    """
    source = Element.of(parts.elements.shape[1])
    allowed = f"with the {source.corners} corners of {source.name}"
    require(element.corners == source.corners, "element", element.name, allowed)
    nodes, cells = parts.nodes, parts.elements[:, : element.nodes]
    if element.quadratic and not source.quadratic:
        facets = Facets.of(cells)
        nodes, cells = (
            np.vstack([nodes, nodes[facets.ends].mean(axis=1)]),
            np.hstack([cells, len(nodes) + facets.number]),
        )
    if element.centred and not source.centred:
        centre = len(nodes) + np.arange(len(cells))
        nodes, cells = np.vstack([nodes, CENTRE @ nodes[cells]]), np.column_stack([cells, centre])
    facets = Facets.of(cells)
    ends = {name: edges[:, [0, -1]] for name, edges in parts.boundaries.items()}
    edges = {name: np.insert(some, 1, facets.nodes[facets.find(some), 1:-1].T, axis=1) for name, some in ends.items()}
    return used(Parts(nodes, cells, edges))


def used(parts: Parts) -> Parts:
    """The parts without nodes of no cell."""
    kept, elements = np.unique(parts.elements, return_inverse=True)
    number = np.full(len(parts.nodes), -1, dtype=np.intp)
    number[kept] = np.arange(len(kept))
    boundaries = {name: number[edges] for name, edges in parts.boundaries.items()}
    return Parts(parts.nodes[kept], elements.reshape(parts.elements.shape), boundaries)
