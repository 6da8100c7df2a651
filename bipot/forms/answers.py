"""Shared by the exact conic forms: answers to their programs, Newton on the quadratic model, the remaining error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from bipot.conic.problem import Claim, ConicProgram, Timing
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.errors import require
from bipot.forms.base import Cache, FormName
from bipot.forms.posed import Posed
from bipot.forms.spring import softly_held, unresisted
from bipot.iterate import Iterate
from bipot.laws.coulomb import force_threshold, natural_map
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block, Stopwatch
from bipot.programs.polish import couple
from bipot.programs.terms import ContactTerms
from bipot.response import TangentKind
from bipot.typing import Floats


@dataclass(frozen=True)
class Raw:
    """An answer in the program's own units, the solver's claim and cost, and whether friction is exact."""

    u: Floats
    r: Floats
    outcome: Claim
    iterations: int
    timing: Timing
    exact: bool = False


class Posing(Protocol):
    """A form that poses programs."""

    name: ClassVar[FormName]
    """The key under which the cache keeps data for the solver to reuse."""

    @property
    def solver(self) -> ConicSolver:
        """Which solves its programs."""
        ...

    @property
    def accuracy(self) -> Accuracy:
        """Asked of the solver."""
        ...


class Exact(Protocol):
    """A program with exact contact terms."""

    @property
    def contact(self) -> ContactTerms:
        """Its contact terms."""
        ...

    def conic(self) -> ConicProgram:
        """Its data."""
        ...


class Tried(NamedTuple):
    """An iterate with forces r (c, d) of all, its distance from equilibrium and law, whether a step was whole."""

    iterate: Iterate
    r: Floats
    distance: float
    whole: bool = True


def solved(form: Posing, program: Exact, cache: Cache) -> Raw:
    """Solve the program by the form's solver, which keeps reusable data in the cache."""
    answer, handle = form.solver.solve(program.conic(), form.accuracy, cache.handles.get(form.name))
    cache.handles[form.name] = handle
    r = program.contact.contact_forces(answer)
    return Raw(answer.block(Block.DISPLACEMENT), r, answer.outcome, answer.iterations, answer.timing)


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


def gone_on(program: TangentProgram, iterate: Iterate, r: Floats, state: Posed) -> tuple[Floats, Floats] | None:
    """Newton with exact Coulomb friction on the quadratic model, from the iterate and forces r (c, d), or None."""
    units = state.units
    return couple(
        program,
        iterate.x / units.length,
        r[state.near] / units.force,
        state.cache.frames(program.contact.rows, iterate),
    )


def distance_of(iterate: Iterate, r: Floats, state: Posed) -> float:
    """Largest component of equilibrium residual and natural map of the exact law, in the units of the program."""
    units, rows, near = state.units, state.turned(iterate).rows, r[state.near]
    residual = (iterate.residual - rows.forces(near)) / units.force
    motion, force = iterate.motion[state.near] / units.length, near / units.force
    residual_of_law = natural_map(force, motion, rows.mu, 1.0, rows.cap / units.force, force_threshold(force))
    law = np.where(rows.tied[:, None], motion, residual_of_law)
    return float(max(np.abs(residual).max(), np.abs(law).max(initial=0.0)))


def require_solver(solver: object, field: str) -> None:
    """Raise SceneError unless the ``solver`` of a form is one."""
    made = isinstance(solver, ConicSolver) and not isinstance(solver, type)
    require(made, field, solver, "a ConicSolver, e.g. Clarabel() or Cvxpy('SCS')")
