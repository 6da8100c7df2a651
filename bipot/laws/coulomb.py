"""Unilateral contact with Coulomb friction and its bipotential, (11)-(18), for d = 2 and 3.

Arrays are (c, d), or (…, d), rows (n, t_1 … t_{d-1}); ``mu`` is a number or (c,). The body's displacement
relative to the tool is du (du_n >= 0 opens), the force on the body r (r_n >= 0 pushes), and sliding means
r_t = -mu r_n du_t/|du_t|.

mu = inf glues what touches. The cone is then the closed half space r_n >= 0, its dual {u_t = 0, u_n >= 0};
du_t = 0 is a constraint measured by :func:`dual_cone_violation`, and the terms mu |u_t| and mu r_n |du_t|
count as 0 in the shift, the natural map and the gap. Only :func:`bipotential` gives its +inf.

A ``cap`` on the friction force, a number or (c,), makes it |r_t| <= s(r_n) = min(mu r_n, cap) (:func:`limit`): Orowan's
law. With it mu = inf glues nothing, and s = cap where r_n > 0 is constant shear; where a point touches without a force
s = 0, so s jumps at a landing. The set of (15), K = {r_n >= 0, |r_t| <= s(r_n)}, stays convex, a cone cut by a
cylinder, but De Saxce's shift, made for the cone, does not reduce its law to one projection: natural map and gap then
treat the normal and the tangential part separately, each with its own projection at the frozen s(r_n). Without a cap
(inf) nothing changes.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from bipot.laws.projections import project_cone, project_disc
from bipot.tensors import norm
from bipot.typing import Bools, Floats

Friction = Floats | float


class Status(IntEnum):
    """What a contact point does in an increment."""

    OPEN = 0
    STICK = 1
    SLIP = 2
    UNDECIDED = 3


def _finite(mu: Friction) -> Floats:
    """The coefficient with 0 in place of inf."""
    return np.where(np.isinf(mu), 0.0, mu)


CARRIES = 1e-8
"""A contact force below this fraction of the increment's largest counts as none: solvers leave such at open points."""


def force_threshold(r: Floats) -> float:
    """The force up to which a contact force of r (c, d) counts as none, see :data:`CARRIES`."""
    return CARRIES * float(norm(r).max(initial=0.0))


def limit(r_n: Floats, mu: Friction, cap: Friction = np.inf, none: float = 0.0) -> Floats:
    """Largest friction force s = min(mu r_n, cap), (…).

    Where mu = inf: inf without a cap, whatever r_n (the closed cone), else the cap where r_n is above ``none``, the
    force that counts as none.

    >>> limit(np.array([1.0, 4.0, 0.0]), np.array([0.5, 0.5, np.inf]), 1.0).tolist()
    [0.5, 1.0, 0.0]
    """
    glued = np.where(np.isinf(cap) | (r_n > none), np.inf, 0.0)
    return np.minimum(np.where(np.isinf(mu), glued, _finite(mu) * r_n), cap)


def limit_slope(r_n: Floats, mu: Friction, cap: Friction = np.inf) -> Floats:
    """ds/dr_n of :func:`limit`, (…): mu, and 0 where the cap is active or mu = inf."""
    return np.where(_finite(mu) * r_n < cap, _finite(mu), 0.0)


def cone_violation(r: Floats, mu: Friction, cap: Friction = np.inf, none: float = 0.0) -> Floats:
    """How far r is outside K (15): max of (|r_t| - s(r_n))+ and (-r_n)+, (…, d) -> (…), force units."""
    r_n = r[..., 0]
    return np.maximum(np.maximum(norm(r[..., 1:]) - limit(r_n, mu, cap, none), -r_n), 0.0)


def dual_cone_violation(u: Floats, mu: Friction) -> Floats:
    """How far u is outside the dual cone: (mu |u_t| - u_n)+, (…, d) -> (…), length units.

    mu = inf: max of |u_t| and (-u_n)+.
    """
    u_n, u_t = u[..., 0], norm(u[..., 1:])
    glued = np.maximum(u_t, -u_n)
    return np.maximum(np.where(np.isinf(mu), glued, _finite(mu) * u_t - u_n), 0.0)


def bipotential(du: Floats, r: Floats, mu: Friction, tol: float = 0.0) -> Floats:
    """b_c(-du, r) = mu r_n |du_t| if r is in K_mu and du_n >= 0, +inf otherwise (14), (…), energy units.

    ``tol`` is how far outside, in the units of r and of du, still counts as inside. 0 · inf counts as 0.

    >>> bipotential(np.array([[0.0, -2.0], [-1.0, 0.0]]), np.array([[3.0, 0.5], [3.0, 0.5]]), 0.5).tolist()
    [3.0, inf]
    """
    admissible = (cone_violation(r, mu) <= tol) & (du[..., 0] >= -tol)
    slip_force = r[..., 0] * norm(du[..., 1:])
    with np.errstate(invalid="ignore"):
        value = np.where(slip_force == 0, 0.0, mu * slip_force)
    return np.where(admissible, value, np.inf)


def friction_gap(r: Floats, du_t: Floats, mu: Friction, cap: Friction = np.inf, none: float = 0.0) -> Floats:
    """s(r_n) |du_t| + r_t · du_t, (…), energy units: the tangential part of the gap, for |r_t| <= s >= 0.

    Without a cap mu = inf counts as 0.
    """
    s = limit(r[..., 0], np.where(np.isinf(cap), _finite(mu), mu), cap, none)
    return s * norm(du_t) + np.vecdot(r[..., 1:], du_t)


def bipotential_gap(du: Floats, r: Floats, mu: Friction) -> Floats:
    """Distance to the law, mu r_n |du_t| + r_n du_n + r_t · du_t, (…), energy units.

    It is b_c(-du, r) + du · r without the +inf of (14): never negative for r in K_mu and du_n >= 0, and then
    0 exactly where the law (12) holds. For a law with a gap, pass gap + du_n in the place of du_n.

    >>> bipotential_gap(np.array([[0.0, 2.0]]), np.array([[3.0, -1.5]]), 0.5).tolist()
    [0.0]
    """
    return _finite(mu) * r[..., 0] * norm(du[..., 1:]) + np.sum(r * du, axis=-1)


def incremental_bipotential(du: Floats, dr: Floats, r0: Floats, mu: Friction, tol: float = 0.0) -> Floats:
    """Δb_c(-du, dr) = b_c(-du, r0 + dr) + r0 · du (17), (…), energy units."""
    return bipotential(du, r0 + dr, mu, tol) + np.sum(r0 * du, axis=-1)


def de_saxce_shift(u: Floats, mu: Friction) -> Floats:
    """Shifted displacement u + mu |u_t| n, in the dual of K_mu exactly where u_n >= 0, (…, d) -> (…, d)."""
    shifted = np.array(u, dtype=np.float64)
    shifted[..., 0] += _finite(mu) * norm(shifted[..., 1:])
    return shifted


def natural_map(r: Floats, u: Floats, mu: Friction, rho: Friction, cap: Friction = np.inf, none: float = 0.0) -> Floats:
    """Residual r - P_K(r - rho (u + mu |u_t| n)) of the law (12), zero exactly where it holds, (…, d).

    With a cap, r_n - (r_n - rho u_n)+ and r_t - P(r_t - rho u_t), P on the disc of radius s(r_n)+ (:func:`limit`).
    ``rho`` > 0 is a number or (…), force per length; the map has the units of r.
    """
    step = np.asarray(rho)[..., None]
    cone = r - project_cone(r - step * de_saxce_shift(u, mu), mu)
    if np.isinf(cap).all():
        return cone
    y, radius = r - step * u, np.maximum(limit(r[..., 0], mu, cap, none), 0.0)
    normal = r[..., :1] - np.maximum(y[..., :1], 0.0)
    apart = np.concatenate([normal, r[..., 1:] - project_disc(y[..., 1:], radius)], axis=-1)
    return np.where(np.isinf(cap)[..., None], cone, apart)


def status(
    r: Floats,
    du: Floats,
    gap: Floats | float,
    mu: Friction,
    force_tol: float,
    slip_tol: Floats | float,
    cap: Friction = np.inf,
) -> NDArray[np.int8]:
    """:class:`Status` of each point as an integer, (…).

    OPEN: |r| <= force_tol and gap + du_n > slip_tol. Otherwise, touching means r_n > force_tol and
    |gap + du_n| <= slip_tol, and then
    SLIP: |du_t| > slip_tol and |r_t| >= s - force_tol (or mu = 0 or cap = 0, where nothing resists);
    STICK: |du_t| <= slip_tol and |r_t| < s - force_tol, s = mu r_n or less by the cap.
    UNDECIDED is the rest: grazing, on the edge between stick and slip, or outside the law.
    """
    r_n, slip, gap_after = r[..., 0], norm(du[..., 1:]), gap + du[..., 0]
    strictly_inside = norm(r[..., 1:]) < limit(r_n, mu, cap, force_tol) - force_tol
    opened = (norm(r) <= force_tol) & (gap_after > slip_tol)
    touching = (r_n > force_tol) & (np.abs(gap_after) <= slip_tol)
    sliding = touching & (((slip > slip_tol) & ~strictly_inside) | (np.minimum(mu, cap) == 0))
    sticking = touching & (slip <= slip_tol) & strictly_inside
    choices = [np.int8(Status.OPEN), np.int8(Status.SLIP), np.int8(Status.STICK)]
    return np.select([opened, sliding, sticking], choices, np.int8(Status.UNDECIDED))


def satisfies_law(du: Floats, r: Floats, mu: Friction, tol: float) -> Bools:
    """Whether r(du) follows (12), case by case on the force, (…); data of order one, ``tol`` absolute.

    Separating: r = 0 and du_n >= 0. Sticking: |r_t| <= mu r_n and du = 0. Sliding: |r_t| = mu r_n, du_n = 0
    and du_t = -λ r_t/|r_t| with λ >= 0. Two slips of the printed (12) are mended: sliding has du_n = 0, not
    >= 0, and sticking allows equality (which the sliding case with λ = 0 covers).
    """
    r_n, r_t, du_n, du_t = r[..., 0], r[..., 1:], du[..., 0], du[..., 1:]
    force, slip, most = norm(r_t), norm(du_t), limit(r_n, mu)
    no_force = np.abs(r_n) <= tol
    separating = (force <= tol * (1.0 + _finite(mu))) & (du_n >= -tol)
    sticking = (np.abs(du_n) <= tol) & (slip <= tol)
    along = np.divide(r_t, force[..., None], out=np.zeros(r_t.shape), where=force[..., None] > tol)
    opposed = (norm(du_t + slip[..., None] * along) <= tol) | (force <= tol)
    sliding = (np.abs(force - most) <= tol) & (np.abs(du_n) <= tol) & opposed
    pushing = np.where(force < most - tol, sticking, sliding)
    return np.where(no_force, separating, (r_n > tol) & pushing)


def satisfies_inverse_law(du: Floats, r: Floats, mu: Friction, tol: float) -> Bools:
    """Whether du(r) follows (13), case by case on the displacement, (…); data of order one, ``tol`` absolute.

    No contact: du_n > 0 and r = 0. Sticking: du = 0 and |r_t| <= mu r_n. Sliding: du_n = 0, du_t ≠ 0 and
    r_t = -mu r_n du_t/|du_t|. Two slips of the printed (13) are mended: no contact has du_n > 0, not = 0, and
    sticking allows equality.
    """
    r_n, r_t, du_n, du_t = r[..., 0], r[..., 1:], du[..., 0], du[..., 1:]
    slip = norm(du_t)
    no_contact = norm(r) <= tol
    sticking = (r_n >= -tol) & (norm(r_t) <= limit(r_n, mu) + tol)
    along = np.divide(du_t, slip[..., None], out=np.zeros(du_t.shape), where=slip[..., None] > tol)
    opposed = norm(r_t + (_finite(mu) * r_n)[..., None] * along) <= tol
    sliding = np.where(np.isinf(mu), no_contact, (r_n >= -tol) & opposed)
    contact = (du_n >= -tol) & np.where(slip <= tol, sticking, sliding)
    return np.where(du_n > tol, no_contact, contact)
