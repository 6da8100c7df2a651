r"""Semismooth Newton on the penalised program: the fast route.

Written in x alone, Psi bends so sharply where a point sticks (over s/K_t) that Newton hops across. With the forces r
as unknowns too the same optimality conditions read, for any rho > 0 and per contact,

    K x - f - G' r = 0,    r = P(r - rho (m + (r - t_0)/K_c)),    m = (max(g0, 0) + du_n, du_t),

P the projection on r_n >= 0 and on the disc |r_t| <= s, K_c the penalties: one more contact law for the Newton that
all forms share (:func:`bipot.programs.newton.minimised`). rho is the body's mean stiffness, so that sticking and
sliding are told apart by forces of the body's size. Should whole steps not get there, Newton with line search on the
convex Psi takes over. It looks for the sign change of the slope g(x + a d) . d, which stays meaningful down to
round-off, where differences of Psi do not.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import Claim, Timing
from bipot.errors import ProgramError
from bipot.laws.projections import DiscSlope, project_disc
from bipot.programs.condensation import factorise
from bipot.programs.frames import Frames
from bipot.programs.newton import Model, minimised
from bipot.programs.penalty import LOST, Minimum, PenaltyProgram, PenaltyTerms
from bipot.programs.pieces import Mapped
from bipot.typing import Floats, max_abs

STEPS = 40
SEARCHES = 100
"""Whole steps before the line search takes over, and the most steps of the line search."""

SOLVED, EXACT = 1e-9, 1e-13
"""Residuals over the largest force: claimed solved below, ended at once below."""

PATIENCE = 3
"""Steps in a row that do not halve the least residual, after which the search ends; one is enough below SOLVED."""

FLATTER, BISECTIONS = 0.1, 100
"""Slope along a step, over that at its start, at which a line search ends, and the most halvings of its bracket."""

SHIFT = 1e-13
"""Shift of a singular Hessian's diagonal, over its largest entry."""


def _regularised(terms: PenaltyTerms, motion: Floats, r: Floats, rho: tuple[float, float]) -> Mapped:
    """The penalised law linearised at motion (gap at the end, slip) and forces (c, d), with rho for normal, tangent."""
    (rho_n, rho_t), f, (count, d) = rho, terms.rows.frictional, r.shape
    by_motion, by_force, none = np.zeros((count, d, d)), np.tile(np.eye(d), (count, 1, 1)), np.ones(r.shape, dtype=bool)
    lag = motion[:, 0] + np.maximum(-terms.start_gap, 0.0) + (r[:, 0] - terms.t_0[:, 0]) / terms.k_n
    closed, miss = r[:, 0] > rho_n * lag, r.copy()
    miss[closed, 0], none[closed, 0] = rho_n * lag[closed], False
    by_motion[closed, 0, 0], by_force[closed, 0, 0] = rho_n, rho_n / terms.k_n[closed]
    z = r[f, 1:] - rho_t * (motion[f, 1:] + (r[f, 1:] - terms.t_0[f, 1:]) / terms.k_t[:, None])
    slope = DiscSlope.at(z, terms.threshold).by_point
    miss[f, 1:] -= project_disc(z, terms.threshold)
    by_motion[f, 1:, 1:] = rho_t * slope
    by_force[f, 1:, 1:] -= (1 - rho_t / terms.k_t)[:, None, None] * slope
    none[f, 1:] = (terms.threshold == 0)[:, None]
    return Mapped(miss, by_motion, by_force, np.full(count, rho_n), none)


def newton(program: PenaltyProgram, start: Floats, frames: Frames | None = None) -> Minimum:
    """Minimise from ``start`` (n,) until the conditions in x and r stop falling at round-off.

    Where the residual in x alone is then above 1e-9 of the largest force, the line search goes on from there.
    ``frames`` are those of the contacts, where they are known.

    Raises:
        ProgramError: the residual stays above 1e-3 of the largest force, or the stiffness is singular.
    """
    began = time.perf_counter()
    terms, model = program.contact, Model(program.K, program.f, program.contact.rows)
    # For normal and tangential rows the mean stiffness, at most the least penalty.
    mean = float(program.K.diagonal().mean())
    rho = float(terms.k_n.min(initial=mean)), float(terms.k_t.min(initial=mean))
    # A body that nothing holds runs away; its residual is then no number below LOST, and that is the answer.
    with np.errstate(over="ignore", invalid="ignore"):
        found = minimised(
            model,
            lambda motion, r: _regularised(terms, motion, r, rho),
            start,
            _first_forces(program, start),
            frames,
            STEPS,
        )
        best = _Best(start, iterations=found.factors)
        best.settles(program, found.x)
        x = best.x
        for _ in range(0 if best.error <= SOLVED else SEARCHES):
            following = _search(program, x)
            best.iterations += 1
            if best.settles(program, following) or np.array_equal(following, x):
                break
            x = following
    if not best.error <= LOST:
        raise ProgramError(f"penalised Newton left a residual of {best.error:.1e}: use a smaller penalty or increment")
    outcome = Claim.SOLVED if best.error <= SOLVED else Claim.ALMOST
    return Minimum(best.x, outcome, best.iterations, Timing(solve=time.perf_counter() - began))


@dataclass
class _Best:
    """The point of least residual so far, how long ago it came, and how many factorisations were spent."""

    x: Floats
    error: float = np.inf
    waited: int = 0
    iterations: int = 0

    def settles(self, program: PenaltyProgram, x: Floats) -> bool:
        """Keep ``x`` if its residual is the least; returns whether there is nothing left to gain."""
        error = float(np.abs(program.gradient(x)).max() / program.largest(x))
        self.waited = self.waited + 1 if error >= self.error / 2 else 0
        if error < self.error:
            self.x, self.error = x, error
        patience = 1 if self.error <= SOLVED else PATIENCE
        return self.error <= EXACT or (self.error <= LOST and self.waited >= patience)


def _first_forces(program: PenaltyProgram, x: Floats) -> Floats:
    """Forces r (c, d) nearer to equilibrium at x: those of the law there, or t_0 brought within the threshold."""
    terms = program.contact
    f = terms.rows.frictional
    carried = np.maximum(terms.t_0[:, :1], 0.0) * np.eye(1, terms.t_0.shape[1])
    carried[f, 1:] = project_disc(terms.t_0[f, 1:], terms.threshold)
    balance = program.K @ x - program.f
    choices = (terms.forces(x), carried)
    return min(choices, key=lambda r: max_abs(balance - terms.rows.forces(r)))


def _search(program: PenaltyProgram, x: Floats) -> Floats:
    """A lower point x + a d, a in (0, 1], where the slope is a tenth of that at x; x itself at round-off."""
    g = program.gradient(x)
    d = _solve(program.hessian(x), -g)
    enough = -FLATTER * float(g @ d)
    low, high, a = 0.0, 1.0, 1.0
    for _ in range(BISECTIONS):
        slope = float(program.gradient(x + a * d) @ d)
        if abs(slope) <= enough or (slope < 0 and a == 1.0):
            return x + a * d
        low, high = (a, high) if slope < 0 else (low, a)
        a = (low + high) / 2
    return x + low * d


def _solve(H: sp.csc_matrix, b: Floats) -> Floats:
    """H^-1 b. In homogeneous perfect flow H is singular; a shift at round-off then leaves the minimum where it is."""
    try:
        return factorise(H).solve(b)
    except ProgramError:
        return factorise(sp.csc_matrix(H + SHIFT * abs(H).max() * sp.identity(len(b)))).solve(b)
