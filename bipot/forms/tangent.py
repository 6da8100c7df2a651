"""The form `tangent`: exact contact with a frozen threshold or shift, the material as quadratic tangent energy.

A pass first takes semismooth Newton steps on the model of its own program, because interior-point answers stall where
strict complementarity fails. Where these steps do not reach an exact answer it solves the program, and polishes that.

The energy leaves out how the configuration moves. It is convex, and leads to a solution from far away, but near one
its passes only halve the error where perfect flow is strong. There the exact linearisation of equilibrium, which is
unsymmetric and minimises nothing, takes the place of the program's model, and passes converge as those of `newton` do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Claim, Timing
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.conic.through_cvxpy import Cvxpy
from bipot.errors import InvertedElement, require_count, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.posed import (
    Posed,
    Raw,
    Tried,
    coupled,
    distance_of,
    error_of,
    exact_model,
    in_the_air,
    require_solver,
    solved,
    tangent_program,
)
from bipot.iterate import Iterate
from bipot.programs.condensation import condense, pays
from bipot.programs.conic import TangentProgram, couple, polish
from bipot.programs.data import Stopwatch
from bipot.programs.fixed_point import Safeguard
from bipot.response import TangentKind
from bipot.typing import Floats

NEARBY = 1e-4
"""Distance from equilibrium and law, in units of the program, to which Newton is tried even after a pass that rose."""

LINEAR = 1e-2
"""Distance from equilibrium and law, in units of the program, from which on passes take the exact linearisation."""


@dataclass(frozen=True)
class Tangent:
    """Quadratic C^ep energy: a cone program, condensed on the contact unknowns if these are few, and its polish.

    With ``coupled``, the polish has exact Coulomb friction on the same quadratic model (its result is used only if
    exact), a step that leads away from equilibrium and law is halved, at most ``halvings`` times, and near a solution
    the exact linearisation takes the place of the model. Otherwise the threshold moves by the fixed point alone.
    ``safeguard`` says when the fixed point is damped or accelerated. With cvxpy every pass solves its program. ``kind``
    is that of the energy; the exact linearisation is that of the stresses, whatever the kind.
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
        require_solver(self.solver, "tangent.solver")
        require_type(self.accuracy, Accuracy, "tangent.accuracy")
        require_type(self.coupled, bool, "tangent.coupled")
        require_count(self.halvings, "tangent.halvings", 0)
        require_type(self.safeguard, Safeguard, "tangent.safeguard")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Posed:
        """The state before the first pass."""
        return Posed.of(iterate, r, cache, self.safeguard)

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        """One proximal-Newton pass."""
        clock, state = Stopwatch(), state.at(iterate)
        began, units = clock.outside(), state.units
        raw = self._linearised(iterate, r, state, clock) or self._programmed(iterate, r, state, clock)
        x, forces = raw.u * units.length, state.spread(raw.r * units.force)
        if self.coupled:
            tried = _shortened(iterate, r, state, x, forces, self.halvings, clock)
        else:
            with clock:
                there = iterate.increment.at(x)
            tried = Tried(there, forces, distance_of(there, forces, state))
        error = error_of(tried.iterate, tried.r, state)
        state = state.after(tried.iterate, tried.r, raw.exact and tried.whole, tried.distance)
        build = raw.timing.build
        timing = Timing(build, clock.outside() - began - build, clock.seconds)
        report = state.coupling.report
        return Step(tried.iterate, tried.r, raw.outcome, raw.iterations, timing, report, error=error), state

    def _programmed(self, iterate: Iterate, r: Floats, state: Posed, clock: Stopwatch) -> Raw:
        """The answer to the pass's program, by Newton alone where this is exact."""
        began = clock.outside()
        program = tangent_program(iterate, state.terms(iterate, r), state, self.kind, clock)
        stated = Timing(build=clock.outside() - began)
        raw = self._coupled(iterate, r, state, program) or self._solved(program, iterate, r[state.near], state.cache)
        return replace(raw, timing=raw.timing + stated)

    def _solved(self, program: TangentProgram, iterate: Iterate, r: Floats, cache: Cache) -> Raw:
        """The polished answer to the cone program; r (f, d) are the last forces, returned if there are no contacts."""
        frames = cache.frames(program.contact.rows, iterate)
        small = condense(program, cache.split(program)) if pays(program) else None
        if small and not small.kept.size:
            # Without contacts the elimination has solved the program.
            return Raw(small.recover(np.zeros(0)), r, Claim.SOLVED, 0, Timing(), exact=True)
        raw = solved(small.program if small else program, self.name, self.solver, self.accuracy, cache)
        u = small.recover(raw.u) if small else raw.u
        exact = couple(program.model, u, raw.r, frames) if self.coupled else None
        u, forces = exact or polish(program, u, raw.r, frames)
        return replace(raw, u=u, r=forces, exact=exact is not None)

    def _coupled(self, iterate: Iterate, r: Floats, state: Posed, program: TangentProgram) -> Raw | None:
        """The polish from the iterate if this is exact: the cone program takes longer and would add nothing.

        None far from a solution after a pass that led no nearer, and with cvxpy, through which every pass goes.
        """
        astray = state.rose and state.distance is not None and state.distance > NEARBY
        return None if astray or not self._skips else _raw(coupled(program.model, iterate, r, state), Timing())

    def _linearised(self, iterate: Iterate, r: Floats, state: Posed, clock: Stopwatch) -> Raw | None:
        """Exact friction on the exact linearisation; None far from a solution, and after a pass that led no nearer."""
        if not self._skips or state.rose or in_the_air(iterate, r):
            return None
        distance = distance_of(iterate, r, state) if state.distance is None else state.distance
        if distance > LINEAR:
            return None
        began = clock.outside()
        model = exact_model(iterate, r, state, clock)
        stated = Timing(build=clock.outside() - began)
        return _raw(coupled(model, iterate, r, state), stated)

    @property
    def _skips(self) -> bool:
        """Whether a pass may do without its program."""
        return self.coupled and not isinstance(self.solver, Cvxpy)


def _raw(found: tuple[Floats, Floats] | None, timing: Timing) -> Raw | None:
    """What Newton has ``found``, as the answer of a pass."""
    return None if found is None else Raw(*found, Claim.SOLVED, 0, timing, exact=True)


def _shortened(
    iterate: Iterate, r: Floats, state: Posed, x: Floats, forces: Floats, halvings: int, clock: Stopwatch
) -> Tried:
    """The answer (x, forces), or the trial on the way to it that is nearest to equilibrium and law."""
    least = distance_of(iterate, r, state) if state.distance is None else state.distance
    best: Tried | None = None
    t, failure = 1.0, InvertedElement()
    for _ in range(halvings + 1):
        between = r + t * (forces - r)
        try:
            with clock:
                there = iterate.increment.at(iterate.x + t * (x - iterate.x))
        except InvertedElement as inverted:
            failure = inverted
        else:
            distance = distance_of(there, between, state)
            if best is None or distance < best.distance:
                best = Tried(there, between, distance, t == 1.0)
            if distance <= least:
                break
        t /= 2
    if best is None:
        raise failure
    return best
