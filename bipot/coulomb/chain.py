"""A chain of solvers: :func:`solve` tries them in turn until the residual is within the tolerance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

from bipot.coulomb.fixed_point import DeSaxceFixedPoint, TrescaFixedPoint
from bipot.coulomb.functions import NaturalMap
from bipot.coulomb.gauss_seidel import GaussSeidel
from bipot.coulomb.modes import enumerate_modes
from bipot.coulomb.problem import CoulombProblem
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.solution import CoulombSolution, Outcome
from bipot.coulomb.solvability import Existence, existence
from bipot.coulomb.solver import Limits, Solver, run
from bipot.errors import InfeasibleProgram, require, require_tuple, require_type
from bipot.typing import Floats, make_floats


@dataclass(frozen=True)
class Stage:
    """A solver, the share of the remaining time it gets, and whether it starts from the best force so far."""

    solver: Solver[Any]
    share: float
    warm: bool

    def __post_init__(self) -> None:
        require_type(self.solver, Solver, "stage.solver")
        make_floats(self, of="stage.", share="in (0, 1]")
        require_type(self.warm, bool, "stage.warm")


DEFAULT_CHAIN = (
    Stage(ProximalPoint(), 0.9, warm=True),
    Stage(ProximalPoint(function=NaturalMap(), weight=0.1), 0.4, warm=False),
    Stage(TrescaFixedPoint(), 0.3, warm=True),
    Stage(DeSaxceFixedPoint(), 0.3, warm=True),
    Stage(GaussSeidel(), 0.3, warm=True),
    Stage(ProximalPoint(weight=1e-3), 1.0, warm=True),
)


_ENUMERATED = 4
"""Contacts of a plane problem up to which its modes are enumerated as soon as the first solver fails."""

NO_MODE = "None of its modes (open, stick and slip at each contact) holds: the problem has no solution."


def _enumerated(problem: CoulombProblem, tol: float) -> tuple[CoulombSolution | None, str]:
    """The solution of the first mode that holds, or None, and a sentence on it, empty where that is not certain."""
    report = enumerate_modes(problem, tol)
    if report.solutions:
        found = report.solutions[0]
        return found, f"{found.reason[:-1]} of all {4**problem.contacts} solves it."
    return None, "" if report.doubtful else NO_MODE


def _by_chain(
    problem: CoulombProblem, limits: Limits, start: Floats | None, chain: tuple[Stage, ...], ends: float
) -> tuple[CoulombSolution, list[str], int]:
    """The best force found, the reasons of the stages, and steps taken; no stage begins after the time ``ends``."""
    best = run(chain[0].solver, problem, replace(limits, iterations=0), start)
    reasons, iterations = list[str](), 0
    small = problem.dim == 2 and problem.contacts <= _ENUMERATED
    for stage in chain:
        left = ends - perf_counter()
        if best.converged or left <= 0:
            break
        # forces that ran away are no place to start from
        origin = best.r if stage.warm and reasons and best.resolution() <= limits.tol else start
        answer = run(stage.solver, problem, replace(limits, seconds=stage.share * left), origin)
        iterations += answer.iterations
        reasons.append(answer.reason)
        best = answer if len(reasons) == 1 or answer.residual() < best.residual() else best
        if small and not best.converged and perf_counter() < ends:
            small, (found, verdict) = False, _enumerated(problem, limits.tol)
            if verdict:
                return found or best, [*reasons, verdict], iterations
    if not reasons and not best.converged:
        best = replace(best, outcome=Outcome.TIME_LIMIT)
        reasons.append(f"No time was left to try a solver in {limits.seconds:.1e} s; more time may help.")
    return best, reasons or [best.reason], iterations


def solve(
    problem: CoulombProblem,
    limits: Limits | None = None,
    start: Floats | None = None,
    chain: tuple[Stage, ...] = DEFAULT_CHAIN,
) -> CoulombSolution:
    """Solve by the chain; an answer is CONVERGED only where its own residual is <= ``limits.tol``.

    Otherwise the best force found is returned, with the outcome and a sentence on what was tried and what is known
    about existence. If the first solver fails on a plane problem of up to four contacts, its modes are enumerated,
    which finds a solution or shows that there is none. Raises InfeasibleProgram where the existence test proves
    that there is no solution.

    >>> import numpy as np
    >>> answer = solve(CoulombProblem(W=np.eye(2), q=[-1.0, 0.1], mu=0.3, dim=2))
    >>> answer.converged, answer.r.round(9).tolist()
    (True, [1.0, -0.1])
    """
    require_type(problem, CoulombProblem, "problem")
    require_type(limits, Limits, "limits", optional=True)
    chain = require_tuple(chain, Stage, "chain")
    require(len(chain) > 0, "chain", chain, "at least one stage")
    began, limits = perf_counter(), limits or Limits()
    report = existence(problem, 0.1 * limits.seconds)
    if report.verdict is Existence.NONE:
        raise InfeasibleProgram(f"The contact problem has no solution: {report.reason}.")
    best, reasons, iterations = _by_chain(problem, limits, start, chain, began + limits.seconds)
    if not best.converged and reasons[-1] != NO_MODE:
        known = "A solution exists" if report.verdict is Existence.EXISTS else "Whether a solution exists is not known"
        reasons.append(f"{known}: {report.reason}.")
    return replace(best, solver="auto", reason=" ".join(reasons), iterations=iterations, seconds=perf_counter() - began)
