"""Semismooth Newton with exact Coulomb friction and the consistent tangent: at most one factorisation a pass."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bipot.errors import InvertedElement, NotConverged, require
from bipot.fem.assembly import Space
from bipot.forms.base import Answer, FormName, Pass, Workspace
from bipot.programs.data import ContactRows, Outcome, Timing
from bipot.programs.newton import Frames, Linearised, Pattern
from bipot.programs.pieces import Deadband, Pieces
from bipot.response import Body, Response, State

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

BAND_PULL, BAND_GAP = 1e-9, 1e-11
"""Dead band over the largest contact force and the body size: a tenth of the default acceptance bounds."""


@dataclass(frozen=True)
class Reuse:
    """Keep a factor while the merit falls at least by ``fall`` a pass and no contact changes its piece."""

    fall: float = 0.05

    def __post_init__(self) -> None:
        require(0 <= self.fall < 1, "newton.reuse.fall", self.fall, "in [0, 1)")


@dataclass(frozen=True)
class Search:
    """Halve the step until the merit is at most ``slack`` times the largest of the last ``memory``.

    If ``halvings`` do not get there the best trial is taken: active sets change past a bump.
    """

    memory: int = 3
    slack: float = 1.0
    halvings: int = 4

    def __post_init__(self) -> None:
        require(self.memory >= 1, "newton.search.memory", self.memory, ">= 1")
        require(self.slack > 0, "newton.search.slack", self.slack, "> 0")
        require(self.halvings >= 0, "newton.search.halvings", self.halvings, ">= 0")


@dataclass(frozen=True)
class Setup:
    """What a run fixes: the space, the ordered pattern, the scatter of element matrices into its data, and a scale.

    ``stiffness`` (n + 1,) is the diagonal of the run's first tangent: it balances forces against motions.
    """

    space: Space
    pattern: Pattern
    scatter: Ints
    stiffness: Floats

    @staticmethod
    def of(body: Body, response: Response) -> Setup:
        """Order the stiffness pattern and compose the scatters."""
        space = body.space
        pattern = Pattern.of(space.indices, space.indptr)
        scatter = np.append(pattern.place, len(pattern.place))[space.scatter]
        diagonal = space.matrix(body.tangent(response)).diagonal()
        return Setup(space, pattern, scatter, np.append(diagonal, 0.0))

    def data(self, element: Floats) -> Floats:
        """Sum element matrices (e, 2k, 2k) into row-wise data (nnz + 1,), the last entry for held unknowns."""
        # The pattern is made from columns, its data are by rows.
        rowwise = element.transpose(0, 2, 1).ravel()
        return np.bincount(self.scatter, weights=rowwise, minlength=len(self.pattern.place) + 1)

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
    """What Newton keeps between passes: setup, frames of the last rows, the last factor, the increment's merits."""

    setup: Setup
    key: bytes = b""
    frames: Frames | None = None
    linearised: Linearised | None = None
    state: State | None = None
    merits: list[float] = field(default_factory=list)

    def begin(self, given: Pass) -> Frames:
        """Forget what belongs to another increment or to other contacts; frames of the given ones."""
        if self.state is not given.response.state:
            self.state, self.merits, self.linearised = given.response.state, [], None
        key = _key(given.rows)
        if self.frames is None or key != self.key:
            self.key, self.frames, self.linearised = key, Frames.of(given.rows, self.setup.pattern), None
        return self.frames


@dataclass(frozen=True)
class Newton:
    """The fast path and the polish. Raises ProgramError where contacts share unknowns; can cycle, then fall back."""

    reuse: Reuse = Reuse()
    search: Search = Search()
    name: ClassVar[FormName] = FormName.NEWTON
    exact: ClassVar[bool] = True

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """One pass: one step with a line search; a factorisation unless the last one still serves.

        Raises:
            ProgramError: singular matrix, or contact rows Newton does not take (:meth:`Frames.of`).
            InvertedElement: every trial of the line search is inadmissible.
        """
        began = time.perf_counter()
        if workspace.newton is None or workspace.newton.setup.space is not given.body.space:
            workspace.newton = Memory(Setup.of(given.body, given.response))
        memory = workspace.newton
        frames = memory.begin(given)
        scale = memory.setup.scale(frames)
        here = _iterate(given, scale, given.response, given.last_forces, memory.linearised)
        memory.merits.append(here.merit)
        linearised = self._linearised(given, memory, frames, here)
        built = time.perf_counter()
        dx, r = linearised.step(here.residual, here.motion, here.r)
        t, trial = self._search(given, scale, linearised, memory.merits, dx, r)
        timing = Timing(built - began, time.perf_counter() - built)
        return Answer(trial.response.x, trial.r, Outcome.SOLVED, 1, timing, response=trial.response)

    def _linearised(self, given: Pass, memory: Memory, frames: Frames, here: Iterate) -> Linearised:
        """The last factor while it serves, else a new one at the iterate."""
        last, merits = memory.linearised, memory.merits
        falls = len(merits) > 1 and merits[-1] <= self.reuse.fall * merits[-2]
        if last is None or not falls or not last.pieces.same(here.pieces):
            data = memory.setup.data(given.body.tangent(given.response))
            last = memory.linearised = Linearised.of(data, memory.setup.pattern, frames, here.pieces)
        return last

    def _search(
        self, given: Pass, scale: Floats, linearised: Linearised, merits: list[float], dx: Floats, r: Floats
    ) -> tuple[float, Iterate]:
        """The step length t and its iterate; an inverted element halves the step like a merit that does not fall."""
        response, start = given.response, given.last_forces
        enough = self.search.slack * max(merits[-self.search.memory :])
        best: tuple[float, Iterate] | None = None
        t, failure = 1.0, NotConverged("the Newton step is not finite")
        for _ in range(self.search.halvings + 1):
            try:
                there = given.body.respond(response.state, response.x + t * dx)
            except (InvertedElement, NotConverged) as inadmissible:
                failure = inadmissible
            else:
                trial = _iterate(given, scale, there, start + t * (r - start), linearised)
                if best is None or trial.merit < best[1].merit:
                    best = t, trial
                if trial.merit <= enough:
                    break
            t /= 2
        if best is None:
            raise failure
        return best


def _iterate(given: Pass, scale: Floats, response: Response, r: Floats, last: Linearised | None) -> Iterate:
    """Evaluate response and forces: merit = |(rho - G' r, law)| in units of force."""
    rows = given.rows
    motion, residual = rows.motion(response.x), response.internal - given.force
    largest = max(float(np.abs(r).max(initial=0.0)), float(np.abs(given.start_forces).max(initial=0.0)))
    band = Deadband(BAND_PULL * largest, BAND_GAP * given.units.size)
    pieces = Pieces.of(rows, motion, r, scale, band, None if last is None else last.pieces)
    balance, law = residual - rows.forces(r), pieces.value(motion, r)
    return Iterate(response, r, motion, residual, pieces, float(np.sqrt(balance @ balance + np.vdot(law, law))))


def _key(rows: ContactRows) -> bytes:
    """Equal for rows that share their frames."""
    parts = [a for G in (rows.G_n, rows.G_t) for a in (G.indptr, G.indices, G.data)]
    return b"".join(np.ascontiguousarray(a).tobytes() for a in (*parts, rows.frictional))
