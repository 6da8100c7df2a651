r"""Elimination of the unknowns that no contact row touches, by one sparse factorisation, and then of all others.

With dU = (i, c): K_ii u_i + K_ic u_c = f_i gives u_i, and the program on u_c has the Schur complement

    S = K_cc - K_ci K_ii^-1 K_ic,    f_c - K_ci K_ii^-1 f_i.

With the unknowns c eliminated last, K + diag(0, a) = L U contains S + a = L_cc U_cc, so no right-hand side per contact
unknown is needed. The shift a > 0 is needed because S may be singular (perfect flow) where K_ii is not.

:func:`reduce` poses a program's contact conditions as the discrete Coulomb problem u = W r + q on its contacts alone.
Stationarity K dU - f = G' r gives dU = K^-1 (f + G' r), so motion at the contacts is

    u = (g, w_t) + G dU = W r + q,    W = G K^-1 G' (the Delassus operator),    q = (g, w_t) + G K^-1 f,

rows (n, t_1 .. t_{d-1}) a contact. A point without a friction row gets zero tangential rows and mu = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from bipot.coulomb.problem import CoulombProblem
from bipot.errors import ProgramError, UnsuitedForm
from bipot.programs.conic import TangentProgram
from bipot.programs.data import ContactRows
from bipot.programs.factors import RELAX, SYMMETRIC
from bipot.programs.ordering import minimum_degree
from bipot.typing import Floats, Ints

SINGULAR = "the stiffness is singular: a part of the body moves without resistance"

SMALLER = 0.5
"""Entries of a Schur complement over those of the stiffness up to which condensation pays. Condensed, a pass by
interior points takes 0.4 of the time at a ratio of 0.1 (10 x 10 elements), the same at 0.3 to 0.5, 1.2 times as much
at 1 and 4 times as much at 2."""


@dataclass(frozen=True)
class Condensed:
    """A dense program on the contact unknowns ``kept`` and the way back.

    ``factor`` is that of K + diag(0, a) in the order of elimination ``order``, whose first ``inner`` unknowns have no
    contact; ``shifted`` is S + a, and ``loaded`` the answer (n,) of the factored system, in that order, to f_i alone.
    """

    program: TangentProgram
    kept: Ints
    order: Ints
    factor: sla.SuperLU
    shifted: Floats
    loaded: Floats

    def recover(self, u_c: Floats) -> Floats:
        """All unknowns (n,) from those of contact: u_i = K_ii^-1 (f_i - K_ic u_c)."""
        inner = len(self.order) - len(self.kept)
        # Forces on the unknowns c that bring them to u_c: only f_i and these act.
        push = np.zeros(len(self.order))
        push[inner:] = self.shifted @ (u_c - self.loaded[inner:])
        full = np.empty(len(self.order))
        full[self.order] = self.loaded + self.factor.solve(push)
        full[self.kept] = u_c
        return full


def factorise(K: sp.csc_matrix, order: str = "MMD_AT_PLUS_A", relax: int | None = None) -> sla.SuperLU:
    """LU of a symmetric positive definite sparse matrix (symmetric mode; minimum degree, or NATURAL if ordered).

    ``relax`` is the size up to which SuperLU merges the columns at the leaves, with panels of one column, which is
    faster on small meshes. None takes SuperLU's defaults.

    Raises:
        ProgramError: the matrix is singular.
    """
    try:
        panel = None if relax is None else 1
        return sla.splu(K, permc_spec=order, diag_pivot_thresh=0.0, relax=relax, panel_size=panel, options=SYMMETRIC)
    except RuntimeError as singular:
        raise ProgramError(SINGULAR) from singular


@dataclass(frozen=True)
class Split:
    """An order of elimination for a stiffness pattern that ends with the unknowns ``kept``, found once for a pattern.

    ``order`` (n,) lists the unknowns; ``place`` sends the data of K to the CSC pattern in that order, in which
    ``diagonal`` are the entries of K_cc's diagonal.
    """

    kept: Ints
    order: Ints
    place: Ints
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    diagonal: Ints

    @staticmethod
    def of(K: sp.csc_matrix, kept: Ints) -> Split:
        """SuperLU's minimum degree, taken once, on the pattern of K with ``kept`` all connected, as S connects them."""
        n, count = len(K.indptr) - 1, len(kept)
        clique = sp.coo_matrix((np.ones(count**2), (np.repeat(kept, count), np.tile(kept, count))), shape=(n, n))
        pattern = sp.csc_matrix((np.ones(K.nnz), K.indices, K.indptr), shape=(n, n))
        connected = sp.csc_matrix(pattern + clique + sp.eye_array(n))
        indices, indptr = (np.asarray(a, dtype=np.int32) for a in (connected.indices, connected.indptr))
        order = np.argsort(minimum_degree(indices, indptr))
        order = np.concatenate([order[~np.isin(order, kept)], kept])
        numbered = sp.csc_matrix((np.arange(K.nnz), K.indices, K.indptr), shape=(n, n))
        ordered = sp.csc_matrix(numbered[:, order][order])
        ordered.sort_indices()
        column = np.repeat(np.arange(n), np.diff(ordered.indptr))
        diagonal = np.flatnonzero((ordered.indices == column) & (column >= n - count))
        return Split(
            kept,
            order,
            np.asarray(ordered.data, dtype=np.intp),
            np.asarray(ordered.indices, dtype=np.int32),
            np.asarray(ordered.indptr, dtype=np.int32),
            diagonal,
        )

    def factor(self, data: Floats) -> tuple[sla.SuperLU, float]:
        """LU of K + diag(0, a) from the data of K, and a: the mean of K_cc's diagonal, of which S has the round-off.

        Raises:
            ProgramError: K_ii is singular, or so nearly that a zero pivot would have to be avoided.
        """
        data = data[self.place]
        shift = float(np.abs(data[self.diagonal]).mean()) if len(self.diagonal) else 0.0
        data[self.diagonal] += shift
        n = len(self.order)
        lu = factorise(sp.csc_matrix((data, self.indices, self.indptr), shape=(n, n)), "NATURAL", RELAX)
        if not np.array_equal(lu.perm_r, lu.perm_c):
            raise ProgramError(SINGULAR)
        return lu, shift


def _last_block(lu: sla.SuperLU, count: int) -> Floats:
    """L_cc U_cc of the last ``count`` unknowns, wherever SuperLU's postorder has placed them."""
    last = lu.perm_c[len(lu.perm_c) - count :]
    # All other unknowns share one more number, whose row and column are dropped.
    number = np.full(len(lu.perm_c), count)
    number[last] = np.arange(count)
    return _dense(lu.L, number, count) @ _dense(lu.U, number, count)


def _dense(factor: sp.csc_array, number: Ints, count: int) -> Floats:
    """The entries of a CSC matrix whose row and column are numbered below ``count``."""
    first = int(np.argmax(number < count)) if count else len(number)
    entries = slice(factor.indptr[first], None)
    column = np.repeat(number[first:], np.diff(factor.indptr[first:]))
    block = np.zeros((count + 1, count + 1))
    block[number[factor.indices[entries]], column] = factor.data[entries]
    return block[:count, :count]


def touched(rows: ContactRows, size: int) -> Ints:
    """Unknowns that contact rows touch, sorted."""
    marked = np.zeros(size, dtype=bool)
    marked[rows.G_n.indices] = True
    marked[rows.G_t.indices] = True
    return np.flatnonzero(marked)


def condense(program: TangentProgram, split: Split | None = None) -> Condensed:
    """Condense a sparse program on the unknowns its contact rows touch; ``split`` is a known order for this."""
    K = program.K if isinstance(program.K, sp.csc_matrix) else sp.csc_matrix(program.K)
    if split is None:
        split = Split.of(K, touched(program.contact.rows, len(program.f)))
    kept, count = split.kept, len(split.kept)
    inner = len(program.f) - count
    lu, shift = split.factor(np.asarray(K.data, dtype=np.float64))
    shifted = _last_block(lu, count)
    shifted = (shifted + shifted.T) / 2
    load = program.f[split.order]
    load[inner:] = 0.0
    loaded = lu.solve(load)
    f = program.f[kept] + shifted @ loaded[inner:]
    contact = replace(program.contact, rows=program.contact.rows.columns(kept))
    reduced = TangentProgram(shifted - shift * np.eye(count), f, contact)
    return Condensed(reduced, kept, split.order, lu, shifted, loaded)


def pays(program: TangentProgram) -> bool:
    """Whether condensation makes interior points faster, see :data:`SMALLER`."""
    return len(touched(program.contact.rows, len(program.f))) ** 2 <= SMALLER * sp.csc_matrix(program.K).nnz


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
        UnsuitedForm: K is singular to working precision, a point is welded or its friction capped (neither is
            Coulomb's law), or there is no contact.
    """
    rows = program.contact.rows
    if not rows.count:
        raise UnsuitedForm("nothing may touch the body: there is no contact problem")
    if rows.tied.any():
        raise UnsuitedForm("a welded point (mu = inf) has no place in a Coulomb problem")
    if rows.capped:
        raise UnsuitedForm("a cap on friction, tool.shear, is not Coulomb's law")
    G, offset = _stacked(program)
    K = np.asarray(program.K)
    if not np.linalg.cond(K, 1) * len(K) * np.finfo(np.float64).eps < 1:
        free = "without contacts a part of the body, or a tool that a force or moment drives, moves without resistance"
        raise UnsuitedForm(f"the stiffness is singular: {free}")
    solved = np.linalg.solve(K, np.column_stack([program.f, G.T]))
    free, flexibility = np.asarray(solved[:, 0], dtype=np.float64), np.asarray(solved[:, 1:], dtype=np.float64)
    W, q = sp.csr_array(G @ flexibility), offset + G @ free
    return Reduced(CoulombProblem(W=W, q=q, mu=rows.rubbing, dim=1 + rows.tangents), free, flexibility)


def _stacked(program: TangentProgram) -> tuple[Floats, Floats]:
    """G (c d, n) and (g, w_t) (c d,), contact by contact, normal first."""
    rows = program.contact.rows
    d = 1 + rows.tangents
    G = np.zeros((rows.count, d, len(program.f)))
    G[:, 0] = rows.G_n.toarray()
    G[rows.frictional, 1:] = rows.G_t.toarray().reshape(-1, rows.tangents, len(program.f))
    return G.reshape(rows.count * d, -1), rows.motion(np.zeros(len(program.f))).ravel()
