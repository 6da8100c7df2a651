r"""Semismooth Newton on the penalised program, on the sparse system: the fast route.

In x alone, Psi bends so sharply at a sticking point (over s/K_t) that Newton jumps across it. With the forces r as
additional unknowns the same optimality conditions are, for any rho > 0 and per contact,

    K x - f - G' r = 0,    r = P(r - rho (m + (r - t_0)/K_c)),    m = (max(g0, 0) + du_n, du_t),

with P the projection on r_n >= 0 and on the disc |r_t| <= s, and K_c the penalties. rho is the body's mean stiffness,
so sticking and sliding are distinguished by forces of the body's size. Eliminating r leaves K + G' D G, symmetric
positive definite. If the full steps do not converge, Newton with line search on the convex Psi takes over. It seeks the
sign change of the slope g(x + a d) . d, which is accurate down to round-off, unlike differences of Psi.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import Outcome, Timing
from bipot.errors import ProgramError
from bipot.laws.projections import DiscSlope, project_disc
from bipot.programs.condensation import factorise
from bipot.programs.penalty import Minimum, PenaltyProgram
from bipot.typing import Floats

STEPS = 40
SEARCHES = 100
"""Full steps before the line search takes over, and the number of line searches."""

SOLVED = 1e-9
EXACT = 1e-13
LOST = 1e-3
"""Residuals over the largest force: claimed solved below, ended at once below, given up above."""

PATIENCE = 3
FLATTER = 0.1
BISECTIONS = 100
SHIFT = 1e-13


def newton(program: PenaltyProgram, start: Floats) -> Minimum:
    """Minimise from ``start`` (n,) until the residual stops falling at round-off.

    Raises:
        ProgramError: the residual stays above 1e-3 of the largest force, or the stiffness is singular.
    """
    began = time.perf_counter()
    best = _Best(start)
    # A body held by nothing runs away; its residual is then above LOST or no number, which is the answer.
    with np.errstate(over="ignore", invalid="ignore"):
        if not _full_steps(program, start, best):
            _searches(program, best)
    if not best.error <= LOST:
        raise ProgramError(f"penalised Newton left a residual of {best.error:.1e}: use a smaller penalty or increment")
    outcome = Outcome.SOLVED if best.error <= SOLVED else Outcome.ALMOST
    return Minimum(best.x, outcome, best.iterations, Timing(solve=time.perf_counter() - began))


@dataclass
class _Best:
    """The point of least residual so far, its age, and the number of factorisations spent."""

    x: Floats
    error: float = np.inf
    waited: int = 0
    iterations: int = 0

    def settles(self, program: PenaltyProgram, x: Floats) -> bool:
        """Record ``x`` if it is better; returns whether nothing is left to gain."""
        error = float(np.abs(program.gradient(x)).max() / program.largest(x))
        self.waited = self.waited + 1 if error >= self.error / 2 else 0
        if error < self.error:
            self.x, self.error = x, error
        patience = 1 if self.error <= SOLVED else PATIENCE
        return self.error <= EXACT or (self.error <= LOST and self.waited >= patience)


def _full_steps(program: PenaltyProgram, x: Floats, best: _Best) -> bool:
    """Newton on the conditions in x and r; whether it settled."""
    r = _first_forces(program, x)
    rows, f = program.contact.rows, program.contact.rows.frictional
    for _ in range(STEPS):
        if best.settles(program, x):
            return True
        r, D_n, D_t = _linearised(program, x, r)
        step = _solve(program.stiffened(D_n, D_t), program.f + rows.forces(r) - program.K @ x)
        best.iterations += 1
        x = x + step
        r[:, 0] -= D_n * (rows.G_n @ step)
        r[f, 1:] -= (D_t @ (rows.G_t @ step).reshape(*rows.slip.shape, 1))[..., 0]
    return best.settles(program, x)


def _linearised(program: PenaltyProgram, x: Floats, r: Floats) -> tuple[Floats, Floats, Floats]:
    """The contact conditions linearised at (x, r): r - D G dx, with D = rho M/(1 - M + rho M/K_c), M = P'."""
    terms = program.contact
    du, f = terms.motion(x), terms.rows.frictional
    rho_n, rho_t = _scales(program)
    room = np.maximum(terms.start_gap, 0) + du[:, 0]
    y = r[:, 0] - rho_n * (room + (r[:, 0] - terms.t_0[:, 0]) / terms.k_n)
    z = r[f, 1:] - rho_t * (du[f, 1:] + (r[f, 1:] - terms.t_0[f, 1:]) / terms.k_t)
    M = DiscSlope.at(z, terms.threshold).by_point
    A = np.eye(z.shape[1]) - M + rho_t / terms.k_t * M
    closed = y > 0
    now = np.zeros_like(r)
    now[:, 0] = np.where(closed, terms.t_0[:, 0] - terms.k_n * room, 0.0)
    miss = r[f, 1:] - project_disc(z, terms.threshold)
    now[f, 1:] = r[f, 1:] - np.linalg.solve(A, miss[..., None])[..., 0]
    D_t = np.asarray(rho_t * np.linalg.solve(A, M), dtype=np.float64)
    return now, np.where(closed, terms.k_n, 0.0), D_t


def _first_forces(program: PenaltyProgram, x: Floats) -> Floats:
    """r (c, d) of the law at x or of the start, whichever is nearer to equilibrium."""
    terms = program.contact
    f = terms.rows.frictional
    carried = np.maximum(terms.t_0[:, :1], 0.0) * np.eye(1, terms.t_0.shape[1])
    carried[f, 1:] = project_disc(terms.t_0[f, 1:], terms.threshold)
    balance = program.K @ x - program.f
    choices = (terms.forces(x), carried)
    return min(choices, key=lambda r: float(np.abs(balance - terms.rows.forces(r)).max()))


def _scales(program: PenaltyProgram) -> tuple[float, float]:
    """rho for normal and tangential rows: the mean stiffness, at most the penalty."""
    mean = float(program.K.diagonal().mean())
    return min(mean, program.contact.k_n), min(mean, program.contact.k_t)


def _searches(program: PenaltyProgram, best: _Best) -> None:
    """Newton in x with line search, from the best point."""
    x = best.x
    for _ in range(SEARCHES):
        following = _search(program, x)
        best.iterations += 1
        if best.settles(program, following) or np.array_equal(following, x):
            return
        x = following


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
