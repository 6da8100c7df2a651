"""Semismooth Newton with exact Coulomb friction and the consistent tangent: at most one factorisation a pass."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bipot.conic.problem import Claim, Timing
from bipot.errors import BipotError, InvertedElement, NotConverged, require, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.memory import Setup
from bipot.forms.search import FOLDED, Aim, Point, Search
from bipot.iterate import Iterate
from bipot.programs.data import ContactRows, Stopwatch
from bipot.programs.factors import LinearSolver, SuperLU
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.newton import Linearised
from bipot.programs.pieces import Deadband, Pieces
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints, make_floats, max_abs, vdot

BAND_PULL, BAND_GAP = 1e-9, 1e-11
"""Dead band over the largest contact force and the body size: a tenth of the default acceptance bounds."""

FAINT = 1e-14
"""Gaps and slips below this part of the largest place and displacement are round-off of these."""

BAND_LAW = 1e-10
"""Dead band of the gap, as a force over the largest contact force: far below the bound on the law."""

NEAR_ENOUGH, TRIALS = (0.5, 2.0), 40
"""Range of the force of contacts on a tool over its driving force that is accurate enough for a starting point, and the
most trials to get there."""


@dataclass(frozen=True)
class Reuse:
    """Keep a factor while the merit is ``near``, falls at least by ``fall`` a pass, and no contact changes its piece.

    In an attempt's first pass it must fall by the square of ``fall``. ``near`` bounds the merit over the forces: a kept
    factor reduces the merit to a tenth or a hundredth, which reaches the bounds in a pass or two from there; from
    farther away it takes passes that a new factor, which squares the error, saves. In space slips turn from pass to
    pass: turns below the angle ``turn`` keep the piece, and the factor still contracts the error to about ``turn``.
    """

    fall: float = 0.03
    turn: float = 0.005
    near: float = 3e-5

    def __post_init__(self) -> None:
        make_floats(self, "fall", "turn", "near", of="newton.reuse.")
        for name in ("fall", "turn", "near"):
            value = getattr(self, name)
            require(0 <= value < 1, f"newton.reuse.{name}", value, "in [0, 1)")


@dataclass(frozen=True)
class Law:
    """The contacts of an increment with their frames and scale (c,): turns iterates into points.

    ``present`` is the largest contact force at the increment's start.
    """

    frames: Frames
    scale: Floats
    present: float

    def point(self, iterate: Iterate, r: Floats, last: Pieces | None) -> Point:
        """The point of an iterate and forces r (c, d), after the ``last`` pieces of the attempt if there are any."""
        rows, residual, motion = iterate.rows, iterate.residual, iterate.motion
        largest = max(max_abs(r), self.present)
        gap = np.minimum(BAND_GAP * iterate.increment.units.size, BAND_LAW * largest / self.scale)
        clear = motion if last is not None else _without_round_off(iterate, motion)
        pieces = Pieces.of(rows, clear, r, self.scale, Deadband(BAND_PULL * largest, gap), last)
        if iterate.measured is not None:
            pieces = replace(pieces, measured=iterate.measured)
        balance, miss = residual - rows.forces(r), pieces.value(motion, r)
        merit = math.sqrt(float(balance @ balance) + vdot(miss, miss))
        return Point(iterate, r, motion, pieces, miss, merit)

    def frames_at(self, iterate: Iterate) -> Frames:
        """The contacts' frames at an iterate."""
        return self.frames.turned(iterate.rows) if iterate.increment.system.candidates.curved else self.frames


def _without_round_off(iterate: Iterate, motion: Floats) -> Floats:
    """The ``motion`` (c, d) with zero for round-off, which would choose the pieces where an attempt begins.

    Without forces yet, a gap of 1e-17 is an open contact and such a slip slides: nothing may hold the body then.
    """
    places = max(max_abs(iterate.increment.start.nodes), max_abs(iterate.response.du))
    return np.where(np.abs(motion) > FAINT * places, motion, 0.0)


@dataclass(frozen=True)
class Memory:
    """What Newton carries from pass to pass: the last factor, the merits so far, and ``here``, the point where it is.

    ``here`` is made in the first pass, which includes its cost.
    """

    setup: Setup
    law: Law
    linearised: Linearised[Pieces] | None = None
    merits: tuple[float, ...] = ()
    here: Point | None = None


@dataclass(frozen=True)
class Newton:
    """The form of the cheapest passes, which can cycle: then another form has to take over. ``linear`` factorises."""

    reuse: Reuse = Reuse()
    search: Search = Search()
    linear: LinearSolver = SuperLU()
    name: ClassVar[FormName] = FormName.NEWTON

    def __post_init__(self) -> None:
        require_type(self.reuse, Reuse, "newton.reuse")
        require_type(self.search, Search, "newton.search")
        require_type(self.linear, LinearSolver, "newton.linear")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Memory:
        """The state before the first pass; nothing is kept from other attempts."""
        setup, frames = cache.setup(iterate), cache.frames(iterate.rows, iterate)
        return Memory(setup, Law(frames, setup.scale(frames), max_abs(iterate.increment.start.forces)))

    def step(self, iterate: Iterate, r: Floats, state: Memory) -> tuple[Step, Memory]:
        """One step with a line search; a factorisation unless the last one still serves.

        Raises:
            ProgramError: the matrix is singular.
            InvertedElement: in all trials of the line search; so NotConverged, if all run away.
        """
        clock = Stopwatch()
        began = clock.outside()
        here = state.here or self._first(iterate, r, state)
        merits = (*state.merits, here.merit)
        frames = state.law.frames_at(here.iterate)
        linearised = self._linearised(state, here, frames, merits, clock)
        built = clock.outside()
        dx, new = linearised.step(iterate.residual, here.miss, here.r)
        there = self._search(state.law, here, linearised.pieces, dx, new, clock)
        timing = Timing(built - began, clock.outside() - built, clock.seconds)
        # Where a contact has no force, the solution of its row is round-off; caps are those of the new iterate.
        forces = there.pieces.at_caps(np.where(there.pieces.none, 0.0, there.r))
        step = Step(there.iterate, forces, Claim.SOLVED, 1, timing, error=there.error)
        return step, replace(state, linearised=linearised, merits=merits, here=there)

    def _first(self, iterate: Iterate, r: Floats, state: Memory) -> Point:
        """The point where the first pass begins: tools that forces drive and nothing resists are moved to the body."""
        law, pushed = state.law, state.setup.pushed
        here = law.point(iterate, r, None)
        loose = pushed[~resisted(iterate.rows, here.pieces.by_motion, pushed)] if pushed.size else pushed
        if not loose.size or not self.search.landing:
            return here
        return law.point(touching(iterate, loose, self.search.landing / SOFTENED * law.scale), r, None)

    def _linearised(
        self, state: Memory, here: Point, frames: Frames, merits: tuple[float, ...], clock: Stopwatch
    ) -> Linearised[Pieces]:
        """The last factor while it serves, else a new one at the iterate."""
        last, setup = state.linearised, state.setup
        # The first pass takes the tools' motion out of the merit, which is linear: its fall says less of the factor.
        fall = self.reuse.fall ** (2 if len(merits) == 2 else 1)
        falls = len(merits) > 1 and merits[-1] <= fall * merits[-2] and here.error <= self.reuse.near
        if last is not None and falls and last.pieces.same(here.pieces, self.reuse.turn):
            # The matrix is that of an earlier iterate, but what must vanish is that of this one, with its caps.
            return replace(last, frames=frames, pieces=here.pieces)
        with clock:
            element = here.iterate.tangent(here.r, setup.scratch)
        data = setup.data(element)
        if setup.spins.size:
            setup.hold(data, resisted(here.iterate.rows, here.pieces.by_motion, setup.spins))
        return Linearised.of(data, frames, here.pieces, self.linear)

    def _search(self, law: Law, here: Point, pieces: Pieces, along: Floats, r: Floats, clock: Stopwatch) -> Point:
        """The point found by the line search on the step ``along`` (n,) from ``here`` to the forces r (c, d)."""
        increment, aim = here.iterate.increment, Aim(self.search, here, along, r)
        best: Point | None = None
        t, failure = 1.0, BipotError()
        for _ in range(self.search.trials + 1):
            try:
                with clock:
                    iterate = increment.at(here.iterate.x + t * along)
            except (InvertedElement, NotConverged) as inadmissible:
                failure, t = inadmissible, aim.shorter(t, FOLDED)
                continue
            trial = law.point(iterate, here.r + t * (r - here.r), pieces)
            rest = aim.rest(trial)
            if aim.meets(t, trial, rest):
                return trial
            best = trial if best is None or trial.merit < best.merit else best
            t = aim.shorter(t, rest)
        if best is None:
            raise failure
        return best


def resisted(rows: ContactRows, by_motion: Floats, tools: Ints) -> Bools:
    """Which tool coordinates ``tools`` (s,) change the law of any contact, with its slopes ``by_motion`` (c, d, d).

    Round-off does not count: a sliding contact in space resists motion along its slip by a difference of zero.
    """
    motion = np.zeros((*by_motion.shape[:2], len(tools)))
    motion[:, 0] = rows.G_n[:, tools].toarray()
    motion[rows.frictional, 1:] = rows.G_t[:, tools].toarray().reshape(-1, rows.tangents, len(tools))
    change, most = np.abs(by_motion @ motion), np.abs(by_motion) @ np.abs(motion)
    return np.asarray((change > ACROSS * most).any(axis=(0, 1)))


def touching(iterate: Iterate, coordinates: Ints, stiffness: Floats) -> Iterate:
    """The iterate with the tool ``coordinates`` (m,) moved until the contacts push back about as hard as the force.

    Before first contact Newton's matrix is singular. A contact pushes by ``stiffness`` (c,) times its depth in the
    tool, while the body rests. A tool that meets nothing stays where it is.
    """
    for coordinate in coordinates.tolist():
        iterate = _moved(iterate, coordinate, stiffness)
    return iterate


def _moved(iterate: Iterate, coordinate: int, stiffness: Floats) -> Iterate:
    """The iterate with one tool moved by :func:`touching`."""
    force = -float(iterate.residual[coordinate])
    comes = -np.sign(force) * iterate.rows.G_n[:, [coordinate]].toarray()[:, 0]
    meets = np.flatnonzero(comes > 0)
    if not meets.size:
        return iterate
    # The first trial is about where the first contact alone would carry the force.
    ways = iterate.motion[meets, 0] / comes[meets] + abs(force) / (stiffness[meets] * comes[meets] ** 2)
    near, far, way = 0.0, np.inf, float(ways.min())
    for _ in range(TRIALS):
        x = iterate.x.copy()
        x[coordinate] += np.sign(force) * way
        there = iterate.increment.at(x)
        pushed = stiffness * np.maximum(-there.motion[:, 0], 0.0)
        part = -float(pushed @ there.rows.G_n[:, [coordinate]].toarray()[:, 0]) / force
        if NEAR_ENOUGH[0] <= part <= NEAR_ENOUGH[1]:
            return there
        near, far = (way, far) if part < 1 else (near, way)
        way = (near + far) / 2 if np.isfinite(far) else 2 * way
    return iterate
