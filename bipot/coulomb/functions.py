"""Nonsmooth functions F(r, u) that vanish exactly on a contact law, with their generalised derivatives.

All are r - P(r, u) with P a projection. The law is Coulomb's in :class:`AlartCurnier` and :class:`NaturalMap`, whose
``step`` is rho (1 is suitable, because the problem is scaled), and that of one program in the other two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from bipot.laws import coulomb
from bipot.laws.projections import DiscSlope, cone_slope, project_cone, project_disc
from bipot.tensors import unit
from bipot.typing import Floats, make_floats


class Expansion(NamedTuple):
    """F (c, d) and one element of its generalised derivative, dF/du and dF/dr (c, d, d)."""

    value: Floats
    du: Floats
    dr: Floats


@runtime_checkable
class ContactFunction(Protocol):
    """F(r, u) for r, u (c, d) and mu (c,), zero exactly where its law holds."""

    def value(self, r: Floats, u: Floats, mu: Floats) -> Floats:
        """F (c, d)."""
        ...

    def linearise(self, r: Floats, u: Floats, mu: Floats) -> Expansion:
        """F and its derivatives."""
        ...


def _onto_disc(y: Floats, limit: Floats) -> Floats:
    """(y_n)+ and P_B(limit)(y_t), (c, d)."""
    return np.column_stack([np.maximum(y[:, 0], 0.0), project_disc(y[:, 1:], limit)])


def _disc_projection(y: Floats, limit: Floats) -> tuple[Floats, Floats, DiscSlope]:
    """:func:`_onto_disc`, its derivative (c, d, d) for fixed limit (c,), and that of P_B alone."""
    slope = DiscSlope.at(y[:, 1:], limit)
    P = np.zeros((*y.shape, y.shape[1]))
    P[:, 0, 0] = y[:, 0] > 0
    P[:, 1:, 1:] = slope.by_point
    return _onto_disc(y, limit), P, slope


@dataclass(frozen=True)
class AlartCurnier:
    """F_n = r_n - (r_n - ρ u_n)+,  F_t = r_t - P_{B(μ (r_n - ρ u_n)+)}(r_t - ρ u_t)  (Alart and Curnier 1991).

    Cheap, and its Newton steps are the active sets open, stick and slip; not a map of a convex set.
    """

    step: float = 1.0

    def __post_init__(self) -> None:
        make_floats(self, step="finite and > 0")

    def value(self, r: Floats, u: Floats, mu: Floats) -> Floats:
        """F (c, d)."""
        y = r - self.step * u
        return r - _onto_disc(y, mu * np.maximum(y[:, 0], 0.0))

    def linearise(self, r: Floats, u: Floats, mu: Floats) -> Expansion:
        """F and its derivatives; on a kink the open branch wins over the closed, stick over slip."""
        y = r - self.step * u
        limit = mu * np.maximum(y[:, 0], 0.0)
        projected, P, slope = _disc_projection(y, limit)
        P[:, 1:, 0] = (mu * (y[:, 0] > 0))[:, None] * slope.by_radius
        return Expansion(r - projected, self.step * P, np.eye(r.shape[1]) - P)


@dataclass(frozen=True)
class NaturalMap:
    """F = r - P_K(r - ρ (u + μ |u_t| n)): the projection on the cone after De Saxcé's shift."""

    step: float = 1.0

    def __post_init__(self) -> None:
        make_floats(self, step="finite and > 0")

    def value(self, r: Floats, u: Floats, mu: Floats) -> Floats:
        """F (c, d)."""
        return coulomb.natural_map(r, u, mu, self.step)

    def linearise(self, r: Floats, u: Floats, mu: Floats) -> Expansion:
        """F and its derivatives; |u_t| has derivative 0 at u_t = 0."""
        y = r - self.step * coulomb.de_saxce_shift(u, mu)
        P, identity = cone_slope(y, mu), np.eye(r.shape[1])
        shift = np.broadcast_to(identity, P.shape).copy()
        shift[:, 0, 1:] = mu[:, None] * unit(u[:, 1:])
        return Expansion(r - project_cone(y, mu), self.step * (P @ shift), identity - P)


@dataclass(frozen=True, eq=False)
class ConeMap:
    """F = r - P_K(r - u): the associated law, normal to the cone; a shift is part of u. Not Coulomb's law."""

    def value(self, r: Floats, u: Floats, mu: Floats) -> Floats:
        """F (c, d)."""
        return r - project_cone(r - u, mu)

    def linearise(self, r: Floats, u: Floats, mu: Floats) -> Expansion:
        """F and its derivatives."""
        P = cone_slope(r - u, mu)
        return Expansion(self.value(r, u, mu), P, np.eye(r.shape[1]) - P)


@dataclass(frozen=True, eq=False)
class TrescaMap:
    """F_n = r_n - (r_n - u_n)+,  F_t = r_t - P_B(s)(r_t - u_t), s (c,) the given ``threshold``. Not Coulomb's law."""

    threshold: Floats

    def value(self, r: Floats, u: Floats, mu: Floats) -> Floats:
        """F (c, d); mu is not used."""
        return r - _onto_disc(r - u, self.threshold)

    def linearise(self, r: Floats, u: Floats, mu: Floats) -> Expansion:
        """F and its derivatives."""
        y = r - u
        projected, P, _ = _disc_projection(y, self.threshold)
        return Expansion(r - projected, P, np.eye(r.shape[1]) - P)
