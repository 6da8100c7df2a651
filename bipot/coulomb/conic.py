"""Convex cone programs in the contact force, straight to Clarabel, set up once and updated.

    min ½ r · P r + p · r    subject to    r in a product of second-order cones (fixed or with given radii)

P is the symmetric part of W plus a small multiple of I, which a W printed with few digits needs to be positive. A
proximal centre takes that multiple away again at the fixed point.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import clarabel as _clarabel
import numpy as np
from scipy import sparse

from bipot.coulomb.functions import ContactFunction
from bipot.coulomb.newton import Newton, merit
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.scaling import ScaledProblem
from bipot.coulomb.solver import Solver
from bipot.errors import InfeasibleProgram, ProgramError, require
from bipot.laws.tensors import FloatArray

# its stubs do not name what it exports
clarabel: Any = _clarabel

# Least weight of the polish's proximal term, and the |F| of scaled numbers at which nothing is left to polish.
_LIGHTEST, _EXACT = 1e-10, 1e-15


@dataclass(frozen=True)
class ConicSettings:
    """Clarabel's gap and feasibility tolerance, its time limit [s], and the multiple of I added to W.

    A program not solved at ``tol`` is tried again at 100 tol, once; AlmostSolved is refused. ``polish``
    Newton steps follow, because an interior-point answer is only as near as the square root of the gap where
    a force is on its cone while the multiplier vanishes, and asking for a smaller gap does not help.
    """

    tol: float = 1e-9
    seconds: float = 30.0
    regularisation: float = 1e-8
    polish: int = 100

    def __post_init__(self) -> None:
        require(0 < self.tol < 1e-2, "tol", self.tol, "in (0, 0.01)")
        require(self.seconds > 0, "seconds", self.seconds, "> 0")
        require(self.polish >= 0, "polish", self.polish, ">= 0")
        require(self.regularisation >= 0, "regularisation", self.regularisation, ">= 0")

    def for_clarabel(self, loosened: float = 1.0) -> Any:
        """Clarabel's settings object."""
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.presolve_enable = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = self.tol * loosened
        settings.time_limit = self.seconds
        return settings


def _normal_rows(problem: ScaledProblem) -> sparse.csr_array:
    dofs = np.arange(0, problem.size, problem.dim)
    return sparse.csr_array((np.ones(dofs.size), (np.arange(dofs.size), dofs)), shape=(dofs.size, problem.size))


def _cone_rows(problem: ScaledProblem, top: FloatArray) -> sparse.csr_array:
    """diag(top, 1 … 1) by contact: the rows whose cone is |r_t| <= top r_n (+ a radius)."""
    diagonal = np.ones((problem.mu.size, problem.dim))
    diagonal[:, 0] = top
    return sparse.csr_array(sparse.diags_array(diagonal.ravel()))


@dataclass(frozen=True, eq=False)
class ForceProgram:
    """One program with its Clarabel solver; ``solve`` changes the linear term and the radii only.

    ``top`` (c,) is mu for the friction cone |r_t| <= mu r_n, zero for discs of given radii. r_n >= 0 is a
    row of its own wherever the cone does not imply it.
    """

    problem: ScaledProblem
    top: FloatArray
    settings: ConicSettings
    solver: Any
    loose: Any
    contacts_with_row: int

    def solve(self, linear: FloatArray, radius: FloatArray, centre: FloatArray | None = None) -> FloatArray:
        """The minimiser r (dc,), the regularisation around ``centre`` (default 0).

        Raises InfeasibleProgram where it is unbounded, ProgramError where unsolved.
        """
        if centre is not None:
            linear = linear - self.settings.regularisation * centre
        b = np.zeros((self.problem.mu.size, self.problem.dim))
        b[:, 0] = radius
        right = np.concatenate([np.zeros(self.contacts_with_row), b.ravel()])
        status = "not run"
        for solver in (self.solver, self.loose):
            solver.update(q=linear, b=right)
            answer = solver.solve()
            status = str(answer.status)
            if status == "Solved":
                return np.asarray(answer.x)
            if status == "DualInfeasible":
                raise InfeasibleProgram(
                    "the program in the contact forces is unbounded: some self-balanced forces meet no resistance"
                )
        raise ProgramError(f"Clarabel returned {status} at {100 * self.settings.tol:.0e}, which is not accepted")


def polish(problem: ScaledProblem, law: ContactFunction, r: FloatArray, load: FloatArray, steps: int) -> FloatArray:
    """Newton passes on F(r, W r + load) = 0 from an interior-point answer; the iterate of smallest |F| is kept.

    Plain Newton first, which a W of any condition suits while it is regular; then proximal, with a first weight of the
    size of |F|, because W may be singular and the active sets are only nearly known.
    """
    posed = replace(problem, q=load)
    best, lowest = r, merit(posed, law, r, posed.velocity(r))
    best, lowest = _refined(Newton(law), posed, law, (best, lowest), steps)
    return _refined(ProximalPoint(law, weight=max(lowest, _LIGHTEST)), posed, law, (best, lowest), steps)[0]


def _refined(
    solver: Solver[Any], posed: ScaledProblem, law: ContactFunction, start: tuple[FloatArray, float], steps: int
) -> tuple[FloatArray, float]:
    """The iterate of smallest |F| among ``start`` and ``steps`` passes of a solver, with its |F|."""
    best, lowest = start
    state = solver.init(posed, best)
    for _ in range(steps):
        if lowest <= _EXACT or state.stalled:
            break
        try:
            state = solver.step(posed, state)
        except (ProgramError, np.linalg.LinAlgError):
            break
        reached = merit(posed, law, state.r, posed.velocity(state.r))
        if reached < lowest:
            best, lowest = state.r, reached
    return best, lowest


def force_program(problem: ScaledProblem, top: FloatArray, settings: ConicSettings) -> ForceProgram:
    """Set the program up: P, the cones, and two solvers on the same pattern (the asked tolerance and a
    looser)."""
    W = sparse.csr_array(problem.W)
    P = sparse.csc_matrix(sparse.triu((W + W.T) * 0.5 + settings.regularisation * sparse.eye_array(problem.size)))
    bare = np.flatnonzero(top == 0)
    # the zeros of diag(0, 1 … 1) are not stored, harmlessly: those rows hold the radius alone
    A = sparse.csc_matrix(-sparse.vstack([_normal_rows(problem)[bare], _cone_rows(problem, top)]))
    cones = [clarabel.NonnegativeConeT(bare.size)] if bare.size else []
    cones += [clarabel.SecondOrderConeT(problem.dim)] * problem.mu.size
    b = np.zeros(bare.size + problem.size)
    asked, looser = (
        clarabel.DefaultSolver(P, problem.q, A, b, cones, settings.for_clarabel(loosened)) for loosened in (1, 100)
    )
    return ForceProgram(problem, top, settings, asked, looser, bare.size)
