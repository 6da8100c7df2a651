"""Contact candidates as means of nodes: their positions and motions, and the nodal forces of forces on them.

A mean that continues beyond planes of symmetry is one of the whole body: its motion along the planes' normals is
cancelled by its mirror image. In a plane problem such a point does not slip, and in space it slips along the planes
only. The projection ``within`` of its motion is the product of P = I - s s' over the planes, with unit normals s.

Rows give the motion of candidates along their normals or tangents by the unknowns of an increment. The nodes and driven
tools in a row do not change as bodies and tools move: the matrices of all iterates have the same entries, found once,
with different values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.fem.assembly import Space
from bipot.scene.drives import Drives
from bipot.tensors import norm
from bipot.tools.parts import Parts
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints, einsum, read_only


@dataclass(frozen=True)
class Means:
    """Candidates with ``weights`` D (c, a), and ``within`` P (c, d, d), None if no mean continues beyond a plane."""

    weights: sp.csr_matrix
    within: Floats | None = None

    @staticmethod
    def of(nodes: int, weights: Sequence[sp.csr_matrix], within: Sequence[Floats]) -> Means:
        """All these ``weights`` and ``within`` one after the other, in a mesh with this number of ``nodes``."""
        every = sp.csr_matrix(sp.vstack([sp.csr_matrix((0, nodes)), *weights]))
        every.data = read_only(every.data, np.float64)
        mirrored = any((P != np.eye(P.shape[-1])).any() for P in within)
        return Means(every, np.concatenate(within) if mirrored else None)

    @property
    def count(self) -> int:
        """Number c of candidates."""
        return int(self.weights.get_shape()[0])

    def places(self, nodes: Floats) -> Floats:
        """The candidates' positions (c, d) for nodes (a, d), in means over the modelled part of the body."""
        return np.asarray(self.weights @ nodes)

    def motion(self, nodal: Floats) -> Floats:
        """The candidates' displacements (c, d) for those of nodes (a, d)."""
        return self.kept(np.asarray(self.weights @ nodal))

    def nodal(self, vectors: Floats) -> Floats:
        """Forces on nodes (a, d) by forces (c, d) on the candidates."""
        return np.asarray(self._spread @ self.kept(vectors))

    def kept(self, vectors: Floats) -> Floats:
        """Vectors (c, d) projected on the planes of symmetry, zero where the result is round-off."""
        if self.within is None:
            return vectors
        kept = einsum("cij,cj->ci", self.within, vectors)
        return np.where(np.abs(kept) > ACROSS * norm(vectors)[:, None], kept, 0.0)

    @cached_property
    def owner(self) -> Ints:
        """The candidate (w,) of each entry of the weights."""
        return np.repeat(np.arange(self.count), np.diff(self.weights.indptr))

    @cached_property
    def nodes(self) -> Ints:
        """The node (w,) of each entry of the weights."""
        return np.asarray(self.weights.indices, np.intp)

    def apart(self) -> Means:
        """The nodes (w,) of these means one by one, in the order of the weights' entries."""
        count = len(self.owner)
        entries = np.ones(count), self.weights.indices, np.arange(count + 1)
        return Means(sp.csr_matrix(entries, (count, self.weights.get_shape()[1])))

    def parts(self, frames: Floats) -> Parts:
        """How the nodes of :meth:`apart` make up these means, with slips along the tangents of ``frames`` (c, d, d)."""
        tangents = frames[:, 1:]
        within = None if self.within is None else tangents @ self.within @ tangents.swapaxes(1, 2)
        return Parts(self.count, self.owner, np.asarray(self.weights.data, np.float64), within)

    @cached_property
    def _spread(self) -> sp.csr_matrix:
        """The weights' transpose (a, c)."""
        return sp.csr_matrix(self.weights.T)


@dataclass(frozen=True, kw_only=True)
class Operator:
    """Rows sum_k D_k direction_k . (dU_k - dU_tool) of m ``means``, with a direction per entry of their weights D.

    Columns are the unknowns (n,) of the ``space``; held nodes and tools' paths are not among them. A row has an entry
    for each coordinate of its tool that ``drives`` move: l in all, for ``coordinate`` (l,). Such an entry sums over the
    row's entries of D: ``seen`` (s,) are these, and ``led`` (s,) is which of the l each belongs to. Of all w d + l
    entries ``chosen`` (z,) are those of the matrix, in rows by ``indices`` (z,) and ``indptr`` (m + 1,).
    """

    space: Space
    drives: Drives
    means: Means
    coordinate: Ints
    seen: Ints
    led: Ints
    chosen: Ints
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]

    @staticmethod
    def of(space: Space, drives: Drives, means: Means, sees: Bools) -> Operator:
        """The operator of m ``means``; ``sees`` (u, m) says which of u coordinates move the tool of which mean."""
        weights, m, d = means.weights, means.count, space.mesh.dimension
        coordinate, rows = np.nonzero(sees)
        row = np.concatenate([np.repeat(means.owner, d), rows])
        moved = space.position[d * means.nodes[:, None] + np.arange(d)].ravel()
        column = np.concatenate([moved, len(space.free) + coordinate])
        order = np.lexsort((column, row))
        chosen = order[column[order] >= 0]
        return Operator(
            space=space,
            drives=drives,
            means=means,
            coordinate=coordinate,
            seen=_entries(weights, rows),
            led=np.repeat(np.arange(len(rows)), np.diff(weights.indptr)[rows]),
            chosen=chosen,
            indices=read_only(column[chosen], np.int32),
            indptr=read_only(np.cumsum([0, *np.bincount(row[chosen], minlength=m)]), np.int32),
        )

    def matrix(self, direction: Floats, arm: Floats) -> sp.csr_matrix:
        """Rows (m, n) along ``direction`` (w, d), with the ``arm`` (w, d) on the tool; zeros are stored like others."""
        data, seen = self.means.weights.data, self.seen
        gone = self.drives.motion(self.coordinate[self.led], arm[seen])
        by_tool = -np.bincount(self.led, data[seen] * np.vecdot(direction[seen], gone), len(self.coordinate))
        by_tool[np.abs(by_tool) <= ACROSS] = 0.0
        along = self.space.axes.at(self.means.nodes, direction)
        entries = np.concatenate([(data[:, None] * along).ravel(), by_tool])
        shape = len(self.indptr) - 1, self.space.size
        return sp.csr_matrix((entries[self.chosen], self.indices, self.indptr), shape=shape)


@dataclass(frozen=True)
class Operators:
    """Operators along the normals of c candidates, and along their tangents, candidate by candidate.

    Entry by entry of the weights of ``tangents``, ``entry`` (z,) is that of ``means`` and ``tangent`` (z,) its number.
    """

    means: Means
    normal: Operator
    tangents: Operator
    entry: Ints
    tangent: Ints

    @staticmethod
    def of(space: Space, drives: Drives, means: Means, sees: Bools) -> Operators:
        """The operators of candidates that are c ``means``; for ``sees`` (u, c) see :meth:`Operator.of`."""
        tangents = space.mesh.dimension - 1
        across = np.repeat(np.arange(means.count), tangents)
        repeated = Means(sp.csr_matrix(means.weights[across]))
        return Operators(
            means,
            Operator.of(space, drives, means, sees),
            Operator.of(space, drives, repeated, sees[:, across]),
            _entries(means.weights, across),
            repeated.owner % tangents,
        )

    def matrices(self, frames: Floats, arm: Floats, parts: Parts) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal rows (c, n) and tangential ones (c (d - 1), n) by the parts' ``frames`` (w, d, d) and ``arm`` (w, d).

        Where parts are the candidates themselves, all nodes of a mean have its frame.
        """
        if parts.single:
            kept = [self.means.kept(along) for along in frames.swapaxes(0, 1)]
            frames, arm = np.stack(kept, axis=1)[self.means.owner], arm[self.means.owner]
        else:
            frames = parts.rows(frames)
        tangents = frames[self.entry, 1 + self.tangent]
        return self.normal.matrix(frames[:, 0], arm), self.tangents.matrix(tangents, arm[self.entry])


def _entries(weights: sp.csr_matrix, rows: Ints) -> Ints:
    """The entries of the ``rows``, one row after the other."""
    first, count = weights.indptr[rows], np.diff(weights.indptr)[rows]
    return np.arange(count.sum()) + np.repeat(first - np.cumsum(count) + count, count)


def without_zeros(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """The ``matrix`` without stored zeros."""
    out = matrix.copy()
    out.eliminate_zeros()
    return out
