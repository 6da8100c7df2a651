"""Contact candidates as means of nodes: their positions and motions, and the forces on nodes by forces on them.

A mean that continues beyond planes of symmetry is that of the whole body: its motion along their normals is cancelled
by that of its mirror image. In a plane problem such a point does not slip, and in space it slips along the planes only.
The projection ``within`` of its motion is the product of P = I - s s' over the planes, with unit normals s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.tensors import norm
from bipot.tools.parts import Parts
from bipot.tools.surfaces import ACROSS
from bipot.typing import Floats, Ints, einsum


@dataclass(frozen=True)
class Means:
    """Candidates with ``weights`` D (c, a), and ``within`` P (c, d, d), None if no mean continues beyond a plane."""

    weights: sp.csr_matrix
    within: Floats | None = None

    @staticmethod
    def of(nodes: int, weights: Sequence[sp.csr_matrix], within: Sequence[Floats]) -> Means:
        """Those with all these ``weights`` of a mesh of so many ``nodes``, one behind the other, and ``within``."""
        every = sp.csr_matrix(sp.vstack([sp.csr_matrix((0, nodes)), *weights]))
        mirrored = any((P != np.eye(P.shape[-1])).any() for P in within)
        return Means(every, np.concatenate(within) if mirrored else None)

    @property
    def count(self) -> int:
        """Number c of candidates."""
        return int(self.weights.get_shape()[0])

    def places(self, nodes: Floats) -> Floats:
        """The candidates' positions (c, d) for nodes (a, d), by the modelled part of the body."""
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
        """Entry by entry of the weights the candidate (w,)."""
        return np.repeat(np.arange(self.count), np.diff(self.weights.indptr))

    def apart(self) -> Means:
        """The nodes (w,) of these means one by one, entry by entry of the weights."""
        count = len(self.owner)
        entries = np.ones(count), self.weights.indices, np.arange(count + 1)
        return Means(sp.csr_matrix(entries, (count, self.weights.get_shape()[1])))

    def parts(self, frames: Floats) -> Parts:
        """How those of :meth:`apart` make up these; symmetry leaves slips by the tangents of ``frames`` (c, d, d)."""
        tangents = frames[:, 1:]
        within = None if self.within is None else tangents @ self.within @ tangents.swapaxes(1, 2)
        return Parts(self.count, self.owner, np.asarray(self.weights.data, np.float64), within)

    @cached_property
    def _spread(self) -> sp.csr_matrix:
        """The weights' transpose (a, c)."""
        return sp.csr_matrix(self.weights.T)
