"""Cells of one kind made into those of another: mid-sides and centres; sizes along a side, and how many may be."""

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


def require_room(quadrilaterals: int, element: Element, field: str, value: int) -> None:
    """Refuse a ``value`` of ``field`` that makes more ``quadrilaterals``, or halves of them, than memory has room for.

    Raises:
        SceneError: naming the field.
    """
    # In a large mesh each has one corner, two mid-sides and a centre of its own, and halves have four nodes together.
    own = 1 if not element.quadratic else 3 if element.corners == 4 and not element.centred else 4
    require_memory(own * quadrilaterals, field, value)


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
