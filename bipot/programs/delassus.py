r"""A tangent program's contact conditions as the discrete Coulomb problem u = W r + q on its contacts alone.

Stationarity K dU - f = G' r gives dU = K^-1 (f + G' r), so motion at the contacts is

    u = (g, w_t) + G dU = W r + q,    W = G K^-1 G' (the Delassus operator),    q = (g, w_t) + G K^-1 f,

rows (n, t_1 .. t_{d-1}) a contact. A point without a friction row gets zero tangential rows and mu = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.coulomb.problem import CoulombProblem
from bipot.errors import ProgramError, UnsuitedForm
from bipot.programs.conic import TangentProgram
from bipot.typing import Floats

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Reduced:
    """The Coulomb problem of a dense program, and the way back: dU = free + flexibility r."""

    problem: CoulombProblem
    free: Floats
    flexibility: Floats

    def displacement(self, r: Floats) -> Floats:
        """The unknowns (n,) under contact forces r (c, d)."""
        return self.free + self.flexibility @ r.ravel()


def reduce(program: TangentProgram) -> Reduced:
    """Eliminate the unknowns of a dense program.

    Raises:
        UnsuitedForm: K is singular to working precision, friction is capped, or there is no contact.
        ProgramError: a point is welded (a tie is not Coulomb's law).
    """
    rows = program.contact.rows
    if not rows.count:
        raise UnsuitedForm("nothing may touch the body: there is no contact problem")
    if rows.tied.any():
        raise ProgramError("a welded point has no place in a Coulomb problem: use another form for mu = inf")
    if rows.capped:
        raise UnsuitedForm("a cap on friction, tool.shear, is not Coulomb's law: use another form")
    G, offset = _stacked(program)
    K = np.asarray(program.K)
    if not np.linalg.cond(K, 1) * len(K) * _EPS < 1:
        raise UnsuitedForm("the stiffness is singular: the contacts alone do not determine the motion")
    solved = np.linalg.solve(K, np.column_stack([program.f, G.T]))
    free, flexibility = np.asarray(solved[:, 0], dtype=np.float64), np.asarray(solved[:, 1:], dtype=np.float64)
    mu = np.zeros(rows.count)
    mu[rows.frictional] = rows.mu[rows.frictional]
    problem = CoulombProblem(W=sp.csr_array(G @ flexibility), q=offset + G @ free, mu=mu, dim=1 + rows.tangents)
    return Reduced(problem, free, flexibility)


def _stacked(program: TangentProgram) -> tuple[Floats, Floats]:
    """G (c d, n) and (g, w_t) (c d,), contact by contact, normal first."""
    rows = program.contact.rows
    d = 1 + rows.tangents
    G = np.zeros((rows.count, d, len(program.f)))
    G[:, 0] = rows.G_n.toarray()
    G[rows.frictional, 1:] = rows.G_t.toarray().reshape(-1, rows.tangents, len(program.f))
    offset = np.zeros((rows.count, d))
    offset[:, 0] = rows.gap
    offset[rows.frictional, 1:] = rows.slip
    return G.reshape(rows.count * d, -1), offset.ravel()
