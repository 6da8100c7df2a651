r"""Coulomb's law with contact by its smooth pieces, as semismooth Newton needs them.

Per contact, with a scale > 0 that balances force against motion and y_t = r_t - scale slip:

    closed  where r_n - scale gap >= 0:   scale gap = 0,    else r = 0,
    slides  where |y_t| > mu r_n:         r_t = mu r_n y_t / |y_t|,    else scale slip = 0;    tied points always stick.

Where friction is capped, min(mu r_n, cap) stands for mu r_n: a fixed radius where the cap is the smaller.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple, TypeVar

import numpy as np

from bipot.laws.coulomb import limit_slope
from bipot.laws.projections import DiscSlope, cone_slope, project_cone
from bipot.programs.data import ContactRows
from bipot.tensors import norm
from bipot.typing import Bools, Floats, Ints, times

ALIKE, BACK = 1e-9, -0.5
"""Angle between directions of slip that are the same, and cosine of the angle below which one has turned back."""


class Measured(NamedTuple):
    """How motions change at curved tools in space: by ``rows`` (c, d, d) times the change G dU of the rows.

    Beside this they change by ``turned`` (c, d) per unit of the unknowns ``turn`` (c,), turns of tools; -1 for none.
    """

    rows: Floats
    turn: Ints
    turned: Floats


@dataclass(frozen=True)
class Pieces:
    """Pieces of c contacts: ``closed`` (c,) and the ``disc`` of the friction force at y, outside of which it slides.

    The disc's radius is mu r_n of a closed contact plus ``fixed`` (c,), a frozen threshold or a cap in the place of the
    former. ``mu`` (c,) is zero where there is no friction row: the tangential law there only says r_t = 0. Motions
    change as ``measured``; None stands for the change G dU of the rows.
    """

    closed: Bools
    disc: DiscSlope
    mu: Floats
    fixed: Floats
    scale: Floats
    measured: Measured | None = None

    @staticmethod
    def of(
        rows: ContactRows,
        motion: Floats,
        r: Floats,
        scale: Floats,
        band: tuple[Floats | float, Floats | float] = (0.0, 0.0),
        before: Pieces | None = None,
        threshold: Floats | None = None,
    ) -> Pieces:
        """The pieces at motion and forces (c, d); those ``before`` stay within the dead ``band`` of force and gap.

        The axis node of a quadratic mesh carries no consistent share of the pressure: r_n and gap both vanish there up
        to round-off, and without a dead band its piece would change for ever. Below the acceptance bounds it harms
        nothing.

        ``threshold`` (f,) is that of the friction rows where it is frozen.
        """
        # What touches without a force is closed: Newton's matrix is then regular where only contacts hold the body.
        closed = r[:, 0] - scale * motion[:, 0] >= 0
        if before is not None:
            pull, gap = band
            held = np.where(before.closed, r[:, 0] > -pull, motion[:, 0] < -gap)
            weak = np.where(before.closed, np.abs(motion[:, 0]) <= gap, np.abs(r[:, 0]) <= pull)
            closed = np.where(weak, held, closed)
        closed = closed | rows.tied
        mu, fixed = rows.rubbing, np.zeros(rows.count)
        if threshold is not None:
            mu = np.zeros(rows.count)
            fixed[rows.frictional] = np.where(rows.tied[rows.frictional], 0.0, threshold)
        elif rows.capped:
            mu, fixed = _capped(rows, r[:, 0], closed & (r[:, 0] - scale * motion[:, 0] > 0))
        y = r[:, 1:] - scale[:, None] * motion[:, 1:]
        length, radius = norm(y), np.where(closed, mu * r[:, 0], 0.0) + fixed
        rubs = (closed & (mu > 0)) | (fixed > 0)
        slides = ~(rows.tied & rows.rubs) & (~rubs | rows.dragged | (length > np.maximum(radius, 0.0)))
        safe = np.where(length > 0, length, 1.0)
        # What is dragged slides even from inside of the disc, where the projection must not stretch y.
        shrink = np.where(rows.dragged, np.minimum(radius / safe, 1.0), radius / safe)
        return Pieces(closed, DiscSlope(slides, y / safe[:, None], shrink), mu, fixed, scale)

    def steadied(self, last: object, rows: ContactRows) -> Pieces:
        """The pieces for a step after one with the pieces ``last``: a slip that has turned back sticks in between.

        Newton's step does not see that a slip may end: one that the law wants to stick would go to and fro for ever.
        """
        if not isinstance(last, Pieces):
            return self
        ours, theirs = self.disc, last.disc
        back = np.vecdot(ours.direction, theirs.direction) < BACK
        back &= self._slip & last._slip & ~rows.dragged
        return replace(self, disc=replace(ours, slides=ours.slides & ~back)) if back.any() else self

    @property
    def _slip(self) -> Bools:
        """Which contacts (c,) slip against friction."""
        return (self.closed | (self.fixed > 0)) & self.disc.slides & (self.mu + self.fixed > 0)

    def same(self, other: object, turn: float = ALIKE) -> bool:
        """Whether both are the same linear law, except that directions of slip may differ by less than ``turn``."""
        if not isinstance(other, Pieces):
            return False
        ours, theirs, slip = self.disc, other.disc, self._slip
        matters = self.closed | (self.fixed > 0)
        return (
            np.array_equal(self.closed, other.closed)
            and np.array_equal(ours.slides[matters], theirs.slides[matters])
            and np.array_equal(self.mu[matters], other.mu[matters])
            and bool(np.all(norm(ours.direction[slip] - theirs.direction[slip]) < turn))
        )

    def value(self, motion: Floats, r: Floats, weight: float = 1.0) -> Floats:
        """What must vanish (c, d), in units of force; motions count by ``weight`` times the scale."""
        out, scale = np.empty_like(r), weight * self.scale
        out[:, 0] = np.where(self.closed, scale * motion[:, 0], r[:, 0])
        friction = (np.where(self.closed, self.mu * r[:, 0], 0.0) + self.fixed)[:, None] * self.disc.direction
        out[:, 1:] = np.where(self.disc.slides[:, None], r[:, 1:] - friction, scale[:, None] * motion[:, 1:])
        return out

    def at_caps(self, r: Floats) -> Floats:
        """Forces r (c, d), but with the law's friction, which needs no r, where points slide at a ``fixed`` radius."""
        known = (self.fixed > 0) & self.disc.slides
        if not known.any():
            return r
        out = r.copy()
        out[known, 1:] = self.fixed[known, None] * self.disc.direction[known]
        return out

    @property
    def none(self) -> Bools:
        """Which forces (c, d) are zero by the law."""
        rubs = (self.closed & (self.mu > 0)) | (self.fixed > 0)
        out = np.empty((len(self.mu), 1 + self.disc.direction.shape[1]), dtype=bool)
        out[:, 0], out[:, 1:] = ~self.closed, (self.disc.slides & ~rubs)[:, None]
        return out

    @cached_property
    def by_motion(self) -> Floats:
        """Derivative (c, d, d) of :meth:`value` with respect to the motion G dU of the rows."""
        return self._by_motion if self.measured is None else self._by_motion @ self.measured.rows

    @property
    def by_turn(self) -> tuple[Ints, Floats] | None:
        """Derivative (c, d) beside this with respect to unknowns (c,), -1 for none; None if there are none at all."""
        if self.measured is None or (self.measured.turn < 0).all():
            return None
        return self.measured.turn, times(self._by_motion, self.measured.turned)

    @property
    def _by_motion(self) -> Floats:
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


def _capped(rows: ContactRows, r_n: Floats, pushing: Bools) -> tuple[Floats, Floats]:
    """Coefficients (c,) where friction follows mu r_n, and radii (c,) where it is at its cap.

    Of constant shear, mu = inf, the cap acts on contacts that are ``pushing`` (c,): those that only touch do not rub.
    """
    mu = rows.rubbing
    caps = pushing & (mu > 0) & np.isfinite(rows.cap) & (limit_slope(r_n, mu, rows.cap) == 0)
    return np.where(caps | np.isinf(mu), 0.0, mu), np.where(caps, rows.cap, 0.0)


@dataclass(frozen=True)
class Mapped:
    """A law that is a map of motion and forces, linearised: value ``miss`` (c, d), derivatives (c, d, d), scale (c,).

    ``none`` (c, d) marks the forces that are zero by the law.
    """

    miss: Floats
    by_motion: Floats
    by_force: Floats
    scale: Floats
    none: Bools
    by_turn: ClassVar[None] = None

    @staticmethod
    def shifted_cone(rows: ContactRows, motion: Floats, r: Floats, scale: Floats, shift: Floats) -> Mapped:
        """r - P_K(r - scale (u + shift n)), K = {|r_t| <= mu r_n}: the associated law of a shifted motion.

        Exact Coulomb friction where De Saxce's ``shift`` (f,) is mu |du_t|. At motion and forces (c, d).
        """
        u, identity = motion.copy(), np.eye(1 + rows.tangents)
        u[rows.frictional, 0] += shift
        stuck = rows.tied[:, None] & np.column_stack([rows.tied, *[rows.rubs] * rows.tangents])
        pull = scale[:, None] * u
        slope = np.where(stuck[..., None], identity, cone_slope(r - pull, rows.rubbing))
        miss = np.where(stuck, pull, r - project_cone(r - pull, rows.rubbing))
        apart = np.all(slope == 0, axis=(1, 2))
        none = np.broadcast_to(apart[:, None], r.shape)
        return Mapped(miss, scale[:, None, None] * slope, identity - slope, scale, none)

    def value(self, motion: Floats, r: Floats, weight: float = 1.0) -> Floats:
        """What must vanish (c, d), where it was linearised; forces and motions are not told apart in it."""
        return self.miss

    def steadied(self, last: object, rows: ContactRows) -> Mapped:
        """Itself: see :meth:`Pieces.steadied`."""
        return self

    def same(self, other: object, turn: float = ALIKE) -> bool:
        """Whether the derivatives by force, which are of order one, differ by less than ``turn``."""
        return isinstance(other, Mapped) and bool(np.all(np.abs(self.by_force - other.by_force) < turn))


Law = Pieces | Mapped
"""A linearised contact law: value (c, d), derivatives by motion and force (c, d, d), scale, forces that are none."""

L = TypeVar("L", bound=Law)
