r"""The contact terms of every exact program as cone rows, and the forces from their duals: gap, friction, ties.

    G_n dU + g >= 0                 dual r_n,
    t >= |G_t dU + w_t|, cost s t   dual (s, r_t) with |r_t| <= s,
    equality of both where welded   dual (r_n, r_t).

Friction rows with zero threshold are left out: their force is zero, and a free bound t would be undetermined.

With De Saxce's shift frozen instead of the threshold, the two first are one cone and nothing is added to the cost:

    G_n dU + g + shift >= mu |G_t dU + w_t|   dual (r_n, r_t / mu), so |r_t| <= mu r_n.

Where shift = mu |G_t dU + w_t| this reduces to the gap condition. A zero shift is not Coulomb's law but the associated
one, whose sliding opens the contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import Cone, ConicSolution, Rows
from bipot.programs.data import Block, ContactRows, Term, Units, rows_of
from bipot.typing import Bools, Floats

if TYPE_CHECKING:
    import cvxpy as cp


@dataclass(frozen=True)
class ContactTerms:
    """Contact rows with their frozen threshold s (f,) or, where it is given, their frozen shift (f,).

    They are split into unilateral, sliding, coned (in the shifted cone) and tied parts.
    """

    rows: ContactRows
    threshold: Floats
    shift: Floats | None = None

    def scaled(self, units: Units) -> ContactTerms:
        """Dimensionless: gaps, slips and shifts in ``units.length``, thresholds in ``units.force``."""
        shift = None if self.shift is None else self.shift / units.length
        return ContactTerms(self.rows.scaled(units), self.threshold / units.force, shift)

    @property
    def unilateral(self) -> Bools:
        """Candidates (c,) with an inequality on the gap alone."""
        alone = ~self.rows.tied
        alone[self.rows.frictional[self.coned]] = False
        return alone

    @property
    def sliding(self) -> Bools:
        """Friction rows (f,) with a positive finite threshold; none when the shift is frozen."""
        return (self.threshold > 0) & ~self.stuck & (self.shift is None)

    @property
    def coned(self) -> Bools:
        """Friction rows (f,) whose gap and slip share a shifted cone; none when the threshold is frozen."""
        return (self.rows.mu[self.rows.frictional] > 0) & ~self.stuck & (self.shift is not None)

    @property
    def stuck(self) -> Bools:
        """Friction rows (f,) that are welded."""
        return self.rows.tied[self.rows.frictional]

    def tangent_rows(self, chosen: Bools) -> tuple[sp.csr_matrix, Floats]:
        """(G_t, w_t) of the chosen friction rows (f,): ((m (d-1), n), (m, d-1))."""
        return rows_of(self.rows.G_t, np.repeat(chosen, self.rows.tangents)), self.rows.slip[chosen]

    def shifted_rows(self) -> tuple[sp.csr_matrix, Floats, sp.csr_matrix, Floats]:
        """(G_n, g + shift) and (mu G_t, mu w_t) of the coned friction rows: ((m, n), (m,), (m (d-1), n), (m, d-1))."""
        if self.shift is None:
            none = sp.csr_matrix((0, self.rows.size))
            return none, np.zeros(0), none, np.zeros((0, self.rows.tangents))
        coned = self.coned
        contact, shift = self.rows.frictional[coned], self.shift[coned]
        tangent, slip = self.tangent_rows(coned)
        mu = self.rows.mu[contact]
        scale = sp.diags_array(np.repeat(mu, self.rows.tangents))
        return (
            self.rows.G_n[contact],
            self.rows.gap[contact] + shift,
            sp.csr_matrix(scale @ tangent),
            mu[:, None] * slip,
        )

    def cone_rows(self, columns: int, bounds: int) -> tuple[Rows, ...]:
        """Rows on ``columns`` variables; dU comes first and the slip bounds t start at column ``bounds``."""
        rows, alone = self.rows, self.unilateral
        sliding, slip = self.tangent_rows(self.sliding)
        gap = Rows(Term.GAP, Cone.NONNEGATIVE, widened(rows_of(rows.G_n, alone), columns), rows.gap[alone])
        parts = (gap, norm_rows(Term.FRICTION, sliding, slip, columns, bounds), self._tie_rows(columns))
        return parts if self.shift is None else (*parts, _coulomb_rows(*self.shifted_rows(), columns))

    def _tie_rows(self, columns: int) -> Rows:
        tied = self.rows.tied
        if not tied.any():
            return Rows(Term.TIE, Cone.ZERO, sp.csr_matrix((0, columns)), np.zeros(0))
        stuck, offset = self.tangent_rows(self.stuck)
        tie = sp.csr_matrix(sp.vstack([self.rows.G_n[tied], stuck]))
        return Rows(Term.TIE, Cone.ZERO, widened(tie, columns), np.concatenate([self.rows.gap[tied], offset.ravel()]))

    def contact_forces(self, solution: ConicSolution) -> Floats:
        """Contact forces r (c, d) from the duals of :meth:`cone_rows`."""
        rows, dual = self.rows, solution.dual
        r = np.zeros((rows.count, 1 + rows.tangents))
        tie, tied = dual[Term.TIE].ravel(), int(rows.tied.sum())
        cone = dual.get(Term.COULOMB, np.zeros((0, 1 + rows.tangents)))
        r[self.unilateral, 0] = dual[Term.GAP].ravel()
        r[rows.tied, 0] = tie[:tied]
        r[rows.frictional[self.sliding], 1:] = dual[Term.FRICTION][:, 1:]
        r[rows.frictional[self.stuck], 1:] = tie[tied:].reshape(-1, rows.tangents)
        contact = rows.frictional[self.coned]
        r[contact, 0] = cone[:, 0]
        r[contact, 1:] = rows.mu[contact, None] * cone[:, 1:]
        return r

    def statement(self, dU: cp.Variable) -> tuple[Any, dict[str, cp.Expression], dict[str, cp.Constraint]]:
        """The same terms in cvxpy on the displacement ``dU``: cost, variables, constraints by the conic form's names.

        Cost s' t, G_n dU + g >= 0, (t_c, G_t,c dU + w_c) in the second-order cone, ties as equalities; or, with the
        shift frozen, (G_n,c dU + g_c + shift_c, mu G_t,c dU + mu w_c) in it and no cost.
        """
        import cvxpy as cp

        rows = self.rows
        normal, tied = rows.G_n[self.unilateral], rows.G_n[rows.tied]
        sliding, slip = self.tangent_rows(self.sliding)
        cost: Any = cp.Constant(0.0)
        blocks: dict[str, cp.Expression] = {Block.DISPLACEMENT: dU}
        constraints: dict[str, cp.Constraint] = {}
        if normal.shape[0]:
            constraints[Term.GAP] = normal @ dU + rows.gap[self.unilateral] >= 0
        if slip.size:
            t = blocks[Block.SLIP_BOUND] = cp.Variable(len(slip), name=Block.SLIP_BOUND)
            constraints[Term.FRICTION] = cp.SOC(t, cp.reshape(sliding @ dU, slip.shape, order="C") + slip, axis=1)
            cost = self.threshold[self.sliding] @ t
        if tied.shape[0]:
            stuck, offset = self.tangent_rows(self.stuck)
            shut = np.concatenate([rows.gap[rows.tied], offset.ravel()])
            constraints[Term.TIE] = sp.vstack([tied, stuck]) @ dU + shut == 0
        normal, gap, tangent, slip = self.shifted_rows()
        if gap.size:
            motion = cp.reshape(tangent @ dU, slip.shape, order="C") + slip
            constraints[Term.COULOMB] = cp.SOC(normal @ dU + gap, motion, axis=1)
        return cost, blocks, constraints


def norm_rows(
    term: Term, G: sp.csr_matrix, offset: Floats, columns: int, bounds: int, minus: int | None = None
) -> Rows:
    """Second-order rows (t_i, G_i dU + w_i), i = 1 .. m, from G (m k, n) and w (m, k): t_i is variable ``bounds + i``.

    With ``minus``, the variables d from that number on are subtracted: (t_i, G_i dU + w_i - d_i).
    """
    count, width = offset.shape
    lengths = np.diff(G.indptr).reshape(count, width)
    # Inserted in the order of the row-wise data: t_i before its block of rows, d_ij behind each row.
    at, variable, value = G.indptr[:-1].reshape(count, width)[:, :1], bounds + np.arange(count)[:, None], 1.0
    if minus is not None:
        at = np.hstack([at, G.indptr[1:].reshape(count, width)])
        variable = np.hstack([variable, minus + np.arange(count * width).reshape(count, width)])
        value = np.tile(np.repeat([1.0, -1.0], [1, width]), count)
        lengths = lengths + 1
    indptr = np.concatenate([[0], np.cumsum(np.column_stack([np.ones(count, dtype=lengths.dtype), lengths]))])
    A = sp.csr_matrix(
        (np.insert(G.data, at.ravel(), value), np.insert(G.indices, at.ravel(), variable.ravel()), indptr),
        shape=(count * (width + 1), columns),
    )
    b = np.zeros((count, width + 1))
    b[:, 1:] = offset
    return Rows(term, Cone.SECOND_ORDER, A, b.ravel(), width + 1)


def _coulomb_rows(normal: sp.csr_matrix, gap: Floats, tangent: sp.csr_matrix, slip: Floats, columns: int) -> Rows:
    """Second-order rows (gap_i, slip_i) of the contact i, from the parts of :meth:`ContactTerms.shifted_rows`."""
    count, tangents = slip.shape
    width = tangents + 1
    stacked = sp.csr_matrix(sp.vstack([normal, tangent]))
    order = np.column_stack([np.arange(count), count + np.arange(count * tangents).reshape(count, tangents)]).ravel()
    b = np.column_stack([gap, slip]).ravel()
    return Rows(Term.COULOMB, Cone.SECOND_ORDER, widened(sp.csr_matrix(stacked[order]), columns), b, width)


def widened(A: sp.csr_matrix, columns: int) -> sp.csr_matrix:
    """A (m, n) with zeros behind it, as rows of ``columns`` variables."""
    return sp.csr_matrix((A.data, A.indices, A.indptr), shape=(len(A.indptr) - 1, columns))
