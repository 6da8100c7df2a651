"""Cells of one kind made into those of another: mid-sides and centres; sizes along a side, and how many may be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bipot.basics.machine import require_memory
from bipot.errors import require, require_positive
from bipot.meshes.elements import Element
from bipot.meshes.facets import Facets, edges_of
from bipot.typing import Floats, Ints

CENTRE = np.array([-0.25] * 4 + [0.5] * 4)
"""The centre of an eight-node quadrilateral from its nodes."""

SMALLEST = 1e-8
"""Of the side, which no element of a graded mesh may be smaller than."""


class Parts(NamedTuple):
    """Nodes (a, d), elements (e, k) and facets (f, n) by the boundary's name: what a mesh is made of."""

    nodes: Floats
    elements: Ints
    boundaries: Mapping[str, Ints]

    @property
    def element(self) -> Element:
        """What its elements are."""
        return Element.of(self.elements.shape[1], self.nodes.shape[1])


def require_room(boxes: int, element: Element, field: str, value: int) -> None:
    """Refuse a ``value`` of ``field`` that makes more ``boxes``, or parts of them, than memory has room for.

    Boxes are quadrilaterals and hexahedra.

    Raises:
        SceneError: naming the field.
    """
    # In a large mesh each has one corner of its own, and these mid-sides and centres, together with its parts.
    d = element.dimension
    own = 1 if not element.quadratic else 1 + d if element.shape.cube and not element.centred else 2**d
    require_memory(own * boxes, field, value)


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
        SceneError: elements of another shape are asked for.
    """
    source = parts.element
    allowed = f"with the {source.corners} corners of {source.name}"
    require(element.shape is source.shape, "element", element.name, allowed)
    nodes, cells = parts.nodes, parts.elements[:, : element.nodes]
    if element.quadratic and not source.quadratic:
        ends, number = edges_of(cells, source)
        nodes, cells = np.vstack([nodes, nodes[ends].mean(axis=1)]), np.hstack([cells, len(nodes) + number])
    if element.centred and not source.centred:
        centre = len(nodes) + np.arange(len(cells))
        nodes, cells = np.vstack([nodes, CENTRE @ nodes[cells]]), np.column_stack([cells, centre])
    facets = Facets.of(cells, element)
    ends = {name: some[:, source.ends] for name, some in parts.boundaries.items()}
    return used(Parts(nodes, cells, {name: facets.run(facets.find(some), some) for name, some in ends.items()}))


def used(parts: Parts) -> Parts:
    """The parts without nodes of no cell."""
    kept, elements = np.unique(parts.elements, return_inverse=True)
    number = np.full(len(parts.nodes), -1, dtype=np.intp)
    number[kept] = np.arange(len(kept))
    boundaries = {name: number[facets] for name, facets in parts.boundaries.items()}
    return Parts(parts.nodes[kept], elements.reshape(parts.elements.shape), boundaries)
