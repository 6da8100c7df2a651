r"""Elimination of the unknowns that no contact row touches, by one sparse factorisation.

With dU = (i, c): K_ii u_i + K_ic u_c = f_i gives u_i, and the program on u_c has the Schur complement

    S = K_cc - K_ci K_ii^-1 K_ic,    f_c - K_ci K_ii^-1 f_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from bipot.errors import ProgramError
from bipot.programs.conic import TangentProgram

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Condensed:
    """A dense program on the contact unknowns and the way back."""

    program: TangentProgram
    kept: Ints
    inner: Ints
    solution: Floats
    influence: Floats

    def recover(self, u_c: Floats) -> Floats:
        """All unknowns (n,) from those of contact: u_i = K_ii^-1 f_i - (K_ii^-1 K_ic) u_c."""
        full = np.empty(len(self.kept) + len(self.inner))
        full[self.kept] = u_c
        full[self.inner] = self.solution - self.influence @ u_c
        return full


def factorise(K: sp.csc_matrix) -> sla.SuperLU:
    """LU of a symmetric positive definite sparse matrix (symmetric mode, minimum degree).

    Raises:
        ProgramError: the matrix is singular.
    """
    try:
        return sla.splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as singular:
        raise ProgramError("the stiffness is singular: a part of the body moves without resistance") from singular


def condense(program: TangentProgram) -> Condensed:
    """Condense a sparse program on the unknowns its contact rows touch."""
    rows = program.contact.rows
    touched = np.zeros(len(program.f), dtype=bool)
    touched[rows.G_n.indices] = True
    touched[rows.G_t.indices] = True
    kept, inner = np.flatnonzero(touched), np.flatnonzero(~touched)
    K = sp.csc_matrix(program.K)
    columns = K[:, kept]
    coupling = columns[inner].toarray()
    inverse = factorise(K[:, inner][inner]).solve(np.column_stack([program.f[inner], coupling]))
    solution, influence = inverse[:, 0], inverse[:, 1:]
    S = columns[kept].toarray() - coupling.T @ influence
    f = program.f[kept] - coupling.T @ solution
    reduced = TangentProgram.of((S + S.T) / 2, f, rows.columns(kept), program.contact.threshold)
    return Condensed(reduced, kept, inner, solution, influence)
