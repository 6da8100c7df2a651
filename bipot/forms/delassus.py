"""The form `delassus`: the tangent model reduced to its contacts, a discrete Coulomb problem for bipot.coulomb."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from bipot.conic.problem import Claim, Timing
from bipot.conic.solver import asked
from bipot.coulomb import DEFAULT_CHAIN, CoulombSolution, GaussSeidel, Limits, Solver, run, solve
from bipot.errors import NotConverged, require, require_type
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.posed import Posed, softly_held, tangent_program, unresisted
from bipot.iterate import Iterate
from bipot.programs.condensation import Reduced, condense, reduce
from bipot.programs.data import Stopwatch
from bipot.response import TangentKind
from bipot.typing import Floats

USABLE = 1e-8
"""An answer that misses its tolerance but has at most this residual is accepted as ALMOST: the certificate decides."""

PATIENT = Limits(tol=1e-13, iterations=2000, seconds=math.inf, patience=100)
"""Limits by steps and not by time, so that a march is the same on every machine."""

FIRST, *REST = DEFAULT_CHAIN
CHAIN = tuple(stage for stage in REST if not isinstance(stage.solver, GaussSeidel))
"""Solvers tried after the first one, without sweeps over contacts, which take longest because W is full."""


@dataclass(frozen=True)
class Delassus:
    """Exact Coulomb friction on the quadratic model by one discrete ``solver``, or if None by the chain of ``solve()``.

    Newton converges quadratically, so the first solver of the chain must reach ``limits.tol``. The others may converge
    linearly and need only reach a usable answer, from which the next pass continues.
    """

    solver: Solver[Any] | None = None
    limits: Limits = PATIENT
    name: ClassVar[FormName] = FormName.DELASSUS

    def __post_init__(self) -> None:
        require_type(self.solver, Solver, "delassus.solver", optional=True)
        require(isinstance(self.limits, Limits), "delassus.limits", self.limits, "a Limits of bipot.coulomb")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Posed:
        """The state before the first pass."""
        return Posed.of(iterate, r, cache)

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        """One pass, started from the last forces.

        Raises:
            NotConverged: no usable answer, with the solver's reason.
            ProgramError: from the reduction.
        """
        clock, state = Stopwatch(), state.at(iterate)
        began, units = clock.outside(), state.units
        program = tangent_program(iterate, state.terms(iterate, r), state, TangentKind.CONSISTENT, clock)
        program = softly_held(program, iterate, state, ~unresisted(program.contact, iterate))
        condensed = condense(program, state.cache.split(program))
        reduced = reduce(condensed.program)
        built = clock.outside()
        found = self._find(reduced, r[state.near].ravel() / units.force)
        if not found.residual() <= USABLE:
            raise NotConverged(found.reason)
        near = found.r.reshape(-1, r.shape[1])
        x = condensed.recover(reduced.displacement(near)) * units.length
        solved = clock.outside()
        with clock:
            there = iterate.increment.at(x)
        forces = state.spread(near * units.force)
        state = state.after(there, forces, exact=True)
        outcome = Claim.SOLVED if found.converged else Claim.ALMOST
        timing = Timing(built - began, solved - built, clock.seconds)
        return Step(there, forces, outcome, found.iterations, timing, state.coupling.report), state

    def _find(self, reduced: Reduced, start: Floats) -> CoulombSolution:
        """The answer of the chosen solver, or else of the first one in the chain that reaches a usable one."""
        first = FIRST.solver if self.solver is None else self.solver
        with asked(first):
            found = run(first, reduced.problem, self.limits, start)
        if self.solver is not None or found.residual() <= USABLE:
            return found
        return solve(reduced.problem, replace(self.limits, tol=max(self.limits.tol, USABLE)), start, CHAIN)
