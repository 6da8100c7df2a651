"""Semismooth Newton with exact Coulomb friction and the consistent tangent: at most one factorisation a pass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from bipot.conic.problem import Outcome, Timing
from bipot.errors import BipotError, InvertedElement, NotConverged, require, require_count, require_number, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.memory import Setup
from bipot.iterate import Iterate
from bipot.programs.data import Stopwatch
from bipot.programs.frames import Frames
from bipot.programs.newton import Linearised
from bipot.programs.pieces import Deadband, Pieces
from bipot.typing import Floats

BAND_PULL, BAND_GAP = 1e-9, 1e-11
"""Dead band over the largest contact force and the body size: a tenth of the default acceptance bounds."""

BAND_LAW = 1e-10
"""Dead band of the gap in units of force, over the largest contact force: far below the bound on the law."""


@dataclass(frozen=True)
class Reuse:
    """Keep a factor while the merit falls at least by ``fall`` a pass and no contact changes its piece.

    In an attempt's first pass it must fall by the square of that.
    """

    fall: float = 0.05

    def __post_init__(self) -> None:
        require_number(self.fall, "newton.reuse.fall")
        require(0 <= self.fall < 1, "newton.reuse.fall", self.fall, "in [0, 1)")


@dataclass(frozen=True)
class Search:
    """Halve the step until the merit is at most ``slack`` times the largest of the last ``memory``.

    If ``halvings`` do not get there the best trial is taken: active sets change past a bump.
    """

    memory: int = 1
    slack: float = 1.0
    halvings: int = 4

    def __post_init__(self) -> None:
        require_count(self.memory, "newton.search.memory")
        require_number(self.slack, "newton.search.slack")
        require(0 < self.slack < np.inf, "newton.search.slack", self.slack, "finite and > 0")
        require_count(self.halvings, "newton.search.halvings", 0)


class Point(NamedTuple):
    """An iterate with contact forces r (c, d) as Newton sees it: motion (c, d), pieces of the law, merit."""

    iterate: Iterate
    r: Floats
    motion: Floats
    pieces: Pieces
    merit: float


@dataclass(frozen=True)
class Law:
    """The contacts of an increment with their frames and scale (c,): turns iterates into points.

    ``present`` is the largest contact force at the increment's start.
    """

    frames: Frames
    scale: Floats
    present: float

    def point(self, iterate: Iterate, r: Floats, last: Pieces | None) -> Point:
        """Evaluate iterate and forces (c, d): merit = |(rho - G' r, law)| in units of force."""
        rows, residual = iterate.rows, iterate.residual
        motion = iterate.motion
        largest = max(float(np.abs(r).max(initial=0.0)), self.present)
        gap = np.minimum(BAND_GAP * iterate.increment.units.size, BAND_LAW * largest / self.scale)
        pieces = Pieces.of(rows, motion, r, self.scale, Deadband(BAND_PULL * largest, gap), last)
        balance, law = residual - rows.forces(r), pieces.value(motion, r)
        return Point(iterate, r, motion, pieces, float(np.sqrt(balance @ balance + np.vdot(law, law))))


@dataclass(frozen=True)
class Memory:
    """What Newton carries from pass to pass: the last factor, the merits so far, the point where it is.

    ``here`` is made in the first pass, of which it is a part.
    """

    setup: Setup
    law: Law
    linearised: Linearised[Pieces] | None = None
    merits: tuple[float, ...] = ()
    here: Point | None = None


@dataclass(frozen=True)
class Newton:
    """The fast path. It can cycle: then others have to go on."""

    reuse: Reuse = Reuse()
    search: Search = Search()
    name: ClassVar[FormName] = FormName.NEWTON

    def __post_init__(self) -> None:
        require_type(self.reuse, Reuse, "newton.reuse")
        require_type(self.search, Search, "newton.search")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Memory:
        """Nothing is kept of another attempt."""
        setup, frames = cache.newton(iterate)
        present = float(np.abs(iterate.increment.start.forces).max(initial=0.0))
        return Memory(setup, Law(frames, setup.scale(frames), present))

    def step(self, iterate: Iterate, r: Floats, state: Memory) -> tuple[Step, Memory]:
        """One step with a line search; a factorisation unless the last one still serves.

        Raises:
            ProgramError: singular matrix.
            InvertedElement: every trial of the line search is inadmissible.
        """
        clock = Stopwatch()
        began = clock.outside()
        here = state.here or state.law.point(iterate, r, None)
        merits = (*state.merits, here.merit)
        linearised = self._linearised(state, here, merits, clock)
        built = clock.outside()
        dx, new = linearised.step(iterate.residual, here.motion, here.r)
        there = self._search(state.law, here, linearised.pieces, merits, dx, new, clock)
        timing = Timing(built - began, clock.outside() - built, clock.seconds)
        # Where there is no force, what is left of it is the round-off of its row.
        forces = np.where(there.pieces.none, 0.0, there.r)
        step = Step(there.iterate, forces, Outcome.SOLVED, 1, timing)
        return step, replace(state, linearised=linearised, merits=merits, here=there)

    def _linearised(
        self, state: Memory, here: Point, merits: tuple[float, ...], clock: Stopwatch
    ) -> Linearised[Pieces]:
        """The last factor while it serves, else a new one at the iterate."""
        last, setup = state.linearised, state.setup
        # The first pass takes out the tools' motion, which is linear: its fall says less of the factor.
        fall = self.reuse.fall ** (2 if len(merits) == 2 else 1)
        falls = len(merits) > 1 and merits[-1] <= fall * merits[-2]
        if last is not None and falls and last.pieces.same(here.pieces):
            return last
        with clock:
            element = here.iterate.tangent(setup.scratch)
        return Linearised.of(setup.data(element), state.law.frames, here.pieces)

    def _search(
        self,
        law: Law,
        here: Point,
        pieces: Pieces,
        merits: tuple[float, ...],
        dx: Floats,
        r: Floats,
        clock: Stopwatch,
    ) -> Point:
        """The point of the step length found; an inverted element halves it like a merit that does not fall."""
        start = here.iterate
        enough = self.search.slack * max(merits[-self.search.memory :])
        best: Point | None = None
        t, failure = 1.0, BipotError()
        for _ in range(self.search.halvings + 1):
            try:
                with clock:
                    iterate = start.increment.at(start.x + t * dx)
            except (InvertedElement, NotConverged) as inadmissible:
                failure = inadmissible
            else:
                trial = law.point(iterate, here.r + t * (r - here.r), pieces)
                best = trial if best is None or trial.merit < best.merit else best
                if trial.merit <= enough:
                    break
            t /= 2
        if best is None:
            raise failure
        return best
