"""What Newton keeps between the passes of a run: ordering and scatter, contact frames, the last factor."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bipot.fem.assembly import Space
from bipot.fem.geometric import Scratch
from bipot.programs.data import ContactRows
from bipot.programs.newton import Frames, Linearised, Pattern
from bipot.programs.pieces import Pieces
from bipot.response import Body, Response, State

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

SOFTENED = 1e-2
BOUNDED = 0.3


@dataclass(frozen=True)
class Setup:
    """What a run fixes: space, ordered pattern, scatter of element matrices into its data, a scale, and memory.

    ``stiffness`` (n + 1,) is a hundredth of the diagonal of the run's first tangent: it balances forces against
    motions. The hundredth stands for the plastic moduli: with elastic ones a landing node slips to and fro.
    """

    space: Space
    pattern: Pattern
    scatter: Ints
    stiffness: Floats
    scratch: Scratch

    @staticmethod
    def of(body: Body, response: Response) -> Setup:
        """Order the stiffness pattern and compose the scatters."""
        space = body.space
        pattern = Pattern.of(space.indices, space.indptr)
        scatter = np.append(pattern.place, len(pattern.place))[space.scatter]
        scratch = body.scratch()
        diagonal = space.matrix(body.tangent(response, scratch)).diagonal()
        return Setup(space, pattern, scatter, np.append(SOFTENED * diagonal, 0.0), scratch)

    def data(self, element: Floats) -> Floats:
        """Sum element matrices (e, 2k, 2k) into row-wise data (nnz + 1,), the last entry for held unknowns."""
        data = np.bincount(self.scatter, weights=element.ravel(), minlength=len(self.pattern.place) + 1)
        return np.asarray(data, dtype=np.float64)

    def scale(self, frames: Frames) -> Floats:
        """Stiffness (c,) of the contacts' own unknowns."""
        return self.stiffness[frames.own].max(axis=1)


class Iterate(NamedTuple):
    """A response with contact forces r (c, d): motion (c, d), residual rho (n,), pieces of the law, merit."""

    response: Response
    r: Floats
    motion: Floats
    residual: Floats
    pieces: Pieces
    merit: float


@dataclass
class Memory:
    """What Newton keeps between passes: setup, frames of the last rows, the last factor, the attempt's merits."""

    setup: Setup
    rows: ContactRows | None = None
    key: bytes = b""
    frames: Frames | None = None
    linearised: Linearised[Pieces] | None = None
    merits: list[float] = field(default_factory=list)
    iterate: Iterate | None = None

    def begin(self, rows: ContactRows) -> Frames:
        """Forget what belongs to another attempt, which has other rows, be it from the same state; their frames."""
        if self.frames is not None and self.rows is rows:
            return self.frames
        self.merits, self.linearised, self.iterate = [], None, None
        key = _key(rows)
        if self.frames is None or key != self.key:
            self.frames, self.key = Frames.of(rows, self.setup.pattern), key
        self.rows = rows
        return self.frames


@dataclass(frozen=True)
class Step:
    """An accepted increment as the predictor sees it: where it ended, its middle (None if unknown), its velocity."""

    tau: float
    middle: float | None
    velocity: Floats


@dataclass
class Pace:
    """Predicts an increment's displacement: the velocity extrapolated linearly from the last two increments.

    The velocity of an increment is that of its middle. Where it changes by more than BOUNDED of itself (first yield,
    a landing, a reversal) the last velocity is kept.
    """

    last: Step | None = None
    before: Step | None = None

    def predict(self, state: State, tau: float) -> Floats:
        """Displacement (a, d) from ``state`` to ``tau``."""
        if self.last is None or self.last.tau != state.tau:
            middle = None if self.last is None else (self.last.tau + state.tau) / 2
            self.before, self.last = self.last, Step(state.tau, middle, state.velocity)
        return self._velocity(self.last, (state.tau + tau) / 2) * (tau - state.tau)

    def _velocity(self, last: Step, middle: float) -> Floats:
        before = self.before
        if before is None or before.middle is None or last.middle is None:
            return last.velocity
        change = (last.velocity - before.velocity) * ((middle - last.middle) / (last.middle - before.middle))
        bounded = np.linalg.norm(change) <= BOUNDED * np.linalg.norm(last.velocity)
        return last.velocity + change if bounded else last.velocity


def _key(rows: ContactRows) -> bytes:
    """Equal for rows that share their frames."""
    parts = [a for G in (rows.G_n, rows.G_t) for a in (G.indptr, G.indices, G.data)]
    return b"".join(np.ascontiguousarray(a).tobytes() for a in (*parts, rows.frictional))
