"""What loads change by in an increment: on the body as it is at the start, whatever its answer is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.certificate import EPS
from bipot.fem.assembly import element_force
from bipot.state import State
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Floats, max_abs

BALANCED = 1e-3
"""Imbalance of a start's stress with its contact forces and loads, relative to the largest nodal sum of |element
forces|, up to which it counts as balanced.

It is far above the imbalance of accepted increments, and far below what would distort the scale of contact forces."""


@dataclass(frozen=True)
class LoadChange:
    """Loads on a system from the state ``start`` to pseudo-time ``tau``."""

    system: System
    start: State
    tau: float

    @cached_property
    def begins(self) -> bool:
        """Whether loads that are on at tau = 0 come in no time, in this increment: the start does not carry them yet.

        A body at rest does not, and one that is stressed does if it is nearer to balance with them than without.
        """
        if self.start.tau > 0:
            return False
        return max_abs(self._carried) <= max_abs(self._carried - self._given)

    @cached_property
    def before(self) -> Floats:
        """Nodal loads (a, d) that the start carries."""
        if self.others is not None:
            return self.system.body.space.spread(self.others)
        return np.zeros_like(self._at_start) if self.begins else self._at_start

    @cached_property
    def others(self) -> Floats | None:
        """The load on the unknowns (n,) that a start at tau = 0 carries if it is neither none nor what is on then.

        It is that of another path, and goes over into the load at the end as loads do that grow.
        """
        if self.start.tau > 0 or not self.start.stress.any():
            return None
        carried, space = self._carried, self.system.body.space
        forces = element_force(space.gradients(self.start.nodes), self.start.stress)
        scale = space.force_scale(forces, space.spread(self._given))
        off = min(max_abs(carried), max_abs(carried - self._given))
        return carried if off > BALANCED * scale else None

    @cached_property
    def _carried(self) -> Floats:
        """The load on the unknowns (n,) that the start carries."""
        return self.system.carried(self.start)

    @cached_property
    def _given(self) -> Floats:
        """The load on the unknowns (n,) at the pseudo-time of the start."""
        return self.system.load(self._at_start, self.start.tau)

    @cached_property
    def _at_start(self) -> Floats:
        """Nodal loads (a, d) at the pseudo-time of the start, on the body as it is there."""
        nodes = self.system.body.scene.origin(self.start.nodes)
        return self.system.loading.forces(nodes, self.start.tau)

    @cached_property
    def ahead(self) -> Floats:
        """Nodal loads (a, d) at the end of the increment on the body as it is at the start."""
        return self.system.loading.forces(self.system.body.scene.origin(self.start.nodes), self.tau)

    @cached_property
    def change(self) -> Floats:
        """The change of the load on the unknowns (n,), with the body at the start: nodal loads and driving forces."""
        ahead = self.system.load(self.ahead, self.tau)
        if self.others is not None:
            return ahead - self.others
        return ahead if self.begins else ahead - self._given

    @cached_property
    def changes(self) -> bool:
        """Whether the load on the unknowns changes, by more than round-off of loads that supports take up."""
        space, noise = self.system.body.space, EPS * (_largest(self.ahead) + _largest(self.before))
        return bool(_largest(space.spread(self.change)) > noise or space.beside(self.change).any())


def _largest(vectors: Floats) -> float:
    """The length of the longest of (a, d)."""
    return float(norm(vectors).max())
