r"""The parts of candidates that are means of nodes: the nodes, each of which a curved tool meets by itself.

A mean D of nodes (:mod:`bipot.contact.sampling`) has the gap and the slip

    g_p = sum_k D_pk g(x_k),    w_p = Q_p sum_k D_pk w(x_k),

with the gaps and slips of its nodes, slips in frames transported from that of p to the nodes. On a flat tool g_p is the
gap of the mean position sum_k D_pk x_k. Of a body that lies on a curved tool mean positions are off the surface by the
square of the nodes' distance. Q_p projects a slip on the planes of symmetry, in the tangents of p. Dual to this, node k
takes the force D_pk (r_n, Q_p r_t) in its own frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.typing import Bools, Floats, Ints, einsum


@dataclass(frozen=True)
class Parts:
    """w parts of ``count`` c candidates: sorted ``owner`` (w,), ``weight`` D (w,), and ``within`` Q (c, d-1, d-1).

    Q is the identity if None. If each candidate is a :attr:`single` part, values of parts are those of candidates.
    """

    count: int
    owner: Ints
    weight: Floats
    within: Floats | None = None

    @staticmethod
    def whole(count: int) -> Parts:
        """Candidates that are one part each."""
        return Parts(count, np.arange(count), np.ones(count))

    @cached_property
    def single(self) -> bool:
        """Whether each candidate is one part."""
        return len(self.owner) == self.count

    def gathered(self, values: Floats) -> Floats:
        """sum_k D_pk v_k (c, …) of values (w, …)."""
        if self.single:
            return values
        flat = values.reshape(len(values), -1)
        return np.asarray(self._means @ flat).reshape(self.count, *values.shape[1:])

    def changes(self, measured: Floats) -> Floats:
        """Approximate change (c, d, d) of candidates' motions for these changes (w, d, d) of their parts' motions."""
        out = self.averaged(measured)
        if self.within is None:
            return out
        return np.concatenate([out[:, :1], self.within @ out[:, 1:]], axis=1)

    def averaged(self, values: Floats) -> Floats:
        """sum_k |D_pk| v_k / sum_k |D_pk| (c, …) of values (w, …)."""
        if self.single:
            return values
        weights = abs(self._means)
        share = sp.diags_array(1.0 / np.asarray(weights.sum(axis=1)).ravel()) @ weights
        return np.asarray(share @ values.reshape(len(values), -1)).reshape(self.count, *values.shape[1:])

    def motion(self, motion: Floats) -> Floats:
        """Gap and slip (c, d) of candidates from those of their parts (w, d)."""
        return self._kept(self.gathered(motion))

    def spread(self, r: Floats) -> Floats:
        """Forces (w, d) on parts from forces r (c, d) on candidates."""
        return r if self.single else self.weight[:, None] * self._kept(r)[self.owner]

    def rows(self, frames: Floats) -> Floats:
        """Change (w, d, d) of :meth:`motion`, without D, as parts move along their ``frames`` (w, d, d)."""
        if self.within is None:
            return frames
        return np.concatenate([frames[:, :1], self.within[self.owner] @ frames[:, 1:]], axis=1)

    def sums(self, values: Floats) -> Floats:
        """Sums (c,) of values (w,) over the parts of each candidate."""
        return values if self.single else np.asarray(np.bincount(self.owner, values, self.count), np.float64)

    def any(self, of: Bools) -> Bools:
        """Candidates (c,) with any part ``of`` these (w,)."""
        return of if self.single else np.bincount(self.owner, of, self.count) > 0

    @cached_property
    def first(self) -> Ints:
        """Number (c,) of the first part of each candidate."""
        return np.searchsorted(self.owner, np.arange(self.count))

    def _kept(self, vectors: Floats) -> Floats:
        """Normal and tangential components (c, d), the latter projected by Q."""
        if self.within is None:
            return vectors
        return np.column_stack([vectors[:, :1], einsum("cij,cj->ci", self.within, vectors[:, 1:])])

    @cached_property
    def _means(self) -> sp.csr_matrix:
        """D (c, w)."""
        w = len(self.owner)
        return sp.csr_matrix((self.weight, (self.owner, np.arange(w))), shape=(self.count, w))
