"""Semismooth Newton with exact Coulomb friction and the consistent tangent: at most one factorisation a pass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bipot.conic.problem import Claim, Timing
from bipot.errors import BipotError, InvertedElement, NotConverged, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.memory import Setup
from bipot.forms.outset import FLOWS, flow_from_rest, resisted, touching
from bipot.forms.point import Law, Point
from bipot.forms.search import FOLDED, Aim, Search
from bipot.iterate import Iterate
from bipot.programs.data import Stopwatch
from bipot.programs.factors import LinearSolver, SuperLU
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.newton import Linearised
from bipot.programs.pieces import Pieces
from bipot.typing import Floats, make_floats, max_abs


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
        make_floats(self, of="newton.reuse.", fall="in [0, 1)", turn="in [0, 1)", near="in [0, 1)")


@dataclass(frozen=True)
class Memory:
    """What Newton carries from pass to pass: the last factor, the merits so far, and ``here``, the point where it is.

    ``here`` is made in the first pass, which includes its cost. ``flows`` counts the passes in which a body at rest
    flowed, of which there are no merits. The last factor at deformable tools is left in the ``cache``.
    """

    setup: Setup
    law: Law
    cache: Cache
    linearised: Linearised[Pieces] | None = None
    merits: tuple[float, ...] = ()
    here: Point | None = None
    flows: int = 0


@dataclass(frozen=True)
class Newton:
    """The form of the cheapest passes, which can cycle: then another form has to take over.

    ``reuse`` says when a factor is kept, ``search`` how far to go along a step, and ``linear`` factorises.
    """

    reuse: Reuse = Reuse()
    search: Search = Search()
    linear: LinearSolver = SuperLU()
    name: ClassVar[FormName] = FormName.NEWTON

    def __post_init__(self) -> None:
        require_type(self.reuse, Reuse, "newton.reuse")
        require_type(self.search, Search, "newton.search")
        require_type(self.linear, LinearSolver, "newton.linear")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Memory:
        """The state before the first pass; at deformable tools with the last factor of the configuration before."""
        setup, frames = cache.setup(iterate), cache.frames(iterate.rows, iterate)
        law = Law(frames, setup.scale(frames), max_abs(iterate.increment.start.forces))
        # Near an answer, which has contact forces, flow from rest would begin anew.
        flows = FLOWS if r.any() else 0
        return Memory(setup, law, cache, cache.handles.get(self.name), flows=flows)

    def step(self, iterate: Iterate, r: Floats, state: Memory) -> tuple[Step, Memory]:
        """One step with a line search, or the flow of a body at rest; a factorisation unless the last one still serves.

        Raises:
            ProgramError: the matrix is singular.
            InvertedElement: in all trials of the line search; so NotConverged, if all run away.
        """
        clock = Stopwatch()
        began = clock.outside()
        if not state.merits and state.flows < FLOWS:
            flow = flow_from_rest(iterate, state.here, state.law, state.setup, self.linear)
            if flow is not None:
                flowed = replace(state, here=flow, flows=state.flows + 1)
                return _answer(flow, Timing(solve=clock.outside() - began)), flowed
        here = state.here or self._first(iterate, r, state)
        merits = (*state.merits, here.merit)
        frames = state.law.frames_at(here.iterate)
        linearised = self._linearised(state, here, frames, merits, clock)
        built = clock.outside()
        dx, new = linearised.step(iterate.residual, here.miss, here.r)
        there = self._search(state.law, here, linearised.pieces, dx, new, clock)
        if iterate.increment.system.candidates.deformable:
            # A factor with which the merit hardly falls would be the first in every configuration.
            state.cache.handles[self.name] = linearised if there.merit <= self.reuse.fall * here.merit else None
        timing = Timing(built - began, clock.outside() - built, clock.seconds)
        return _answer(there, timing), replace(state, linearised=linearised, merits=merits, here=there)

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
        falls = (len(merits) == 1 or merits[-1] <= fall * merits[-2]) and here.error <= self.reuse.near
        if last is not None and falls and last.pieces.same(here.pieces, self.reuse.turn) and last.serves(frames):
            # The matrix is that of an earlier iterate, but what must vanish is that of this one, with its caps.
            return last.at(frames, here.pieces)
        with clock:
            element = here.iterate.tangent(here.r, setup.scratch)
        return factorised(here, element, frames, setup, self.linear)

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


def factorised(here: Point, element: Floats, frames: Frames, setup: Setup, linear: LinearSolver) -> Linearised[Pieces]:
    """Newton's matrix at a point with the ``element`` matrices there (:meth:`bipot.iterate.Iterate.tangent`).

    Raises:
        ProgramError: it is singular.
    """
    data = setup.data(element)
    if setup.spins.size:
        setup.hold(data, resisted(here.iterate.rows, here.pieces.by_motion, setup.spins))
    return Linearised.of(data, frames, here.pieces, linear)


def _answer(point: Point, timing: Timing) -> Step:
    """The answer of a pass that ends at the ``point``."""
    # Where a contact has no force, the solution of its row is round-off; caps are those of the new iterate.
    forces = point.pieces.at_caps(np.where(point.pieces.none, 0.0, point.r))
    return Step(point.iterate, forces, Claim.SOLVED, 1, timing, error=point.error)
