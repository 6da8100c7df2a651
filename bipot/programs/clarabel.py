"""Clarabel on a conic program's own data: the fast path beside the cvxpy statement of the same program.

Programs of a run mostly differ in their numbers only. A :class:`Solver` keeps the pattern of the last one: ordering,
symbolic factorisation and equilibration stay, and every number is sent to its place.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import clarabel as _clarabel
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.errors import InfeasibleProgram, ProgramError, UnboundedProgram, require, require_count, require_number
from bipot.programs.data import Cone, ConicProgram, ConicSolution, Ints, Outcome, Rows, Term, Timing

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
        require_number(self.tolerance, "tolerance")
        require(0 < self.tolerance < 1e-2, "tolerance", self.tolerance, "in (0, 0.01)")
        require_count(self.iterations, "iterations")


@dataclass(frozen=True)
class Transferred:
    """Clarabel set up for the pattern of ``program``, in its form ``A x + s = b, s in K`` (its A is ours negated).

    ``upper`` are the places of P's upper triangle in the data of P, ``stacked`` those of A in the data of all rows.
    """

    program: ConicProgram
    accuracy: Accuracy
    upper: Ints
    stacked: Ints
    clarabel: Any

    @staticmethod
    def of(program: ConicProgram, accuracy: Accuracy) -> Transferred:
        """Sort the pattern and set Clarabel up with the numbers of ``program``."""
        P, size = program.P, len(program.q)
        numbered = sp.csc_matrix((np.arange(P.nnz), P.indices, P.indptr), shape=(size, size))
        triangle = sp.csc_matrix(sp.triu(numbered, format="csc"))
        rows = sp.csc_matrix(_stacked_pattern(program.rows, size))
        upper, stacked = np.asarray(triangle.data, dtype=np.intp), np.asarray(rows.data, dtype=np.intp)
        q, b, P_data, A_data = _numbers(program, upper, stacked)
        solver = clarabel.DefaultSolver(
            sp.csc_matrix((P_data, triangle.indices, triangle.indptr), shape=(size, size)),
            q,
            sp.csc_matrix((A_data, rows.indices, rows.indptr), shape=(len(b), size)),
            b,
            [cone for r in program.rows if r.count for cone in _cones(r)],
            settings(accuracy),
        )
        return Transferred(program, accuracy, upper, stacked, solver)

    def serves(self, program: ConicProgram, accuracy: Accuracy) -> bool:
        """Whether ``program`` differs in its numbers only."""
        return (
            accuracy == self.accuracy
            and len(program.rows) == len(self.program.rows)
            and _same_pattern(program.P, self.program.P)
            and all(_same_rows(new, old) for new, old in zip(program.rows, self.program.rows, strict=True))
        )

    def send(self, program: ConicProgram) -> None:
        """The numbers of a program that this one :meth:`serves`."""
        q, b, P_data, A_data = _numbers(program, self.upper, self.stacked)
        # Lists, because the binding reads an array as a sequence of array scalars, which takes twice as long.
        self.clarabel.update(P=P_data.tolist(), q=q.tolist(), A=A_data.tolist(), b=b.tolist())


def transfer(program: ConicProgram, accuracy: Accuracy, last: Transferred | None = None) -> Transferred:
    """Clarabel with the numbers of ``program``: ``last`` where that serves, else set up anew."""
    if last is not None and last.serves(program, accuracy):
        last.send(program)
        return last
    return Transferred.of(program, accuracy)


class Solver:
    """Solves one program after another, each at no more cost than its pattern's novelty asks for."""

    def __init__(self) -> None:
        self._last: Transferred | None = None

    def solve(self, program: ConicProgram, accuracy: Accuracy) -> ConicSolution:
        """The solution; what the last program's equilibration does not solve is set up afresh.

        Raises:
            InfeasibleProgram, UnboundedProgram: with Clarabel's certificate.
            ProgramError: no answer within the limits.
        """
        started, lost = time.perf_counter(), Timing()
        ready = transfer(program, accuracy, self._last)
        if ready is self._last:
            sent = time.perf_counter()
            try:
                answer = _answer(ready, program, started)
            except ProgramError:
                pass
            else:
                if answer.outcome is Outcome.SOLVED:
                    return answer
            failed = time.perf_counter()
            lost, started = Timing(build=sent - started, solve=failed - sent), failed
            ready = Transferred.of(program, accuracy)
        self._last = ready
        answer = _answer(ready, program, started)
        return replace(answer, timing=lost + answer.timing)


def solve(program: ConicProgram, accuracy: Accuracy) -> ConicSolution:
    """Solve a single program; errors as of :meth:`Solver.solve`."""
    return Solver().solve(program, accuracy)


def _answer(ready: Transferred, program: ConicProgram, started: float) -> ConicSolution:
    built = time.perf_counter()
    answer = ready.clarabel.solve()
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


def _stacked_pattern(rows: tuple[Rows, ...], columns: int) -> sp.csr_matrix:
    """All rows in one, their entries numbered."""
    counts = np.concatenate([np.diff(r.A.indptr) for r in rows] or [np.zeros(0, np.intp)])
    indices = np.concatenate([r.A.indices for r in rows] or [np.zeros(0, np.intp)])
    indptr = np.concatenate([[0], np.cumsum(counts)])
    return sp.csr_matrix((np.arange(len(indices)), indices, indptr), shape=(len(counts), columns))


def _numbers(program: ConicProgram, upper: Ints, stacked: Ints) -> tuple[Floats, Floats, Floats, Floats]:
    """(q, b, data of P, data of A) in Clarabel's form."""
    none = np.zeros(0)
    b: Floats = np.concatenate([r.b for r in program.rows] or [none])
    P: Floats = np.asarray(program.P.data, dtype=np.float64)[upper]
    A: Floats = np.asarray(np.concatenate([r.A.data for r in program.rows] or [none]), dtype=np.float64)[stacked]
    return program.q, b, P, np.negative(A)


def _same_pattern(one: sp.csc_matrix | sp.csr_matrix, other: sp.csc_matrix | sp.csr_matrix) -> bool:
    return np.array_equal(one.indptr, other.indptr) and np.array_equal(one.indices, other.indices)


def _same_rows(one: Rows, other: Rows) -> bool:
    return (one.cone, one.width) == (other.cone, other.width) and _same_pattern(one.A, other.A)


def settings(accuracy: Accuracy) -> Any:
    """Clarabel's settings for the asked accuracy, silent and on one thread."""
    chosen = clarabel.DefaultSettings()
    chosen.verbose = False
    # It would only look for infinite right-hand sides, of which there are none, and forbid new numbers.
    chosen.presolve_enable = False
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
