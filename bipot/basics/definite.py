"""Whether a sparse matrix is that of an energy: symmetric, positive definite or semidefinite.

Where its unknowns have several units each row is first divided by one of its own, and each column by the same: what is
stiff elsewhere excuses nothing.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from bipot.typing import Floats, max_abs

ROUGHLY = 1e-6
"""Matrices of files are symmetric and semidefinite to single precision, within this part of their largest entry."""


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


def by_units(matrix: sp.csr_array, unit: Floats) -> sp.csr_array:
    """The matrix (n, n) with row and column i divided by unit i (n,)."""
    own = sp.diags_array(1.0 / unit)
    return sp.csr_array(own @ matrix @ own)


def by_diagonal(matrix: sp.csr_array) -> sp.csr_array:
    """The matrix by the roots of its diagonal, where that is positive; by one elsewhere."""
    diagonal = np.asarray(matrix.diagonal(), dtype=np.float64)
    return by_units(matrix, np.sqrt(np.where(diagonal > 0, diagonal, 1.0)))


def asymmetry(matrix: sp.csr_array) -> float:
    """Max |A - Aᵀ| / max |A|, 0 for A = 0.

    >>> asymmetry(sp.csr_array([[1.0, 2.0], [4.0, 3.0]]))
    0.5
    """
    largest = max_abs(matrix.data)
    return max_abs(sp.csr_array(matrix - matrix.T).data) / largest if largest else 0.0


def semidefinite(matrix: sp.csr_array, digits: float = ROUGHLY) -> bool:
    """Whether the symmetric part is positive semidefinite, to ``digits`` of the largest entry.

    >>> ones = sp.csr_array(np.ones((2, 2)))
    >>> semidefinite(ones), semidefinite(ones - sp.eye_array(2))
    (True, False)
    >>> semidefinite(sp.csr_array((2, 2)))
    True
    """
    shift = digits * (max_abs(matrix.data) or 1.0)
    return definite(sp.csc_matrix(matrix + shift * sp.eye_array(matrix.indptr.size - 1)))
