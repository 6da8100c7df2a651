"""The two conic forms: exact contact with a frozen threshold or shift, the material as tangent energy or dissipation.

Both take semismooth Newton steps on a quadratic model: interior-point answers stall where strict complementarity fails.
`tangent` takes them first, on the model of its own program, and poses that where they do not end exactly, to polish its
answer; `dissipation` takes one of the tangent model at its answer, and keeps it only if equilibrium and the exact law
are then met better. Every pass of it starts from an interior-point answer: where these have come no nearer, it takes
more.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import ConicProgram, Outcome, Timing
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.conic.through_cvxpy import Cvxpy
from bipot.errors import InvertedElement, ProgramError, require, require_count, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.posed import Posed
from bipot.forms.spring import softly_held, softly_placed, unresisted
from bipot.iterate import Iterate
from bipot.laws.coulomb import force_threshold, natural_map
from bipot.programs.condensation import condense, pays
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block, Stopwatch
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.fixed_point import Safeguard
from bipot.programs.polish import couple, polish
from bipot.programs.terms import ContactTerms
from bipot.response import TangentKind
from bipot.typing import Floats

NEARBY = 1e-4
"""An answer this near to equilibrium and law, in units of the program, is not far from the next: its pieces hold."""

STEPS = 4
"""Newton steps with which a pass of `dissipation` may end. The model leaves out how the configuration moves: a step
gains a factor of three at worst, measured on T6 with a mean volume change, of ten or more on other elements."""


@dataclass(frozen=True)
class Tangent:
    """Quadratic C^ep energy: a cone program, condensed on the contact unknowns if these are few, and its polish.

    With ``coupled``, the polish carries exact Coulomb friction on the same quadratic model (its result is used only
    when exact); otherwise the threshold moves by the fixed point alone. The model leaves out how the configuration
    moves: with ``coupled``, a step that leads away from equilibrium and law is halved, at most ``halvings`` times.
    ``safeguard`` says when the fixed point is helped.
    """

    kind: TangentKind = TangentKind.CONSISTENT
    solver: ConicSolver = Clarabel()
    accuracy: Accuracy = Accuracy(1e-9)
    coupled: bool = True
    halvings: int = 3
    safeguard: Safeguard = Safeguard()
    name: ClassVar[FormName] = FormName.TANGENT

    def __post_init__(self) -> None:
        require_type(self.kind, TangentKind, "tangent.kind")
        _require_solver(self.solver, "tangent.solver")
        require_type(self.accuracy, Accuracy, "tangent.accuracy")
        require_type(self.coupled, bool, "tangent.coupled")
        require_count(self.halvings, "tangent.halvings", 0)
        require_type(self.safeguard, Safeguard, "tangent.safeguard")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Posed:
        """Before the first pass."""
        return Posed.of(iterate, r, cache, self.safeguard)

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        """One proximal-Newton pass."""
        clock, state = Stopwatch(), state.at(iterate)
        began, units = clock.outside(), state.units
        program = tangent_program(iterate, state.terms(iterate, r), state, self.kind, clock)
        built = clock.outside()
        raw = self._gone_on(iterate, r, state, program) or self._posed(program, iterate, r[state.near], state.cache)
        x, forces = raw.u * units.length, state.spread(raw.r * units.force)
        if self.coupled:
            tried = _shortened(iterate, r, state, x, forces, self.halvings, clock)
        else:
            with clock:
                there = iterate.increment.at(x)
            tried = Tried(there, forces, _distance(there, forces, state))
        state = state.after(tried.iterate, tried.r, raw.exact and tried.whole, tried.distance)
        build = built - began + raw.timing.build
        timing = Timing(build, clock.outside() - began - build, clock.seconds)
        return Step(tried.iterate, tried.r, raw.outcome, raw.iterations, timing, state.coupling.report), state

    def _posed(self, program: TangentProgram, iterate: Iterate, r: Floats, cache: Cache) -> Raw:
        """The polished answer to the cone program; r (c, d) is what no contact is left to change."""
        frames = cache.frames(program, iterate)
        small = condense(program, cache.split(program)) if pays(program) else None
        if small and not small.kept.size:
            # Where nothing may touch, the elimination has solved it.
            return Raw(small.recover(np.zeros(0)), r, Outcome.SOLVED, 0, Timing(), exact=True)
        raw = _solved(self, small.program if small else program, cache)
        u = small.recover(raw.u) if small else raw.u
        coupled = couple(program, u, raw.r, frames) if self.coupled else None
        u, forces = coupled or polish(program, u, raw.r, frames)
        return replace(raw, u=u, r=forces, exact=coupled is not None)

    def _gone_on(self, iterate: Iterate, r: Floats, state: Posed, program: TangentProgram) -> Raw | None:
        """The polish from the iterate, where this is exact: the cone program, which takes longer, tells nothing new.

        None far away after a pass that did not lead nearer, and through cvxpy, which poses every pass.
        """
        astray = state.rose and state.distance is not None and state.distance > NEARBY
        if astray or not self.coupled or isinstance(self.solver, Cvxpy):
            return None
        found = _coupled(program, iterate, r, state)
        return None if found is None else Raw(*found, Outcome.SOLVED, 0, Timing(), exact=True)


@dataclass(frozen=True)
class Dissipation:
    """Plastic strain as a variable, one second-order cone a point; globally convergent at a frozen threshold.

    With ``polished``, a pass ends with the Newton steps described above. ``safeguard`` says when friction's fixed point
    is helped.
    """

    solver: ConicSolver = Clarabel()
    accuracy: Accuracy = Accuracy(1e-11)
    polished: bool = True
    safeguard: Safeguard = Safeguard()
    name: ClassVar[FormName] = FormName.DISSIPATION

    def __post_init__(self) -> None:
        _require_solver(self.solver, "dissipation.solver")
        require_type(self.accuracy, Accuracy, "dissipation.accuracy")
        require_type(self.polished, bool, "dissipation.polished")
        require_type(self.safeguard, Safeguard, "dissipation.safeguard")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Posed:
        """Before the first pass."""
        return Posed.of(iterate, r, cache, self.safeguard)

    def program(self, iterate: Iterate, r: Floats, state: Posed) -> DissipationProgram:
        """The dimensionless program of a pass."""
        increment, state = iterate.increment, state.at(iterate)
        model = increment.system.body.plastic_model(iterate.response)
        program = DissipationProgram(model, iterate.load, state.terms(iterate, r)).scaled(state.units)
        return softly_placed(program, iterate, state) if iterate.translated.size else program

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        """One program with the configuration and the line of the yield stress frozen."""
        clock, state = Stopwatch(), state.at(iterate)
        began = clock.outside()
        with clock:
            program = self.program(iterate, r, state)
        raw = _solved(self, program, state.cache)
        with clock:
            there = iterate.increment.at(raw.u * state.units.length)
        forces = state.spread(raw.r * state.units.force)
        tried = Tried(there, forces, _distance(there, forces, state), whole=False)
        if self.polished:
            tried = _polished(iterate, r, state, tried, clock)
        state = state.after(tried.iterate, tried.r, tried.whole, tried.distance)
        timing = Timing(raw.timing.build, clock.outside() - began - raw.timing.build, clock.seconds)
        return Step(tried.iterate, tried.r, raw.outcome, raw.iterations, timing, state.coupling.report), state


class Tried(NamedTuple):
    """An iterate with forces r (c, d) of all, its distance from equilibrium and law; whether a Newton step is whole."""

    iterate: Iterate
    r: Floats
    distance: float
    whole: bool = True


def _shortened(
    iterate: Iterate, r: Floats, state: Posed, x: Floats, forces: Floats, halvings: int, clock: Stopwatch
) -> Tried:
    """The answer (x, forces), or what is nearest to equilibrium and law on the way to it."""
    least = _distance(iterate, r, state) if state.distance is None else state.distance
    best: Tried | None = None
    nearest, t, failure = np.inf, 1.0, InvertedElement()
    for _ in range(halvings + 1):
        between = r + t * (forces - r)
        try:
            with clock:
                there = iterate.increment.at(iterate.x + t * (x - iterate.x))
        except InvertedElement as inverted:
            failure = inverted
        else:
            distance = _distance(there, between, state)
            if best is None or distance < nearest:
                best, nearest = Tried(there, between, distance, t == 1.0), distance
            if distance <= least:
                break
        t /= 2
    if best is None:
        raise failure
    return best


def _polished(iterate: Iterate, r: Floats, state: Posed, tried: Tried, clock: Stopwatch) -> Tried:
    """The answer ``tried`` after one Newton step, after more while it is hardly nearer than what the pass began from.

    Interior points end as far from equilibrium and law as they always do, however near the pass began.
    """
    enough = np.inf if state.distance is None else state.distance / 2
    for _ in range(STEPS):
        last, tried = tried, _improved(iterate, r, state, tried, clock)
        if tried is last or tried.distance <= enough:
            break
    return tried


def _improved(iterate: Iterate, r: Floats, state: Posed, tried: Tried, clock: Stopwatch) -> Tried:
    """The answer ``tried`` after one Newton step of the tangent model, if that is nearer to balance and law.

    ``iterate`` and r are those of the pass, whose threshold the model has.
    """
    there, units = tried.iterate, state.units
    terms = state.turned(tried.iterate).terms(iterate, r)
    try:
        program = tangent_program(there, terms, state, TangentKind.CONSISTENT, clock)
        found = _coupled(program, there, tried.r, state)
        if found is None:
            return tried
        forces = state.spread(found[1] * units.force)
        with clock:
            after = iterate.increment.at(found[0] * units.length)
    except (InvertedElement, ProgramError):
        return tried
    distance = _distance(after, forces, state)
    return Tried(after, forces, distance) if distance < tried.distance else tried


def _coupled(program: TangentProgram, iterate: Iterate, r: Floats, state: Posed) -> tuple[Floats, Floats] | None:
    """Exact Coulomb on the quadratic model, from the iterate and forces r (c, d) of all; None where Newton fails."""
    units = state.units
    return couple(program, iterate.x / units.length, r[state.near] / units.force, state.cache.frames(program, iterate))


def _distance(iterate: Iterate, r: Floats, state: Posed) -> float:
    """Largest component of equilibrium residual and natural map of the exact law, in the units of the program."""
    units, rows, near = state.units, state.turned(iterate).rows, r[state.near]
    residual = (iterate.residual - rows.forces(near)) / units.force
    motion, force = iterate.motion[state.near] / units.length, near / units.force
    residual_of_law = natural_map(force, motion, rows.mu, 1.0, rows.cap / units.force, force_threshold(force))
    law = np.where(rows.tied[:, None], motion, residual_of_law)
    return float(max(np.abs(residual).max(), np.abs(law).max(initial=0.0)))


def tangent_program(
    iterate: Iterate, terms: ContactTerms, state: Posed, kind: TangentKind, clock: Stopwatch
) -> TangentProgram:
    """The tangent program of a pass, dimensionless."""
    with clock:
        K = iterate.stiffness(kind)
    program = TangentProgram(K, K @ iterate.x - iterate.residual, terms).scaled(state.units)
    return (
        softly_held(program, iterate, state, unresisted(program.contact, iterate))
        if iterate.translated.size
        else program
    )


@dataclass(frozen=True)
class Raw:
    """An answer in the program's own units, what the interior points claimed and cost, whether friction is exact."""

    u: Floats
    r: Floats
    outcome: Outcome
    iterations: int
    timing: Timing
    exact: bool = False


class Exact(Protocol):
    """A program with exact contact terms."""

    @property
    def contact(self) -> ContactTerms:
        """Its contact terms."""
        ...

    def conic(self) -> ConicProgram:
        """Its data."""
        ...


def _solved(form: Tangent | Dissipation, program: Exact, cache: Cache) -> Raw:
    """The program solved by the form's solver, which keeps in the cache what it can use again."""
    answer, handle = form.solver.solve(program.conic(), form.accuracy, cache.handles.get(form.name))
    cache.handles[form.name] = handle
    r = program.contact.contact_forces(answer)
    return Raw(answer.block(Block.DISPLACEMENT), r, answer.outcome, answer.iterations, answer.timing)


def _require_solver(solver: object, field: str) -> None:
    require(callable(getattr(solver, "solve", None)), field, solver, "a ConicSolver, e.g. Clarabel() or Cvxpy('SCS')")
