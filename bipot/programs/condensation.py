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
from bipot.programs.data import ContactRows

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


def factorise(K: sp.csc_matrix, order: str = "MMD_AT_PLUS_A") -> sla.SuperLU:
    """LU of a symmetric positive definite sparse matrix (symmetric mode; minimum degree, or NATURAL if ordered).

    Raises:
        ProgramError: the matrix is singular.
    """
    try:
        return sla.splu(K, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as singular:
        raise ProgramError("the stiffness is singular: a part of the body moves without resistance") from singular


@dataclass(frozen=True)
class Split:
    """Where the entries of a stiffness pattern go when ``kept`` unknowns stay: found once for a pattern.

    ``inner`` (m,) lists the others in the order of elimination; ``inside``, ``cross``, ``corner`` are the places in
    the data of K_ii (a CSC pattern of its own), of K_ic and of K_cc, the latter two with their (row, column).
    """

    kept: Ints
    inner: Ints
    inside: Ints
    indices: Ints
    indptr: Ints
    cross: tuple[Ints, Ints, Ints]
    corner: tuple[Ints, Ints, Ints]

    @staticmethod
    def of(K: sp.csc_matrix, kept: Ints) -> Split:
        """Sort the pattern of K; the order of elimination is SuperLU's minimum degree on K_ii, taken once."""
        size = len(K.indptr) - 1
        inner = np.setdiff1d(np.arange(size), kept)
        numbered = sp.csc_matrix((np.arange(1.0, K.nnz + 1), K.indices, K.indptr), shape=(size, size))
        # Any diagonally dominant matrix will do: only its ordering is kept.
        sample = abs(K[:, inner][inner]) + sp.diags_array(np.asarray(abs(K).sum(axis=0)).ravel()[inner] + 1.0)
        inner = inner[np.argsort(factorise(sp.csc_matrix(sample)).perm_c)]
        inside = sp.csc_matrix(numbered[:, inner][inner])
        inside.sort_indices()
        return Split(
            kept,
            inner,
            inside.data.astype(np.intp) - 1,
            np.asarray(inside.indices, dtype=np.intp),
            np.asarray(inside.indptr, dtype=np.intp),
            _places(numbered[:, kept][inner]),
            _places(numbered[:, kept][kept]),
        )

    def inside_factor(self, data: Floats) -> sla.SuperLU:
        """LU of K_ii from the data of K."""
        size = len(self.inner)
        return factorise(sp.csc_matrix((data[self.inside], self.indices, self.indptr), shape=(size, size)), "NATURAL")


def _places(block: sp.csc_matrix) -> tuple[Ints, Ints, Ints]:
    """Rows, columns and (numbers - 1) of the entries of a numbered block."""
    entries = block.tocoo()
    return entries.row.astype(np.intp), entries.col.astype(np.intp), entries.data.astype(np.intp) - 1


def _dense(shape: tuple[int, int], places: tuple[Ints, Ints, Ints], data: Floats) -> Floats:
    block = np.zeros(shape)
    block[places[0], places[1]] = data[places[2]]
    return block


def touched(rows: ContactRows, size: int) -> Ints:
    """Unknowns that contact rows touch, sorted."""
    marked = np.zeros(size, dtype=bool)
    marked[rows.G_n.indices] = True
    marked[rows.G_t.indices] = True
    return np.flatnonzero(marked)


def condense(program: TangentProgram, split: Split | None = None) -> Condensed:
    """Condense a sparse program on the unknowns its contact rows touch; ``split`` saves finding them again."""
    K = sp.csc_matrix(program.K)
    data = np.asarray(K.data, dtype=np.float64)
    if split is None:
        split = Split.of(K, touched(program.contact.rows, len(program.f)))
    kept, inner = split.kept, split.inner
    coupling = _dense((len(inner), len(kept)), split.cross, data)
    factor = split.inside_factor(data)
    inverse = factor.solve(np.column_stack([program.f[inner], coupling]))
    solution, influence = inverse[:, 0], inverse[:, 1:]
    S = _dense((len(kept), len(kept)), split.corner, data) - coupling.T @ influence
    f = program.f[kept] - coupling.T @ solution
    reduced = TangentProgram((S + S.T) / 2, f, program.contact.columns(kept))
    return Condensed(reduced, kept, inner, solution, influence)
