"""Whether a matrix is that of an energy: symmetric, and positive definite or semidefinite.

Each row is first divided by a unit of its own, and each column by the same: what is stiff elsewhere excuses nothing.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from bipot.tensors import FloatArray

ROUGHLY = 1e-6
"""Matrices of files are symmetric and semidefinite to single precision, within this part of their largest entry."""


def by_units(matrix: sparse.csr_array, unit: FloatArray) -> sparse.csr_array:
    """The matrix (n, n) with row and column i divided by unit i (n,)."""
    own = sparse.diags_array(1.0 / unit)
    return sparse.csr_array(own @ matrix @ own)


def by_diagonal(matrix: sparse.csr_array) -> sparse.csr_array:
    """The matrix by the roots of its diagonal, where that is positive; by one elsewhere."""
    diagonal = np.asarray(matrix.diagonal(), dtype=np.float64)
    return by_units(matrix, np.sqrt(np.where(diagonal > 0, diagonal, 1.0)))


def asymmetry(matrix: sparse.csr_array) -> float:
    """Max |A - Aᵀ| / max |A|, 0 for A = 0.

    >>> asymmetry(sparse.csr_array([[1.0, 2.0], [4.0, 3.0]]))
    0.5
    """
    largest = _largest(matrix)
    return _largest(sparse.csr_array(matrix - matrix.T)) / largest if largest else 0.0


def definite(matrix: sparse.csr_array, within: float = 0.0) -> bool:
    """Whether A + ``within`` max |A| I is positive definite, A the symmetric part: all pivots of its factors are.

    >>> ones = sparse.csr_array(np.ones((2, 2)))
    >>> definite(ones, ROUGHLY), definite(ones - sparse.eye_array(2), ROUGHLY)
    (True, False)
    """
    shift = within * _largest(matrix)
    shifted = sparse.csc_matrix((matrix + matrix.T) * 0.5 + shift * sparse.eye_array(matrix.indptr.size - 1))
    try:
        lu = sparse_linalg.splu(
            shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:
        return False
    return np.array_equal(lu.perm_r, lu.perm_c) and bool((lu.U.diagonal() > 0).all())


def _largest(matrix: sparse.csr_array) -> float:
    return float(np.abs(matrix.data).max(initial=0.0))
