"""Contact rows, units, and the names of a mechanical program's terms and variables."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.laws.coulomb import force_threshold, limit, limit_slope
from bipot.typing import Bools, Floats, Ints


class Term(StrEnum):
    """The mechanical terms that contribute rows; they name the duals of a solution."""

    GAP = "gap"
    FRICTION = "friction"
    COULOMB = "coulomb"
    TIE = "tie"
    YIELD = "yield"
    FICTITIOUS = "fictitious"
    LAG = "lag"
    GAIN = "gain"
    VOLUME = "volume"


class Block(StrEnum):
    """The named variable blocks of a program."""

    DISPLACEMENT = "dU"
    ELASTIC_DEVIATOR = "elastic_deviator"
    PLASTIC_NORM = "plastic_norm"
    SLIP_BOUND = "slip_bound"
    FICTITIOUS_GAP = "fictitious_gap"
    FICTITIOUS_SLIP = "fictitious_slip"
    LAG = "lag"


@dataclass
class Stopwatch:
    """Sums the seconds spent inside its ``with`` blocks, which do not nest."""

    seconds: float = 0.0
    _began: float = field(default=0.0, init=False, repr=False)

    def __enter__(self) -> None:
        """Start."""
        self._began = time.perf_counter()

    def __exit__(self, *raised: object) -> None:
        """Stop, also when something was raised."""
        self.seconds += time.perf_counter() - self._began

    def outside(self) -> float:
        """A clock (s) that stops inside the blocks."""
        return time.perf_counter() - self.seconds


@dataclass(frozen=True)
class Units:
    """The units of a dimensionless program: increment length, body size, stress and body volume."""

    length: float
    size: float
    stress: float
    volume: float

    @property
    def strain(self) -> float:
        """length / size."""
        return self.length / self.size

    @property
    def force(self) -> float:
        """stress volume / size, so that energy = force length = stress strain volume."""
        return self.stress * self.volume / self.size


@dataclass(frozen=True)
class ContactRows:
    """Affine contact operators of c candidates, f of them with friction rows, on n unknowns dU.

    Gap at the end ``gap + G_n dU`` (c,), slip ``slip + G_t dU`` (f, d-1); ``frictional`` (f,) numbers the
    candidates with friction rows, ``mu`` (c,), ``cap`` (c,) the largest friction force, inf where there is none,
    ``tied`` (c,) marks welded points (gap and slip are equalities).
    """

    G_n: sp.csr_matrix
    gap: Floats
    G_t: sp.csr_matrix
    slip: Floats
    frictional: Ints
    mu: Floats
    cap: Floats
    tied: Bools

    @property
    def count(self) -> int:
        """Number c of candidates."""
        return len(self.gap)

    @property
    def size(self) -> int:
        """Number n of unknowns."""
        return int(np.asarray(self.G_n.shape)[1])

    @property
    def tangents(self) -> int:
        """d - 1."""
        return self.slip.shape[1]

    @cached_property
    def rubs(self) -> Bools:
        """Which candidates have friction rows (c,)."""
        out = np.zeros(self.count, dtype=bool)
        out[self.frictional] = True
        return out

    @cached_property
    def capped(self) -> bool:
        """Whether friction is capped anywhere, so that the law is not Coulomb's."""
        return bool(np.isfinite(self.cap).any())

    @cached_property
    def rubbing(self) -> Floats:
        """Coefficients (c,) where Coulomb's law governs the tangential motion, zero elsewhere and where tied."""
        return np.where(self.rubs & ~self.tied, self.mu, 0.0)

    @cached_property
    def dragged(self) -> Bools:
        """Which candidates (c,) slip along a tangent along which no unknown moves them: they slide if they are closed.

        In space a support may hold one tangent, along which the tool moves, and leave the other free.
        """
        out = np.zeros(self.count, dtype=bool)
        out[self.frictional] = (self._held & (self.slip != 0)).any(axis=1)
        return out

    @cached_property
    def idle(self) -> Bools:
        """Components (c, d) of friction along which nothing slips, whatever the unknowns: the law leaves them open."""
        out = np.zeros((self.count, 1 + self.tangents), dtype=bool)
        out[self.frictional, 1:] = self._held & (self.slip == 0)
        return out

    @cached_property
    def told(self) -> Bools:
        """Components (c, d) of contact forces of which unknowns or the law of friction tell something; others are none.

        Unlike all others, friction between a tool and a support that it slips along is told by the law alone.
        """
        out = np.ones((self.count, 1 + self.tangents), dtype=bool)
        out[~self.rubs, 1:] = False
        return out & ~self.idle

    @cached_property
    def _held(self) -> Bools:
        """Slips (f, d-1) that no unknown moves."""
        lines = np.repeat(np.arange(self.slip.size), np.diff(self.G_t.indptr))
        return np.bincount(lines, np.abs(self.G_t.data), self.slip.size).reshape(self.slip.shape) == 0

    def take(self, chosen: Bools) -> ContactRows:
        """The rows of the chosen candidates (c,) only."""
        if chosen.all():
            return self
        kept = chosen[self.frictional]
        return ContactRows(
            rows_of(self.G_n, chosen),
            self.gap[chosen],
            rows_of(self.G_t, np.repeat(kept, self.tangents)),
            self.slip[kept],
            (np.cumsum(chosen) - 1)[self.frictional[kept]],
            self.mu[chosen],
            self.cap[chosen],
            self.tied[chosen],
        )

    def columns(self, dofs: Ints) -> ContactRows:
        """The same rows on the unknowns ``dofs`` only, which must include every one they touch."""
        number = np.zeros(self.size, dtype=np.intp)
        number[dofs] = np.arange(len(dofs))
        G_n, G_t = (
            sp.csr_matrix((G.data, number[G.indices], G.indptr), shape=(len(G.indptr) - 1, len(dofs)))
            for G in (self.G_n, self.G_t)
        )
        return replace(self, G_n=G_n, G_t=G_t)

    def scaled(self, units: Units) -> ContactRows:
        """Gap and slip in ``units.length``, caps in ``units.force``."""
        length = units.length
        return replace(self, gap=self.gap / length, slip=self.slip / length, cap=self.cap / units.force)

    def motion(self, x: Floats) -> Floats:
        """(g + du_n, du_t) (c, d), zero tangential part where there is no friction row."""
        row, column, entry = self.entries
        moved = np.bincount(row, entry * x[column], minlength=self._still.size)
        return self._still + moved.reshape(self._still.shape)

    def forces(self, r: Floats) -> Floats:
        """G_n^T r_n + G_t^T r_t (n,): contact forces r (c, d) on the unknowns."""
        row, column, entry = self.entries
        return np.asarray(np.bincount(column, entry * r.ravel()[row], minlength=self.size), dtype=np.float64)

    @cached_property
    def _still(self) -> Floats:
        """The motion (c, d) at dU = 0."""
        out = np.zeros((self.count, 1 + self.tangents))
        out[:, 0], out[self.frictional, 1:] = self.gap, self.slip
        return out

    @cached_property
    def entries(self) -> tuple[Ints, Ints, Floats]:
        """Row in the motion (c, d) as one vector, unknown and value (nnz,) of every entry of G_n and G_t.

        Sums over these are faster than products with two such small matrices and their transposes.
        """
        width = 1 + self.tangents
        normal = np.repeat(width * np.arange(self.count), np.diff(self.G_n.indptr))
        lines = (width * self.frictional[:, None] + np.arange(1, width)).ravel()
        row = np.concatenate([normal, np.repeat(lines, np.diff(self.G_t.indptr))])
        column = np.concatenate([self.G_n.indices, self.G_t.indices], dtype=np.intp)
        entry: Floats = np.concatenate([self.G_n.data, self.G_t.data], dtype=np.float64)
        return row, column, entry

    def limit(self, r: Floats) -> Floats:
        """Largest friction force min(mu r_n, cap) (c,) for forces r (c, d) of all these candidates; inf where tied."""
        return np.where(self.tied, np.inf, limit(r[:, 0], self._unwelded, self.cap, force_threshold(r)))

    def limit_slope(self, r: Floats) -> Floats:
        """Derivative (c,) of :meth:`limit` by r_n."""
        return limit_slope(r[:, 0], self._unwelded, self.cap)

    @cached_property
    def _unwelded(self) -> Floats:
        """The coefficients (c,), zero of welds (mu = inf without a cap): before they form nothing rubs."""
        return np.where(np.isinf(self.mu) & np.isinf(self.cap), 0.0, self.mu)

    def threshold(self, r: Floats) -> Floats:
        """Threshold s (f,) of the friction rows: :meth:`limit`, but never negative; inf where tied."""
        return np.maximum(self.limit(r)[self.frictional], 0.0)

    def shift(self, x: Floats) -> Floats:
        """De Saxce's shift mu |w_t + G_t dU| (f,) at displacement x (n,); 0 where tied."""
        length = np.linalg.norm(self.motion(x)[self.frictional, 1:], axis=1)
        return np.where(self.tied[self.frictional], 0.0, self.mu[self.frictional]) * length


def rows_of(G: sp.csr_matrix, chosen: Bools) -> sp.csr_matrix:
    """G[chosen] (m,), without the cost of a general index, and without a copy if all are chosen."""
    if chosen.all():
        return G
    lengths = np.diff(G.indptr)
    kept = np.repeat(chosen, lengths)
    ends = np.concatenate([[0], np.cumsum(lengths[chosen])])
    width = G.get_shape()[1]
    return sp.csr_matrix((G.data[kept], G.indices[kept], ends), shape=(len(ends) - 1, width))
