r"""The increment as a quadratic energy with penalised contact: smooth, convex, unconstrained.

    minimise  Psi(dU) = 1/2 dU' K dU - f' dU + sum_c b_n(du_n,c) + b_t(du_t,c),      du = G dU + w,

(25) with the contact bipotential replaced by its envelopes (26)-(29) at a frozen threshold s. K and f are those of
the ``tangent`` program, so that the two differ in the contact term alone. Tractions are nodal forces and
penalties forces per length. How it is minimised is a choice: :mod:`bipot.programs.penalty_newton`,
:mod:`bipot.programs.penalty_optimisers`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import Claim, Cone, ConicProgram, Rows, Timing, Variables
from bipot.conic.through_cvxpy import Stated
from bipot.errors import ProgramError
from bipot.laws.penalised import Envelope, normal_potential, normal_traction, tangential_potential, tangential_traction
from bipot.programs.condensation import Condensed, condense, factorise
from bipot.programs.conic import TangentProgram, padded
from bipot.programs.data import Block, ContactRows, Term, Units
from bipot.programs.terms import ContactTerms
from bipot.typing import Floats, max_abs

LOST = 1e-3
"""Residual over the largest force above which a minimisation is given up."""

DISTINCT = 1e-12
"""Pivots of a stiffness over its largest entry on the diagonal that are not round-off."""


class Minimum(NamedTuple):
    """Minimiser x (n,), the optimiser's claim, its iterations and seconds."""

    x: Floats
    outcome: Claim
    iterations: int
    timing: Timing


@dataclass(frozen=True)
class PenaltyTerms:
    """Penalised contact of c candidates: rows, gap g0 (c,) from which du_n is measured, forces t_0 (c, d).

    ``threshold`` (f,) is the frozen mu t_n of the friction rows, ``k_n`` (c,) and ``k_t`` (f,) forces per length.
    """

    rows: ContactRows
    start_gap: Floats
    t_0: Floats
    threshold: Floats
    k_n: Floats
    k_t: Floats

    def motion(self, x: Floats) -> Floats:
        """du (c, d): the gap at the end, as given by the rows, minus g0 at the start, and the slip."""
        du = self.rows.motion(x)
        du[:, 0] -= self.start_gap
        return du

    def normal(self, du: Floats) -> Envelope:
        """b_n and its derivatives at every candidate, (c,)."""
        return normal_potential(du[:, 0], self.start_gap, self.t_0[:, 0], self.k_n)

    def tangential(self, du: Floats) -> Envelope:
        """b_t and its derivatives at the friction rows, (f,), (f, d-1), (f, d-1, d-1)."""
        f = self.rows.frictional
        return tangential_potential(du[f, 1:], self.t_0[f, 1:], self.threshold, self.k_t)

    def forces(self, x: Floats) -> Floats:
        """Contact forces r (c, d) at the frozen threshold."""
        return self.law(x, self.threshold)

    def mismatch(self, x: Floats, r: Floats) -> float:
        """Distance of forces r (c, d) from the law at x with the coupled threshold s = mu t_n, over the largest."""
        largest = max_abs(r)
        coupled = self.law(x, self.rows.threshold(r))
        return max_abs(r - coupled) / largest if largest > 0 else 0.0

    def law(self, x: Floats, threshold: Floats) -> Floats:
        """r (c, d) of (26)-(29) for the motion of x and a threshold (f,)."""
        du, f = self.motion(x), self.rows.frictional
        r = np.zeros_like(du)
        r[:, 0] = normal_traction(du[:, 0], self.start_gap, self.t_0[:, 0], self.k_n)
        r[f, 1:] = tangential_traction(du[f, 1:], self.t_0[f, 1:], threshold, self.k_t)
        return r

    def scaled(self, units: Units) -> PenaltyTerms:
        """Lengths in ``units.length``, forces in ``units.force``."""
        stiffness = units.force / units.length
        return PenaltyTerms(
            self.rows.scaled(units),
            self.start_gap / units.length,
            self.t_0 / units.force,
            self.threshold / units.force,
            self.k_n / stiffness,
            self.k_t / stiffness,
        )


@dataclass(frozen=True)
class PenaltyProgram:
    """K (n, n) sparse or dense, f (n,), penalised contact on dU."""

    K: sp.csc_matrix | Floats
    f: Floats
    contact: PenaltyTerms

    def scaled(self, units: Units) -> PenaltyProgram:
        """Dimensionless: displacements in ``units.length``, forces in ``units.force``."""
        K, f = self.K * (units.length / units.force), self.f / units.force
        return PenaltyProgram(K, f, self.contact.scaled(units))

    def value(self, x: Floats) -> float:
        """Psi."""
        du = self.contact.motion(x)
        envelopes = self.contact.normal(du).value.sum() + self.contact.tangential(du).value.sum()
        return float(0.5 * x @ (self.K @ x) - self.f @ x + envelopes)

    def gradient(self, x: Floats) -> Floats:
        """K x - f - G' r (n,)."""
        return self.K @ x - self.f - self.contact.rows.forces(self.contact.forces(x))

    def largest(self, x: Floats) -> float:
        """The largest force, the scale of residuals."""
        r = self.contact.forces(x)
        return max(max_abs(r), max_abs(self.f), np.finfo(float).tiny)

    def hessian(self, x: Floats) -> sp.csc_matrix:
        """K + G_n' D_n G_n + G_t' D_t G_t with the generalised Hessians D of the envelopes."""
        du, rows = self.contact.motion(x), self.contact.rows
        normal = rows.G_n.T @ _weighted(rows.G_n, self.contact.normal(du).hessian[:, None, None])
        tangential = rows.G_t.T @ _weighted(rows.G_t, self.contact.tangential(du).hessian)
        return sp.csc_matrix(self.K + (normal + tangential))

    def conic(self) -> ConicProgram:
        """(29) in standard form, of the variables dU, v_n, v_t, bounds on |v_t| and the lags e = c (du - v).

        The cost is 1/2 dU' K dU - f' dU + sum_c [k/c^2 |e|^2/2 - t_0 . e / c + s |v_t|], c the larger of sqrt(k) and 1.
        With c = 1 it would have numbers of the size of a large k, with c = sqrt(k) of t_0 over the root of a small one,
        and residuals measured by these would hide forces however wrong.
        """
        terms, contact = self.contact, self.contact.rows
        (count, width), variables = contact.slip.shape, Variables()
        variables.add(Block.DISPLACEMENT, len(self.f))
        gaps = variables.add(Block.FICTITIOUS_GAP, contact.count)
        slips = variables.add(Block.FICTITIOUS_SLIP, contact.slip.size)
        bounds = variables.add(Block.SLIP_BOUND, count)
        lags = variables.add(Block.LAG, bounds - gaps)
        k = np.concatenate([terms.k_n, np.repeat(terms.k_t, width)])
        scale = np.sqrt(np.maximum(k, 1.0))
        t_0 = np.concatenate([terms.t_0[:, 0], terms.t_0[contact.frictional, 1:].ravel()])
        B = sp.vstack([contact.G_n, contact.G_t], format="csr")
        fictitious, unbound = sp.eye_array(bounds - gaps), sp.csr_array((bounds - gaps, count))
        lag = sp.csr_matrix(sp.hstack([B, -fictitious, unbound, sp.diags_array(-1 / scale)], format="csr"))
        squares = np.concatenate([np.zeros(lags), k / scale**2])
        P = sp.csc_matrix(padded(self.K, variables.size) + sp.diags_array(squares))
        q = np.concatenate([-self.f, np.zeros(bounds - gaps), terms.threshold, -t_0 / scale])
        identity = sp.csr_matrix(sp.eye_array(variables.size))
        order = np.column_stack([bounds + np.arange(count), slips + np.arange(count * width).reshape(count, width)])
        room = np.maximum(terms.start_gap, 0.0)
        rows = (
            Rows(Term.LAG, Cone.ZERO, lag, np.concatenate([contact.gap - terms.start_gap, contact.slip.ravel()])),
            Rows(Term.FICTITIOUS, Cone.NONNEGATIVE, identity[gaps:slips], room),
            Rows(Term.FRICTION, Cone.SECOND_ORDER, identity[order.ravel()], np.zeros(order.size), width + 1),
        )
        return ConicProgram(P, q, rows, variables.blocks)

    def statement(self) -> Stated:
        """The same program as (29) states it; the dual of its constraint is t_n.

        Squares are stated as sums of squares of variables scaled by L, L' L = K, and by sqrt(k): with these interior
        points gain three digits over quadratic forms. In the plane |v_t| is an absolute value, two linear
        rows: as cones of two rows, points that stick (apex against interior) made interior points break down at a
        tolerance of 1e-12, where the linear rows still answer at 1e-14. The terms in -t_0 . du are those of (17), see
        :mod:`bipot.laws.penalised`.
        """
        import cvxpy as cp

        terms, rows, f = self.contact, self.contact.rows, self.contact.rows.frictional
        dU = cp.Variable(len(self.f), name=Block.DISPLACEMENT)
        v_n = cp.Variable(rows.count, name=Block.FICTITIOUS_GAP)
        v_t = cp.Variable(rows.slip.shape, name=Block.FICTITIOUS_SLIP)
        lag_n = rows.G_n @ dU + (rows.gap - terms.start_gap) - v_n
        lag_t = cp.reshape(rows.G_t @ dU, rows.slip.shape, order="C") + rows.slip - v_t
        length = cp.abs(v_t[:, 0]) if rows.tangents == 1 else cp.norm(v_t, 2, axis=1)
        cost = (
            -terms.t_0[:, 0] @ lag_n
            + cp.sum_squares(cp.multiply(np.sqrt(terms.k_n / 2), lag_n))
            - cp.sum(cp.multiply(terms.t_0[f, 1:], lag_t))
            + terms.threshold @ length
            + cp.sum_squares(cp.multiply(np.repeat(np.sqrt(terms.k_t / 2)[:, None], rows.tangents, axis=1), lag_t))
        )
        closed = v_n >= -np.maximum(terms.start_gap, 0.0)
        energy = cp.sum_squares(_square_root(self.K) @ dU) / 2 - self.f @ dU
        problem = cp.Problem(cp.Minimize(energy + cost), [closed])
        # The lags of the standard form have the cost of these, to the constant.
        return Stated(problem, {Block.DISPLACEMENT: dU}, {Term.FICTITIOUS: closed}, omitted=0.0)

    def condensed(self) -> tuple[PenaltyProgram, Condensed]:
        """The same program on the unknowns that its contact rows touch, and the way back to all."""
        small = condense(TangentProgram(self.K, self.f, ContactTerms(self.contact.rows, self.contact.threshold)))
        terms = replace(self.contact, rows=small.program.contact.rows)
        return PenaltyProgram(small.program.K, small.program.f, terms), small


def _square_root(K: sp.csc_matrix | Floats) -> sp.csc_matrix | Floats:
    """L with L' L = K: of a sparse K by its pivots, as sparse as its factors; of any other by eigenvalues.

    In homogeneous perfect flow K is singular, and Cholesky would refuse it.
    """
    if not isinstance(K, np.ndarray):
        try:
            factor = factorise(K)
        except ProgramError:
            return _square_root(K.toarray())
        pivot, order = factor.U.diagonal(), factor.perm_c
        if np.array_equal(factor.perm_r, order) and pivot.min(initial=np.inf) > DISTINCT * np.abs(K.diagonal()).max():
            return sp.csc_matrix(sp.diags(1 / np.sqrt(pivot)) @ factor.U)[:, order]
        return _square_root(K.toarray())
    values, vectors = np.linalg.eigh(K)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def _weighted(G: sp.csr_matrix, D: Floats) -> sp.csr_matrix:
    """diag(D) G for blocks D (m, w, w)."""
    count, width, _ = D.shape
    if width == 1:
        return sp.csr_matrix((G.data * np.repeat(D.ravel(), np.diff(G.indptr)), G.indices, G.indptr), shape=G.shape)
    places = np.arange(count + 1)
    return sp.csr_matrix(sp.bsr_matrix((D, places[:-1], places), shape=(count * width, count * width)) @ G)
