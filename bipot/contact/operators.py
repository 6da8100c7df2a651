"""Rows of candidates along their normals or tangents, by the unknowns of an increment.

Which nodes and which driven tools a row is of does not change as bodies and tools move: a matrix made anew at an
iterate has the entries of the last one, found once, with other numbers in them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.contact.means import Means
from bipot.fem.assembly import Space
from bipot.scene.drives import Drives
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints, read_only


@dataclass(frozen=True, kw_only=True)
class Operator:
    """Rows ``direction . (dU_point - dU_tool)`` of m directions, of points that are ``means`` of nodes.

    By the unknowns (n,) of the ``space``: held nodes and what paths prescribe of tools are apart. Entry by entry of
    the weights, ``owner`` (w,) is its row; coordinate by coordinate of the tools that ``drives`` move, ``led`` (l,) is
    a row that sees it and ``coordinate`` (l,) which it is. Of these w d + l entries ``chosen`` (z,) are those of the
    matrix, row by row as ``indices`` (z,) and ``indptr`` (m + 1,) say.
    """

    space: Space
    drives: Drives
    means: Means
    owner: Ints
    led: Ints
    coordinate: Ints
    chosen: Ints
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]

    @staticmethod
    def of(space: Space, drives: Drives, means: Means, sees: Bools) -> Operator:
        """That of m ``means``; ``sees`` (u, m) says whose tool has which coordinate."""
        weights, m, d = means.weights, means.count, space.mesh.dimension
        owner = np.repeat(np.arange(m), np.diff(weights.indptr))
        coordinate, led = np.nonzero(sees)
        row = np.concatenate([np.repeat(owner, d), led])
        moved = space.position[d * weights.indices[:, None] + np.arange(d)].ravel()
        column = np.concatenate([moved, len(space.free) + coordinate])
        order = np.lexsort((column, row))
        chosen = order[column[order] >= 0]
        return Operator(
            space=space,
            drives=drives,
            means=means,
            owner=owner,
            led=led,
            coordinate=coordinate,
            chosen=chosen,
            indices=read_only(column[chosen], np.int32),
            indptr=read_only(np.cumsum([0, *np.bincount(row[chosen], minlength=m)]), np.int32),
        )

    def matrix(self, direction: Floats, arm: Floats) -> sp.csr_matrix:
        """Rows (m, n) along ``direction`` (m, d), of tools seen at ``arm`` (m, d); zeros are entries like others."""
        by_tool = -np.vecdot(direction[self.led], self.drives.motion(self.coordinate, arm[self.led]))
        by_tool[np.abs(by_tool) <= ACROSS] = 0.0
        weights, kept = self.means.weights, self.means.kept(direction)
        along = self.space.axes.at(np.asarray(weights.indices, np.intp), kept[self.owner])
        entries = np.concatenate([(weights.data[:, None] * along).ravel(), by_tool])
        shape = len(direction), self.space.size
        return sp.csr_matrix((entries[self.chosen], self.indices, self.indptr), shape=shape)


@dataclass(frozen=True)
class Operators:
    """Those along the normals of c candidates, and along their tangents, candidate by candidate."""

    normal: Operator
    tangents: Operator

    @staticmethod
    def of(space: Space, drives: Drives, means: Means, sees: Bools) -> Operators:
        """Those of candidates that are c ``means``; ``sees`` (u, c) says whose tool has which coordinate."""
        tangents = space.mesh.dimension - 1
        across = np.repeat(np.arange(means.count), tangents)
        return Operators(
            Operator.of(space, drives, means, sees),
            Operator.of(space, drives, means.repeated(tangents), sees[:, across]),
        )

    def matrices(self, frames: Floats, arm: Floats) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal rows (c, n) and tangential ones (c (d - 1), n) in ``frames`` (c, d, d), of tools at ``arm`` (c, d)."""
        d = frames.shape[-1]
        across = np.repeat(arm, d - 1, axis=0)
        return self.normal.matrix(frames[:, 0], arm), self.tangents.matrix(frames[:, 1:].reshape(-1, d), across)


def without_zeros(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """The same without the entries that are zero."""
    out = matrix.copy()
    out.eliminate_zeros()
    return out
