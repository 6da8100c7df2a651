"""Problems of order one: each contact in units of its own, then all loads in the length of the load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from bipot.coulomb.definite import by_units
from bipot.coulomb.problem import Affine, CoulombProblem, column_count
from bipot.typing import Floats, Ints

# Above this many rows and below this filling a sparse factorisation beats a dense one.
DENSE_ROWS = 300
DENSE_FILLING = 0.2


@dataclass(frozen=True, eq=False)
class Blocks:
    """W by contacts: ``data`` (k, d, d) at contact ``row`` and ``column`` (k,), sorted by row; ``diagonal``
    (c,) says where.

    Every diagonal block is there, zero or not.
    """

    data: Floats
    row: Ints
    column: Ints
    diagonal: Ints


def blocks(W: sparse.csr_array, dim: int) -> Blocks:
    """Gather the entries of W (dc, dc) into blocks."""
    c = column_count(W) // dim
    entries = sparse.coo_array(W)
    row, column = entries.coords[0] // dim, entries.coords[1] // dim
    each = np.arange(c)
    keys, place = np.unique(np.r_[row * c + column, each * (c + 1)], return_inverse=True)
    data = np.zeros((keys.size, dim, dim))
    inside = entries.coords[0] % dim, entries.coords[1] % dim
    np.add.at(data, (place[: row.size], *inside), entries.data)
    return Blocks(data, keys // c, keys % c, place[row.size :])


@dataclass(frozen=True, eq=False)
class ScaledProblem(Affine):
    """Scaled problem u' = W' r' + q' with r = force r', u = length u' row by row: |q'| = 1, each contact's mean
    diagonal of W' is 1.

    With w the mean diagonal of a contact's block (its unit squared), force = β/√w and length = β √w,
    β = |q/√w|. Each is the same for all rows of a contact and K_mu is a cone, so the law does not change.
    ``W`` is dense where dense algebra is faster; ``blocks`` are those of a sparse W, None for a dense one.
    """

    W: Floats | sparse.csr_array
    q: Floats
    mu: Floats
    dim: int
    force: Floats
    length: Floats
    blocks: Blocks | None

    def unscale(self, r: Floats) -> Floats:
        """Force in the units of the problem it came from."""
        return self.force * r


def scale(problem: CoulombProblem) -> ScaledProblem:
    """The problem in its own units; |q| counts as 1 where q = 0."""
    unit = np.repeat(problem.contact_unit, problem.dim)
    q = problem.q / unit
    size = float(np.linalg.norm(q)) or 1.0
    W = by_units(problem.W, unit)
    small = problem.size <= DENSE_ROWS or W.nnz > DENSE_FILLING * problem.size**2
    pieces = None if small else blocks(W, problem.dim)
    dense = W.toarray() if small else W
    return ScaledProblem(dense, q / size, problem.mu, problem.dim, size / unit, size * unit, pieces)
