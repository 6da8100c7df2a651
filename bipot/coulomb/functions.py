"""Nonsmooth functions F(r, u) that vanish exactly on Coulomb's law, with their generalised derivatives.

Both are r - P(r, u) with P a projection; ``step`` plays the part of rho (the problem is scaled: 1 fits).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from bipot.errors import require
from bipot.laws import coulomb
from bipot.laws.tensors import FloatArray, norm


class Linearised(NamedTuple):
    """F (c, d) and one element of its generalised derivative, dF/du and dF/dr (c, d, d)."""

    value: FloatArray
    du: FloatArray
    dr: FloatArray


class ContactFunction(Protocol):
    """F(r, u) for r, u (c, d) and mu (c,), zero exactly where Coulomb's law holds."""

    def value(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> FloatArray:
        """F (c, d)."""
        ...

    def linearise(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> Linearised:
        """F and its derivatives."""
        ...


def _unit(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(|t|, t/|t|), the direction 0 where t = 0."""
    length = norm(t)
    return length, np.divide(t, length[:, None], out=np.zeros(t.shape), where=length[:, None] > 0)


def _outer(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[:, :, None] * b[:, None, :]


def _disc_projection(y: FloatArray, limit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(y_n)+ and P_B(limit)(y_t), (c, d), and the derivative for fixed limit (c,); none where the limit is
    0."""
    d = y.shape[1]
    closed = y[:, 0] > 0
    length, t = _unit(y[:, 1:])
    stick = (length <= limit) & (limit > 0)
    shrink = np.where(stick, 1.0, np.divide(limit, length, out=np.zeros(length.shape), where=length > 0))
    P = np.zeros((len(y), d, d))
    P[:, 0, 0] = closed
    P[:, 1:, 1:] = shrink[:, None, None] * (np.eye(d - 1) - ~stick[:, None, None] * _outer(t, t))
    return np.column_stack([np.where(closed, y[:, 0], 0.0), shrink[:, None] * y[:, 1:]]), P


@dataclass(frozen=True)
class AlartCurnier:
    """F_n = r_n - (r_n - ρ u_n)+,  F_t = r_t - P_{B(μ (r_n - ρ u_n)+)}(r_t - ρ u_t)  (Alart and Curnier
    1991).

    Cheap, and its Newton steps are the active sets open, stick and slip; not a map of a convex set.
    """

    step: float = 1.0

    def __post_init__(self) -> None:
        require(self.step > 0, "step", self.step, "> 0")

    def value(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> FloatArray:
        """F (c, d)."""
        y = r - self.step * u
        n = np.maximum(y[:, 0], 0.0)
        return r - np.column_stack([n, coulomb.project_disc(y[:, 1:], mu * n)])

    def linearise(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> Linearised:
        """F and its derivatives; on a kink the open branch wins over the closed, stick over slip."""
        y = r - self.step * u
        limit = mu * np.maximum(y[:, 0], 0.0)
        projected, P = _disc_projection(y, limit)
        outside = (norm(y[:, 1:]) > limit) & (limit > 0)
        P[:, 1:, 0] = (outside * mu)[:, None] * _unit(y[:, 1:])[1]
        return Linearised(r - projected, self.step * P, np.eye(r.shape[1]) - P)


def _cone_projection(z: FloatArray, mu: FloatArray) -> tuple[FloatArray, FloatArray]:
    """P_K(z) (c, d) and its generalised derivative (c, d, d)."""
    d = z.shape[1]
    length, t = _unit(z[:, 1:])
    # The sign counts where mu = 0 and z_t = 0.
    inside = (length <= mu * z[:, 0]) & (z[:, 0] >= 0)
    polar = ~inside & (mu * length <= -z[:, 0])
    share = 1.0 / (1.0 + mu**2)
    height = (z[:, 0] + mu * length) * share
    ray = np.column_stack([np.ones(len(z)), mu[:, None] * t])
    P = share[:, None, None] * _outer(ray, ray)
    across = np.divide(mu * height, length, out=np.zeros(length.shape), where=length > 0)
    P[:, 1:, 1:] += across[:, None, None] * (np.eye(d - 1) - _outer(t, t))
    P[inside] = np.eye(d)
    # Without friction the cone is a ray: it has no inside, and nothing tangential passes.
    P[inside & (mu == 0), 1:, 1:] = 0.0
    P[polar] = 0.0
    return coulomb.project_cone(z, mu), P


@dataclass(frozen=True)
class NaturalMap:
    """F = r - P_K(r - ρ (u + μ |u_t| n)): the projection on the cone after De Saxcé's shift."""

    step: float = 1.0

    def __post_init__(self) -> None:
        require(self.step > 0, "step", self.step, "> 0")

    def value(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> FloatArray:
        """F (c, d)."""
        return coulomb.natural_map(r, u, mu, self.step)

    def linearise(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> Linearised:
        """F and its derivatives; |u_t| has derivative 0 at u_t = 0."""
        projected, P = _cone_projection(r - self.step * coulomb.de_saxce_shift(u, mu), mu)
        identity = np.eye(r.shape[1])
        shift = np.broadcast_to(identity, P.shape).copy()
        shift[:, 0, 1:] = mu[:, None] * _unit(u[:, 1:])[1]
        return Linearised(r - projected, self.step * (P @ shift), identity - P)


@dataclass(frozen=True, eq=False)
class ConeMap:
    """F = r - P_K(r - u): the associated law, normal to the cone; a shift is part of u. Not Coulomb's law."""

    def value(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> FloatArray:
        """F (c, d)."""
        return r - coulomb.project_cone(r - u, mu)

    def linearise(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> Linearised:
        """F and its derivatives."""
        projected, P = _cone_projection(r - u, mu)
        return Linearised(r - projected, P, np.eye(r.shape[1]) - P)


@dataclass(frozen=True, eq=False)
class TrescaMap:
    """F_n = r_n - (r_n - u_n)+,  F_t = r_t - P_B(s)(r_t - u_t): given ``threshold`` s (c,). Not Coulomb's
    law."""

    threshold: FloatArray

    def value(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> FloatArray:
        """F (c, d); mu is not used."""
        y = r - u
        return r - np.column_stack([np.maximum(y[:, 0], 0.0), coulomb.project_disc(y[:, 1:], self.threshold)])

    def linearise(self, r: FloatArray, u: FloatArray, mu: FloatArray) -> Linearised:
        """F and its derivatives."""
        y = r - u
        projected, P = _disc_projection(y, self.threshold)
        return Linearised(r - projected, P, np.eye(r.shape[1]) - P)
