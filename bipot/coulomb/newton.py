"""Semismooth Newton on a nonsmooth function of the law: a line search on |F|, open contacts eliminated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from bipot.coulomb.functions import AlartCurnier, ContactFunction, Expansion
from bipot.coulomb.solver import ScaledProblem, SolverState
from bipot.errors import ProgramError, require_count, require_type
from bipot.typing import Bools, Floats, einsum, make_floats

_SHORTEST = 1e-3
_DECREASE = 0.1
_PATIENCE = 50


@dataclass(frozen=True)
class LineSearch:
    """Halve from the full step until |F| <= (1 - 0.1 t) of the largest of the last ``memory`` values.

    memory = 1 is monotone; more lets active sets change past a bump. If no step qualifies the best tried is taken.
    """

    memory: int = 4

    def __post_init__(self) -> None:
        require_count(self.memory, "memory")

    def __call__(
        self, merit: Callable[[Floats], float], r: Floats, step: Floats, past: tuple[float, ...]
    ) -> tuple[Floats, float]:
        """(new r, its merit)."""
        reference, t = max(past[-self.memory :]), 1.0
        best, lowest = r, np.inf
        while t > _SHORTEST:
            trial = r + t * step
            value = merit(trial)
            if value < lowest:
                best, lowest = trial, value
            if value <= (1.0 - _DECREASE * t) * reference:
                break
            t *= 0.5
        return best, float(lowest)


@dataclass(frozen=True, eq=False)
class NewtonState(SolverState):
    """r, the merit |F| of the iterates so far, and why it stopped."""

    r: Floats
    merits: tuple[float, ...]
    stalled: str | None = None


def merit(problem: ScaledProblem, function: ContactFunction, r: Floats, u: Floats) -> float:
    """|F(r, u)|, 2-norm over all contacts."""
    return float(np.linalg.norm(function.value(problem.by_contact(r), problem.by_contact(u), problem.mu)))


def linearise(problem: ScaledProblem, function: ContactFunction, r: Floats, u: Floats) -> Expansion:
    """F and its derivatives by contact."""
    return function.linearise(problem.by_contact(r), problem.by_contact(u), problem.mu)


def _levenberg_direction(problem: ScaledProblem, rows: Expansion, weight: float) -> Floats:
    """Solve (Jᵀ J + λ I) δr = -Jᵀ F as the least squares of [J; √λ I], λ = ``weight``: defined for singular W."""
    J, F = jacobian(problem, rows), rows.value.ravel()
    if isinstance(J, np.ndarray):
        stacked = np.vstack([J, np.sqrt(weight) * np.eye(F.size)])
        right = np.concatenate([-F, np.zeros(F.size)])
        least: Any = linalg.lstsq(stacked, right, lapack_driver="gelsy", check_finite=False)
        return np.asarray(least[0])
    normal = sparse.csc_matrix(J.T @ J + weight * sparse.eye_array(F.size))
    return factorised(normal).solve(-(J.T @ F))


@dataclass(frozen=True)
class Newton:
    """J δr = -F with J = dF/du W + dF/dr; one factorisation a step.

    ``levenberg`` = 0 solves the square system and fails where W makes it singular; > 0 takes the
    Levenberg-Marquardt step with λ = levenberg |F|, which a rank-deficient (hyperstatic) W needs.
    Stalls when |F| has not been halved in fifty steps: active sets then usually cycle.
    """

    function: ContactFunction = field(default_factory=AlartCurnier)
    levenberg: float = 0.0
    search: LineSearch = field(default_factory=LineSearch)

    def __post_init__(self) -> None:
        require_type(self.function, ContactFunction, "function")
        make_floats(self, levenberg="finite and >= 0")
        require_type(self.search, LineSearch, "search")

    @property
    def name(self) -> str:
        """Label: newton-AlartCurnier, newton-NaturalMap, with -LM for Levenberg-Marquardt."""
        return f"newton-{type(self.function).__name__}" + ("-LM" if self.levenberg else "")

    def init(self, problem: ScaledProblem, r: Floats) -> NewtonState:
        """Merit at the start."""
        return NewtonState(r, (merit(problem, self.function, r, problem.velocity(r)),))

    def step(self, problem: ScaledProblem, state: NewtonState) -> NewtonState:
        """One direction and one line search."""
        rows = linearise(problem, self.function, state.r, problem.velocity(state.r))
        if self.levenberg:
            direction = _levenberg_direction(problem, rows, self.levenberg * state.merits[-1])
        else:
            direction = newton_direction(problem, rows, 0.0)
        r, value = self.search(
            lambda x: merit(problem, self.function, x, problem.velocity(x)), state.r, direction, state.merits
        )
        merits = (*state.merits[-_PATIENCE:], value)
        tired = len(merits) > _PATIENCE and min(merits) > 0.5 * merits[0]
        reason = f"|F| was not halved in {_PATIENCE} Newton steps, the active sets cycle" if tired else None
        return NewtonState(r, merits, reason)


def _dense_jacobian(W: Floats, du: Floats, dr: Floats) -> Floats:
    c, d, _ = du.shape
    J = (du @ W.reshape(c, d, c * d)).reshape(c, d, c, d)
    each = np.arange(c)
    J[each, :, each, :] += dr
    return J.reshape(c * d, c * d)


def _sparse_jacobian(W: sparse.bsr_array, du: Floats, dr: Floats, kept: Bools) -> sparse.csc_matrix:
    """Rows and columns of the ``kept`` contacts only; du and dr (c, d, d) of all."""
    d = dr.shape[1]
    row = np.repeat(np.arange(kept.size), np.diff(W.indptr))
    chosen = kept[row] & kept[W.indices]
    row, column = row[chosen], W.indices[chosen]
    data = du[row] @ W.data[chosen]
    data[row == column] += dr[kept]
    number, count = np.cumsum(kept) - 1, int(kept.sum())
    start = np.searchsorted(number[row], np.arange(count + 1))
    return sparse.csc_matrix(sparse.bsr_array((data, number[column], start), shape=(count * d, count * d)))


def jacobian(problem: ScaledProblem, rows: Expansion) -> Floats | sparse.csc_matrix:
    """dF/du W + dF/dr of the whole problem, (dc, dc)."""
    if problem.blocks is None:
        return _dense_jacobian(np.asarray(problem.W), rows.du, rows.dr)
    return _sparse_jacobian(problem.blocks, rows.du, rows.dr, np.ones(problem.mu.size, dtype=np.bool_))


def factorised(matrix: sparse.csc_matrix) -> sparse_linalg.SuperLU:
    """Sparse LU, ordered for the symmetric pattern that contacts have. Raises ProgramError where singular."""
    try:
        return sparse_linalg.splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}
        )
    except RuntimeError as failure:
        raise ProgramError("the Newton matrix is singular") from failure


def newton_direction(problem: ScaledProblem, rows: Expansion, proximal: float) -> Floats:
    """Solve (dF/du (W + α I) + dF/dr) δr = -F, (dc,); open contacts (dF/du = 0, F = r) are eliminated with δr = -F.

    Raises ProgramError where the matrix is singular to working precision.
    """
    kept = np.any(rows.du != 0, axis=(1, 2))
    open_part = np.where(kept[:, None], 0.0, -rows.value)
    if not np.any(kept):
        return open_part.ravel()
    pushed = problem.by_contact(problem.W @ open_part.ravel())
    right = -(rows.value + einsum("cij,cj->ci", rows.du, pushed))[kept].ravel()
    dr = rows.dr + proximal * rows.du
    step = open_part.copy()
    step[kept] = _solve(problem, rows.du, dr, kept, right).reshape(-1, problem.dim)
    if not np.all(np.isfinite(step)):
        raise ProgramError("the Newton matrix is singular to working precision")
    return step.ravel()


def _solve(problem: ScaledProblem, du: Floats, dr: Floats, kept: Bools, right: Floats) -> Floats:
    if problem.blocks is not None:
        return factorised(_sparse_jacobian(problem.blocks, du, dr, kept)).solve(right)
    dofs = np.flatnonzero(np.repeat(kept, problem.dim))
    J = _dense_jacobian(np.asarray(problem.W)[np.ix_(dofs, dofs)], du[kept], dr[kept])
    try:
        return np.asarray(np.linalg.solve(J, right), dtype=np.float64)
    except np.linalg.LinAlgError as failure:
        raise ProgramError("the Newton matrix is singular") from failure
