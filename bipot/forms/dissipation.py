"""The form `dissipation`: exact contact with a frozen threshold or shift, the material as its plastic dissipation.

After its program, a pass takes one Newton step at the answer, on the exact linearisation with exact friction, and keeps
it only if equilibrium and the law are then met better. Otherwise, and where a driven tool is in the air, the energy of
the form `tangent` takes the place of the linearisation: it has a spring for such tools, and does not depend on contact
forces, which an answer far from a solution may have quite wrong. Where the answer is still hardly nearer to the
solution than the start of the pass, it takes more steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Timing
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.errors import InvertedElement, ProgramError, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.posed import (
    Posed,
    Tried,
    coupled,
    distance_of,
    error_of,
    exact_model,
    in_the_air,
    require_solver,
    softly_placed,
    solved,
    tangent_program,
)
from bipot.iterate import Iterate
from bipot.programs.data import Stopwatch
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.fixed_point import Safeguard
from bipot.programs.newton import Model
from bipot.response import TangentKind
from bipot.typing import Floats

STEPS = 4
"""Newton steps with which a pass of `dissipation` may end."""


@dataclass(frozen=True)
class Dissipation:
    """Plastic strain as a variable, one second-order cone per point; globally convergent at a frozen threshold.

    With ``polished``, a pass ends with Newton steps (:mod:`bipot.forms.dissipation`). ``safeguard`` says when the fixed
    point of friction is damped or accelerated.
    """

    solver: ConicSolver = Clarabel()
    accuracy: Accuracy = Accuracy(1e-11)
    polished: bool = True
    safeguard: Safeguard = Safeguard()
    name: ClassVar[FormName] = FormName.DISSIPATION

    def __post_init__(self) -> None:
        require_solver(self.solver, "dissipation.solver")
        require_type(self.accuracy, Accuracy, "dissipation.accuracy")
        require_type(self.polished, bool, "dissipation.polished")
        require_type(self.safeguard, Safeguard, "dissipation.safeguard")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Posed:
        """The state before the first pass."""
        return Posed.of(iterate, r, cache, self.safeguard)

    def program(self, iterate: Iterate, r: Floats, state: Posed) -> DissipationProgram:
        """The dimensionless program of a pass."""
        increment, state = iterate.increment, state.at(iterate)
        model = increment.system.body.plastic_model(iterate.response)
        program = DissipationProgram(model, iterate.load, state.terms(iterate, r)).scaled(state.units)
        return softly_placed(program, iterate, state) if iterate.translated.size else program

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        """Solve one program with the configuration and the linearised yield stress frozen."""
        clock, state = Stopwatch(), state.at(iterate)
        began = clock.outside()
        with clock:
            program = self.program(iterate, r, state)
        raw = solved(program, self.name, self.solver, self.accuracy, state.cache)
        with clock:
            there = iterate.increment.at(raw.u * state.units.length)
        forces = state.spread(raw.r * state.units.force)
        tried = Tried(there, forces, distance_of(there, forces, state), whole=False)
        if self.polished:
            tried = _polished(state, tried, clock)
        error = error_of(tried.iterate, tried.r, state)
        state = state.after(tried.iterate, tried.r, tried.whole, tried.distance)
        timing = Timing(raw.timing.build, clock.outside() - began - raw.timing.build, clock.seconds)
        report = state.coupling.report
        return Step(tried.iterate, tried.r, raw.outcome, raw.iterations, timing, report, error=error), state


def _polished(state: Posed, tried: Tried, clock: Stopwatch) -> Tried:
    """The answer ``tried`` after one Newton step, or more while it is hardly nearer than the start of the pass.

    More may be needed near the solution: the error of an interior-point answer does not fall with that of the start.
    """
    enough = np.inf if state.distance is None else state.distance / 2
    for _ in range(STEPS):
        last, tried = tried, _improved(state, tried, clock)
        if tried is last or tried.distance <= enough:
            break
    return tried


def _improved(state: Posed, tried: Tried, clock: Stopwatch) -> Tried:
    """The answer ``tried`` after one Newton step, if that is nearer to equilibrium and law."""
    there, r = tried.iterate, tried.r
    state = state.turned(there)
    after = tried if in_the_air(there, r) else _stepped(exact_model(there, r, state, clock), state, tried, clock)
    if after is not tried:
        return after
    program = tangent_program(there, state.terms(there, r), state, TangentKind.CONSISTENT, clock)
    return _stepped(program.model, state, tried, clock)


def _stepped(model: Model, state: Posed, tried: Tried, clock: Stopwatch) -> Tried:
    """The answer ``tried`` after Newton's step on a ``model`` of it, if that is nearer to equilibrium and law."""
    there, units = tried.iterate, state.units
    try:
        found = coupled(model, there, tried.r, state)
        if found is None:
            return tried
        forces = state.spread(found[1] * units.force)
        with clock:
            after = there.increment.at(found[0] * units.length)
    except (InvertedElement, ProgramError):
        return tried
    distance = distance_of(after, forces, state)
    return Tried(after, forces, distance) if distance < tried.distance else tried
