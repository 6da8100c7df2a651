r"""One semismooth Newton step on an increment with exact Coulomb friction inside: one sparse LU on a fixed pattern.

With the residual rho = f_int - F, a contact's forces act on the unknowns *own* to it alone, where equilibrium
rho = G' r *defines* them: with the frame T of the contact (rows n, t_1 ..) on its own unknowns, r = T^-T rho. Every own
row of K_T dx = -rho is then replaced by the linearised contact law

    open: r = 0,    closed: gap = 0,    stick: slip = 0,    slip: r_t = mu r_n y / |y|,   y = r_t - scale slip

(multiplied by T', so that an open contact leaves the row as it is). Slip couples r_t to r_n: the matrix is unsymmetric,
but has the pattern of K whatever the contacts do, so its ordering and every scatter are computed once. There are no
multipliers, no saddle point and no condensation. Contacts that share unknowns border the matrix by their forces
(:mod:`bipot.programs.frames`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from bipot.programs.factors import DEFAULT, Factor, LinearSolver
from bipot.programs.frames import Frames, times
from bipot.programs.pieces import L
from bipot.typing import Floats, Ints


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
        back = frames.T.transpose(0, 2, 1)
        W = (back @ pieces.by_force @ frames.dual)[frames.owner]
        data[frames.entries] = np.einsum("mij,jm->im", W, product)
        data[frames.corner] += back @ pieces.by_motion @ frames.T
        border = frames.border
        if border is None:
            factor = frames.pattern.factorise(data[:-1], solver)
        else:
            factor = border.factorise(data[:-1], pieces, solver)
        return Linearised(frames, pieces, factor, product)

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
        change = np.stack([_sums(frames.owner, row, len(r)) for row in moved], axis=1)
        b[:-1] = residual
        new = times(frames.dual, b[frames.own] * (frames.own < len(dx)) + change)
        if border is not None:
            new[border.contact] = beside
        return dx, new


def _sums(owner: Ints, values: Floats, count: int) -> Floats:
    return np.asarray(np.bincount(owner, values, minlength=count), dtype=np.float64)
