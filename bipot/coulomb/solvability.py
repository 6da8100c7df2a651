"""Whether a solution can exist, asked before any is sought; the answer has three values.

Both tests maximise the margin t by which some velocity satisfies
    u_n >= t              t* < 0: no velocity is admissible, none exists (Farkas forces prove it)
    u_n >= mu |u_t| + t   t* > 0: a velocity inside the dual cone, one exists
and say nothing in between. Velocities are the points of {H v + w} or {W x + q}, in the second test of {S x + q}, S the
symmetric part of W. It has to be positive semidefinite, in the global form that of M positive definite.

Why the second suffices: F(r) = u + mu |u_t| n is continuous, and r · F(r) >= r · S r + q · r for r in K. Some S x + q
lies inside the dual cone exactly where q · d > 0 for every d != 0 in K with S d = 0 (in the global form with H d = 0,
and then q · d = w · d). So r · F(r) > 0 for all large r in K, and the variational inequality of F on K, which is
Coulomb's law, has a solution (Hartman and Stampacchia). For a symmetric W this is the theorem of Acary, Cadoux,
Lemaréchal and Malick.

Matrices are semidefinite to some digits only. If S + e is, e > 0, and (S + e) x + q lies inside by t, then on all r of
K whose normal forces add up to R: r · F(r) >= t R - x · (S + e) x / 4 - e (1 + mu²) R². Some R makes this positive
where t² > e (1 + mu²) x · (S + e) x, and the solution is found among the smaller forces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy import sparse

from bipot.basics.definite import ROUGHLY, semidefinite
from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Claim, Cone, ConicProgram, Rows
from bipot.conic.solver import Accuracy
from bipot.coulomb.problem import CoulombProblem, GlobalCoulombProblem, column_count, require_problem
from bipot.errors import ProgramError
from bipot.tensors import norm
from bipot.typing import Floats, max_abs

# A certificate must hold this well in scaled numbers to count; what is nearer to 0 is "unknown".
_CERTAIN = 1e-7
_BALANCED = 1e-6
# How far, over its largest entry, S may be from semidefinite: not at all, to round-off, or to single precision.
_SHIFTS = (0.0, 1e-12, ROUGHLY)
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


class _Margin(NamedTuple):
    """The largest margin t, at x (n,), with its multipliers; nan and zeros where the program was not solved."""

    t: float
    x: Floats
    multipliers: Floats


def _largest_margin(A: sparse.csr_array, b: Floats, cone: Floats | None, seconds: float, dim: int) -> _Margin:
    """Max t, t <= 1: A x + b >= t (cone None, rows n), or A x + b - t n in the dual cones with mu = ``cone``."""
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
        return _Margin(np.nan, np.zeros(n), np.zeros(b.size))
    margin = float(answer.x[-1]) if answer.outcome is Claim.SOLVED else np.nan
    return _Margin(margin, answer.x[:-1], answer.dual["margin"].ravel())


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
    opening = _largest_margin(sparse.csr_array(A[::dim]), b[::dim], None, seconds, dim)
    if opening.t < -_CERTAIN and _is_farkas(A[::dim], b[::dim], opening.multipliers):
        reason = (
            "no velocity keeps every contact from closing: H_n v + w_n >= 0 is infeasible, by self-balanced "
            f"normal forces of work {opening.t:.1e} < 0; open the clearances or drop a contact"
        )
        forces = np.maximum(opening.multipliers, 0.0) / unit[::dim]
        return ExistenceReport(Existence.NONE, reason, opening.t, forces / forces.sum())
    if local is not None:
        A = sparse.csr_array((A + A.T) / 2)
    inside = _largest_margin(A, b, mu, seconds, dim)
    if not _depth(A @ inside.x + b, mu) > _CERTAIN:
        return ExistenceReport(Existence.UNKNOWN, "neither condition decides", inside.t)
    if local is None and not problem.semidefinite:
        reason = "M is not positive definite, the sufficient condition supposes it"
        return ExistenceReport(Existence.UNKNOWN, reason, inside.t)
    if local is not None and not any(_presses_back(A, b, mu, inside.x, shift) for shift in _SHIFTS):
        reason = "W is not positive semidefinite, or not to enough digits, the sufficient condition supposes it"
        return ExistenceReport(Existence.UNKNOWN, reason, inside.t)
    return ExistenceReport(Existence.EXISTS, "some velocity lies inside the dual cone", inside.t)


def _depth(u: Floats, mu: Floats) -> float:
    """Least u_n - mu |u_t| of velocities u (dc,)."""
    rows = u.reshape(mu.size, -1)
    return float((rows[:, 0] - mu * norm(rows[:, 1:])).min())


def _presses_back(S: sparse.csr_array, b: Floats, mu: Floats, x: Floats, shift: float) -> bool:
    """Whether r · F(r) > 0 for all r of K of some size, by S + ``shift`` (module docstring) and its velocity at x."""
    moved = S @ x + shift * x
    t, spent = _depth(moved + b, mu), shift * (1.0 + max_abs(mu) ** 2) * float(x @ moved)
    return t > _CERTAIN and t * t > spent and semidefinite(S, shift)


def _is_farkas(A: sparse.csr_array, b: Floats, y: Floats) -> bool:
    """Whether y >= 0 (sum y = 1) balances itself, |Aᵀ y| <= 1e-6 |b · y|, and does negative work b · y < 0.

    What is left of Aᵀ y could only be used by x above 1e6 in scaled units: of such forces round-off leaves 1e-10 of the
    load, so no answer with them would be one at the default tolerance.
    """
    y = np.maximum(y, 0.0)
    work = float(b @ y)
    return work < 0 and max_abs(A.T @ y) <= _BALANCED * -work
