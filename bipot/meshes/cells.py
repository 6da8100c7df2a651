"""Conversion of cells between kinds (mid-sides and centres), sizes along a side, and limits of their number."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_count, require_magnitude, require_positive
from bipot.meshes.elements import Element
from bipot.meshes.facets import Facets, edges_of
from bipot.typing import Floats, FrozenMap, Ints, make_floats

CENTRE = np.array([-0.25] * 4 + [0.5] * 4)
"""The centre of an eight-node quadrilateral from its nodes."""

SMALLEST = 1e-8
"""Least size of an element of a graded mesh over the side."""

SLENDEREST = 1e6
"""Largest ratio of the sides of a body: beyond it places along the shorter one are lost in round-off."""

SAME_SIDES = 1e-9
"""Relative round-off of sides, as of a wall that is the difference of two radii."""

HALVINGS = 60
"""Halvings of the bracket of a growth factor, to round-off."""


BYTES_A_NODE = 20_000
"""Memory that a march by :class:`~bipot.forms.Newton` needs per node of a square mesh, for response, stiffness and its
factors: measured from T3 to Q9 on 40 x 40 elements, 14 000 to 30 000. Cone programs need three times as much.
"""

GIGABYTE = 1e9


@dataclass(frozen=True)
class Fine:
    """A grading of a side: its last ``length`` in ``elements`` of one size, from which the others grow by one factor.

    It is for a side with an end that rolls onto a tool: the force jumps as a node lands, in proportion to the size.
    """

    length: float
    elements: int

    def __post_init__(self) -> None:
        make_floats(self, of="fine.", length="finite and > 0")
        require_count(self.elements, "fine.elements")
        object.__setattr__(self, "elements", int(self.elements))

    def ends(self, start: float, end: float, count: int) -> Floats:
        """Ends (count + 1,) of the elements along a side from ``start`` to ``end``.

        Raises:
            SceneError: a length that is not a part of the side, or no element, or only smaller ones, left for the
                rest.

        >>> Fine(1.0, 2).ends(0.0, 4.0, 4).round(3).tolist()
        [0.0, 2.0, 3.0, 3.5, 4.0]
        """
        start, end = float(start), float(end)
        whole, others = end - start, count - self.elements
        require(self.length < whole, "fine.length", self.length, f"below that of the side, {whole:g}")
        require(others > 0, "fine.elements", self.elements, f"below the side's own number, {count}")
        size, rest = self.length / self.elements, whole - self.length
        require(size > SMALLEST * whole, "fine.elements", self.elements, f"of at least {SMALLEST:g} of the side")
        allowed = f"such that {others} no smaller ones fill the rest of the side"
        require(others * size <= rest, "fine.length", self.length, allowed)
        powers, low, high = np.arange(1, others + 1), 1.0, (rest / size) ** (1 / others)
        for _ in range(HALVINGS):
            factor = (low + high) / 2
            low, high = (factor, high) if size * (factor**powers).sum() < rest else (low, factor)
        sizes = size * np.append(np.ones(self.elements), low**powers)
        ends = end - np.append(0.0, np.cumsum(sizes))[::-1]
        ends[0] = start
        return ends


class MeshParts(NamedTuple):
    """The parts of a mesh: nodes (a, d), elements (e, k), and by name facets (f, n) and element numbers (n,)."""

    nodes: Floats
    elements: Ints
    boundaries: Mapping[str, Ints]
    regions: Mapping[str, Ints] = FrozenMap({})

    @property
    def element(self) -> Element:
        """The kind of its elements."""
        return Element.of(self.elements.shape[1], self.nodes.shape[1])


def require_sides(**sides: float) -> None:
    """Refuse lengths of sides, by name, with which there is no body.

    Raises:
        SceneError: a length that is not finite and > 0, requires other units, or is more than SLENDEREST times another.
    """
    require_positive(**sides)
    # In shorter precisions of NumPy the largest length would be infinite.
    lengths = {field: float(length) for field, length in sides.items()}
    for field, length in lengths.items():
        require_magnitude(length, field, LARGEST_LENGTH)
    short, long = min(lengths, key=lengths.__getitem__), max(lengths, key=lengths.__getitem__)
    allowed = f"at most {SLENDEREST:g} times {short} = {lengths[short]:g}"
    most = SLENDEREST * lengths[short] * (1 + SAME_SIDES)
    require(lengths[long] <= most, long, lengths[long], allowed)


def counted(**counts: int) -> dict[str, int]:
    """The counts by name as Python's integers, as NumPy's would overflow; raises SceneError unless all are counts."""
    for name, count in counts.items():
        require_count(count, name)
    return {name: int(count) for name, count in counts.items()}


def memory() -> int | None:
    """Bytes of memory of the machine; None if unknown.

    >>> (memory() or 2**30) > 2**20
    True
    """
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def require_room(boxes: int, element: Element, counts: Mapping[str, int]) -> None:
    """Refuse ``counts`` by name if a march on their ``boxes``, quadrilaterals or hexahedra, needs more memory."""
    # Nodes per box in a large mesh: one corner, and with its mid-sides and centres this many.
    d = element.dimension
    nodes = 1 if not element.quadratic else 1 + d if element.shape.cube and not element.centred else 2**d
    largest = max(counts, key=lambda name: counts[name])
    need, there = nodes * boxes * BYTES_A_NODE, memory()
    if there is not None:
        amounts = f"{there / GIGABYTE:.3g} GB of memory here, where a march would need about {need / GIGABYTE:.2g} GB"
        require(need <= there, largest, counts[largest], f"so few that they fit into the {amounts}")


def graded(start: float, end: float, count: int, ratio: float) -> Floats:
    """Ends (count + 1,) of elements whose sizes grow by one factor, the last ``ratio`` times the first."""
    require_positive(grading=ratio)
    # Large whole numbers, and NumPy's other precisions, would give ends that are not float64.
    start, end = float(start), float(end)
    ends = np.linspace(start, end, count + 1)
    if ratio != 1 and count > 1:
        # Over the largest size, so that no ratio overflows.
        sizes = float(ratio) ** (np.arange(count) / (count - 1) - (ratio > 1))
        ends[1:-1] = start + (end - start) * np.cumsum(sizes / sizes.sum())[:-1]
        apart = bool((np.diff(ends) > SMALLEST * (end - start)).all())
        require(apart, "grading", ratio, f"such that no element is smaller than {SMALLEST:g} of the side")
    return ends


def along(start: float, end: float, count: int, grading: float | Fine) -> Floats:
    """Ends (count + 1,) of elements from ``start`` to ``end``, by :class:`Fine` or :func:`graded`."""
    if isinstance(grading, Fine):
        return grading.ends(start, end, count)
    return graded(start, end, count, grading)


def converted(parts: MeshParts, element: Element) -> MeshParts:
    """The same shape in other elements: mid-sides (of straight edges) and centres are added or dropped.

    Raises:
        SceneError: the elements are of another shape.
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
    ends = {name: bounds[:, source.ends] for name, bounds in parts.boundaries.items()}
    boundaries = {name: facets.run(found, ends[name]) for name, found in facets.find_each(ends).items()}
    return used(MeshParts(nodes, cells, boundaries, parts.regions))


def used(parts: MeshParts) -> MeshParts:
    """The parts without the nodes that belong to no cell."""
    kept, elements = np.unique(parts.elements, return_inverse=True)
    number = np.full(len(parts.nodes), -1, dtype=np.intp)
    number[kept] = np.arange(len(kept))
    boundaries = {name: number[facets] for name, facets in parts.boundaries.items()}
    return MeshParts(parts.nodes[kept], elements.reshape(parts.elements.shape), boundaries, parts.regions)
