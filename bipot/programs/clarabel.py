"""Clarabel on a conic program's own data: the fast path beside the cvxpy statement of the same program."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import clarabel as _clarabel
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.errors import InfeasibleProgram, ProgramError, UnboundedProgram, require
from bipot.programs.data import Cone, ConicProgram, ConicSolution, Outcome, Rows, Term, Timing

Floats = NDArray[np.float64]

# The extension module carries no annotations.
clarabel: Any = _clarabel

CLAIMS = {clarabel.SolverStatus.Solved: Outcome.SOLVED, clarabel.SolverStatus.AlmostSolved: Outcome.ALMOST}
INFEASIBLE = (clarabel.SolverStatus.PrimalInfeasible, clarabel.SolverStatus.AlmostPrimalInfeasible)
UNBOUNDED = (clarabel.SolverStatus.DualInfeasible, clarabel.SolverStatus.AlmostDualInfeasible)


@dataclass(frozen=True)
class Accuracy:
    """Interior-point tolerance (gap and feasibility, on dimensionless data) and iteration limit."""

    tolerance: float = 1e-10
    iterations: int = 100

    def __post_init__(self) -> None:
        require(0 < self.tolerance < 1e-2, "tolerance", self.tolerance, "in (0, 0.01)")
        require(self.iterations >= 1, "iterations", self.iterations, ">= 1")


def solve(program: ConicProgram, accuracy: Accuracy) -> ConicSolution:
    """Solve in Clarabel's form ``A x + s = b, s in K`` (its A is ours negated).

    Raises:
        InfeasibleProgram, UnboundedProgram: with Clarabel's certificate.
        ProgramError: no answer within the limits.
    """
    started = time.perf_counter()
    rows = [r for r in program.rows if r.count]
    A = sp.vstack([r.A for r in rows], format="csc") if rows else sp.csc_matrix((0, len(program.q)))
    b = np.concatenate([r.b for r in rows]) if rows else np.zeros(0)
    cones = [cone for r in rows for cone in _cones(r)]
    solver = clarabel.DefaultSolver(sp.triu(program.P, format="csc"), program.q, -A, b, cones, settings(accuracy))
    built = time.perf_counter()
    answer = solver.solve()
    solved = time.perf_counter()
    if answer.status in INFEASIBLE:
        raise InfeasibleProgram("no displacement satisfies the contact and support constraints together")
    if answer.status in UNBOUNDED:
        raise UnboundedProgram("the load is above the limit load: a mechanism dissipates less than it gains", answer.x)
    if answer.status not in CLAIMS:
        raise ProgramError(f"conic solver stopped with {answer.status}: refine the increment or loosen the tolerance")
    return ConicSolution(
        program,
        np.array(answer.x),
        _split(program.rows, np.array(answer.z)),
        CLAIMS[answer.status],
        answer.iterations,
        Timing(built - started, solved - built),
    )


def settings(accuracy: Accuracy) -> Any:
    """Clarabel's settings for the asked accuracy, silent and on one thread."""
    chosen = clarabel.DefaultSettings()
    chosen.verbose = False
    chosen.max_iter = accuracy.iterations
    chosen.max_threads = 1
    chosen.tol_gap_abs = chosen.tol_gap_rel = chosen.tol_feas = accuracy.tolerance
    return chosen


def _cones(rows: Rows) -> list[object]:
    if rows.cone is Cone.ZERO:
        return [clarabel.ZeroConeT(len(rows.b))]
    if rows.cone is Cone.NONNEGATIVE:
        return [clarabel.NonnegativeConeT(len(rows.b))]
    return [clarabel.SecondOrderConeT(rows.width)] * rows.count


def _split(rows: tuple[Rows, ...], z: Floats) -> dict[Term, Floats]:
    ends = np.cumsum([len(r.b) for r in rows])
    return {r.term: z[end - len(r.b) : end].reshape(-1, r.width) for r, end in zip(rows, ends, strict=True)}
