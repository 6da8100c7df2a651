"""Linear least squares by unknowns that are not negative."""

from __future__ import annotations

import numpy as np

from bipot.typing import Floats

STEPS = 100
"""Iterations per row and column; a search that takes more cycles."""


def nonnegative(matrix: Floats, right: Floats) -> Floats | None:
    """The w (n,) >= 0 by which |matrix w - right|, of the ``matrix`` (m, n), is least; None if the search cycles.

    >>> nonnegative(np.eye(2), np.array([3.0, -1.0])).tolist()
    [3.0, 0.0]
    """
    if not matrix.size:
        # scipy's search overwrites other memory then.
        return np.zeros(matrix.shape[1])
    # scipy.optimize takes long to import, and most runs end without asking.
    from scipy.optimize import nnls

    try:
        return nnls(matrix, right, maxiter=STEPS * sum(matrix.shape))[0]
    except RuntimeError:
        return None
