"""Axes of nodes: those of the coordinates, except where a support holds another direction.

The unknowns of a node are the components of its displacement along its axes. A support then holds a single component,
which is left out, and the others are free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.tensors import norm
from bipot.tools.surfaces import ACROSS
from bipot.typing import Floats, Ints, einsum


@dataclass(frozen=True)
class Axes:
    """Orthonormal ``rows`` (t, d, d) at the ascending ``nodes`` (t,); all others have the axes of the coordinates."""

    nodes: Ints
    rows: Floats

    @property
    def turned(self) -> bool:
        """Whether any node has axes of its own."""
        return len(self.nodes) > 0

    def frames(self, count: int, d: int) -> Floats:
        """The axes (a, d, d) of all nodes, ``count`` in ``d`` dimensions."""
        out = np.tile(np.eye(d), (count, 1, 1))
        out[self.nodes] = self.rows
        return out

    def components(self, field: Floats) -> Floats:
        """The components (a, d) along the axes of a nodal field (a, d)."""
        return self._turned(field, self.rows) if self.turned else field

    def field(self, components: Floats) -> Floats:
        """The nodal field (a, d) of components (a, d) along the axes."""
        return self._turned(components, self.rows.transpose(0, 2, 1)) if self.turned else components

    def at(self, nodes: Ints, vectors: Floats) -> Floats:
        """Components (p, d) of vectors (p, d) at nodes (p,); where axes are rotated, round-off of zero is zero."""
        if not self.turned:
            return vectors
        place = np.minimum(np.searchsorted(self.nodes, nodes), len(self.nodes) - 1)
        turned = self.nodes[place] == nodes
        components = einsum("pij,pj->pi", self.rows[place[turned]], vectors[turned])
        components[np.abs(components) <= ACROSS * norm(components)[:, None]] = 0.0
        out = vectors.copy()
        out[turned] = components
        return out

    def _turned(self, field: Floats, rows: Floats) -> Floats:
        out = field.copy()
        out[self.nodes] = einsum("tij,tj->ti", rows, field[self.nodes])
        return out


STRAIGHT = Axes(np.empty(0, np.intp), np.empty((0, 0, 0)))
"""The axes of the coordinates at all nodes."""
