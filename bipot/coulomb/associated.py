"""The associated relaxation: a convex program that is often mistaken for Coulomb's law, kept apart by name.

    min ½ r · W r + q · r   over r in K_mu

Its solution has u in the dual cone, normal to r: sliding then *opens* the contact, u_n = mu |u_t|
(dilatancy). That is the flow rule of an associated material, not dry friction; De Saxcé's shift removes it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.coulomb.conic import ConicSettings, force_program, polished_force
from bipot.coulomb.functions import ConeMap
from bipot.coulomb.problem import ROUGHLY, CoulombProblem
from bipot.coulomb.solver import scale
from bipot.errors import require, require_type
from bipot.laws.projections import project_cone
from bipot.typing import Floats


@dataclass(frozen=True, eq=False)
class AssociatedSolution:
    """Minimiser r (dc,) of the relaxation. Not a :class:`CoulombSolution`: it solves another law."""

    problem: CoulombProblem
    r: Floats

    @property
    def u(self) -> Floats:
        """W r + q, (dc,)."""
        return self.problem.velocity(self.r)

    def residual(self) -> float:
        """|r - P_K(r - ρ u)| / max(ρ |q|, |r|), ρ = d c / trace W: the relaxation's own optimality."""
        p = self.problem
        r, u = p.by_contact(self.r), p.by_contact(self.u)
        error = r - project_cone(r - p.force_scale * u, p.mu)
        size = max(p.force_scale * float(np.linalg.norm(p.q)), float(np.linalg.norm(r)))
        return float(np.linalg.norm(error)) / size if size else 0.0

    def dilatancy(self) -> float:
        """Opening by sliding, the sum of u_n over contacts that carry force, length units; 0 under Coulomb's
        law."""
        r, u = self.problem.by_contact(self.r), self.problem.by_contact(self.u)
        return float(np.sum(np.where(r[:, 0] > 1e-9 * np.abs(r).max(initial=0.0), u[:, 0], 0.0)))


def solve_associated(problem: CoulombProblem, settings: ConicSettings | None = None) -> AssociatedSolution:
    """Solve the relaxation by one conic program and its polish.

    Raises SceneError for an unsymmetric W or an indefinite one, InfeasibleProgram where the program is unbounded.
    """
    require_type(problem, CoulombProblem, "problem")
    require_type(settings, ConicSettings, "settings", optional=True)
    asymmetry, settings = problem.asymmetry, settings or ConicSettings()
    require(asymmetry <= ROUGHLY, "asymmetry of W", asymmetry, f"<= {ROUGHLY}: the relaxation is an energy")
    require(problem.semidefinite, "W", "indefinite", "positive semidefinite: the relaxation is a convex energy")
    scaled = scale(problem)
    program = force_program(scaled, scaled.mu, settings)
    r = program.solve(scaled.q, np.zeros_like(scaled.mu))
    return AssociatedSolution(problem, scaled.unscale(polished_force(scaled, ConeMap(), r, scaled.q, 10)))
