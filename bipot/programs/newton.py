r"""One semismooth Newton step on an increment with exact Coulomb friction inside: one sparse LU on a fixed pattern.

With the residual rho = f_int - F, a contact's forces act on the unknowns *own* to it alone, where equilibrium
rho = G' r *defines* them: with the frame T of the contact (rows n, t_1 ..) on its own unknowns, r = T^-T rho. Every own
row of K_T dx = -rho is then replaced by the linearised contact law

    open: r = 0,    closed: gap = 0,    stick: slip = 0,    slip: r_t = mu r_n y / |y|,   y = r_t - scale slip

(multiplied by T', so that an open contact leaves the row as it is). Slip couples r_t to r_n: the matrix is unsymmetric,
but has the pattern of K whatever the contacts do, so its ordering and every scatter are computed once. There are no
multipliers, no saddle point and no condensation. Contacts that share unknowns border the matrix by their forces
(:mod:`bipot.programs.frames`).

:func:`minimised` repeats the step on a quadratic model, K and f constant: a tangent program or a penalised one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, NamedTuple

import numpy as np
import scipy.sparse as sp

from bipot.errors import ProgramError
from bipot.programs.data import ContactRows
from bipot.programs.factors import DEFAULT, Factor, LinearSolver
from bipot.programs.frames import SOFTENED, Frames
from bipot.programs.ordering import Pattern
from bipot.programs.pieces import ALIKE, L, Law
from bipot.typing import Floats, einsum, max_abs, times

ITERATIONS = 12
"""Most steps of one minimisation."""

EXACT = 1e-10
"""Error of :class:`Best` at which the iteration ends as soon as a step no longer lessens it."""

TURN, FALL = 0.005, 0.1
"""In space slips turn from step to step. The last factor serves for turns below the angle TURN while a step with it
leaves at most FALL of the error, and once the error is EXACT: such a step takes a tenth of the time of a factorisation.
"""

RUNAWAY = 1e100
"""A step or a force above this, in the model's own units, has next to no square, and leads nowhere."""


@dataclass(frozen=True)
class Linearised(Generic[L]):
    """A factorised Newton matrix with the pieces of the law in it; ``product`` (d, m) holds the own rows of K."""

    frames: Frames
    pieces: L
    factor: Factor
    product: Floats

    @staticmethod
    def of(data: Floats, frames: Frames, pieces: L, solver: LinearSolver = DEFAULT) -> Linearised[L]:
        """Put the contact law into the own rows of ``data`` (nnz + 1, row-wise; the last collects ghosts).

        Raises:
            ProgramError: the matrix is singular.
        """
        data[-1] = 0.0
        product = data[frames.entries]
        transposed = frames.T.transpose(0, 2, 1)
        W = (transposed @ pieces.by_force @ frames.dual)[frames.owner]
        data[frames.entries] = einsum("mij,jm->im", W, product)
        data[frames.corner] += transposed @ pieces.by_motion @ frames.T
        border = frames.border
        if border is None:
            factor = frames.pattern.factorise(data[:-1], solver)
        else:
            factor = border.factorise(data[:-1], pieces, solver)
        return Linearised(frames, pieces, factor, product)

    def serves(self, frames: Frames) -> bool:
        """Whether contacts in these frames are on the same unknowns."""
        mine, its = self.frames.border, frames.border
        alike = mine is None if its is None else mine is not None and np.array_equal(mine.contact, its.contact)
        return alike and np.array_equal(self.frames.own, frames.own)

    def at(self, frames: Frames, pieces: L) -> Linearised[L]:
        """The same factor for contacts in such ``frames``, on these ``pieces``."""
        mine, its = self.frames.border, frames.border
        if mine is not None and its is not None:
            frames = replace(frames, border=replace(its, pattern=mine.pattern))
        return replace(self, frames=frames, pieces=pieces)

    def step(self, residual: Floats, miss: Floats, r: Floats) -> tuple[Floats, Floats]:
        """(dx (n,), new r (c, d)) from rho (n,), the law's value ``miss`` and forces (c, d) at the iterate."""
        frames, pieces, border = self.frames, self.pieces, self.frames.border
        law = miss + times(pieces.by_force, frames.reaction(residual) - r)
        b: Floats = np.append(-residual, 0.0)
        b[frames.own] = -times(frames.T.transpose(0, 2, 1), law)
        if border is None:
            dx, beside = frames.pattern.solve(self.factor, b[:-1]), None
        else:
            dx, beside = border.solve(self.factor, b[:-1], pieces, miss, r)
        moved = self.product * dx[frames.column]
        change = np.stack([np.bincount(frames.owner, row, len(r)) for row in moved], axis=1)
        b[:-1] = residual
        new = times(frames.dual, b[frames.own] * (frames.own < len(dx)) + change)
        if border is not None:
            new[border.contact] = beside
        return dx, new


class Model(NamedTuple):
    """A body's linear residual K dU - f: K (n, n) sparse or dense, f (n,), with contact ``rows`` on dU.

    Where K is symmetric it is that of the energy 1/2 dU' K dU - f' dU.
    """

    K: sp.csc_matrix | Floats
    f: Floats
    rows: ContactRows


class Best(NamedTuple):
    """The iterate x (n,), r (c, d) of least ``error`` (residual over the largest force), and the factors it took."""

    x: Floats
    r: Floats
    error: float
    factors: int


def minimised(
    model: Model,
    at: Callable[[Floats, Floats], Law],
    x: Floats,
    r: Floats,
    frames: Frames | None = None,
    iterations: int = ITERATIONS,
) -> Best:
    """K x - f - G' r = 0 and the law ``at(motion, r)``, from x (n,) and r (c, d), by whole steps.

    The matrix is factorised anew only where the law's derivatives change by more than TURN, or by less and the last
    factor serves no longer.
    """
    rows, K = model.rows, sp.csc_matrix(model.K)
    frames = frames or Frames.of(rows, Pattern.of(K.indices, K.indptr))
    best = Best(x, r, np.inf, 0)
    last: Linearised[Law] | None = None
    changed = False
    scale, factors, before = max(max_abs(model.f), float(np.finfo(float).tiny)), 0, np.inf
    for step in range(iterations):
        # A solver's answer may be as far off as a step.
        if not max(max_abs(x), max_abs(r)) <= RUNAWAY:
            break
        residual, motion = K @ x - model.f, rows.motion(x)
        law, scale = at(motion, r), max(scale, max_abs(r))
        balance, miss = max_abs(residual - rows.forces(r)), law.value(motion, r)
        error = max(balance, max_abs(miss)) / scale
        if error <= EXACT:
            # By the softened scale contacts that stick might slip a hundred times as far as forces are exact.
            error = min(max(balance, max_abs(law.value(motion, r, 1 / SOFTENED))) / scale, EXACT)
        if step == 1 and max(best.error, error) <= EXACT:
            # Beside K x the start may be exact though it is no solution of the increment.
            best = Best(x, r, error, factors)
        # Where the error is round-off and no longer falls, another step would only add noise. Until then steps are
        # worth taking: an open contact of a body without force must carry exactly none.
        if best.error <= EXACT and error >= best.error:
            # Once it may be that a piece has changed, and changes back.
            if changed or last is None or last.pieces.same(law):
                break
            changed = True
        if error < best.error:
            best = Best(x, r, error, factors)
        if last is not None and (steady := law.steadied(last.pieces, rows)) is not law:
            law, miss = steady, steady.value(motion, r)
        serves = error <= FALL * before or best.error <= EXACT
        try:
            if last is None or not last.pieces.same(law, TURN if serves else ALIKE):
                last = Linearised.of(frames.pattern.by_row(np.asarray(K.data, dtype=np.float64)), frames, law)
                factors += 1
        except ProgramError:
            break
        dx, r = last.step(residual, miss, r)
        # A force that the law says is zero has the round-off of its row left.
        x, r, before = x + dx, np.where(last.pieces.none, 0.0, r), error
    return best._replace(factors=factors)
