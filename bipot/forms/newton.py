"""Semismooth Newton with exact Coulomb friction and the consistent tangent: at most one factorisation a pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bipot.errors import BipotError, InvertedElement, NotConverged, require, require_count, require_number, require_type
from bipot.forms.base import Answer, FormName, Pass, Workspace
from bipot.forms.memory import Iterate, Memory, Setup
from bipot.programs.data import Outcome, Stopwatch, Timing
from bipot.programs.newton import Frames, Linearised
from bipot.programs.pieces import Deadband, Pieces
from bipot.response import Response

Floats = NDArray[np.float64]

BAND_PULL, BAND_GAP = 1e-9, 1e-11
"""Dead band over the largest contact force and the body size: a tenth of the default acceptance bounds."""

BAND_LAW = 1e-10
"""Dead band of the gap in units of force, over the largest contact force: far below the bound on the law."""


@dataclass(frozen=True)
class Reuse:
    """Keep a factor while the merit falls at least by ``fall`` a pass and no contact changes its piece.

    In an attempt's first pass it must fall by the third power of that.
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


@dataclass(frozen=True)
class Newton:
    """The fast path and the polish. Raises ProgramError where contacts share unknowns; can cycle, then fall back."""

    reuse: Reuse = Reuse()
    search: Search = Search()
    name: ClassVar[FormName] = FormName.NEWTON
    exact: ClassVar[bool] = True
    shifts: ClassVar[bool] = False
    nearby: ClassVar[bool] = False

    def __post_init__(self) -> None:
        require_type(self.reuse, Reuse, "newton.reuse")
        require_type(self.search, Search, "newton.search")

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """One pass: one step with a line search; a factorisation unless the last one still serves.

        Raises:
            ProgramError: singular matrix, or contact rows Newton does not take (:meth:`Frames.of`).
            InvertedElement: every trial of the line search is inadmissible.
        """
        began = workspace.assembly.outside()
        if workspace.newton is None or workspace.newton.setup.space is not given.body.space:
            workspace.newton = Memory(Setup.of(given.body, given.response))
        memory = workspace.newton
        frames = memory.begin(given.rows)
        law = Law(given, frames, memory.setup.scale(frames))
        here = memory.iterate
        if here is None or here.response is not given.response:
            here = law.iterate(given.response, given.last_forces, memory.linearised)
        memory.merits.append(here.merit)
        linearised = self._linearised(given, memory, frames, here, workspace.assembly)
        built = workspace.assembly.outside()
        dx, r = linearised.step(here.residual, here.motion, here.r)
        trial = self._search(law, here, linearised, memory.merits, dx, r, workspace.assembly)
        memory.iterate = trial
        timing = Timing(built - began, workspace.assembly.outside() - built)
        # An open contact's force is the round-off of its row.
        r = np.where(trial.pieces.closed[:, None], trial.r, 0.0)
        return Answer(trial.response.x, r, Outcome.SOLVED, 1, timing, response=trial.response, coupled=True)

    def _linearised(
        self, given: Pass, memory: Memory, frames: Frames, here: Iterate, assembly: Stopwatch
    ) -> Linearised[Pieces]:
        """The last factor while it serves, else a new one at the iterate."""
        last, merits = memory.linearised, memory.merits
        # The first pass takes out the tools' motion, which is linear: its fall says less of the factor.
        fall = self.reuse.fall ** (3 if len(merits) == 2 else 1)
        falls = len(merits) > 1 and merits[-1] <= fall * merits[-2]
        if last is None or not falls or not last.pieces.same(here.pieces):
            with assembly:
                element = given.body.tangent(given.response, memory.setup.scratch)
            data = memory.setup.data(element)
            last = memory.linearised = Linearised.of(data, memory.setup.pattern, frames, here.pieces)
        return last

    def _search(
        self,
        law: Law,
        here: Iterate,
        linearised: Linearised[Pieces],
        merits: list[float],
        dx: Floats,
        r: Floats,
        assembly: Stopwatch,
    ) -> Iterate:
        """The iterate of the step length found; an inverted element halves it like a merit that does not fall."""
        body, start = law.given.body, here.response
        enough = self.search.slack * max(merits[-self.search.memory :])
        best: Iterate | None = None
        t, failure = 1.0, BipotError()
        for _ in range(self.search.halvings + 1):
            try:
                with assembly:
                    response = body.respond(start.state, start.x + t * dx)
            except (InvertedElement, NotConverged) as inadmissible:
                failure = inadmissible
            else:
                trial = law.iterate(response, here.r + t * (r - here.r), linearised)
                best = trial if best is None or trial.merit < best.merit else best
                if trial.merit <= enough:
                    break
            t /= 2
        if best is None:
            raise failure
        return best


@dataclass(frozen=True)
class Law:
    """The contacts of a pass with their frames and scale (c,): turns responses into iterates."""

    given: Pass
    frames: Frames
    scale: Floats

    def iterate(self, response: Response, r: Floats, last: Linearised[Pieces] | None) -> Iterate:
        """Evaluate response and forces (c, d): merit = |(rho - G' r, law)| in units of force."""
        given, rows = self.given, self.given.rows
        motion, residual = self.frames.motion(rows, response.x), response.internal - given.force
        largest = max(float(np.abs(r).max(initial=0.0)), float(np.abs(given.start_forces).max(initial=0.0)))
        gap = np.minimum(BAND_GAP * given.units.size, BAND_LAW * largest / self.scale)
        band = Deadband(BAND_PULL * largest, gap)
        pieces = Pieces.of(rows, motion, r, self.scale, band, None if last is None else last.pieces)
        balance, law = residual - self.frames.forces(r, len(residual)), pieces.value(motion, r)
        return Iterate(response, r, motion, residual, pieces, float(np.sqrt(balance @ balance + np.vdot(law, law))))
