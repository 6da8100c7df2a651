"""The place of contacts in a stiffness: on unknowns that they own, or on shared ones, where their forces border it.

A contact owns its unknowns if no other contact touches them, they are no more than its rows, which are independent, and
all have the same neighbours (as those of one node do): equilibrium there defines its forces. Other contacts keep their
forces as unknowns: those that share a node, are on a tool driven by a force, couple several nodes, have two rows on one
unknown (an inclined tool at the axis), or slip along a held tangent, where no equilibrium determines a force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from bipot.programs.data import ContactRows
from bipot.programs.factors import Factor, LinearSolver
from bipot.programs.ordering import Pattern
from bipot.programs.pieces import Law
from bipot.typing import Bools, Floats, Ints, times

DEPENDENT = 1e-8
"""Volume of a contact's frame, of unit rows, below which its rows are dependent."""

YIELDING = 1e-9
"""Compliance of closed contacts that share unknowns, in the Newton matrix: where their rows are dependent it selects
the forces nearest to the last ones, and elsewhere it does not slow convergence."""

SOFTENED = 1e-2
"""Fraction of the elastic stiffness by which the law weighs forces against motions; it represents the plastic moduli.
With the full stiffness, a point that lands or begins to slip alternates between states."""

MANY = 120
"""Unknowns of one contact, as of a coarse side before a fine one, above which they do not count as neighbours: pairs
grow as their square, take longer to order than the factors take, and fill more than the force, which comes after all.
"""


@dataclass(frozen=True)
class Frames:
    """The place of c contacts in a ``pattern``: own unknowns (c, d), frames T (c, d, d), duals T^-T, and rows.

    A contact with fewer than d unknowns of its own is padded with ghosts, numbered n; one of the ``border`` has only
    ghosts. ``entries`` (d, m) are the places in the data of K's entries in the own rows, contact by contact, ``column``
    (m,) their unknown, ``owner`` (m,) the contact; ``corner`` (c, d, d) the places of the entries (own, own).
    """

    pattern: Pattern
    own: Ints
    T: Floats
    dual: Floats
    entries: Ints
    column: Ints
    owner: Ints
    corner: Ints
    border: Border | None

    @staticmethod
    def of(rows: ContactRows, pattern: Pattern) -> Frames:
        """Frames of contact rows on the unknowns of ``pattern``."""
        touched = Touched.of(rows)
        alone = touched.alone(pattern.size) & ~rows.dragged
        own, T, owns = touched.frames(alone & _alike(touched, pattern), pattern.size)
        border = None if owns.all() else Border.of(touched, ~owns, pattern)
        return Frames(pattern, own, T, _dual(T), *_places(own, pattern), border)

    def turned(self, rows: ContactRows) -> Frames:
        """The frames of rows with the same entries in other directions."""
        touched, before = Touched.of(rows), self.own[:, 0] < self.pattern.size
        _, T, owns = touched.frames(before, self.pattern.size)
        if not np.array_equal(owns, before) or (owns & rows.dragged).any():
            return Frames.of(rows, self.pattern)
        border = self.border and replace(self.border, touched=touched.take(~owns))
        return replace(self, T=T, dual=_dual(T), border=border)

    def largest(self, stiffness: Floats) -> Floats:
        """The largest (c,) of a ``stiffness`` (n + 1,), whose last entry is zero, on each contact's unknowns."""
        out = stiffness[self.own].max(axis=1)
        if self.border is not None:
            touched = self.border.touched
            np.maximum.at(out, touched.contact, stiffness[touched.dof])
        return out

    def reaction(self, residual: Floats) -> Floats:
        """r = T^-T rho (c, d) of the contacts that own their unknowns, from the residual (n,)."""
        return times(self.dual, np.append(residual, 0.0)[self.own])


@dataclass(frozen=True)
class Touched:
    """Unknowns that contacts touch: pairs of ``contact`` and ``dof`` (p,), sorted, with their column of G (p, d)."""

    count: int
    contact: Ints
    dof: Ints
    column: Floats

    @staticmethod
    def of(rows: ContactRows) -> Touched:
        """The pairs of all rows."""
        line, dof, entry = rows.entries
        contact, axis = np.divmod(line, 1 + rows.tangents)
        pairs, inverse = np.unique(contact * rows.size + dof, return_inverse=True)
        column = np.zeros((len(pairs), 1 + rows.tangents))
        column[inverse, axis] = entry
        return Touched(rows.count, *np.divmod(pairs, rows.size), column)

    def alone(self, n: int) -> Bools:
        """Contacts (c,) with at most d unknowns, none of which another contact touches."""
        shared = np.bincount(self.contact, np.bincount(self.dof, minlength=n)[self.dof] > 1, self.count)
        return (shared == 0) & (np.bincount(self.contact, minlength=self.count) <= self.column.shape[1])

    def coupled(self, n: int) -> sp.csc_matrix:
        """The pattern (n, n) of pairs of unknowns that one contact touches, unless these are MANY."""
        few = (np.bincount(self.contact, minlength=self.count) <= MANY)[self.contact]
        touches = sp.csr_matrix((np.ones(few.sum()), (self.contact[few], self.dof[few])), shape=(self.count, n))
        return sp.csc_matrix(touches.T @ touches)

    def frames(self, chosen: Bools, n: int) -> tuple[Ints, Floats, Bools]:
        """Own unknowns (c, d) of ``chosen`` contacts (c,), padded with n, frames T (c, d, d), and who owns any (c,).

        T is G on these unknowns, where rows that do not exist (no friction, held tangents, ghosts) complete it to a
        basis. Contacts that are not chosen, or whose G gives no basis, own nothing and get n and the identity.
        """
        width, pairs = self.column.shape[1], chosen[self.contact]
        contact = self.contact[pairs]
        local = (np.arange(len(self.contact)) - np.searchsorted(self.contact, self.contact))[pairs]
        own = np.full((self.count, width), n, dtype=np.intp)
        own[contact, local] = self.dof[pairs]
        T = np.zeros((self.count, width, width))
        T[contact, :, local] = self.column[pairs]
        T = _completed(T)
        volume = np.abs(np.linalg.det(T / np.linalg.norm(T, axis=2, keepdims=True)))
        owns = chosen & (volume > DEPENDENT)
        own[~owns], T[~owns] = n, np.eye(width)
        return own, T, owns

    def take(self, chosen: Bools) -> Touched:
        """The pairs of the chosen contacts (c,)."""
        pairs = chosen[self.contact]
        return Touched(self.count, self.contact[pairs], self.dof[pairs], self.column[pairs])


@dataclass(frozen=True)
class Border:
    """Contacts (b,) whose forces are unknowns too: [K, -G'; law by motion G, law by force], (n + b d).

    ``touched`` are their unknowns, ``number`` (p,) says which of the b contacts a pair belongs to; ``pattern`` is made
    from the entries of K, of -G', and of the law by motion and by force.
    """

    contact: Ints
    touched: Touched
    number: Ints
    pattern: Pattern

    @staticmethod
    def of(touched: Touched, chosen: Bools, inner: Pattern) -> Border:
        """Border the pattern ``inner`` of K with the chosen contacts (c,)."""
        contact, touched, n = np.flatnonzero(chosen), touched.take(chosen), inner.size
        number, width = np.searchsorted(contact, touched.contact), touched.column.shape[1]
        force = n + np.arange(len(contact) * width).reshape(-1, width)
        inner_row = inner.order[np.repeat(np.arange(n), np.diff(inner.indptr))]
        pair, beside = np.repeat(touched.dof, width), force[number].ravel()
        law_row, law_column = np.repeat(force, width, axis=1).ravel(), np.tile(force, width).ravel()
        row = np.concatenate([inner_row, pair, beside, law_row])
        column = np.concatenate([inner.order[inner.indices], beside, pair, law_column])
        pattern = Pattern.ranked(row, column, _bordered(inner, pair, beside, force.size))
        return Border(contact, touched, number, replace(pattern, panel=inner.panel))

    def factorise(self, data: Floats, law: Law, solver: LinearSolver) -> Factor:
        """Factors with the data (nnz,) of K and the law of all contacts; raises ProgramError where it is singular."""
        G, unit = self.touched.column, law.scale[self.contact] / SOFTENED
        by_motion, by_force = law.by_motion[self.contact], law.by_force[self.contact]
        # A compliance where the law does not depend on the force.
        by_force = (by_force + YIELDING * np.eye(by_force.shape[1]) * (by_force == 0)) * unit[:, None, None]
        acting, moved = -unit[self.number, None] * G, times(by_motion[self.number], G)
        if (by_turn := law.by_turn) is not None:
            turn, slope = by_turn
            turns = self.touched.dof == turn[self.touched.contact]
            moved[turns] += slope[self.touched.contact[turns]]
        entries = np.concatenate([data, acting.ravel(), moved.ravel(), by_force.ravel()])
        return self.pattern.factorise(self.pattern.by_row(entries)[:-1], solver)

    def solve(self, factor: Factor, b: Floats, law: Law, miss: Floats, r: Floats) -> tuple[Floats, Floats]:
        """dx (n,) and the new forces (b, d) from the right-hand side b (n,) of K, and ``miss`` and r (c, d) of the law.

        The unknowns are changes of the forces: where little moves these are small, and so is their round-off in dx.
        """
        contact, touched = self.contact, self.touched
        acting = np.vecdot(touched.column, r[touched.contact])
        b = b + np.bincount(touched.dof, acting, minlength=len(b))
        found = self.pattern.solve(factor, np.concatenate([b, -miss[contact].ravel()]))
        change = found[len(b) :].reshape(len(contact), -1) * (law.scale[contact, None] / SOFTENED)
        return found[: len(b)], r[contact] + change


def _bordered(inner: Pattern, dof: Ints, force: Ints, count: int) -> Ints:
    """Ranks (n + f,) in the elimination of n unknowns and f = ``count`` forces; ``force`` (m,) act on ``dof`` (m,)."""
    n, inner_rank = inner.size, np.argsort(inner.order)
    # A force follows the last unknown on which it acts: it then has a pivot and hardly any fill.
    when = np.concatenate([inner_rank, np.full(count, -1)]).astype(np.float64)
    untouched = np.concatenate([(np.diff(inner.indptr) == 1)[inner_rank], np.zeros(count, dtype=bool)])
    untouched[n - inner.placeless : n] = True
    np.maximum.at(when, force, np.where(untouched[dof], -1, when[dof]) + 0.5)
    # What no element touches, a tool's coordinate, has a pivot only behind the forces that act on it.
    when[untouched] = np.inf
    return np.argsort(np.argsort(when, kind="stable"))


def _completed(T: Floats) -> Floats:
    """Frames T (c, d, d) with unit vectors at a right angle to all others in the place of rows that are zero."""
    missing = ~np.any(T != 0, axis=2)
    # The last right singular vectors span what the rows do not.
    number = T.shape[1] - missing.sum(axis=1, keepdims=True) + np.cumsum(missing, axis=1) - 1
    across = np.take_along_axis(np.linalg.svd(T)[2], np.where(missing, number, 0)[..., None], axis=1)
    return np.where(missing[..., None], across, T)


def _dual(T: Floats) -> Floats:
    """T^-T (c, d, d)."""
    return np.asarray(np.linalg.inv(T), dtype=np.float64).transpose(0, 2, 1)


def _alike(touched: Touched, pattern: Pattern) -> Bools:
    """Contacts (c,) whose unknowns all have the same neighbours in the pattern."""
    at = np.argsort(pattern.order)[touched.dof]
    first = at[np.searchsorted(touched.contact, touched.contact)]
    neighbours = {k: pattern.indices[pattern.indptr[k] : pattern.indptr[k + 1]].tobytes() for k in at.tolist()}
    differ = [neighbours[a] != neighbours[b] for a, b in zip(at.tolist(), first.tolist(), strict=True)]
    out = np.ones(touched.count, dtype=bool)
    out[touched.contact[differ]] = False
    return out


def _places(own: Ints, pattern: Pattern) -> tuple[Ints, Ints, Ints, Ints]:
    """Entries, column, owner and corner of :class:`Frames`; ghosts point behind the data."""
    n, nnz = pattern.size, len(pattern.indices)
    rank = np.append(np.argsort(pattern.order), n)
    lengths = np.append(np.diff(pattern.indptr), 0)
    starts = np.append(pattern.indptr[:-1], nnz)
    position = rank[own]
    length = lengths[position[:, 0]]
    owner = np.repeat(np.arange(len(own)), length)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(length) - length, length)
    entries = np.where((own < n)[owner], starts[position][owner] + within[:, None], nnz).T
    column = np.append(pattern.indices, n)[entries[0]]
    corner = np.full((len(own), own.shape[1], own.shape[1]), nnz)
    at, axis = np.nonzero(column[:, None] == position[owner])
    corner[owner[at], :, axis] = entries[:, at].T
    return entries, pattern.order[column], owner, corner
