"""Whether a solution can exist, asked before any is sought; the answer has three values.

Both tests maximise the margin t by which some velocity, a point of {H v + w} or {W x + q}, satisfies
    u_n >= t              t* < 0: no velocity is admissible, none exists (Farkas forces prove it)
    u_n >= mu |u_t| + t   t* > 0: a velocity inside the dual cone, one exists (the theorem of Acary, Cadoux,
                          Lemaréchal and Malick)
and say nothing in between. The second needs W symmetric and positive semidefinite, as theirs is; in the global form
M symmetric and positive definite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy import sparse

from bipot.basics.definite import ROUGHLY
from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Claim, Cone, ConicProgram, Rows
from bipot.conic.solver import Accuracy
from bipot.coulomb.problem import CoulombProblem, GlobalCoulombProblem, column_count, require_problem
from bipot.errors import ProgramError
from bipot.typing import Floats, max_abs

# A certificate must hold this well in scaled numbers to count; what is nearer to 0 is "unknown".
_CERTAIN = 1e-7
_BALANCED = 1e-6
_ACCURACY = Accuracy(1e-10, 200)


class Existence(Enum):
    """Verdict of the existence test."""

    NONE = "none exists"
    EXISTS = "one exists"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class ExistenceReport:
    """``verdict`` with its ``reason``; ``margin`` is t*, relative to |q| (nan when not needed).

    ``forces`` (c,), where none exists: self-balanced normal forces on which every admissible velocity would
    do negative work, y >= 0, W_nᵀ y = 0, q_n · y < 0.
    """

    verdict: Existence
    reason: str
    margin: float
    forces: Floats | None = None


def _largest_margin(
    A: sparse.csr_array, b: Floats, cone: Floats | None, seconds: float, dim: int
) -> tuple[float, Floats]:
    """Max t, t <= 1: A x + b >= t (cone None, rows n), or A x + b - t n in the dual cones with mu = ``cone``; and its
    multipliers. What is not solved is nan.
    """
    n, on_t = column_count(A), np.ones(b.size)
    if cone is not None:
        weight = np.repeat(cone, dim)
        weight[::dim], on_t = 1.0, np.tile([1.0] + [0.0] * (dim - 1), cone.size)
        A, b = sparse.csr_array(sparse.diags_array(weight) @ A), weight * b
    kind, width = (Cone.NONNEGATIVE, 1) if cone is None else (Cone.SECOND_ORDER, dim)
    capped = sparse.csr_matrix(([-1.0], ([0], [n])), shape=(1, n + 1))
    inside = sparse.csr_matrix(sparse.hstack([A, -on_t[:, None]]))
    rows = (Rows("cap", Cone.NONNEGATIVE, capped, np.ones(1)), Rows("margin", kind, inside, b, width))
    objective = np.zeros(n + 1)
    objective[-1] = -1.0
    program = ConicProgram(sparse.csc_matrix((n + 1, n + 1)), objective, rows, {"x": slice(0, n), "t": slice(n, n + 1)})
    try:
        answer, _ = Clarabel(seconds=seconds).solve(program, _ACCURACY)
    except ProgramError:
        return np.nan, np.zeros(b.size)
    margin = float(answer.x[-1]) if answer.outcome is Claim.SOLVED else np.nan
    return margin, answer.dual["margin"].ravel()


def _operator(problem: CoulombProblem | GlobalCoulombProblem) -> tuple[sparse.csr_array, Floats, Floats]:
    """Velocities as A x + b, rows and b by each contact's unit (dc,), then A by its largest entry, b by its length."""
    if isinstance(problem, GlobalCoulombProblem):
        A, b = sparse.csr_array(problem.H.T), problem.w
        size = np.sqrt(np.asarray(A.multiply(A).sum(axis=1), dtype=np.float64).reshape(-1, problem.dim).sum(axis=1))
        unit = np.repeat(np.where(size > 0, size, 1.0), problem.dim)
    else:
        unit = np.repeat(problem.contact_unit, problem.dim)
        A, b = sparse.csr_array(problem.W @ sparse.diags_array(1.0 / unit)), problem.q
    A, b = sparse.csr_array(sparse.diags_array(1.0 / unit) @ A), b / unit
    size = max_abs(A.data) or 1.0
    return sparse.csr_array(A / size), b / (float(np.linalg.norm(b)) or 1.0), unit


def existence(problem: CoulombProblem | GlobalCoulombProblem, seconds: float = math.inf) -> ExistenceReport:
    """Test whether the problem has a solution; at most ``seconds`` for each of the two programs.

    >>> opposed = [[1, 0, -1, 0], [0, 1, 0, 0], [-1, 0, 1, 0], [0, 0, 0, 1]]
    >>> existence(CoulombProblem(W=opposed, q=[-1, 0, -1, 0], mu=0.1, dim=2)).verdict.value
    'none exists'
    """
    require_problem(problem)
    dim, mu = problem.dim, problem.mu
    local = problem if isinstance(problem, CoulombProblem) else None
    if local is not None and np.all(local.q[::dim] >= 0):
        return ExistenceReport(Existence.EXISTS, "no contact closes without forces: r = 0 is a solution", np.nan)
    A, b, unit = _operator(problem)
    opening, multiplier = _largest_margin(sparse.csr_array(A[::dim]), b[::dim], None, seconds, dim)
    if opening < -_CERTAIN and _is_farkas(A[::dim], b[::dim], multiplier):
        reason = (
            "no velocity keeps every contact from closing: H_n v + w_n >= 0 is infeasible, by self-balanced "
            f"normal forces of work {opening:.1e} < 0; open the clearances or drop a contact"
        )
        forces = np.maximum(multiplier, 0.0) / unit[::dim]
        return ExistenceReport(Existence.NONE, reason, opening, forces / forces.sum())
    name = "M" if local is None else "W"
    if problem.asymmetry > ROUGHLY:
        reason = f"{name} is not symmetric, the sufficient condition supposes it"
        return ExistenceReport(Existence.UNKNOWN, reason, np.nan)
    inside, _ = _largest_margin(A, b, mu, seconds, dim)
    if not inside > _CERTAIN:
        return ExistenceReport(Existence.UNKNOWN, "neither condition decides", inside)
    if not problem.semidefinite:
        reason = f"{name} is not positive {'definite' if local is None else 'semidefinite'}, "
        return ExistenceReport(Existence.UNKNOWN, reason + "the sufficient condition supposes it", inside)
    return ExistenceReport(Existence.EXISTS, "some velocity lies inside the dual cone", inside)


def _is_farkas(A: sparse.csr_array, b: Floats, y: Floats) -> bool:
    """Whether y >= 0 (sum y = 1) balances itself, |Aᵀ y| <= 1e-6 |b · y|, and does negative work b · y < 0.

    What is left of Aᵀ y could only be used by x above 1e6 in scaled units: of such forces round-off leaves 1e-10 of the
    load, so no answer with them would be one at the default tolerance.
    """
    y = np.maximum(y, 0.0)
    work = float(b @ y)
    return work < 0 and max_abs(A.T @ y) <= _BALANCED * -work
