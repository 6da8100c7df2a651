"""The measure that decides whether a force solves a problem: the distance to the law relative to the load.

Each contact has units of its own: w, the mean of its diagonal of W, turns force into length, so that
r' = √w r and u' = u/√w share a unit (the root of an energy). One w for all rows of a contact keeps the law as
it is. A contact's distance to the law is the length of the shortest (δr', δu') that leads to an exact pair: open
(r = 0, u_n >= 0), stick (u = 0, r in K_mu) or slip (u_n = 0, r on the cone against u_t). It covers the primal cone, the
dual cone and complementarity together, and a large mu does not magnify it.

The scale is the load q' and never the force: forces that diverge where no solution exists would hide any error, and
u = W r + q diverges with them. Only the part of q' that presses or drags touching contacts counts: all of it where they
stick, its normal part where they slip, nothing where they are open, because a clearance or a sliding velocity may be
arbitrarily large without affecting the forces. Groups of contacts that W does not couple are separate problems,
measured separately. Each contact is also measured by what moves it where that is less than the load of its group,
because otherwise even a weak coupling would let one contact's large load hide another's error. The residual is the
largest of these.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.coulomb.problem import CoulombProblem
from bipot.laws.projections import project_cone
from bipot.tensors import norm
from bipot.typing import Floats

_EPS, _TIE = float(np.finfo(np.float64).eps), 1.0 + 1e-9


class Nearest(NamedTuple):
    """Distance to the law (c,), and which rows of a load bear on each contact's nearest branch, 0 or 1 (c, d)."""

    distance: Floats
    bearing: Floats


class Judgement(NamedTuple):
    """``residual`` and, as a part of it, the ``resolution`` that round-off leaves; both relative to the load."""

    residual: float
    resolution: float


NOWHERE = Judgement(float("inf"), float("inf"))


def _slip_distance(r: Floats, u: Floats, mu: Floats, e: Floats) -> Floats:
    """Distance to slip along e, (c, d - 1) of unit length: u_n = 0, u_t = s e, r = f (1, -mu e), s and f >= 0."""
    ray = np.column_stack([np.ones_like(mu), -mu[:, None] * e]) / np.sqrt(1.0 + mu * mu)[:, None]
    force = np.maximum(np.sum(r * ray, axis=1), 0.0)
    slip = np.maximum(np.sum(u[:, 1:] * e, axis=1), 0.0)
    off_force, off_slip = norm(r - force[:, None] * ray), norm(u[:, 1:] - slip[:, None] * e)
    return np.sqrt(u[:, 0] ** 2 + off_force**2 + off_slip**2)


def _direction(t: Floats) -> Floats:
    size = norm(t)[:, None]
    first = np.eye(1, t.shape[1])
    return np.where(size > 0, np.divide(t, size, out=np.zeros(t.shape), where=size > 0), first)


def nearest_law(r: Floats, u: Floats, mu: Floats) -> Nearest:
    """Distance of each pair r, u (c, d) to Coulomb's law with mu (c,), in the common unit of both.

    Slip in space has a direction to choose: that of u_t and that against r_t are tried, so the distance may be
    too long (by a factor of √2 at most) and is never too short.

    >>> r, u = np.array([[2.0, -1.0], [0.0, 0.0]]), np.array([[-0.1, 3.0], [4.0, 1.0]])
    >>> nearest_law(r, u, np.array([0.5, 0.5])).distance.tolist()
    [0.1, 0.0]
    """
    slip = np.minimum(_slip_distance(r, u, mu, _direction(u[:, 1:])), _slip_distance(r, u, mu, _direction(-r[:, 1:])))
    stick = np.hypot(norm(u), norm(r - project_cone(r, mu)))
    opened = np.hypot(norm(r), np.minimum(u[:, 0], 0.0))
    # Where branches tie, the one of least load, but never open: a violated gap must not hide behind its clearance.
    # Ties are common (forces outside the cone, a gap violated without a force), so round-off must not decide them.
    slips = slip <= _TIE * np.minimum(stick, opened)
    sticks = ~slips & (stick <= _TIE * opened)
    bearing = np.zeros(r.shape)
    bearing[:, 0] = slips | sticks
    bearing[:, 1:] = (sticks & (mu > 0))[:, None]
    return Nearest(np.minimum(np.minimum(slip, stick), opened), bearing)


def judge(problem: CoulombProblem, r: Floats) -> Judgement:
    """How far a force r (dc,) is from solving a problem, relative to the load.

    For each group of contacts, in contact units, 2-norms over the group:

        residual = max(|distance| / |load|, resolution),   resolution = ε | |W'| |r'| | / |load|,   ε = 2.2e-16

    and for each contact the same of its own rows, with |q'| + | |W'| |r'| | for |load| where that is less.
    The resolution is what round-off of W r leaves unknown: where it is above a tolerance no answer with that force
    can be said to meet it. Where no load bears on a touching contact (q = 0 there), the smaller of |q'| and |r'|
    that is not zero is the scale.
    Forces so large that their squares overflow are infinitely far off.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        found = _judged(problem, r)
    return found if np.isfinite(found.residual) else NOWHERE


def _judged(problem: CoulombProblem, r: Floats) -> Judgement:
    unit, group = problem.contact_unit, problem.groups
    rows = np.repeat(unit, problem.dim)
    forces, load = problem.by_contact(r * rows), problem.by_contact(problem.q / rows)
    moves = problem.by_contact(problem.velocity(r) / rows)
    found = nearest_law(forces, moves, problem.mu)
    reach = norm(problem.by_contact((problem.magnitudes @ np.abs(r)) / rows))
    pressing = norm(load * found.bearing)
    count = int(group.max()) + 1

    def length(lengths: Floats) -> Floats:
        return np.sqrt(np.bincount(group, lengths * lengths, count))

    scale = _scale(length(pressing), length(norm(load)), length(norm(forces)))
    moved = pressing + reach
    own = np.where(moved > 0, np.minimum(moved, scale[group]), scale[group])

    def worst(lengths: Floats) -> float:
        return max(float(np.max(length(lengths) / scale)), float(np.max(lengths / own)))

    resolution = worst(_EPS * reach)
    return Judgement(max(worst(found.distance), resolution), resolution)


def _scale(bearing: Floats, load: Floats, force: Floats) -> Floats:
    either = np.minimum(np.where(load > 0, load, np.inf), np.where(force > 0, force, np.inf))
    return np.where(bearing > 0, bearing, np.where(np.isfinite(either), either, 1.0))
