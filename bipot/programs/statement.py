r"""Contact as one states it in cvxpy, shared by every exact program, and how a stated program is solved.

    cost s' t,   G_n dU + g >= 0,   (t_c, G_t,c dU + w_c) in the second-order cone,   ties as equalities,

or, with De Saxce's shift frozen, (G_n,c dU + g_c + shift_c, mu G_t,c dU + mu w_c) in it and no cost.

Thresholds, gaps and slips may be numbers or ``cp.Parameter``: the compiled program states them the same way.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.errors import InfeasibleProgram, ProgramError, UnboundedProgram
from bipot.programs.clarabel import Accuracy
from bipot.programs.data import Outcome, Timing
from bipot.programs.terms import ContactTerms

Floats = NDArray[np.float64]
Data = Any  # a number array or a cp.Parameter of that shape


@dataclass(frozen=True)
class ContactData:
    """What may change between two solves of one compiled program.

    Gap (c,), slip (f, d-1) and threshold (f,) of their parts; gap + shift and mu slip of the shifted cones.
    """

    gap: Data
    tied_gap: Data
    slip: Data
    stuck_slip: Data
    threshold: Data
    cone_gap: Data
    cone_slip: Data

    @staticmethod
    def of(contact: ContactTerms) -> ContactData:
        """The numbers of one program."""
        rows = contact.rows
        _, cone_gap, _, cone_slip = contact.shifted_rows()
        return ContactData(
            rows.gap[contact.unilateral],
            rows.gap[rows.tied],
            rows.slip[contact.sliding],
            rows.slip[contact.stuck].ravel(),
            contact.threshold[contact.sliding],
            cone_gap,
            cone_slip,
        )

    @staticmethod
    def parameters(contact: ContactTerms) -> ContactData:
        """Parameters of the shapes that ``contact`` has."""
        numbers = ContactData.of(contact)
        made = {name: cp.Parameter(a.shape) if a.size else a for name, a in vars(numbers).items()}
        bound = numbers.threshold
        return ContactData(**made | {"threshold": cp.Parameter(bound.shape, nonneg=True) if bound.size else bound})

    def assign(self, contact: ContactTerms) -> None:
        """Give the parameters the numbers of ``contact``."""
        numbers = ContactData.of(contact)
        for name, value in vars(numbers).items():
            parameter = getattr(self, name)
            if isinstance(parameter, cp.Parameter):
                parameter.value = value


@dataclass(frozen=True)
class ContactStatement:
    """The contact part of a stated program: its cost and its constraints (None where there are no rows)."""

    contact: ContactTerms
    cost: Any
    gap: cp.Constraint | None
    friction: cp.Constraint | None
    tie: cp.Constraint | None
    cone: cp.Constraint | None

    @staticmethod
    def of(dU: cp.Variable, contact: ContactTerms, data: ContactData) -> ContactStatement:
        """State gap, friction and ties on the displacement variable ``dU``."""
        rows = contact.rows
        normal, tied = rows.G_n[contact.unilateral], rows.G_n[rows.tied]
        sliding, slip = contact.tangent_rows(contact.sliding)
        stuck, _ = contact.tangent_rows(contact.stuck)
        cost, friction = cp.Constant(0.0), None
        if slip.size:
            t = cp.Variable(len(slip))
            motion = cp.reshape(sliding @ dU, slip.shape, order="C") + data.slip
            friction = cp.SOC(t, motion, axis=1)
            cost = data.threshold @ t
        gap = normal @ dU + data.gap >= 0 if normal.shape[0] else None
        tie = None
        if tied.shape[0]:
            tie = sp.vstack([tied, stuck]) @ dU + cp.hstack([data.tied_gap, data.stuck_slip]) == 0
        return ContactStatement(contact, cost, gap, friction, tie, _cone(dU, contact, data))

    @property
    def constraints(self) -> list[cp.Constraint]:
        """Those that are there."""
        return [c for c in (self.gap, self.friction, self.tie, self.cone) if c is not None]

    def forces(self) -> Floats:
        """Contact forces r (c, d) from the dual values; cvxpy's equality duals have the opposite sign."""
        tangents = self.contact.rows.tangents
        normal = np.zeros(0) if self.gap is None else _dual(self.gap)
        tie = np.zeros(0) if self.tie is None else -_dual(self.tie)
        tangential = np.zeros((0, tangents))
        if self.friction is not None:
            tangential = np.asarray(list(self.friction.dual_variables)[1].value).reshape(-1, tangents)
        cone = np.zeros((0, tangents + 1))
        if self.cone is not None:
            head, body = (np.asarray(dual.value) for dual in self.cone.dual_variables)
            cone = np.column_stack([head.ravel(), body.reshape(-1, tangents)])
        return self.contact.assemble(normal, tangential, tie, cone)


def _cone(dU: cp.Variable, contact: ContactTerms, data: ContactData) -> cp.Constraint | None:
    """The shifted cones of gap and slip."""
    normal, gap, tangent, slip = contact.shifted_rows()
    if not gap.size:
        return None
    motion = cp.reshape(tangent @ dU, slip.shape, order="C") + data.cone_slip
    return cp.SOC(normal @ dU + data.cone_gap, motion, axis=1)


def _dual(constraint: cp.Constraint) -> Floats:
    return np.asarray(constraint.dual_value, dtype=float).reshape(-1)


@dataclass(frozen=True)
class Stated:
    """A cvxpy problem with its displacement variable and contact statement."""

    problem: cp.Problem
    dU: cp.Variable
    contact: ContactStatement


def solve_stated(stated: Stated, accuracy: Accuracy) -> tuple[Outcome, int, Timing]:
    """Solve with Clarabel through cvxpy; values and duals are then in the statement's variables.

    Raises:
        InfeasibleProgram, UnboundedProgram, ProgramError: by the solver's status.
    """
    started = time.perf_counter()
    tolerance = accuracy.tolerance
    with warnings.catch_warnings():
        # cvxpy warns of AlmostSolved; we record it as an outcome and re-check the answer ourselves.
        warnings.filterwarnings("ignore", message="Solution may be inaccurate")
        try:
            stated.problem.solve(
                solver=cp.CLARABEL,
                tol_gap_abs=tolerance,
                tol_gap_rel=tolerance,
                tol_feas=tolerance,
                max_iter=accuracy.iterations,
                max_threads=1,
                warm_start=False,
            )
        except cp.SolverError as broken:
            # cvxpy raises where the solver stops without an answer: a failed attempt like any other.
            raise ProgramError(f"conic solver stopped without an answer ({broken}): refine the increment") from broken
    total = time.perf_counter() - started
    status, stats = stated.problem.status, stated.problem.solver_stats
    if status in (cp.INFEASIBLE, cp.INFEASIBLE_INACCURATE):
        raise InfeasibleProgram("no displacement satisfies the contact and support constraints together")
    if status in (cp.UNBOUNDED, cp.UNBOUNDED_INACCURATE):
        raise UnboundedProgram("the load is above the limit load: a mechanism dissipates less than it gains")
    if status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise ProgramError(f"conic solver stopped with {status}: refine the increment or loosen the tolerance")
    outcome = Outcome.SOLVED if status == cp.OPTIMAL else Outcome.ALMOST
    solved = float(stats.solve_time or 0.0)
    return outcome, int(stats.num_iters or 0), Timing(total - solved, solved)
