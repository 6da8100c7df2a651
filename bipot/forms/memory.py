"""What a run fixes for Newton, ordering and scatter, and the prediction of its increments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.fem.strain import Scratch
from bipot.iterate import Iterate
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.ordering import Pattern
from bipot.response import State
from bipot.typing import Floats, Ints

BOUNDED = 0.3

FASTER = 1.05
"""What the motion speeds up by from one increment to the next before it tells of a maximum of the load."""


@dataclass(frozen=True)
class Setup:
    """What a run fixes: ordered pattern, scatter of element matrices into its data, a scale, and memory.

    ``stiffness`` (n + 1,) is the diagonal of the run's first tangent (of translations the mean), SOFTENED: it balances
    forces against motions.
    """

    pattern: Pattern
    scatter: Ints
    stiffness: Floats
    scratch: Scratch

    @staticmethod
    def of(iterate: Iterate, pattern: Pattern) -> Setup:
        """Compose the scatters into the ordered stiffness ``pattern``."""
        body = iterate.increment.system.body
        space = body.space
        scatter = np.append(pattern.place, len(pattern.place))[space.scatter]
        scratch = body.scratch()
        diagonal = space.matrix(iterate.tangent(scratch)).diagonal()
        # A contact of a held node with a tool that a force drives has no other unknown than that.
        diagonal[len(space.free) :] = diagonal[: len(space.free)].mean()
        return Setup(pattern, scatter, np.append(SOFTENED * diagonal, 0.0), scratch)

    def data(self, element: Floats) -> Floats:
        """Sum element matrices (e, 2k, 2k) into row-wise data (nnz + 1,), the last entry for held unknowns."""
        data = np.bincount(self.scatter, weights=element.ravel(), minlength=len(self.pattern.place) + 1)
        return np.asarray(data, dtype=np.float64)

    def scale(self, frames: Frames) -> Floats:
        """Stiffness (c,) of the contacts' unknowns."""
        return frames.largest(self.stiffness)


@dataclass(frozen=True)
class Paced:
    """An accepted increment as the predictor sees it: where it ended, its middle (None if unknown), its velocity."""

    tau: float
    middle: float | None
    velocity: Floats


@dataclass
class Pace:
    """Predicts an increment's motion: the velocity extrapolated linearly from the last two increments.

    The velocity of an increment is that of its middle. Where it changes by more than BOUNDED of itself (first yield,
    a landing, a reversal) the last velocity is kept.
    """

    last: Paced | None = None
    before: Paced | None = None

    def predict(self, state: State, tau: float) -> Floats:
        """Displacements, node by node, and translations (a d + m,) from ``state`` to ``tau``."""
        if self.last is None or self.last.tau != state.tau:
            middle = None if self.last is None else (self.last.tau + state.tau) / 2
            self.before, self.last = self.last, Paced(state.tau, middle, state.rates)
        return self._velocity(self.last, (state.tau + tau) / 2) * (tau - state.tau)

    def maximum(self) -> float | None:
        """Where the load has a maximum by how the motion speeds up before it; None where it does not.

        Next to one, at tau_c, |velocity| grows as (tau_c - tau)^(-1/2): |velocity|^-2 goes to zero linearly.
        """
        last, before = self.last, self.before
        if before is None or last is None or before.middle is None or last.middle is None:
            return None
        fast, slow = (float(v @ v) for v in (last.velocity, before.velocity))
        if not fast > FASTER**2 * slow > 0:
            return None
        return last.middle + (last.middle - before.middle) / (fast / slow - 1)

    def _velocity(self, last: Paced, middle: float) -> Floats:
        before = self.before
        if before is None or before.middle is None or last.middle is None:
            return last.velocity
        change = (last.velocity - before.velocity) * ((middle - last.middle) / (last.middle - before.middle))
        bounded = np.linalg.norm(change) <= BOUNDED * np.linalg.norm(last.velocity)
        return last.velocity + change if bounded else last.velocity
