r"""Semismooth Newton polish of a small dense program, from an interior-point answer.

Interior points stall where strict complementarity fails (the axis node of a quadratic mesh carries no force and no
gap). The natural map of the same program has no such trouble once the right pieces are chosen:

    K dU - f - G' r = 0,   r_n = (r_n - rho gap)+,   r_t = projection of (r_t - rho slip) on the disc of radius s,

with s frozen (or De Saxce's shift, :func:`shifted_map`), or s = mu (r_n)+ for exact Coulomb friction on the same
quadratic model (then unsymmetric, and only a step of the fixed point on s: the start is the convex program's answer,
and the result counts only if it is exact).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.laws.projections import DiscSlope, project_disc
from bipot.programs.conic import TangentProgram
from bipot.programs.data import ContactRows
from bipot.programs.shifted import shifted_map
from bipot.typing import Floats

ITERATIONS = 12
EXACT = 1e-10

YIELDING = 1e-9
"""Compliance of closed contacts that share unknowns, in the Newton matrix: where their rows repeat each other it picks
the forces next to the last ones, and where they do not it slows nothing."""


@dataclass(frozen=True)
class NaturalMap:
    """Operators stacked as multipliers (normal; tangential): G (m, n), offset (m,), and the scale rho > 0.

    ``threshold`` (f,) is the frozen one, or None for mu (r_n)+; where a ``shift`` (f,) is frozen, that alone counts.
    """

    rows: ContactRows
    threshold: Floats | None
    shift: Floats | None
    G: Floats
    offset: Floats
    rho: float

    @staticmethod
    def of(program: TangentProgram, threshold: Floats | None, shift: Floats | None) -> NaturalMap:
        """Stack G_n, G_t and their offsets; rho is the mean stiffness, which balances force against motion."""
        rows = program.contact.rows
        G = np.vstack([rows.G_n.toarray(), rows.G_t.toarray()])
        offset = np.concatenate([rows.gap, rows.slip.ravel()])
        rho = float(np.trace(np.asarray(program.K))) / max(len(program.f), 1)
        return NaturalMap(rows, threshold, shift, G, offset, rho)

    @property
    def shares(self) -> bool:
        """Whether two contacts touch the same unknown."""
        touched = np.abs(self.G[: self.rows.count])
        np.add.at(touched, self.rows.frictional.repeat(self.rows.tangents), np.abs(self.G[self.rows.count :]))
        return bool(((touched > 0).sum(axis=0) > 1).any())

    def evaluate(self, motion: Floats, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Residual (m,) and its derivatives with respect to motion and to r, (m, m) each."""
        if self.shift is not None:
            return shifted_map(self.rows, self.shift, self.rho, motion, r)
        c = self.rows.count
        value, by_motion, by_r = np.empty_like(r), np.zeros((len(r), len(r))), np.zeros((len(r), len(r)))
        trial = r - self.rho * motion
        closed = self.rows.tied | (trial[:c] > 0)
        value[:c] = np.where(closed, self.rho * motion[:c], r[:c])
        normal = np.arange(c)
        by_motion[normal, normal] = self.rho * closed
        by_r[normal, normal] = ~closed
        self._tangential(trial, r, value, by_motion, by_r)
        return value, by_motion, by_r

    def _tangential(self, trial: Floats, r: Floats, value: Floats, by_motion: Floats, by_r: Floats) -> None:
        """r_t - P(y), y = r_t - rho slip: sticking rows give the slip, sliding ones M = dP/dy and dP/ds."""
        c, width = self.rows.count, self.rows.tangents
        frictional = self.rows.frictional
        radius = self.rows.threshold(r[:c, None]) if self.threshold is None else self.threshold
        y = trial[c:].reshape(-1, width)
        slope = DiscSlope.at(y, radius)
        value[c:] = r[c:] - project_disc(y, radius).ravel()
        M = slope.by_point
        rows = c + np.arange(len(y) * width).reshape(-1, width)
        i, j = rows[:, :, None], rows[:, None, :]
        by_motion[i, j] = self.rho * M
        by_r[i, j] = np.eye(width) - M
        if self.threshold is None:
            mu = np.where(slope.slides & (r[frictional] > 0), self.rows.mu[frictional], 0.0)
            by_r[rows, frictional[:, None]] = -mu[:, None] * slope.direction


def polish(program: TangentProgram, x: Floats, r: Floats) -> tuple[Floats, Floats]:
    """The program's own answer to round-off, from (x (n,), r (c, d)); the start if Newton worsens it."""
    law = NaturalMap.of(program, program.contact.threshold, program.contact.shift)
    x, r, _ = _newton(program, law, x, r)
    return x, r


def couple(program: TangentProgram, x: Floats, r: Floats) -> tuple[Floats, Floats] | None:
    """Exact Coulomb on the program's quadratic model, from (x, r); None when Newton does not reach it."""
    x, r, error = _newton(program, NaturalMap.of(program, None, None), x, r)
    return (x, r) if error <= EXACT else None


def _newton(program: TangentProgram, natural: NaturalMap, x: Floats, r: Floats) -> tuple[Floats, Floats, float]:
    """Best iterate and its residual over the largest force."""
    rows, n = program.contact.rows, len(x)
    best = current = np.concatenate([x, r[:, 0], r[rows.frictional, 1:].ravel()])
    least = np.inf
    scale = max(float(np.abs(r).max(initial=0.0)), float(np.abs(program.f).max(initial=0.0)), np.finfo(float).tiny)
    jacobian = np.empty((len(current), len(current)))
    jacobian[:n, :n], jacobian[:n, n:] = np.asarray(program.K), -natural.G.T
    compliance = YIELDING * natural.shares
    for _ in range(ITERATIONS):
        x, force = current[:n], current[n:]
        value, by_motion, by_r = natural.evaluate(natural.G @ x + natural.offset, force)
        residual = np.concatenate([program.K @ x - program.f - natural.G.T @ force, value])
        error = float(np.abs(residual).max(initial=0.0)) / scale
        # Once it no longer falls from round-off, another step would only add noise. Until then steps are worth taking:
        # an open contact of a body without force must carry exactly none.
        if least <= EXACT and error >= least:
            break
        if error < least:
            best, least = current, error
        jacobian[n:, :n], jacobian[n:, n:] = by_motion @ natural.G, by_r
        yields = np.flatnonzero(by_r.diagonal() == 0)
        jacobian[n + yields, n + yields] = compliance
        try:
            current = current - np.linalg.solve(jacobian, residual)
        except np.linalg.LinAlgError:
            break
    polished = np.zeros_like(r)
    polished[:, 0] = best[n : n + rows.count]
    polished[rows.frictional, 1:] = best[n + rows.count :].reshape(-1, rows.tangents)
    return best[:n], polished, least
