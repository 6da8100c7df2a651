"""Whether a matrix is that of an energy: symmetric and positive semidefinite.

Each row is first divided by a unit of its own, and each column by the same: what is stiff elsewhere excuses nothing.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from bipot.basics.definite import definite
from bipot.typing import Floats, max_abs

ROUGHLY = 1e-6
"""Matrices of files are symmetric and semidefinite to single precision, within this part of their largest entry."""


def by_units(matrix: sparse.csr_array, unit: Floats) -> sparse.csr_array:
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
    largest = max_abs(matrix.data)
    return max_abs(sparse.csr_array(matrix - matrix.T).data) / largest if largest else 0.0


def semidefinite(matrix: sparse.csr_array) -> bool:
    """Whether the symmetric part is positive semidefinite, to :data:`ROUGHLY` of the largest entry.

    >>> ones = sparse.csr_array(np.ones((2, 2)))
    >>> semidefinite(ones), semidefinite(ones - sparse.eye_array(2))
    (True, False)
    """
    shift = ROUGHLY * max_abs(matrix.data)
    return definite(sparse.csc_matrix(matrix + shift * sparse.eye_array(matrix.indptr.size - 1)))
