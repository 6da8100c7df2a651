r"""The increment as a quadratic energy with exact contact at a frozen threshold: the ``tangent`` program.

    minimise    1/2 dU' K dU - f' dU + sum_c s_c |G_t,c dU + w_t,c|
    subject to  G_n dU + g >= 0

The proximal-Newton model of (21)-(25): K from C^ep at the current iterate, f the load that makes the model's
stationarity the increment's equilibrium. :meth:`TangentProgram.statement` is the readable cvxpy form;
:meth:`TangentProgram.conic` has the same data for a solver. A test holds the two equal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import ConicProgram, Variables
from bipot.conic.through_cvxpy import Stated
from bipot.programs.data import Block, ContactRows, Units
from bipot.programs.terms import ContactTerms
from bipot.typing import Floats


@dataclass(frozen=True)
class TangentProgram:
    """K (n, n) sparse or dense, f (n,), contact rows on dU with their frozen threshold s (f,)."""

    K: sp.csc_matrix | Floats
    f: Floats
    contact: ContactTerms

    @staticmethod
    def of(K: sp.csc_matrix | Floats, f: Floats, rows: ContactRows, threshold: Floats) -> TangentProgram:
        """The program from its physical data."""
        return TangentProgram(K, f, ContactTerms(rows, threshold))

    def scaled(self, units: Units) -> TangentProgram:
        """Dimensionless: displacements in ``units.length``, forces in ``units.force``."""
        return TangentProgram(
            self.K * (units.length / units.force),
            self.f / units.force,
            self.contact.scaled(units),
        )

    def conic(self) -> ConicProgram:
        """Variables (dU, t): P = diag(K, 0), q = (-f, s), rows of :class:`ContactTerms`."""
        variables, cost = Variables(), self.contact.threshold[self.contact.sliding]
        variables.add(Block.DISPLACEMENT, len(self.f))
        bounds = variables.add(Block.SLIP_BOUND, len(cost))
        rows = self.contact.cone_rows(variables.size, bounds)
        P, q = padded(self.K, variables.size), np.concatenate([-self.f, cost])
        return ConicProgram(P, q, rows, variables.blocks, self.statement)

    def statement(self) -> Stated:
        """The same program stated in cvxpy."""
        import cvxpy as cp

        dU = cp.Variable(len(self.f), name=Block.DISPLACEMENT)
        cost, blocks, constraints = self.contact.statement(dU)
        energy = cp.quad_form(dU, cp.psd_wrap(self.K)) / 2 - self.f @ dU
        problem = cp.Problem(cp.Minimize(energy + cost), list(constraints.values()))
        return Stated(problem, blocks, constraints)


def padded(K: sp.csc_matrix | Floats, size: int) -> sp.csc_matrix:
    """diag(K, 0) (size, size); a dense K keeps its zeros, so that its pattern does not depend on its values."""
    if not isinstance(K, np.ndarray):
        P = sp.csc_matrix(K)
        P.resize((size, size))
        return P
    n = len(K)
    ends = np.minimum(np.arange(size + 1), n) * n
    return sp.csc_matrix((K.ravel(order="F"), np.tile(np.arange(n), n), ends), shape=(size, size))
