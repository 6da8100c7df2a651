"""A contact force that measures itself against Coulomb's law, whatever solver it came from.

The measure that decides whether a force solves a problem: the distance to the law relative to the load.

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

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bipot.coulomb.problem import TIE, CoulombProblem
from bipot.errors import require, require_type
from bipot.laws import coulomb
from bipot.laws.projections import project_cone
from bipot.tensors import norm, unit
from bipot.typing import Floats, as_numbers, max_abs, require_within

_EPS = float(np.finfo(np.float64).eps)


class Outcome(Enum):
    """Why a solver stopped. Only CONVERGED answers passed the test of :func:`residual`, recomputed from r."""

    CONVERGED = "converged"
    STALLED = "stalled"
    ITERATION_LIMIT = "iteration limit"
    TIME_LIMIT = "time limit"
    FAILED = "failed"


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


def nearest_law(r: Floats, u: Floats, mu: Floats) -> Nearest:
    """Distance of each pair r, u (c, d) to Coulomb's law with mu (c,), in the common unit of both.

    Slip in space has a direction to choose: that of u_t and that against r_t are tried, so the distance may be
    too long (by a factor of √2 at most) and is never too short.

    >>> r, u = np.array([[2.0, -1.0], [0.0, 0.0]]), np.array([[-0.1, 3.0], [4.0, 1.0]])
    >>> nearest_law(r, u, np.array([0.5, 0.5])).distance.tolist()
    [0.1, 0.0]
    """
    first = np.eye(1, r.shape[1] - 1)
    slip = np.minimum(*(_slip_distance(r, u, mu, unit(along, first)) for along in (u[:, 1:], -r[:, 1:])))
    stick = np.hypot(norm(u), norm(r - project_cone(r, mu)))
    opened = np.hypot(norm(r), np.minimum(u[:, 0], 0.0))
    # Where branches tie, the one of least load, but never open: a violated gap must not hide behind its clearance.
    # Ties are common (forces outside the cone, a gap violated without a force), so round-off must not decide them.
    slips = slip <= TIE * np.minimum(stick, opened)
    sticks = ~slips & (stick <= TIE * opened)
    bearing = np.zeros(r.shape)
    bearing[:, 0] = slips | sticks
    bearing[:, 1:] = (sticks & (mu > 0))[:, None]
    return Nearest(np.minimum(np.minimum(slip, stick), opened), bearing)


def judge(problem: CoulombProblem, r: Floats) -> Judgement:
    """How far a force r (dc,) is from solving a problem, relative to the load.

    For each group of contacts, in contact units, 2-norms over the group:

        residual = max(|distance| / |load|, resolution),   resolution = ε | |W'| |r'| | / |load|,   ε = 2.2e-16

    and for each contact the same of its own rows, with |its load| + | |W'| |r'| | in the place of |load| where this is
    less. The resolution is what round-off of W r leaves unknown: where it is above a tolerance no answer with that
    force can be said to meet it. Where no load bears on a touching contact (q = 0 there), the smaller of |q'| and |r'|
    that is not zero is the scale. Forces so large that their squares overflow are infinitely far off.
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
    added = reach(problem, r)
    pressing = norm(load * found.bearing)
    count = int(group.max()) + 1

    def by_group(lengths: Floats) -> Floats:
        return np.sqrt(np.bincount(group, lengths * lengths, count))

    scale = _scale(by_group(pressing), by_group(norm(load)), by_group(norm(forces)))
    moved = pressing + added
    contact_scale = np.where(moved > 0, np.minimum(moved, scale[group]), scale[group])

    def worst(lengths: Floats) -> float:
        return max(float(np.max(by_group(lengths) / scale)), float(np.max(lengths / contact_scale)))

    resolution = worst(_EPS * added)
    return Judgement(max(worst(found.distance), resolution), resolution)


def reach(problem: CoulombProblem, r: Floats) -> Floats:
    """| |W'| |r'| | of each contact (c,), in contact units: the magnitude of what a force r (dc,) moves it by."""
    return norm(problem.by_contact(problem.magnitudes @ np.abs(r)) / problem.contact_unit[:, None])


def _scale(bearing: Floats, load: Floats, force: Floats) -> Floats:
    """The bearing load of each group, else the smaller of its load and its force that is not zero, else 1."""
    either = np.minimum(np.where(load > 0, load, np.inf), np.where(force > 0, force, np.inf))
    return np.where(bearing > 0, bearing, np.where(np.isfinite(either), either, 1.0))


def _natural_error(problem: CoulombProblem, r: Floats, u: Floats, q: Floats) -> float:
    """|F| / max(|q|, |r|, |u|) with F the natural map at step 1 (absolute when the scale is round-off)."""
    F = coulomb.natural_map(problem.by_contact(r), problem.by_contact(u), problem.mu, 1.0)
    scale = max(float(np.linalg.norm(x)) for x in (q, r, u))
    error = float(np.linalg.norm(F))
    return error / scale if scale > _EPS else error


def known_force(problem: CoulombProblem, r: object, field: str = "r") -> Floats:
    """``r`` as a force of the problem; raises SceneError unless it is one of finite numbers (dc,)."""
    require_type(problem, CoulombProblem, "problem")
    force = as_numbers(r, field)
    require(force.shape == (problem.size,), f"{field}.shape", force.shape, f"({problem.size},)")
    require(bool(np.isfinite(force).all()), field, "a force with NaN or inf", "finite")
    return force


def natural_residual(problem: CoulombProblem, r: Floats) -> float:
    """The usual criterion: |r - P_K(r - (u + mu |u_t| n))| / max(|q|, |r|, |u|), 2-norms over all contacts.

    It mixes units (step 1) and hides any error where |r| diverges: it is reported but decides nothing.
    """
    r = known_force(problem, r)
    return _natural_error(problem, r, problem.velocity(r), problem.q)


def unit_free_residual(problem: CoulombProblem, r: Floats) -> float:
    """The same of the problem (rho W, q/|q|) at r/(rho |q|), rho = d c / trace W: no unit enters.

    |F| / max(1, |r|/(rho |q|), |u|/|q|); where q = 0, |q| counts as 1 and the 1 as 0. It too hides errors where r
    diverges.
    """
    r = known_force(problem, r)
    length = float(np.linalg.norm(problem.q)) or 1.0
    force = problem.force_scale * length
    return _natural_error(problem, r / force, problem.velocity(r) / length, problem.q / length)


def residual(problem: CoulombProblem, r: Floats) -> float:
    """Distance to the law relative to the load, which decides "solved": :func:`judge`."""
    return judge(problem, known_force(problem, r)).residual


@dataclass(frozen=True, eq=False, repr=False)
class CoulombSolution:
    """A force r (dc,) for ``problem``, with the solver's report and the means to check it.

    ``reason`` is a full sentence: what happened and, unless converged, what to try. ``seconds`` is wall time.
    """

    problem: CoulombProblem
    r: Floats
    outcome: Outcome
    solver: str
    reason: str
    iterations: int
    seconds: float

    def __repr__(self) -> str:
        """One line, without the arrays."""
        return f"CoulombSolution({self.problem.contacts} contacts: {self.reason})"

    @property
    def converged(self) -> bool:
        """Whether the residual, recomputed from r, is within the tolerance."""
        return self.outcome is Outcome.CONVERGED

    @cached_property
    def u(self) -> Floats:
        """Relative velocities or displacements W r + q, (dc,)."""
        return self.problem.velocity(self.r)

    def _pair(self) -> tuple[Floats, Floats]:
        return self.problem.by_contact(self.r), self.problem.by_contact(self.u)

    def natural_residual(self) -> float:
        """See :func:`natural_residual`."""
        return natural_residual(self.problem, self.r)

    def unit_free_residual(self) -> float:
        """See :func:`unit_free_residual`."""
        return unit_free_residual(self.problem, self.r)

    def residual(self) -> float:
        """See :func:`residual`."""
        return residual(self.problem, self.r)

    def resolution(self) -> float:
        """The residual that round-off of W r alone would explain, relative to the load; a part of the residual."""
        return judge(self.problem, self.r).resolution

    def cone_violation(self) -> float:
        """Largest distance outside the friction cone, max (|r_t| - mu r_n)+, (-r_n)+, in force units."""
        return float(coulomb.cone_violation(self._pair()[0], self.problem.mu).max())

    def dual_cone_violation(self) -> float:
        """Largest (-u_n)+, length units: the shifted u + mu |u_t| n is in the dual cone exactly where u_n >= 0."""
        return float(np.maximum(-self._pair()[1][:, 0], 0.0).max())

    def bipotential_gap(self) -> float:
        """Sum over contacts of |mu r_n |u_t| + r_n u_n + r_t · u_t|, energy units; absolute, so that none cancel."""
        r, u = self._pair()
        return float(np.abs(coulomb.bipotential_gap(u, r, self.problem.mu)).sum())

    def status(self, tol: float = 1e-8) -> NDArray[np.int8]:
        """:class:`~bipot.laws.coulomb.Status` of each contact, (c,), in its unit (:attr:`CoulombProblem.contact_unit`).

        ``tol`` is relative: of forces to max |r'|, of velocities to what they are the sum of, |q'| + |W'| |r'|.
        """
        require_within(tol, "tol", ">= 0")
        r, u = self._pair()
        unit = self.problem.contact_unit[:, None]
        r, u = r * unit, u / unit
        force = tol * max(max_abs(r), float(np.finfo(np.float64).tiny))
        slip = tol * (norm(self.problem.by_contact(self.problem.q) / unit) + reach(self.problem, self.r))
        return coulomb.status(r, u, 0.0, self.problem.mu, force, slip)
