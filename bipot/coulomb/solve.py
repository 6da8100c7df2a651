"""Pick, chain and certify: :func:`solve` tries solvers in turn until the residual itself says it is done."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

from bipot.coulomb.existence import Existence, ExistenceReport, existence
from bipot.coulomb.fixed_point import DeSaxceFixedPoint, TrescaFixedPoint
from bipot.coulomb.functions import NaturalMap
from bipot.coulomb.gauss_seidel import GaussSeidel
from bipot.coulomb.problem import CoulombProblem
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.solution import CoulombSolution
from bipot.coulomb.solver import Limits, Solver, run
from bipot.errors import InfeasibleProgram
from bipot.laws.tensors import FloatArray


@dataclass(frozen=True)
class Stage:
    """A solver, the share of the remaining time it gets, and whether it starts from the best force so far."""

    solver: Solver[Any]
    share: float
    warm: bool


DEFAULT_CHAIN = (
    Stage(ProximalPoint(), 0.9, warm=True),
    Stage(ProximalPoint(function=NaturalMap(), weight=0.1), 0.4, warm=False),
    Stage(TrescaFixedPoint(), 0.3, warm=True),
    Stage(DeSaxceFixedPoint(), 0.3, warm=True),
    Stage(GaussSeidel(), 0.3, warm=True),
    Stage(ProximalPoint(weight=1e-3), 1.0, warm=True),
)


def _refuse(report: ExistenceReport) -> None:
    if report.verdict is Existence.NONE:
        raise InfeasibleProgram(f"The contact problem has no solution: {report.reason}.")


def solve(
    problem: CoulombProblem,
    limits: Limits | None = None,
    start: FloatArray | None = None,
    chain: tuple[Stage, ...] = DEFAULT_CHAIN,
) -> CoulombSolution:
    """Solve by the chain; an answer is CONVERGED only where its own residual is <= ``limits.tol``.

    Otherwise the best force met is returned, with the outcome and a sentence on what was tried. Raises
    InfeasibleProgram where the existence test proves that there is no solution.

    >>> import numpy as np
    >>> answer = solve(CoulombProblem(W=np.eye(2), q=[-1.0, 0.1], mu=0.3, dim=2))
    >>> answer.converged, answer.r.round(9).tolist()
    (True, [1.0, -0.1])
    """
    began, limits = perf_counter(), limits or Limits()
    _refuse(existence(problem, 0.1 * limits.seconds))
    best: CoulombSolution | None = None
    tried: list[str] = []
    iterations = 0
    for stage in chain:
        left = limits.seconds - (perf_counter() - began)
        if left <= 0:
            break
        origin = best.r if stage.warm and best is not None else start
        answer = run(stage.solver, problem, replace(limits, seconds=stage.share * left), origin)
        iterations += answer.iterations
        tried.append(answer.reason)
        if best is None or answer.residual() < best.residual():
            best = answer
        if best.converged:
            break
    assert best is not None
    return replace(
        best,
        solver="auto",
        reason=" ".join(tried),
        iterations=iterations,
        seconds=perf_counter() - began,
    )
