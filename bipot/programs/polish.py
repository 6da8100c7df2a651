r"""Semismooth Newton polish of a tangent program, from an interior-point answer or the last pass's.

Interior points stall where strict complementarity fails (the axis node of a quadratic mesh carries no force and no
gap). The natural map of the same program has no such trouble once the right pieces are chosen:

    K dU - f - G' r = 0,   r_n = (r_n - rho gap)+,   r_t = projection of (r_t - rho slip) on the disc of radius s,

with s frozen (or De Saxce's shift, :class:`ShiftedCone`), or s = mu (r_n)+ for exact Coulomb friction on the same
quadratic model (then unsymmetric, and only a step of the fixed point on s: the start is the convex program's answer,
and the result counts only if it is exact). A step is that of :mod:`bipot.programs.newton` where the contacts own their
unknowns; contacts that share some keep their forces as unknowns, and so border the stiffness.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from bipot.coulomb.functions import ConeMap
from bipot.errors import ProgramError, UnsuitedForm
from bipot.programs.conic import TangentProgram
from bipot.programs.data import ContactRows
from bipot.programs.newton import Frames, Law, Linearised, Pattern
from bipot.programs.pieces import Pieces

Floats = NDArray[np.float64]
At = Callable[[Floats, Floats], Law]

ITERATIONS = 12
EXACT = 1e-10
SOFTENED = 1e-2

YIELDING = 1e-9
"""Compliance of closed contacts that share unknowns, in the Newton matrix: where their rows repeat each other it picks
the forces next to the last ones, and where they do not it slows nothing."""


@dataclass(frozen=True)
class ShiftedCone:
    """r - P_K(r - rho (u + shift n)), K = {|r_t| <= mu r_n}: the associated law of a shifted motion, linearised.

    Exact Coulomb friction where shift = mu |du_t|.
    """

    miss: Floats
    by_motion: Floats
    by_force: Floats

    @staticmethod
    def of(rows: ContactRows, shift: Floats, rho: float, motion: Floats, r: Floats) -> ShiftedCone:
        """At motion and forces (c, d), with ``shift`` (f,)."""
        u = motion.copy()
        u[rows.frictional, 0] += shift
        found = ConeMap().linearise(r, rho * u, np.where(rows.rubs & ~rows.tied, rows.mu, 0.0))
        stuck = rows.tied[:, None] & np.column_stack([rows.tied, *[rows.rubs] * rows.tangents])
        one, row = np.eye(1 + rows.tangents), stuck[..., None]
        by_motion, by_force = np.where(row, one, found.du), np.where(row, 0.0, found.dr)
        return ShiftedCone(np.where(stuck, rho * u, found.value), rho * by_motion, by_force)

    def value(self, motion: Floats, r: Floats) -> Floats:
        """What must vanish (c, d), where it was linearised."""
        return self.miss


@dataclass(frozen=True)
class Elimination:
    """How the contacts of ``rows`` enter a stiffness of a fixed pattern: in frames of their own, or None: bordered."""

    pattern: Pattern
    rows: ContactRows
    frames: Frames | None

    @staticmethod
    def of(K: sp.csc_matrix, rows: ContactRows, last: Elimination | None = None) -> Elimination:
        """For the pattern of K; ``last`` gives what it has in common."""
        if last is not None and last.serves(K):
            if last.rows is rows:
                return last
            pattern = last.pattern
        else:
            pattern = Pattern.of(np.asarray(K.indices, np.int32), np.asarray(K.indptr, np.int32))
        try:
            return Elimination(pattern, rows, Frames.of(rows, pattern))
        except UnsuitedForm:
            return Elimination(pattern, rows, None)

    def serves(self, K: sp.csc_matrix) -> bool:
        """Whether K has the pattern."""
        return bool(
            np.array_equal(self.pattern.source[0], K.indices) and np.array_equal(self.pattern.source[1], K.indptr)
        )

    def step(self, K: sp.csc_matrix, law: Law, residual: Floats, motion: Floats, r: Floats) -> tuple[Floats, Floats]:
        """(dx (n,), new r (c, d)) from K x - f (n,), motion and forces (c, d); raises ProgramError."""
        if self.frames is None:
            return self._bordered(K, law, residual, motion, r)
        data = np.zeros(K.nnz + 1)
        data[self.pattern.place] = K.data
        return Linearised.of(data, self.pattern, self.frames, law).step(residual, motion, r)

    def _bordered(
        self, K: sp.csc_matrix, law: Law, residual: Floats, motion: Floats, r: Floats
    ) -> tuple[Floats, Floats]:
        """From [K, -G'; law by motion G, law by force] (dx, dr) = -(K x - f - G' r, law)."""
        rows, n = self.rows, len(residual)
        G = _stacked(rows)
        yields = YIELDING * (np.eye(1 + rows.tangents) * (law.by_force == 0))
        by_motion, by_force = (sp.block_diag(list(part)) for part in (law.by_motion, law.by_force + yields))
        J = sp.csc_matrix(sp.block_array([[K, -G.T], [by_motion @ G, by_force]]))
        try:
            lu = sla.splu(J)
        except RuntimeError as singular:
            raise ProgramError("the matrix bordered by the contact forces is singular") from singular
        step = lu.solve(-np.concatenate([residual - G.T @ r.ravel(), law.value(motion, r).ravel()]))
        return step[:n], r + step[n:].reshape(r.shape)


def polish(
    program: TangentProgram, x: Floats, r: Floats, elimination: Elimination | None = None
) -> tuple[Floats, Floats]:
    """The program's own answer to round-off, from (x (n,), r (c, d)); the start if Newton worsens it."""
    rows, shift, threshold = program.contact.rows, program.contact.shift, program.contact.threshold
    K = sp.csc_matrix(program.K)
    rho = _stiffness(K)

    def at(motion: Floats, r: Floats) -> Law:
        if shift is not None:
            return ShiftedCone.of(rows, shift, rho, motion, r)
        return Pieces.of(rows, motion, r, np.full(rows.count, rho), threshold=threshold)

    x, r, _ = _newton(program, K, at, x, r, elimination)
    return x, r


def couple(
    program: TangentProgram, x: Floats, r: Floats, elimination: Elimination | None = None
) -> tuple[Floats, Floats] | None:
    """Exact Coulomb on the program's quadratic model, from (x, r); None when Newton does not reach it."""
    rows, K = program.contact.rows, sp.csc_matrix(program.K)
    scale = np.full(rows.count, _stiffness(K))
    x, r, error = _newton(program, K, lambda motion, r: Pieces.of(rows, motion, r, scale), x, r, elimination)
    return (x, r) if error <= EXACT else None


def _newton(
    program: TangentProgram, K: sp.csc_matrix, at: At, x: Floats, r: Floats, elimination: Elimination | None
) -> tuple[Floats, Floats, float]:
    """Best iterate and its residual over the largest force."""
    rows = program.contact.rows
    elimination = Elimination.of(K, rows, elimination)
    best, least = (x, r), np.inf
    scale = max(float(np.abs(r).max(initial=0.0)), float(np.abs(program.f).max()), np.finfo(float).tiny)
    for _ in range(ITERATIONS):
        residual, motion = K @ x - program.f, rows.motion(x)
        law = at(motion, r)
        balance = float(np.abs(residual - rows.forces(r)).max())
        error = max(balance, float(np.abs(law.value(motion, r)).max(initial=0.0))) / scale
        # Once it no longer falls from round-off, another step would only add noise. Until then steps are worth taking:
        # an open contact of a body without force must carry exactly none.
        if least <= EXACT and error >= least:
            break
        if error < least:
            best, least = (x, r), error
        try:
            dx, r = elimination.step(K, law, residual, motion, r)
        except ProgramError:
            break
        x = x + dx
    return *best, least


def _stiffness(K: sp.csc_matrix) -> float:
    """It balances force against motion: a hundredth of the mean, which stands for the plastic moduli at the contacts.

    With more, points that start to slip stick again and slip to and fro.
    """
    return SOFTENED * float(K.diagonal().mean())


def _stacked(rows: ContactRows) -> sp.csr_matrix:
    """G (c d, n), contact by contact, normal first; zero rows where there is no friction row."""
    place = np.arange(rows.count * (1 + rows.tangents)).reshape(rows.count, -1)
    order = np.concatenate([place[:, 0], place[rows.frictional, 1:].ravel()])
    put = sp.csr_matrix((np.ones(len(order)), (order, np.arange(len(order)))), shape=(place.size, len(order)))
    return sp.csr_matrix(put @ sp.vstack([rows.G_n, rows.G_t]))
