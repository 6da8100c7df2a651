r"""The increment as a quadratic energy with exact contact at a frozen threshold: the ``tangent`` program.

    minimise    1/2 dU' K dU - f' dU + sum_c s_c |G_t,c dU + w_t,c|
    subject to  G_n dU + g >= 0

The proximal-Newton model of (21)-(25): K from C^ep at the current iterate, f the load that makes the model's
stationarity the increment's equilibrium. :meth:`TangentProgram.statement` is the readable cvxpy form;
:meth:`TangentProgram.conic` has the same data for a solver. A test holds the two equal.

Interior points stall where strict complementarity fails (the axis node of a quadratic mesh carries no force and no
gap). The natural map of the same program has no such trouble once the right pieces are chosen:

    K dU - f - G' r = 0,   r_n = (r_n - rho gap)+,   r_t = projection of (r_t - rho slip) on the disc of radius s,

with s frozen (or De Saxce's shift, :meth:`bipot.programs.pieces.Mapped.shifted_cone`), or s = mu (r_n)+ for exact
Coulomb friction on the same quadratic model. They are then unsymmetric and minimise nothing, so that only an exact
solution counts. :func:`polish` and :func:`couple` solve them by semismooth Newton
(:func:`bipot.programs.newton.minimised`), from an interior-point answer or from any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import ConicProgram, Variables
from bipot.conic.through_cvxpy import Stated
from bipot.programs.data import Block, Units
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.newton import EXACT, Model, minimised
from bipot.programs.pieces import Law, Mapped, Pieces
from bipot.programs.terms import ContactTerms
from bipot.typing import Floats


@dataclass(frozen=True)
class TangentProgram:
    """K (n, n) sparse or dense, f (n,), contact rows on dU with their frozen threshold s (f,)."""

    K: sp.csc_matrix | Floats
    f: Floats
    contact: ContactTerms

    @property
    def model(self) -> Model:
        """Its energy and contact rows, without threshold or shift."""
        return Model(self.K, self.f, self.contact.rows)

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


def polish(program: TangentProgram, x: Floats, r: Floats, frames: Frames | None = None) -> tuple[Floats, Floats]:
    """The program's answer to round-off, by Newton from x (n,) and r (c, d); these if Newton does not improve them."""
    terms, scale = program.contact, _scale(program.model)

    def at(motion: Floats, r: Floats) -> Law:
        if terms.shift is not None:
            return Mapped.shifted_cone(terms.rows, motion, r, scale, terms.shift)
        return Pieces.of(terms.rows, motion, r, scale, threshold=terms.threshold)

    best = minimised(program.model, at, x, r, frames)
    return best.x, best.r


def couple(model: Model, x: Floats, r: Floats, frames: Frames | None = None) -> tuple[Floats, Floats] | None:
    """Exact Coulomb friction on the model, from (x, r); None when Newton does not reach it."""
    rows, scale = model.rows, _scale(model)
    best = minimised(model, lambda motion, r: Pieces.of(rows, motion, r, scale), x, r, frames)
    return (best.x, best.r) if best.error <= EXACT else None


def _scale(model: Model) -> Floats:
    """The law's scale of force against motion at each contact (c,): SOFTENED times the mean of K's diagonal."""
    return np.full(model.rows.count, SOFTENED * float(np.abs(model.K.diagonal()).mean()))
