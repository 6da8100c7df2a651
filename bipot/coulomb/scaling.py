"""Problems of order one: forces in units of rho |q|, displacements in units of |q|."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from bipot.coulomb.problem import CoulombProblem, columns
from bipot.laws.tensors import FloatArray

# Above this many rows and below this filling a sparse factorisation beats a dense one.
DENSE_ROWS = 300
DENSE_FILLING = 0.2


@dataclass(frozen=True, eq=False)
class Blocks:
    """W by contacts: ``data`` (k, d, d) at contact ``row`` and ``column`` (k,), sorted by row; ``diagonal``
    (c,) says where.

    Every diagonal block is there, zero or not.
    """

    data: FloatArray
    row: NDArray[np.intp]
    column: NDArray[np.intp]
    diagonal: NDArray[np.intp]


def blocks(W: sparse.csr_array, dim: int) -> Blocks:
    """Gather the entries of W (dc, dc) into blocks."""
    c = columns(W) // dim
    entries = sparse.coo_array(W)
    row, column = entries.coords[0] // dim, entries.coords[1] // dim
    each = np.arange(c)
    keys, place = np.unique(np.r_[row * c + column, each * (c + 1)], return_inverse=True)
    data = np.zeros((keys.size, dim, dim))
    inside = entries.coords[0] % dim, entries.coords[1] % dim
    np.add.at(data, (place[: row.size], *inside), entries.data)
    return Blocks(data, keys // c, keys % c, place[row.size :])


@dataclass(frozen=True, eq=False)
class ScaledProblem:
    """Scaled problem u' = W' r' + q' with W' = rho W, q' = q/|q|, r = rho |q| r', u = |q| u'; rho = d c /
    trace W.

    K_mu is a cone, so the law does not change. ``W`` is dense where dense algebra is faster; ``blocks`` are
    those of a sparse W, None for a dense one.
    """

    W: FloatArray | sparse.csr_array
    q: FloatArray
    mu: FloatArray
    dim: int
    force: float
    length: float
    blocks: Blocks | None

    @property
    def size(self) -> int:
        """Number of contact rows, d c."""
        return self.q.size

    def by_contact(self, vector: FloatArray) -> FloatArray:
        """(dc,) -> (c, d)."""
        return vector.reshape(-1, self.dim)

    def velocity(self, r: FloatArray) -> FloatArray:
        """Scaled W' r' + q', (dc,)."""
        return self.W @ r + self.q

    def unscale(self, r: FloatArray) -> FloatArray:
        """Force in the units of the problem it came from."""
        return self.force * r


def scale(problem: CoulombProblem) -> ScaledProblem:
    """The problem in its own units; |q| counts as 1 where q = 0."""
    length = float(np.linalg.norm(problem.q)) or 1.0
    rho = problem.force_scale
    W = sparse.csr_array(problem.W * rho)
    small = problem.size <= DENSE_ROWS or W.nnz > DENSE_FILLING * problem.size**2
    pieces = None if small else blocks(W, problem.dim)
    q, force = problem.q / length, rho * length
    return ScaledProblem(W.toarray() if small else W, q, problem.mu, problem.dim, force, length, pieces)
