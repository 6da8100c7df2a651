"""A contact force that measures itself against Coulomb's law, whatever solver it came from."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bipot.coulomb.judgement import judge
from bipot.coulomb.problem import CoulombProblem
from bipot.errors import require, require_type
from bipot.laws import coulomb
from bipot.typing import Floats, as_numbers, max_abs


class Outcome(Enum):
    """Why a solver stopped. Only CONVERGED answers passed the test of :func:`residual`, recomputed from r."""

    CONVERGED = "converged"
    STALLED = "stalled"
    ITERATION_LIMIT = "iteration limit"
    TIME_LIMIT = "time limit"
    FAILED = "failed"


def _natural_error(problem: CoulombProblem, r: Floats, u: Floats, q: Floats) -> float:
    """|F| / max(|q|, |r|, |u|) with F the natural map at step 1 (absolute when the scale is round-off)."""
    F = coulomb.natural_map(problem.by_contact(r), problem.by_contact(u), problem.mu, 1.0)
    scale = max(float(np.linalg.norm(x)) for x in (q, r, u))
    error = float(np.linalg.norm(F))
    return error / scale if scale > np.finfo(np.float64).eps else error


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

    |F| / max(1, |r|/(rho |q|), |u|/|q|); |q| counts as 1 where q = 0. It too hides errors where r diverges.
    """
    r = known_force(problem, r)
    length = float(np.linalg.norm(problem.q)) or 1.0
    force = problem.force_scale * length
    return _natural_error(problem, r / force, problem.velocity(r) / length, problem.q / length)


def residual(problem: CoulombProblem, r: Floats) -> float:
    """Distance to the law relative to the load, which decides "solved": :func:`bipot.coulomb.judgement.judge`."""
    return judge(problem, known_force(problem, r)).residual


@dataclass(frozen=True, eq=False)
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
        """Largest (-u_n)+: the shifted u + mu |u_t| n lies in the dual cone exactly where u_n >= 0; length
        units."""
        return float(np.maximum(-self._pair()[1][:, 0], 0.0).max())

    def bipotential_gap(self) -> float:
        """Sum over contacts of |mu r_n |u_t| + r_n u_n + r_t · u_t|, energy units; absolute, so that bad
        signs cannot cancel."""
        r, u = self._pair()
        return float(np.abs(coulomb.bipotential_gap(u, r, self.problem.mu)).sum())

    def status(self, tol: float = 1e-8) -> NDArray[np.int8]:
        """:class:`bipot.laws.coulomb.Status` of each contact, (c,); ``tol`` relative to max |r'| and max |u'|, in
        the units of each contact (:attr:`CoulombProblem.contact_unit`)."""
        r, u = self._pair()
        unit = self.problem.contact_unit[:, None]
        r, u = r * unit, u / unit
        force, slip = (tol * max(max_abs(x), float(np.finfo(np.float64).tiny)) for x in (r, u))
        return coulomb.status(r, u, 0.0, self.problem.mu, force, slip)
