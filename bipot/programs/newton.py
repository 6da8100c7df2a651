r"""One semismooth Newton step on the increment with exact Coulomb friction inside: one sparse LU on a fixed pattern.

Unknowns are the displacements x alone. With the residual rho = f_int - F, the contact forces act only on the unknowns
*own* to each contact, where equilibrium rho = G' r *defines* them: with the frame T of a contact (rows n, t_1 ..) on
its own unknowns, r = T^-T rho. Every own row of K_T dx = -rho is then replaced by the linearised contact law

    open: r = 0,    closed: gap = 0,    stick: slip = 0,    slip: r_t = mu r_n y / |y|,   y = r_t - scale slip

(multiplied by T', so that an open contact leaves the row as it is). Slip couples r_t to r_n: the matrix is
unsymmetric, but has the pattern of K whatever the contacts do, so its ordering and every scatter are found once.
No multipliers, no saddle point, no condensation.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from bipot.errors import ProgramError, UnsuitedForm
from bipot.programs.data import ContactRows
from bipot.programs.ordering import SYMMETRIC, minimum_degree
from bipot.programs.pieces import Pieces
from bipot.typing import Floats, Ints

PIVOT = 1e-2
"""The diagonal is the pivot unless it is this much smaller than its column: it keeps the ordering's fill."""


@dataclass(frozen=True)
class Pattern:
    """A structurally symmetric pattern in a fill-reducing order, by rows.

    ``order`` (n,) lists the unknowns in the order of elimination; ``place`` (nnz,) sends an entry of the CSC pattern
    it was made from to the row-wise data in that order.
    """

    order: Ints
    place: Ints
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]

    @staticmethod
    def of(indices: NDArray[np.int32], indptr: NDArray[np.int32]) -> Pattern:
        """Order the CSC pattern by minimum degree."""
        n = len(indptr) - 1
        column = np.repeat(np.arange(n), np.diff(indptr))
        rank = minimum_degree(indices, indptr)
        row, column = rank[indices], rank[column]
        by_row = np.lexsort((column, row))
        place = np.empty(len(by_row), dtype=np.intp)
        place[by_row] = np.arange(len(by_row))
        starts = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
        return Pattern(np.argsort(rank), place, column[by_row].astype(np.int32), starts.astype(np.int32))

    @property
    def size(self) -> int:
        """Number n of unknowns."""
        return len(self.order)

    def factorise(self, data: Floats) -> sla.SuperLU:
        """LU of the *transpose* of the row-wise ``data``; raises ProgramError when it is singular."""
        # Its index arrays are checked once, not at every factorisation.
        transpose = copy(self._transpose)
        transpose.data = data
        try:
            return sla.splu(
                transpose, permc_spec="NATURAL", diag_pivot_thresh=PIVOT, relax=4, panel_size=1, options=SYMMETRIC
            )
        except RuntimeError as singular:
            raise ProgramError("the Newton matrix is singular: the body can move without resistance") from singular

    @cached_property
    def _transpose(self) -> sp.csc_matrix:
        """The transpose's pattern with data of no meaning."""
        return sp.csc_matrix((np.ones(len(self.indices)), self.indices, self.indptr), shape=(self.size, self.size))

    def solve(self, lu: sla.SuperLU, b: Floats) -> Floats:
        """x (n,) with A x = b, both in the numbering of the unknowns."""
        x = np.empty_like(b)
        x[self.order] = lu.solve(b[self.order], "T")
        return x


@dataclass(frozen=True)
class Frames:
    """Where c contacts sit: own unknowns (c, d), frames T (c, d, d), their duals T^-T, and their rows in the data.

    A contact with fewer than d unknowns of its own is filled up with ghosts, numbered n. ``entries`` (d, m) are the
    places of the own rows' entries, contact by contact, ``column`` (m,) their unknown, ``owner`` (m,) the contact;
    ``corner`` (c, d, d) the places of the entries (own, own).
    """

    own: Ints
    T: Floats
    dual: Floats
    entries: Ints
    column: Ints
    owner: Ints
    corner: Ints

    @staticmethod
    def of(rows: ContactRows, pattern: Pattern) -> Frames:
        """Frames of contact rows, each on the unknowns of one node.

        Raises:
            ProgramError: two contacts share an unknown, or rows couple several nodes or are dependent.
        """
        own, T = _own(rows, pattern.size)
        shared = np.bincount(own.ravel(), minlength=pattern.size + 1)[: pattern.size] > 1
        if shared.any():
            raise UnsuitedForm("two contacts share an unknown: Newton needs a conic form there")
        # Rows that do not exist (no friction, held tangents, ghosts) are completed to a basis.
        complement = np.linalg.svd(T)[2]
        T = np.where(np.any(T != 0, axis=2, keepdims=True), T, complement)
        try:
            dual = np.linalg.inv(T).transpose(0, 2, 1)
        except np.linalg.LinAlgError as singular:
            raise UnsuitedForm("contact rows at one node are dependent: Newton needs a conic form") from singular
        return Frames(own, T, dual, *_places(own, pattern))

    def motion(self, rows: ContactRows, x: Floats) -> Floats:
        """(g + du_n, du_t) (c, d) as ``rows.motion``, by the frames."""
        out = _times(self.T, np.append(x, 0.0)[self.own])
        out[:, 0] += rows.gap
        out[rows.frictional, 1:] += rows.slip
        return out

    def forces(self, r: Floats, n: int) -> Floats:
        """G' r (n,) as ``rows.forces``: own unknowns are not shared."""
        out = np.zeros(n + 1)
        out[self.own] = _times(self.T.transpose(0, 2, 1), r)
        return out[:-1]

    def reaction(self, residual: Floats) -> Floats:
        """r = T^-T rho (c, d) from the residual (n,)."""
        return _times(self.dual, np.append(residual, 0.0)[self.own])


@dataclass(frozen=True)
class Linearised:
    """A factorised Newton matrix with the law's pieces it stands on; ``product`` (d, m) holds the own rows of K."""

    pattern: Pattern
    frames: Frames
    pieces: Pieces
    lu: sla.SuperLU
    product: Floats

    @staticmethod
    def of(data: Floats, pattern: Pattern, frames: Frames, pieces: Pieces) -> Linearised:
        """Put the contact law into the own rows of ``data`` (nnz + 1, row-wise; the last collects ghosts)."""
        data[-1] = 0.0
        product = data[frames.entries]
        back = frames.T.transpose(0, 2, 1)
        W = (back @ pieces.by_force @ frames.dual)[frames.owner]
        data[frames.entries] = np.einsum("mij,jm->im", W, product)
        data[frames.corner] += back @ pieces.by_motion @ frames.T
        return Linearised(pattern, frames, pieces, pattern.factorise(data[:-1]), product)

    def step(self, residual: Floats, motion: Floats, r: Floats) -> tuple[Floats, Floats]:
        """(dx (n,), new r (c, d)) from rho (n,), motion and forces (c, d) at the iterate."""
        frames, pieces = self.frames, self.pieces
        law = pieces.value(motion, r) + _times(pieces.by_force, frames.reaction(residual) - r)
        b: Floats = np.append(-residual, 0.0)
        b[frames.own] = -_times(frames.T.transpose(0, 2, 1), law)
        dx = self.pattern.solve(self.lu, b[:-1])
        moved = self.product * dx[frames.column]
        change = np.stack([_sums(frames.owner, row, len(r)) for row in moved], axis=1)
        b[:-1] = residual
        return dx, _times(frames.dual, b[frames.own] * (frames.own < len(dx)) + change)


def _sums(owner: Ints, values: Floats, count: int) -> Floats:
    return np.asarray(np.bincount(owner, values, minlength=count), dtype=np.float64)


def _times(matrices: Floats, vectors: Floats) -> Floats:
    return (matrices @ vectors[..., None])[..., 0]


def _own(rows: ContactRows, n: int) -> tuple[Ints, Floats]:
    """Own unknowns (c, d), padded with n, and rows of G on them (c, d, d), zero where there is none."""
    width = 1 + rows.tangents
    lifted = rows.frictional.repeat(rows.tangents)
    contact = np.concatenate(
        [np.repeat(np.arange(rows.count), np.diff(rows.G_n.indptr)), lifted.repeat(np.diff(rows.G_t.indptr))]
    )
    axis = np.concatenate(
        [
            np.zeros(rows.G_n.nnz, dtype=np.intp),
            np.tile(np.arange(1, width), len(rows.frictional)).repeat(np.diff(rows.G_t.indptr)),
        ]
    )
    dof = np.concatenate([rows.G_n.indices, rows.G_t.indices])
    value = np.concatenate([rows.G_n.data, rows.G_t.data])
    pairs, inverse = np.unique(contact * (n + 1) + dof, return_inverse=True)
    first = np.searchsorted(pairs, np.arange(rows.count) * (n + 1))
    local = np.arange(len(pairs)) - first[pairs // (n + 1)]
    if np.any(local >= width):
        raise UnsuitedForm("a contact row couples several nodes: Newton needs a conic form")
    own = np.full((rows.count, width), n, dtype=np.intp)
    own[pairs // (n + 1), local] = pairs % (n + 1)
    T = np.zeros((rows.count, width, width))
    T[contact, axis, local[inverse]] = value
    return own, T


def _places(own: Ints, pattern: Pattern) -> tuple[Ints, Ints, Ints, Ints]:
    """Entries, column, owner and corner of :class:`Frames`; ghosts point behind the data."""
    n, nnz = pattern.size, len(pattern.indices)
    rank = np.empty(n + 1, dtype=np.intp)
    rank[pattern.order], rank[n] = np.arange(n), n
    lengths = np.append(np.diff(pattern.indptr), 0)
    starts = np.append(pattern.indptr[:-1], nnz)
    position = rank[own]
    length = lengths[position[:, 0]]
    owner = np.repeat(np.arange(len(own)), length)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(length) - length, length)
    entries = np.where((own < n)[owner], starts[position][owner] + within[:, None], nnz).T
    columns = np.append(pattern.indices, n)[entries]
    if np.any((columns != columns[0]) & (columns < n)):
        raise UnsuitedForm("the unknowns of a contact have different neighbours: Newton needs a conic form")
    matches = columns[0][:, None] == position[owner]
    corner = np.full((len(own), own.shape[1], own.shape[1]), nnz)
    at, axis = np.nonzero(matches)
    corner[owner[at], :, axis] = entries[:, at].T
    return entries, pattern.order[columns[0]], owner, corner
