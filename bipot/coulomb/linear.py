"""Linear algebra of a semismooth Newton step: block rows times W, open contacts eliminated."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from bipot.coulomb.functions import Expansion
from bipot.coulomb.scaling import Blocks, ScaledProblem
from bipot.errors import ProgramError
from bipot.typing import Bools, Floats, einsum


def _dense_jacobian(W: Floats, du: Floats, dr: Floats) -> Floats:
    c, d, _ = du.shape
    J = (du @ W.reshape(c, d, c * d)).reshape(c, d, c, d)
    each = np.arange(c)
    J[each, :, each, :] += dr
    return J.reshape(c * d, c * d)


def _sparse_jacobian(W: Blocks, du: Floats, dr: Floats, kept: Bools) -> sparse.csc_matrix:
    """Rows and columns of the ``kept`` contacts only; du and dr (c, d, d) of all."""
    d = dr.shape[1]
    chosen = kept[W.row] & kept[W.column]
    row, column = W.row[chosen], W.column[chosen]
    data = du[row] @ W.data[chosen]
    data[(np.cumsum(chosen) - 1)[W.diagonal[kept]]] += dr[kept]
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
