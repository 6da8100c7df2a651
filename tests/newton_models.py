"""Small models of a step of the Newton form: contact rows, full steps on a dense matrix, patterns, turns."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from bipot.programs.data import ContactRows
from bipot.programs.frames import Frames
from bipot.programs.newton import Linearised
from bipot.programs.ordering import Pattern
from bipot.programs.pieces import Pieces


def rows_of(
    G_n: np.ndarray, G_t: np.ndarray, gap: np.ndarray, slip: np.ndarray, mu: float, tied: bool = False
) -> ContactRows:
    c = len(gap)
    return ContactRows(
        sp.csr_matrix(G_n),
        gap,
        sp.csr_matrix(G_t),
        slip.reshape(c, -1),
        np.arange(c),
        np.full(c, np.inf if tied else mu),
        np.full(c, np.inf),
        np.full(c, tied),
    )


def newton(
    K: np.ndarray, F: np.ndarray, rows: ContactRows, steps: int = 10, sparse: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Full Newton steps on K x = F + G' r from rest, with all entries of K stored or only those that are not zero."""
    stored = sp.csc_matrix(K)
    pattern, data = Pattern.of(*csc(K)), K.T.ravel()
    if sparse:
        pattern, data = Pattern.of(stored.indices, stored.indptr), stored.data
    held = Frames.of(rows, pattern)
    x, r = np.zeros(len(F)), np.zeros((rows.count, 1 + rows.tangents))
    scale = np.full(rows.count, K.diagonal().max())
    for _ in range(steps):
        pieces = Pieces.of(rows, rows.motion(x), r, scale)
        miss = pieces.value(rows.motion(x), r)
        dx, r = Linearised.of(pattern.by_row(data), held, pieces).step(K @ x - F, miss, r)
        x = x + dx
    return x, r


def csc(K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The full pattern of a dense matrix, by columns."""
    n = len(K)
    return np.tile(np.arange(n, dtype=np.int32), n), np.arange(0, n * n + 1, n, dtype=np.int32)


def turned(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])
