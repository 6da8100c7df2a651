"""Semismooth Newton with exact Coulomb friction and the consistent tangent: at most one factorisation a pass."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from bipot.conic.problem import Outcome, Timing
from bipot.errors import BipotError, InvertedElement, NotConverged, require, require_count, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.memory import Setup
from bipot.forms.touching import resisted, touching
from bipot.iterate import Iterate
from bipot.programs.data import Stopwatch
from bipot.programs.factors import LinearSolver, SuperLU
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.newton import Linearised
from bipot.programs.pieces import Deadband, Pieces
from bipot.typing import Floats, make_floats, vdot

BAND_PULL, BAND_GAP = 1e-9, 1e-11
"""Dead band over the largest contact force and the body size: a tenth of the default acceptance bounds."""

BAND_LAW = 1e-10
"""Dead band of the gap in units of force, over the largest contact force: far below the bound on the law."""


@dataclass(frozen=True)
class Reuse:
    """Keep a factor while the merit is ``near``, falls at least by ``fall`` a pass, and no contact changes its piece.

    In an attempt's first pass it must fall by the square of that. Near is a merit of at most so much of the forces: a
    kept factor leaves a tenth to a hundredth of it, which reaches the bounds in a pass or two from there; from farther
    away it takes passes that a new one, which squares the error, saves. In space slips turn from pass to pass: by less
    than the angle ``turn`` they are those of the factor, which then still contracts the error about so much.
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
class Search:
    """How far to go along Newton's step: all of it where the merit falls to ``fall`` of itself, else by trials.

    The work of the body's forces against the new ones of the contacts, g(t) = dx . (rho - G' r) at x + t dx, r + dr, is
    - dx . K dx at the start, however far contacts are from their law, and goes linearly to zero at t = 1 where
    everything is linear; where a landing unloads the body or brings much of it to yield, the whole step goes too far
    and g changes its sign. Then t is found by false position such that |g(t)| is at most ``work`` times |g(0)|. A whole
    step that is too short is not lengthened. A step to a larger merit is halved: contacts have met what it was not made
    for. Where there are no contacts, as in a body that loads alone deform, it is not: a load beyond the limit, of which
    the steps grow without end, is then given up soon. A step of less merit next to one that was halved so, along which
    g has hardly begun to fall, is as good as any between them: these are as far from g = 0. A step is halved, too,
    until the merit falls, where g(0) is not below zero and says nothing. If ``trials`` do not get there the one of
    least merit is taken: active sets change past a bump.

    A tool that a force drives and that few contacts resist would go through all others. Those that were open are taken
    to push it where it comes upon them, by ``landing`` times the elastic stiffness there, less than all of it as they
    yield together, and g counts the work of that. How deep they lie in it then says more than how the merit falls.
    """

    fall: float = 0.1
    work: float = 0.3
    landing: float = 0.1
    trials: int = 5

    def __post_init__(self) -> None:
        make_floats(self, "fall", "work", "landing", of="newton.search.")
        for name in ("fall", "work", "landing"):
            value = getattr(self, name)
            require(0 <= value < 1, f"newton.search.{name}", value, "in [0, 1)")
        require_count(self.trials, "newton.search.trials", 0)


UNBEGUN = 0.8
"""g(t)/g(0) above which g has hardly begun to fall."""

NARROWED = 0.15, 0.75
"""Part of its bracket that a false position leaves and takes, at least and at most."""

FOLDED = -4.0
"""Stands for g(t)/g(0) of a step that folds an element: it is much too long."""


class Point(NamedTuple):
    """An iterate with contact forces r (c, d) as Newton sees it: motion (c, d), pieces of the law, ``miss``, merit.

    The merit is |(rho - G' r, miss)|, in units of force; ``miss`` (c, d) is the law's value.
    """

    iterate: Iterate
    r: Floats
    motion: Floats
    pieces: Pieces
    miss: Floats
    merit: float

    @property
    def error(self) -> float:
        """The merit over the norm of the forces; inf where there are none."""
        present = math.sqrt(vdot(self.r, self.r))
        return self.merit / present if present else np.inf

    def work(self, along: Floats, r: Floats) -> float:
        """Work along a step (n,) of the body's forces that contact forces r (c, d) leave unbalanced."""
        return float(along @ (self.iterate.residual - self.iterate.rows.forces(r)))

    def landing(self, before: Pieces, driven: Floats) -> float:
        """Work of the elastic stiffness at contacts open ``before`` on what tools went ``driven`` (n,) into them."""
        depth = np.where(before.closed, 0.0, np.maximum(-self.motion[:, 0], 0.0))
        deeper = -(self.iterate.rows.G_n @ driven)
        return float((before.scale / SOFTENED * depth) @ deeper)


@dataclass(frozen=True)
class Law:
    """The contacts of an increment with their frames and scale (c,): turns iterates into points.

    ``present`` is the largest contact force at the increment's start.
    """

    frames: Frames
    scale: Floats
    present: float

    def point(self, iterate: Iterate, r: Floats, last: Pieces | None) -> Point:
        """Evaluate iterate and forces (c, d)."""
        rows, residual = iterate.rows, iterate.residual
        motion = iterate.motion
        largest = max(float(np.abs(r).max(initial=0.0)), self.present)
        gap = np.minimum(BAND_GAP * iterate.increment.units.size, BAND_LAW * largest / self.scale)
        pieces = Pieces.of(rows, motion, r, self.scale, Deadband(BAND_PULL * largest, gap), last)
        if iterate.measured is not None:
            pieces = replace(pieces, measured=iterate.measured)
        balance, miss = residual - rows.forces(r), pieces.value(motion, r)
        merit = math.sqrt(float(balance @ balance) + vdot(miss, miss))
        return Point(iterate, r, motion, pieces, miss, merit)

    def frames_at(self, iterate: Iterate) -> Frames:
        """The contacts' frames at an iterate."""
        return self.frames.turned(iterate.rows) if iterate.increment.system.candidates.curved else self.frames


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
    """The fast path. It can cycle: then others have to go on. ``linear`` factorises."""

    reuse: Reuse = Reuse()
    search: Search = Search()
    linear: LinearSolver = SuperLU()
    name: ClassVar[FormName] = FormName.NEWTON

    def __post_init__(self) -> None:
        require_type(self.reuse, Reuse, "newton.reuse")
        require_type(self.search, Search, "newton.search")
        require_type(self.linear, LinearSolver, "newton.linear")

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
        here = state.here or self._first(iterate, r, state)
        merits = (*state.merits, here.merit)
        frames = state.law.frames_at(here.iterate)
        linearised = self._linearised(state, here, frames, merits, clock)
        built = clock.outside()
        dx, new = linearised.step(iterate.residual, here.miss, here.r)
        there = self._search(state.law, here, linearised.pieces, dx, new, clock)
        timing = Timing(built - began, clock.outside() - built, clock.seconds)
        # Where there is no force, what is left of it is the round-off of its row; caps are those of the new iterate.
        forces = there.pieces.at_caps(np.where(there.pieces.none, 0.0, there.r))
        step = Step(there.iterate, forces, Outcome.SOLVED, 1, timing, error=there.error)
        return step, replace(state, linearised=linearised, merits=merits, here=there)

    def _first(self, iterate: Iterate, r: Floats, state: Memory) -> Point:
        """Where the first pass begins: tools that forces drive and nothing resists go to what they come upon."""
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
        # The first pass takes out the tools' motion, which is linear: its fall says less of the factor.
        fall = self.reuse.fall ** (2 if len(merits) == 2 else 1)
        falls = len(merits) > 1 and merits[-1] <= fall * merits[-2] and here.error <= self.reuse.near
        if last is not None and falls and last.pieces.same(here.pieces, self.reuse.turn):
            # Its matrix is that of an earlier iterate; what must vanish is of this one, with its caps.
            return replace(last, frames=frames, pieces=here.pieces)
        with clock:
            element = here.iterate.tangent(here.r, setup.scratch)
        data = setup.data(element)
        if setup.spins.size:
            setup.hold(data, resisted(here.iterate.rows, here.pieces.by_motion, setup.spins))
        return Linearised.of(data, frames, here.pieces, self.linear)

    def _search(self, law: Law, here: Point, pieces: Pieces, along: Floats, r: Floats, clock: Stopwatch) -> Point:
        """The point of the step length found, of the step ``along`` (n,) to forces r (c, d)."""
        increment, aim = here.iterate.increment, _Aim(self.search, here, along, r)
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


class _Aim:
    """How far to go along a step: what has been tried of it."""

    def __init__(self, search: Search, here: Point, along: Floats, r: Floats) -> None:
        self.search, self.here, self.along, self.r = search, here, along, r
        self.work = here.work(along, r)
        # What of the step tools that are driven go by themselves.
        self.driven = along.copy()
        self.driven[: len(here.iterate.increment.system.body.space.free)] = 0.0
        self.halves = not self.work < 0
        # Whether the last trial was too long because contacts met something.
        self.met = False
        # Step lengths with g(t)/g(0) above and below zero.
        self.short, self.long = (0.0, 1.0), (1.0, FOLDED)

    def rest(self, trial: Point) -> float:
        """g(t)/g(0) of a trial, zero where it says nothing, -1 where it has the larger merit and is to be halved."""
        if self.halves:
            return 0.0
        rest = (trial.work(self.along, self.r) + self._landing(trial)) / self.work
        return -1.0 if trial.merit > self.here.merit and trial.miss.size else rest

    def meets(self, t: float, trial: Point, rest: float) -> bool:
        """Whether the trial of length t is good enough."""
        if self.halves:
            return trial.merit <= self.here.merit
        falls = trial.merit <= self.search.fall * self.here.merit and not self._landing(trial)
        whole = t == 1.0 and (rest > 0 or falls)
        before = self.met and rest > UNBEGUN and trial.merit <= self.here.merit
        return whole or before or abs(rest) <= self.search.work

    def _landing(self, trial: Point) -> float:
        """What the work of the unbalanced forces grows by where driven tools come upon open contacts."""
        return self.search.landing * trial.landing(self.here.pieces, self.driven) if self.driven.any() else 0.0

    def shorter(self, t: float, rest: float) -> float:
        """The length to try after t."""
        if self.halves:
            return t / 2
        self.met = rest == -1.0
        if rest > 0:
            self.short = t, rest
        else:
            self.long = t, rest
        (a, at_a), (b, at_b) = self.short, self.long
        return a + (b - a) * min(max(at_a / (at_a - at_b), NARROWED[0]), NARROWED[1])
