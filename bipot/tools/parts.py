r"""Nodes that candidates are means of, one by one, as curved tools meet them.

A mean D of nodes (:mod:`bipot.contact.sampling`) has the gap and the slip

    g_p = sum_k D_pk g(x_k),    w_p = Q_p sum_k D_pk w(x_k),

of its nodes at the tool, the slips in frames that are carried to the nodes from that of p. At a flat tool that is the
gap of the mean place, sum_k D_pk x_k; at a curved one mean places of a body that lies on it are off it by the square of
their distance. Q_p is what planes of symmetry leave of a slip, in the tangents of p. Dual to it, node k takes the force
D_pk (r_n, Q_p r_t), in its own frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.typing import Bools, Floats, Ints


@dataclass(frozen=True)
class Parts:
    """w nodes of ``count`` c candidates: ``owner`` (w,), in order, ``weight`` D (w,), and Q, ``within`` (c, d-1, d-1).

    None for Q is the identity. Where each candidate is :attr:`single`, what is asked of parts is that of candidates.
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
        """What motions of candidates change by (c, d, d) where those of their parts do by these (w, d, d), about."""
        out = self.averaged(measured)
        if self.within is None:
            return out
        return np.concatenate([out[:, :1], self.within @ out[:, 1:]], axis=1)

    def averaged(self, values: Floats) -> Floats:
        """The same by |D|, over their sum."""
        if self.single:
            return values
        size = abs(self._means)
        share = sp.diags_array(1.0 / np.asarray(size.sum(axis=1)).ravel()) @ size
        return np.asarray(share @ values.reshape(len(values), -1)).reshape(self.count, *values.shape[1:])

    def motion(self, motion: Floats) -> Floats:
        """Gap and slip (c, d) of those of parts (w, d)."""
        return self._kept(self.gathered(motion))

    def spread(self, r: Floats) -> Floats:
        """What parts (w, d) take of forces r (c, d) on candidates."""
        return r if self.single else self.weight[:, None] * self._kept(r)[self.owner]

    def rows(self, frames: Floats) -> Floats:
        """What :meth:`motion` changes by (w, d, d), without D, as parts do along their ``frames`` (w, d, d)."""
        if self.within is None:
            return frames
        return np.concatenate([frames[:, :1], self.within[self.owner] @ frames[:, 1:]], axis=1)

    def sums(self, values: Floats) -> Floats:
        """Sums (c,) of the values (w,) of their parts."""
        return values if self.single else np.asarray(np.bincount(self.owner, values, self.count), np.float64)

    def any(self, of: Bools) -> Bools:
        """Candidates (c,) of which any part (w,) is one ``of`` these."""
        return of if self.single else np.bincount(self.owner, of, self.count) > 0

    @cached_property
    def first(self) -> Ints:
        """A part of each candidate (c,)."""
        return np.searchsorted(self.owner, np.arange(self.count))

    def _kept(self, vectors: Floats) -> Floats:
        """Normal and tangential components (c, d), of which Q is left."""
        if self.within is None:
            return vectors
        return np.column_stack([vectors[:, :1], np.einsum("cij,cj->ci", self.within, vectors[:, 1:])])

    @cached_property
    def _means(self) -> sp.csr_matrix:
        """D (c, w)."""
        w = len(self.owner)
        return sp.csr_matrix((self.weight, (self.owner, np.arange(w))), shape=(self.count, w))
