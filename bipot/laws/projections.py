"""The projections in Coulomb's law (15), each with its generalised derivative, for d = 2 and 3.

On the disc |t| <= s of the friction force and on the cone K_mu = {|r_t| <= mu r_n}. Arrays are (…, d - 1) and (…, d),
rows (n, t_1 … t_{d-1}); units are those of a force, derivatives have none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.tensors import norm, unit
from bipot.typing import Bools, Floats


def project_disc(t: Floats, radius: Floats | float) -> Floats:
    """Nearest point of the disc |t| <= radius, (…, d-1) -> (…, d-1); radius >= 0, inf allowed.

    >>> project_disc(np.array([[3.0, 4.0]]), 1.0).round(12).tolist()
    [[0.6, 0.8]]
    """
    length = norm(t)
    shrink = np.divide(radius, length, out=np.ones(length.shape), where=length > radius)
    return shrink[..., None] * t


@dataclass(frozen=True)
class DiscSlope:
    """Derivative of the projection on a disc of radius s at t: s/|t| (I - e e') outside, I inside, e = t/|t|.

    ``slides`` (…) tells where t is outside, ``direction`` (…, d-1) is e there, ``shrink`` (…) is s/|t| there.
    """

    slides: Bools
    direction: Floats
    shrink: Floats

    @staticmethod
    def at(t: Floats, radius: Floats | float) -> DiscSlope:
        """At t (…, d-1); all t, even 0, count as outside of a disc of radius 0."""
        length = norm(t)
        slides = (length > radius) | (np.asarray(radius) == 0)
        shrink = np.divide(radius, length, out=np.zeros(length.shape), where=slides & (length > 0))
        return DiscSlope(slides, unit(t), shrink)

    @cached_property
    def by_point(self) -> Floats:
        """With respect to t, (…, d-1, d-1)."""
        identity, e = np.eye(self.direction.shape[-1]), self.direction
        across = self.shrink[..., None, None] * (identity - e[..., :, None] * e[..., None, :])
        return np.where(self.slides[..., None, None], across, identity)

    @property
    def by_radius(self) -> Floats:
        """With respect to s, (…, d-1): e outside, 0 inside."""
        return np.where(self.slides[..., None], self.direction, 0.0)


def project_cone(r: Floats, mu: Floats | float) -> Floats:
    """Nearest point of K_mu (15), (…, d) -> (…, d); mu = inf: the half space r_n >= 0.

    r inside; 0 in the polar cone mu |r_t| <= -r_n; else n (1, mu r_t/|r_t|), n = (r_n + mu |r_t|)/(1 + mu²).

    >>> project_cone(np.array([[1.0, 3.0], [-3.0, 1.0]]), 1.0).tolist()
    [[2.0, 2.0], [0.0, 0.0]]
    """
    r_n, r_t, glued = r[..., 0], r[..., 1:], np.isinf(mu)
    m = np.where(glued, 0.0, mu)
    length = norm(r_t)
    n = np.maximum((r_n + m * length) / (1.0 + m * m), 0.0)
    inside = (glued | (length <= m * r_n)) & (r_n >= 0)
    shrink = np.divide(m * n, length, out=np.zeros(length.shape), where=length > 0)
    normal = np.where(inside, r_n, n)
    return np.concatenate([normal[..., None], np.where(inside | glued, 1.0, shrink)[..., None] * r_t], axis=-1)


def cone_slope(r: Floats, mu: Floats) -> Floats:
    """Derivative (c, d, d) of :func:`project_cone` at r (c, d) for finite mu (c,): I inside, 0 in the polar cone, else

    q q'/(1 + mu²) + mu n/|r_t| (I_t - e e'), q = (1, mu e), e = r_t/|r_t|.
    """
    d, e = r.shape[1], unit(r[:, 1:])
    length = norm(r[:, 1:])
    # The sign of r_n decides where mu = 0 and r_t = 0.
    inside = (length <= mu * r[:, 0]) & (r[:, 0] >= 0)
    polar = ~inside & (mu * length <= -r[:, 0])
    share = 1.0 / (1.0 + mu**2)
    height = (r[:, 0] + mu * length) * share
    ray = np.column_stack([np.ones(len(r)), mu[:, None] * e])
    slope = share[:, None, None] * (ray[:, :, None] * ray[:, None, :])
    across = np.divide(mu * height, length, out=np.zeros(length.shape), where=length > 0)
    slope[:, 1:, 1:] += across[:, None, None] * (np.eye(d - 1) - e[:, :, None] * e[:, None, :])
    slope[inside] = np.eye(d)
    # Without friction the cone is a ray: it has no inside, and nothing tangential passes.
    slope[inside & (mu == 0), 1:, 1:] = 0.0
    slope[polar] = 0.0
    return slope
