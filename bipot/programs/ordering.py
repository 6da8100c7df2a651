"""A fill-reducing order of elimination for a symmetric pattern, used by every sparse factorisation of the library."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from bipot.conic.solver import asked
from bipot.programs.factors import DEFAULT, SYMMETRIC, Factor, LinearSolver
from bipot.typing import Floats, Ints

LARGE = {2: 20_000, 3: 0}
"""Unknowns from which on nested dissection is used, in two and three dimensions.

In a plane its fill over that of minimum degree is 1.05 on 10 x 10 Q8 elements, 0.98 on 40 x 40 (9760 unknowns), where
factorisations take the same time, and 0.86 on 80 x 80 (38 720). In space it is 0.91, 0.79 and 0.72 on bricks of 8, 12
and 16 H8 a side (1944, 6084 and 13 872 unknowns), and a factorisation takes 0.8, 0.4 and 0.3 of the time."""

PANEL = {2: 1, 3: 8}
"""Columns that SuperLU processes at once: in space, where supernodes are wide, single columns take a third longer."""


def minimum_degree(indices: NDArray[np.integer], indptr: NDArray[np.integer]) -> Ints:
    """Place of each unknown (n,) in SuperLU's minimum-degree order of a symmetric CSC pattern with its diagonal."""
    n = len(indptr) - 1
    column = np.repeat(np.arange(n), np.diff(indptr))
    # Any diagonally dominant matrix will do: only its ordering is kept.
    sample = sp.csc_matrix((np.where(indices == column, float(n), -0.5), indices, indptr), shape=(n, n))
    lu = sla.splu(sample, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=SYMMETRIC)
    return np.asarray(lu.perm_c, dtype=np.intp)


LEAF = 100
"""Unknowns of a part that is not divided further but ordered by minimum degree."""


def dissection(indices: NDArray[np.integer], indptr: NDArray[np.integer], places: Floats) -> Ints:
    """Place of each unknown (n,) in an order by nested dissection of a symmetric CSC pattern.

    A part is divided across its longest extent at the median of its unknowns' ``places`` (n, d). The unknowns of the
    upper half with a neighbour in the lower one separate the two and are eliminated after both. Unknowns without a
    place (NaN), such as a tool's translation, come last.
    """
    n = len(indptr) - 1
    graph = sp.csr_matrix((np.ones(len(indices), dtype=np.int8), indices, indptr), shape=(n, n))
    placed = np.isfinite(places).all(axis=1)
    # Parts still to be ordered, and whether each is a separator, which is not divided.
    parts, order = [(np.flatnonzero(placed), False)], [np.flatnonzero(~placed)]
    # From the end of the order: a separator before the halves it separates.
    while parts:
        part, separates = parts.pop()
        x = places[part]
        along = x[:, np.argmax(np.ptp(x, axis=0))] if len(part) else np.empty(0)
        lower = along < np.median(along) if len(part) > LEAF and not separates else np.zeros(len(part), dtype=bool)
        if not lower.any():
            order.append(part if separates else part[_least_filling(graph, part)])
            continue
        reached = np.zeros(n, dtype=bool)
        reached[graph[part[lower]].indices] = True
        between = ~lower & reached[part]
        parts += [(part[lower], False), (part[~lower & ~between], False), (part[between], True)]
    rank = np.empty(n, dtype=np.intp)
    rank[np.concatenate(order[::-1])] = np.arange(n)
    return rank


def _least_filling(graph: sp.csr_matrix, part: Ints) -> Ints:
    """The unknowns ``part`` of a graph, numbered among themselves, in the order of minimum degree."""
    inner = sp.csc_matrix(graph[part][:, part])
    return np.argsort(minimum_degree(inner.indices, inner.indptr)) if len(part) else part


@dataclass(frozen=True)
class Pattern:
    """A structurally symmetric pattern in a fill-reducing order, by rows.

    ``order`` (n,) lists the unknowns in the order of elimination; ``place`` (nnz,) sends an entry of the CSC pattern
    it was made from to the row-wise data in that order. ``placeless`` is the number of unknowns at the end
    without a place: coordinates of tools. ``panel`` is the number of columns that SuperLU processes at once.
    """

    order: Ints
    place: Ints
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    placeless: int = 0
    panel: int = 1

    @staticmethod
    def of(
        indices: NDArray[np.integer],
        indptr: NDArray[np.integer],
        places: Floats | None = None,
        coupled: sp.csc_matrix | None = None,
    ) -> Pattern:
        """Order the CSC pattern by minimum degree, a large one by nested dissection if ``places`` (n, d) are known.

        What is ``coupled`` (n, n) beside it, as by the forces between two parts, fills in later, which minimum degree
        takes into account.
        """
        n = len(indptr) - 1
        column = np.repeat(np.arange(n), np.diff(indptr))
        if places is None:
            return Pattern.ranked(indices, column, minimum_degree(indices, indptr))
        d = places.shape[1]
        if n >= LARGE[d]:
            rank = dissection(indices, indptr, places)
        else:
            pattern = sp.csc_matrix((np.ones(len(indices)), indices, indptr), shape=(n, n))
            whole = pattern if coupled is None else sp.csc_matrix(pattern + coupled)
            rank = minimum_degree(whole.indices, whole.indptr)
        found = Pattern.ranked(indices, column, rank)
        return replace(found, placeless=int(np.isnan(places).any(axis=1).sum()), panel=PANEL[d])

    @staticmethod
    def ranked(row: NDArray[np.integer], column: NDArray[np.integer], rank: Ints) -> Pattern:
        """The pattern of entries (nnz,), each given once; ``rank`` (n,) is the place of each unknown in the order."""
        n = len(rank)
        row, column = rank[row], rank[column]
        # A stable sort is the fast one of entries in order and a few behind them, as of a matrix with a border.
        by_row = np.argsort(row.astype(np.int64) * n + column, kind="stable")
        place = np.empty(len(by_row), dtype=np.intp)
        place[by_row] = np.arange(len(by_row))
        starts = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
        return Pattern(np.argsort(rank), place, column[by_row].astype(np.int32), starts.astype(np.int32))

    @property
    def size(self) -> int:
        """Number n of unknowns."""
        return len(self.order)

    def by_row(self, data: Floats) -> Floats:
        """Row-wise data (nnz + 1,), the last zero and for what has no place, from data of the original CSC pattern."""
        out = np.zeros(len(self.place) + 1)
        out[self.place] = data
        return out

    def factorise(self, data: Floats, solver: LinearSolver = DEFAULT) -> Factor:
        """Factors of the matrix with row-wise ``data`` (nnz,).

        Raises:
            ProgramError: the matrix is singular.
            BrokenSolver: the ``solver`` raised another error.
        """
        # SciPy checks the index arrays of _transpose once, not at every factorisation.
        transpose = copy(self._transpose)
        transpose.data = data
        with asked(solver):
            return solver.factorise(transpose, self.panel)

    @cached_property
    def _transpose(self) -> sp.csc_matrix:
        """The transpose's pattern with meaningless data; SciPy knows that its indices are sorted and none is double."""
        data = np.ones(len(self.indices))
        found = sp.csc_matrix((data, self.indices, self.indptr), shape=(self.size, self.size))
        found.sum_duplicates()
        return found

    def solve(self, factor: Factor, b: Floats) -> Floats:
        """x (n,) with A x = b, both in the numbering of the unknowns; raises BrokenSolver as :meth:`factorise` does."""
        x = np.empty_like(b)
        with asked(factor):
            x[self.order] = factor.solve(b[self.order])
        return x
