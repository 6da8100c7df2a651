"""Clarabel on a conic program's own data.

Programs of a run mostly differ in their numbers only. :class:`Transferred` keeps the pattern of the last one, with its
ordering, symbolic factorisation and equilibration, and sends the new numbers.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import clarabel as _clarabel
import numpy as np
import scipy.sparse as sp

from bipot.conic import proofs
from bipot.conic.problem import Claim, Cone, ConicProgram, ConicSolution, Rows, Timing, stacked
from bipot.conic.solver import Accuracy, infeasible, unbounded, unsolved
from bipot.errors import ProgramError, require, require_type
from bipot.typing import Floats, Ints, make_floats

# The extension module carries no annotations.
clarabel: Any = _clarabel

CLAIMS = {clarabel.SolverStatus.Solved: Claim.SOLVED, clarabel.SolverStatus.AlmostSolved: Claim.ALMOST}
INFEASIBLE = (clarabel.SolverStatus.PrimalInfeasible, clarabel.SolverStatus.AlmostPrimalInfeasible)
UNBOUNDED = (clarabel.SolverStatus.DualInfeasible, clarabel.SolverStatus.AlmostDualInfeasible)
STALLED = (clarabel.SolverStatus.InsufficientProgress, clarabel.SolverStatus.NumericalError)

METHODS = ("auto", "qdldl", "faer")

BALANCING = 3
"""Rounds of Clarabel's equilibration. Programs are dimensionless: with its default of ten rounds the seed paper's
upsetting by ``dissipation`` takes 7 to 18 % more iterations, and small meshes take as many as with three."""

PROVED = 1e-11
"""Clarabel's tolerance on the balance of a certificate. With its default of 1e-8 programs with a large answer end as
unbounded, and the certificates do not exclude answers that are far."""


@dataclass(frozen=True)
class Clarabel:
    """Interior points by Clarabel, on one thread, for at most ``seconds``.

    ``method`` solves its linear systems: "qdldl" in the plane, "faer" (supernodal) for large programs in 3D.
    """

    method: str = "auto"
    seconds: float = math.inf

    def __post_init__(self) -> None:
        require_type(self.method, str, "clarabel.method")
        require(self.method in METHODS, "clarabel.method", self.method, f"one of {', '.join(METHODS)}")
        make_floats(self, of="clarabel.", seconds="> 0")

    def solve(
        self, program: ConicProgram, accuracy: Accuracy, last: Transferred | None = None
    ) -> tuple[ConicSolution, Transferred]:
        """As :meth:`~bipot.conic.solver.ConicSolver.solve`.

        If the program is not solved with the last one's equilibration, it is set up anew.
        """
        started, lost = time.perf_counter(), Timing()
        ready = transfer(program, accuracy, last, self)
        if ready is last:
            sent = time.perf_counter()
            try:
                answer = _answer(ready, program, started)
            except ProgramError:
                pass
            else:
                if answer.outcome is Claim.SOLVED:
                    return answer, ready
            failed = time.perf_counter()
            lost, started = Timing(build=sent - started, solve=failed - sent), failed
            ready = Transferred.of(program, accuracy, self)
        answer = _answer(ready, program, started)
        return replace(answer, timing=lost + answer.timing), ready

    def settings(self, accuracy: Accuracy) -> Any:
        """Clarabel's settings for the requested accuracy, silent and on one thread."""
        chosen = clarabel.DefaultSettings()
        chosen.verbose = False
        # Presolving only looks for infinite right-hand sides, of which there are none, and excludes updates.
        chosen.presolve_enable = False
        chosen.equilibrate_max_iter = BALANCING
        chosen.max_iter = accuracy.iterations
        chosen.max_threads = 1
        chosen.time_limit = self.seconds
        chosen.direct_solve_method = self.method
        chosen.tol_gap_abs = chosen.tol_gap_rel = chosen.tol_feas = accuracy.tolerance
        chosen.tol_infeas_abs = chosen.tol_infeas_rel = PROVED
        return chosen


@dataclass(eq=False)
class Transferred:
    """Clarabel set up for the pattern of ``program``, in its form ``A x + s = b, s in K`` (with minus our A).

    ``program`` is the last one sent. ``upper`` are the places of P's upper triangle in the data of P, ``stacked`` those
    of A in the data of all rows.
    """

    program: ConicProgram
    accuracy: Accuracy
    solver: Clarabel
    upper: Ints
    stacked: Ints
    clarabel: Any

    @staticmethod
    def of(program: ConicProgram, accuracy: Accuracy, solver: Clarabel) -> Transferred:
        """Sort the pattern and set Clarabel up with the numbers of ``program``."""
        P, size = program.P, len(program.q)
        numbered = sp.csc_matrix((np.arange(P.nnz), P.indices, P.indptr), shape=(size, size))
        triangle = sp.csc_matrix(sp.triu(numbered, format="csc"))
        A, b = stacked(program.rows, size)
        rows = sp.csc_matrix(sp.csr_matrix((np.arange(A.nnz), A.indices, A.indptr), shape=A.shape))
        upper, places = np.asarray(triangle.data, dtype=np.intp), np.asarray(rows.data, dtype=np.intp)
        made = clarabel.DefaultSolver(
            sp.csc_matrix((_quadratic(program, upper), triangle.indices, triangle.indptr), shape=(size, size)),
            program.q,
            sp.csc_matrix((_linear(program, places), rows.indices, rows.indptr), shape=(len(b), size)),
            b,
            [cone for r in program.rows if r.count for cone in _cones(r)],
            solver.settings(accuracy),
        )
        return Transferred(program, accuracy, solver, upper, places, made)

    def serves(self, program: ConicProgram, accuracy: Accuracy, solver: Clarabel) -> bool:
        """Whether ``program`` differs from the last one in its numbers only."""
        return (
            (accuracy, solver) == (self.accuracy, self.solver)
            and len(program.rows) == len(self.program.rows)
            and _same_pattern(program.P, self.program.P)
            and all(
                (new.cone, new.width) == (old.cone, old.width) and _same_pattern(new.A, old.A)
                for new, old in zip(program.rows, self.program.rows, strict=True)
            )
        )

    def send(self, program: ConicProgram) -> None:
        """Send the numbers of a program that this one :meth:`serves`; identical matrix objects are skipped."""
        # Lists, because the binding reads an array as a sequence of array scalars, which takes twice as long.
        numbers = {"q": program.q.tolist(), "b": np.concatenate([np.zeros(0), *(r.b for r in program.rows)]).tolist()}
        if program.P is not self.program.P:
            numbers["P"] = _quadratic(program, self.upper).tolist()
        if any(new.A is not old.A for new, old in zip(program.rows, self.program.rows, strict=True)):
            numbers["A"] = _linear(program, self.stacked).tolist()
        self.clarabel.update(**numbers)
        self.program = program


def transfer(
    program: ConicProgram, accuracy: Accuracy, last: Transferred | None = None, solver: Clarabel = Clarabel()
) -> Transferred:
    """Clarabel with the numbers of ``program``: ``last`` if it serves, else set up anew."""
    if last is not None and last.serves(program, accuracy, solver):
        last.send(program)
        return last
    return Transferred.of(program, accuracy, solver)


def solve_once(program: ConicProgram, accuracy: Accuracy) -> ConicSolution:
    """Solve a single program; errors as of :meth:`Clarabel.solve`."""
    return Clarabel().solve(program, accuracy)[0]


def _answer(ready: Transferred, program: ConicProgram, started: float) -> ConicSolution:
    built = time.perf_counter()
    answer = ready.clarabel.solve()
    solved = time.perf_counter()
    if answer.status in INFEASIBLE and proofs.infeasible(program, np.array(answer.z)):
        raise infeasible()
    if answer.status in UNBOUNDED and proofs.unbounded(program, np.array(answer.x)):
        raise unbounded(answer.x)
    if answer.status not in CLAIMS:
        raise unsolved(answer.status, stalled=answer.status in STALLED)
    return ConicSolution(
        program,
        np.array(answer.x),
        program.split(np.array(answer.z)),
        CLAIMS[answer.status],
        answer.iterations,
        Timing(built - started, solved - built),
    )


def _quadratic(program: ConicProgram, upper: Ints) -> Floats:
    return np.asarray(program.P.data, dtype=np.float64)[upper]


def _linear(program: ConicProgram, stacked: Ints) -> Floats:
    data = np.concatenate([r.A.data for r in program.rows] or [np.zeros(0)])
    return np.negative(np.asarray(data, dtype=np.float64)[stacked])


def _same_pattern(a: sp.csc_matrix | sp.csr_matrix, b: sp.csc_matrix | sp.csr_matrix) -> bool:
    return a is b or (np.array_equal(a.indptr, b.indptr) and np.array_equal(a.indices, b.indices))


def _cones(rows: Rows) -> list[object]:
    if rows.cone is Cone.ZERO:
        return [clarabel.ZeroConeT(len(rows.b))]
    if rows.cone is Cone.NONNEGATIVE:
        return [clarabel.NonnegativeConeT(len(rows.b))]
    return [clarabel.SecondOrderConeT(rows.width)] * rows.count
