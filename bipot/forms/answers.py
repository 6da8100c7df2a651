"""Shared by the exact conic forms: answers to their programs, Newton on the quadratic model, the remaining error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.conic.problem import Claim, Timing
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.errors import require
from bipot.forms.base import Cache, FormName
from bipot.forms.posed import Posed
from bipot.forms.spring import softly_held, unresisted
from bipot.iterate import Iterate
from bipot.laws.coulomb import force_threshold, natural_map
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block, Stopwatch
from bipot.programs.dissipation import DissipationProgram
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


class Tried(NamedTuple):
    """An iterate with forces r (c, d) of all, its distance from equilibrium and law, whether a step was whole."""

    iterate: Iterate
    r: Floats
    distance: float
    whole: bool = True


def solved(
    program: TangentProgram | DissipationProgram, name: FormName, solver: ConicSolver, accuracy: Accuracy, cache: Cache
) -> Raw:
    """Solve the program of the form of that name, whose ``solver`` keeps reusable data in the cache."""
    answer, handle = solver.solve(program.conic(), accuracy, cache.handles.get(name))
    cache.handles[name] = handle
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
