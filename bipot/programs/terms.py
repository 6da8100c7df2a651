r"""The contact terms of every exact program, as cone rows and back: gap, friction at a frozen threshold, ties.

    G_n dU + g >= 0                 dual r_n,
    t >= |G_t dU + w_t|, cost s t   dual (s, r_t) with |r_t| <= s,
    equality of both where welded   dual (r_n, r_t).

Friction rows with zero threshold are left out: their force is zero, and a free bound t would be undetermined.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.programs.data import Bools, Cone, ConicSolution, ContactRows, Ints, Rows, Term

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ContactTerms:
    """Contact rows with their frozen threshold s (f,), split into unilateral, sliding and tied parts."""

    rows: ContactRows
    threshold: Floats

    @property
    def unilateral(self) -> Bools:
        """Candidates (c,) with an inequality on the gap."""
        return ~self.rows.tied

    @property
    def sliding(self) -> Bools:
        """Friction rows (f,) with a positive finite threshold."""
        return (self.threshold > 0) & ~self.rows.tied[self.rows.frictional]

    @property
    def stuck(self) -> Bools:
        """Friction rows (f,) that are welded."""
        return self.rows.tied[self.rows.frictional]

    def tangent_rows(self, chosen: Bools) -> tuple[sp.csr_matrix, Floats]:
        """(G_t, w_t) of the chosen friction rows (f,): ((m (d-1), n), (m, d-1))."""
        return self.rows.G_t[np.repeat(chosen, self.rows.tangents)], self.rows.slip[chosen]

    def cone_rows(self, columns: int, bounds: int) -> tuple[Rows, ...]:
        """Rows on ``columns`` variables; dU comes first and the slip bounds t start at column ``bounds``."""
        normal = self.rows.G_n
        sliding, slip = self.tangent_rows(self.sliding)
        stuck, offset = self.tangent_rows(self.stuck)
        tie = sp.csr_matrix(sp.vstack([normal[self.rows.tied], stuck]))
        return (
            Rows(
                Term.GAP,
                Cone.NONNEGATIVE,
                _pad(normal[self.unilateral], columns),
                self.rows.gap[self.unilateral],
            ),
            _norm_rows(Term.FRICTION, sliding, slip, columns, bounds),
            Rows(
                Term.TIE,
                Cone.ZERO,
                _pad(tie, columns),
                np.concatenate([self.rows.gap[self.rows.tied], offset.ravel()]),
            ),
        )

    def contact_forces(self, solution: ConicSolution) -> Floats:
        """Contact forces r (c, d) from the duals of :meth:`cone_rows`."""
        return self.assemble(
            solution.dual[Term.GAP].ravel(),
            solution.dual[Term.FRICTION][:, 1:],
            solution.dual[Term.TIE].ravel(),
        )

    def assemble(self, normal: Floats, tangential: Floats, tie: Floats) -> Floats:
        """r (c, d) from r_n of the unilateral, r_t of the sliding and (r_n, r_t) of the tied points."""
        rows = self.rows
        r = np.zeros((rows.count, 1 + rows.tangents))
        tied = int(rows.tied.sum())
        r[self.unilateral, 0] = normal
        r[rows.tied, 0] = tie[:tied]
        r[rows.frictional[self.sliding], 1:] = tangential
        r[rows.frictional[self.stuck], 1:] = tie[tied:].reshape(-1, rows.tangents)
        return r


def _norm_rows(term: Term, G: sp.csr_matrix, offset: Floats, columns: int, bounds: int) -> Rows:
    """Second-order rows (t_i, G_i dU + w_i), t_i being variable ``bounds + i``."""
    count, tangents = offset.shape
    width = tangents + 1
    bound: Ints = np.arange(count) * width
    body = np.setdiff1d(np.arange(count * width), bound)
    coo = G.tocoo()
    A = sp.csr_matrix(
        (
            np.concatenate([np.ones(count), coo.data]),
            (np.concatenate([bound, body[coo.row]]), np.concatenate([bounds + np.arange(count), coo.col])),
        ),
        shape=(count * width, columns),
    )
    b = np.zeros((count, width))
    b[:, 1:] = offset
    return Rows(term, Cone.SECOND_ORDER, A, b.ravel(), width)


def _pad(A: sp.csr_matrix, columns: int) -> sp.csr_matrix:
    return sp.csr_matrix((A.data, A.indices, A.indptr), shape=(len(A.indptr) - 1, columns))
