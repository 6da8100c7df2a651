r"""Any solver that cvxpy supports, on a program's own statement if it has one, else on its data."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bipot.basics.undisturbed import undisturbed
from bipot.conic.problem import Claim, Cone, ConicProgram, ConicSolution, Timing
from bipot.conic.solver import Accuracy, infeasible, unbounded, unsolved
from bipot.errors import StalledProgram, require, require_type
from bipot.typing import Floats

if TYPE_CHECKING:
    import cvxpy as cp


@dataclass(frozen=True)
class Stated:
    """A cvxpy problem with its variables and constraints by the names of a conic program's blocks and terms.

    Empty blocks and terms may be missing in either. ``omitted`` is what the conic program omits of the cost; None for
    the cost at x = 0, where that of every conic program is 0.
    """

    problem: cp.Problem
    blocks: Mapping[str, cp.Expression]
    constraints: Mapping[str, cp.Constraint]
    omitted: float | None = None

    @property
    def value(self) -> float:
        """The least cost of the solved problem."""
        return float(np.asarray(self.problem.value))

    def dual(self, term: str) -> Floats:
        """Multipliers (m, width) of the solved problem's constraint of that name, as in :class:`ConicSolution`.

        Raises:
            SceneError: there is no such constraint.
        """
        from cvxpy.constraints.zero import Equality, Zero

        known = ", ".join(self.constraints)
        require(term in self.constraints, "term", term, f"one of {known}")
        constraint = self.constraints[term]
        parts = [np.atleast_1d(np.asarray(v.value, dtype=float)) for v in constraint.dual_variables]
        stacked = np.hstack([part.reshape(len(part), -1) for part in parts])
        # cvxpy's multipliers of equalities have the opposite sign.
        return -stacked if isinstance(constraint, Equality | Zero) else stacked

    def constant(self) -> float:
        """The statement's cost without that of the conic program; the variables keep their values."""
        if self.omitted is not None:
            return self.omitted
        kept = [(variable, variable.value) for variable in self.problem.variables()]
        for variable, _ in kept:
            variable.value = np.zeros(variable.shape)
        constant = float(np.asarray(self.problem.objective.expr.value))
        for variable, value in kept:
            variable.value = value
        return constant


BROUGHT = ("CLARABEL", "SCS")
"""Solvers that cvxpy itself requires: known to be installed without the slow import of cvxpy."""


@dataclass(frozen=True)
class Cvxpy:
    """The solver called ``name`` in cvxpy; solvers not in OPTIONS use their default tolerance.

    Raises:
        SceneError: cvxpy finds no solver of that name installed, or one that takes no second-order cones.
    """

    name: str = "CLARABEL"

    def __post_init__(self) -> None:
        require_type(self.name, str, "cvxpy.name")
        # In a march a wrong name would be one more failed attempt, and another form would silently take over.
        if self.name not in BROUGHT:
            known = cone_solvers()
            require(self.name in known, "cvxpy.name", self.name, f"one of {', '.join(known)}, which are installed")

    def solve(self, program: ConicProgram, accuracy: Accuracy, last: None = None) -> tuple[ConicSolution, None]:
        """As :meth:`~bipot.conic.solver.ConicSolver.solve`."""
        began = time.perf_counter()
        stated = written(program) if program.statement is None else program.statement()
        built = Timing(build=time.perf_counter() - began)
        outcome, iterations, timing = solve_stated(stated, accuracy, self.name)
        x = np.zeros(len(program.q))
        for block, variable in stated.blocks.items():
            x[program.blocks[block]] = np.ravel(np.asarray(variable.value))
        dual = {r.term: np.zeros((r.count, r.width)) for r in program.rows}
        dual |= {term: stated.dual(term) for term in stated.constraints}
        return ConicSolution(program, x, dual, outcome, iterations, built + timing), None


OPTIONS: Mapping[str, Any] = {
    "CLARABEL": lambda a: {
        "tol_gap_abs": a.tolerance,
        "tol_gap_rel": a.tolerance,
        "tol_feas": a.tolerance,
        "max_iter": a.iterations,
        "max_threads": 1,
    },
    "QOCO": lambda a: {"abstol": a.tolerance, "reltol": a.tolerance, "max_iters": a.iterations},
    "SCS": lambda a: {"eps_abs": a.tolerance, "eps_rel": a.tolerance, "max_iters": a.iterations},
}
"""The requested accuracy as options of each solver."""


@cache
def cone_solvers() -> tuple[str, ...]:
    """Names of the solvers of second-order cone programs that cvxpy finds installed."""
    import cvxpy as cp

    return tuple(name for name in cp.installed_solvers() if _takes_cones(name))


def _takes_cones(name: str) -> bool:
    """Whether min t with |1| <= t can be posed to the solver of that name."""
    import cvxpy as cp

    t = cp.Variable(2)
    try:
        cp.Problem(cp.Minimize(t[0]), [cp.SOC(t[0], t[1:]), t[1] == 1]).get_problem_data(name)
    except (cp.SolverError, ValueError):
        return False
    return True


def written(program: ConicProgram) -> Stated:
    """The data of a program as a statement of one variable x."""
    import cvxpy as cp

    x = cp.Variable(len(program.q))
    constraints: dict[str, Any] = {}
    for r in program.rows:
        value = r.A @ x + r.b
        if r.count and r.cone is Cone.SECOND_ORDER:
            cones = cp.reshape(value, (r.count, r.width), order="C")
            constraints[r.term] = cp.SOC(cones[:, 0], cones[:, 1:], axis=1)
        elif r.count:
            constraints[r.term] = value == 0 if r.cone is Cone.ZERO else value >= 0
    cost = cp.quad_form(x, cp.psd_wrap(program.P)) / 2 + program.q @ x
    problem = cp.Problem(cp.Minimize(cost), list(constraints.values()))
    return Stated(problem, {name: x[part] for name, part in program.blocks.items()}, constraints)


def solve_stated(stated: Stated, accuracy: Accuracy, name: str = "CLARABEL") -> tuple[Claim, int, Timing]:
    """Solve through cvxpy; values and duals are then in the statement's variables.

    Raises:
        InfeasibleProgram, UnboundedProgram, StalledProgram, ProgramError: by the solver's status.
    """
    import cvxpy as cp

    started = time.perf_counter()
    with warnings.catch_warnings():
        # cvxpy warns of AlmostSolved; we record it as an outcome and re-check the answer ourselves.
        warnings.filterwarnings("ignore", message="Solution may be inaccurate")
        try:
            # SCS intercepts Ctrl-C and ends without an answer.
            with undisturbed():
                stated.problem.solve(solver=name, warm_start=False, **OPTIONS.get(name, lambda a: {})(accuracy))
        except cp.SolverError as broken:
            # cvxpy raises where the solver came no nearer; at a limit of time or iterations it says so.
            raise StalledProgram(f"conic solver stopped without an answer ({broken}): refine the increment") from broken
    total = time.perf_counter() - started
    status, stats = stated.problem.status, stated.problem.solver_stats
    # An inaccurate claim proves nothing, and cvxpy keeps no certificate that could be checked.
    if status == cp.INFEASIBLE:
        raise infeasible()
    if status == cp.UNBOUNDED:
        raise unbounded()
    if status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise unsolved(status)
    outcome = Claim.SOLVED if status == cp.OPTIMAL else Claim.ALMOST
    solved = float(stats.solve_time or 0.0)
    return outcome, int(stats.num_iters or 0), Timing(total - solved, solved)
