"""The block of :mod:`studies.block` as an input deck of CalculiX: an eighth of it, the platen one stiff brick.

As :mod:`studies.accuracy.deck` has the cylinder: the platen's nodes are all prescribed, candidates are the top and the
upper half of the sides, contact is penalised.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bipot.meshes.elements import CUBE, Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.typing import Floats, Ints
from studies.accuracy.block_alone import scene_of
from studies.accuracy.deck import NODES, OUTSIDE, PUNCH, Deck, entries, numbered
from studies.block import CANDIDATES

QUADRATIC = ("C3D20R",)
REDUCTION = 0.3
"""Of a scene of which only mesh and material are asked."""

COPIES = 4
"""Quarters of the platen."""

SIDES = (0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)
"""Corners of the sides S1 to S6 of a brick."""


@dataclass(frozen=True)
class BlockDeck(Deck):
    """One calculation, as a :class:`~studies.accuracy.deck.Deck`."""

    def scene(self) -> Scene:
        """The study's."""
        return scene_of(self.mu, 1, REDUCTION)

    def force(self, total: Sequence[float]) -> float:
        """On the whole platen."""
        return COPIES * abs(total[2])

    def mesh(self) -> Mesh:
        """Of the eighth."""
        element, n = Element.H20 if self.element in QUADRATIC else Element.H8, self.elements
        width, depth, half = map(float, self.scene().mesh.nodes.max(axis=0))
        return brick(width, depth, half, n, n, n, element=element)

    def _held(self, mesh: Mesh) -> dict[str, Floats]:
        return dict(zip(("LEFT", "FRONT", "BASE"), mesh.nodes.T, strict=True))

    def _punch(self, mesh: Mesh) -> Iterator[str]:
        (width, depth, half), first = mesh.nodes.max(axis=0), len(mesh.nodes) + 1
        # Beyond the planes of symmetry, too, so that no node of these is at its edge.
        low, high = np.array([-width, -depth, half]), np.array([OUTSIDE * width, OUTSIDE * depth, 1.2 * half])
        yield f"*NODE, NSET={PUNCH}"
        yield from numbered(first, low + np.array(CUBE.corners) * (high - low))
        yield "*ELEMENT, TYPE=C3D8, ELSET=TOOL"
        yield from entries(len(mesh.elements) + 1, *range(first, first + 8))

    def _slave(self, mesh: Mesh) -> Iterator[str]:
        upper = self._upper(mesh, CANDIDATES)
        yield "*SURFACE, NAME=SLAVE" + (", TYPE=NODE" if self.contact == NODES else "")
        if self.contact == NODES:
            yield from (f"{node + 1}," for node in np.unique(upper))
        else:
            yield from faces_of(mesh, upper)
        yield from self._master(mesh)


def faces_of(mesh: Mesh, facets: Ints, before: int = 0) -> Iterator[str]:
    """Element, with so many ``before`` it, and side of ``facets`` (f, n), in the counting of the deck."""
    wanted = {frozenset(corners) for corners in facets[:, :4].tolist()}
    for number, cell in enumerate(mesh.elements.tolist(), before + 1):
        for side, corners in enumerate(SIDES, 1):
            if frozenset(cell[k] for k in corners) in wanted:
                yield f"{number}, S{side}"
