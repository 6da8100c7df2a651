"""Projected Gauss-Seidel, the standard method of the field: contact by contact, here colour by colour.

Contacts of one colour are not coupled by W, so a sweep over the colours is a Gauss-Seidel sweep in that order, with
whole colours updated at once. Where W is nearly full there are as many colours as contacts and a sweep is slow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from bipot.coulomb.problem import column_count
from bipot.coulomb.solver import ScaledProblem, SolverState
from bipot.errors import require_count
from bipot.laws import coulomb
from bipot.laws.projections import project_cone
from bipot.typing import Floats, Ints, einsum, make_floats


@dataclass(frozen=True, eq=False)
class Colour:
    """Contacts that are not coupled: their ``dofs`` (k, d), rows of W (k d, dc), blocks (k, d, d), step, mu (k,)."""

    dofs: Ints
    rows: sparse.csr_array
    blocks: Floats
    step: Floats
    mu: Floats


@dataclass(frozen=True, eq=False)
class SweepState(SolverState):
    """Force after the last sweep, and the colours, made once."""

    r: Floats
    colours: tuple[Colour, ...]


def neighbours(W: sparse.csr_array, dim: int) -> sparse.csr_array:
    """Which contacts are coupled by W: symmetric pattern (c, c), diagonal included."""
    i, j = W.nonzero()
    c = column_count(W) // dim
    pairs = np.unique(np.stack([np.r_[i, j], np.r_[j, i]]) // dim, axis=1)
    i, j = np.hstack([pairs, np.tile(np.arange(c), (2, 1))])
    return sparse.csr_array(sparse.coo_array((np.ones(i.size), (i, j)), shape=(c, c)))


def colouring(touching: sparse.csr_array) -> Ints:
    """Colour of each contact, (c,), no two neighbours alike: the local maxima of a fixed random order, peeled off."""
    c = column_count(touching)
    rank = np.random.default_rng(0).permutation(c) + 1.0
    colour = np.full(c, -1, dtype=np.intp)
    current = 0
    while np.any(colour < 0):
        active = np.where(colour < 0, rank, 0.0)
        highest = np.maximum.reduceat(active[touching.indices], touching.indptr[:-1])
        colour[(colour < 0) & (active == highest)] = current
        current += 1
    return colour


def _colour(problem: ScaledProblem, W: sparse.csr_array, contacts: Ints) -> Colour:
    d = problem.dim
    dofs = contacts[:, None] * d + np.arange(d)
    rows = sparse.csr_array(W[dofs.ravel()])
    i, j = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
    blocks = np.asarray(W[i.ravel(), j.ravel()]).reshape(-1, d, d)
    size = np.linalg.norm(blocks, ord=2, axis=(1, 2))
    return Colour(dofs, rows, blocks, 1.0 / np.where(size > 0, size, 1.0), problem.mu[contacts])


@dataclass(frozen=True)
class GaussSeidel:
    """r_c <- P_K(r_c - ρ_c (u_c + μ |u_t,c| n)), ρ_c = 1/|W_cc|, ``local`` times for each contact in turn.

    local = 1 is the projected Gauss-Seidel of the literature; more solves the contact's own problem better.
    ``relaxation`` in (0, 2) extrapolates each contact's update; ``sweeps`` are done a step.
    """

    local: int = 5
    relaxation: float = 1.0
    sweeps: int = 10
    name = "gauss-seidel"

    def __post_init__(self) -> None:
        require_count(self.local, "local")
        require_count(self.sweeps, "sweeps")
        make_floats(self, relaxation="in (0, 2)")

    def init(self, problem: ScaledProblem, r: Floats) -> SweepState:
        """Colour the contacts."""
        W = sparse.csr_array(problem.W)
        colour = colouring(neighbours(W, problem.dim))
        groups = [np.flatnonzero(colour == k) for k in range(colour.max() + 1)]
        return SweepState(r, tuple(_colour(problem, W, contacts) for contacts in groups))

    def _update(self, problem: ScaledProblem, colour: Colour, r: Floats) -> None:
        """Replace the forces of one colour in r (dc,)."""
        old = r[colour.dofs]
        free = (colour.rows @ r).reshape(old.shape) + problem.q[colour.dofs]
        new = old
        for _ in range(self.local):
            u = free + einsum("cij,cj->ci", colour.blocks, new - old)
            new = project_cone(new - colour.step[:, None] * coulomb.de_saxce_shift(u, colour.mu), colour.mu)
        relaxed = old + self.relaxation * (new - old)
        r[colour.dofs] = new if self.relaxation == 1 else project_cone(relaxed, colour.mu)

    def step(self, problem: ScaledProblem, state: SweepState) -> SweepState:
        """``sweeps`` sweeps over all colours."""
        r = state.r.copy()
        for _ in range(self.sweeps):
            for colour in state.colours:
                self._update(problem, colour, r)
        return SweepState(r, state.colours)
