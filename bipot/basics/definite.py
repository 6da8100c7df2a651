"""Whether a sparse matrix is positive definite."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla


def definite(matrix: sp.csc_matrix) -> bool:
    """Whether the symmetric part of a matrix (n, n) is positive definite: all pivots of its factors are.

    >>> definite(sp.csc_matrix(np.diag([1.0, 2.0]))), definite(sp.csc_matrix(np.array([[1.0, 2.0], [2.0, 1.0]])))
    (True, False)
    """
    half = sp.csc_matrix((matrix + matrix.T) / 2)
    try:
        lu = sla.splu(half, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return False
    return np.array_equal(lu.perm_r, lu.perm_c) and bool((lu.U.diagonal() > 0).all())
