r"""Coulomb's law with contact by its smooth pieces, as semismooth Newton needs them.

Per contact, with a scale > 0 that balances force against motion and y_t = r_t - scale slip:

    closed  where r_n - scale gap > 0:    scale gap = 0,    else r = 0,
    slides  where |y_t| > mu r_n:         r_t = mu r_n y_t / |y_t|,    else scale slip = 0;    tied points always stick.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.laws.projections import DiscSlope, unit
from bipot.laws.tensors import norm
from bipot.programs.data import ContactRows
from bipot.typing import Bools, Floats


@dataclass(frozen=True)
class Deadband:
    """How far contacts may stray from their pieces before those change: pull (force) and gap (length), (c,) or one.

    The axis node of a quadratic mesh carries no consistent share of the pressure: r_n and gap both vanish there up to
    round-off, and without a dead band its piece would change for ever. Below the acceptance bounds it harms nothing.
    """

    pull: Floats | float = 0.0
    gap: Floats | float = 0.0


@dataclass(frozen=True)
class Pieces:
    """Pieces of c contacts: ``closed`` (c,) and the ``disc`` of radius mu r_n at y, outside of which it slides.

    ``mu`` (c,) is zero where there is no friction row: the tangential law there only says r_t = 0.
    """

    closed: Bools
    disc: DiscSlope
    mu: Floats
    scale: Floats

    @staticmethod
    def of(
        rows: ContactRows,
        motion: Floats,
        r: Floats,
        scale: Floats,
        band: Deadband = Deadband(),
        before: Pieces | None = None,
    ) -> Pieces:
        """The pieces at motion and forces (c, d); ``before`` are those the dead band holds on to."""
        closed = r[:, 0] - scale * motion[:, 0] > 0
        if before is not None:
            held = np.where(before.closed, r[:, 0] > -band.pull, motion[:, 0] < -band.gap)
            weak = np.where(before.closed, np.abs(motion[:, 0]) <= band.gap, np.abs(r[:, 0]) <= band.pull)
            closed = np.where(weak, held, closed)
        closed = closed | rows.tied
        mu = np.where(rows.rubs & ~rows.tied, rows.mu, 0.0)
        y = r[:, 1:] - scale[:, None] * motion[:, 1:]
        length = norm(y)
        radius = mu * np.maximum(r[:, 0], 0.0)
        slides = ~(rows.tied & rows.rubs) & (~closed | (length > radius) | (mu == 0))
        drag = np.divide(mu * r[:, 0], length, out=np.zeros(rows.count), where=slides & closed & (length > 0))
        return Pieces(closed, DiscSlope(slides, unit(y), drag), mu, scale)

    def same(self, other: Pieces) -> bool:
        """Whether the law is linear with the same coefficients on both (directions compared on sliding contacts)."""
        ours, theirs = self.disc, other.disc
        slip = self.closed & ours.slides & (self.mu > 0)
        return (
            np.array_equal(self.closed, other.closed)
            and np.array_equal(ours.slides[self.closed], theirs.slides[self.closed])
            and bool(np.all(np.abs(ours.direction[slip] - theirs.direction[slip]) < 1e-9))
        )

    def value(self, motion: Floats, r: Floats) -> Floats:
        """What must vanish (c, d), in units of force."""
        out = np.empty_like(r)
        out[:, 0] = np.where(self.closed, self.scale * motion[:, 0], r[:, 0])
        dragged = np.where(self.closed, self.mu * r[:, 0], 0.0)[:, None] * self.disc.direction
        out[:, 1:] = np.where(self.disc.slides[:, None], r[:, 1:] - dragged, self.scale[:, None] * motion[:, 1:])
        return out

    @cached_property
    def by_motion(self) -> Floats:
        """Derivative (c, d, d) of :meth:`value` with respect to motion."""
        out = self._zeros()
        out[:, 0, 0] = self.scale * self.closed
        out[:, 1:, 1:] = self.scale[:, None, None] * self.disc.by_point
        return out

    @cached_property
    def by_force(self) -> Floats:
        """Derivative (c, d, d) of :meth:`value` with respect to r."""
        out = self._zeros()
        out[:, 0, 0] = ~self.closed
        out[:, 1:, 0] = -(self.mu * self.closed)[:, None] * self.disc.by_radius
        out[:, 1:, 1:] = np.eye(out.shape[1] - 1) - self.disc.by_point
        return out

    def _zeros(self) -> Floats:
        width = 1 + self.disc.direction.shape[1]
        return np.zeros((len(self.mu), width, width))
