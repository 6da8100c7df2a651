"""A fill-reducing order of elimination for a symmetric pattern: what every sparse factorisation here starts from."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from bipot.typing import Ints

SYMMETRIC = {"SymmetricMode": True}
"""SuperLU's mode for a symmetric pattern: it keeps to the diagonal pivots the order was made for."""


def minimum_degree(indices: NDArray[np.int32], indptr: NDArray[np.int32]) -> Ints:
    """Place of each unknown (n,) in SuperLU's minimum-degree order of a symmetric CSC pattern with its diagonal."""
    n = len(indptr) - 1
    column = np.repeat(np.arange(n), np.diff(indptr))
    # Any diagonally dominant matrix will do: only its ordering is kept.
    sample = sp.csc_matrix((np.where(indices == column, float(n), -0.5), indices, indptr), shape=(n, n))
    lu = sla.splu(sample, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=SYMMETRIC)
    return np.asarray(lu.perm_c, dtype=np.intp)
