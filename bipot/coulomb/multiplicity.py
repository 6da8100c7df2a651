"""Whether a problem has more than one solution: two starts, two answers; or every mode of a small plane
problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.coulomb.modes import MOST_CONTACTS, distinct, every_mode
from bipot.coulomb.problem import CoulombProblem
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.solution import CoulombSolution
from bipot.coulomb.solver import Limits, run
from bipot.laws.projections import project_cone
from bipot.laws.tensors import FloatArray


@dataclass(frozen=True, eq=False)
class MultiplicityReport:
    """Solutions with different velocities u. ``exhaustive`` says whether every mode was tried, ``continuum``
    whether some mode holds a whole range of velocities; the ends of the range are then among the solutions.

    Forces may differ at the same u where W is singular: that is hyperstatic, not multiple, and not counted.
    """

    solutions: tuple[CoulombSolution, ...]
    exhaustive: bool
    continuum: bool = False

    @property
    def multiple(self) -> bool:
        """Whether two different answers to the same problem were found."""
        return len(self.solutions) > 1

    @property
    def reason(self) -> str:
        """One sentence."""
        how = "all modes enumerated" if self.exhaustive else "from several starts"
        found = len(self.solutions)
        if not found:
            return f"No solution found ({how})."
        word = "solution" if found == 1 else "solutions with different velocities"
        between = ", with others all the way between some of them" if self.continuum else ""
        return f"{found} {word} found ({how}){between}; a solver returns one of them, by its start."


def _starts(problem: CoulombProblem, count: int) -> list[FloatArray]:
    """No force, full stick, and ``count`` random forces in the cone, of the size that stops u = q."""
    stick = np.linalg.lstsq(problem.W.toarray(), -problem.q, rcond=1e-10)[0]
    size = float(np.abs(stick).max(initial=0.0)) or problem.force_scale
    rng = np.random.default_rng(0)
    random = [rng.normal(size=(problem.contacts, problem.dim)) * size for _ in range(count)]
    guesses = [problem.by_contact(stick), *random]
    return [np.zeros(problem.size), *(project_cone(r, problem.mu).ravel() for r in guesses)]


def enumerate_modes(problem: CoulombProblem, tol: float = 1e-10) -> tuple[CoulombSolution, ...]:
    """Every velocity that solves a plane problem, mode by mode (open, stick, slip either way at each contact).

    4^c modes, so c <= 6 and dim = 2, else SceneError. Where a mode holds a range of velocities its ends are listed:
    see :attr:`MultiplicityReport.continuum`.
    """
    return every_mode(problem, tol).solutions


def multiplicity(
    problem: CoulombProblem, starts: int = 8, limits: Limits | None = None, apart: float = 1e-6
) -> MultiplicityReport:
    """Solve from no force, from full stick and from ``starts`` random forces; plane problems of c <= 6 by
    all modes."""
    if problem.dim == 2 and problem.contacts <= MOST_CONTACTS:
        found = every_mode(problem, apart=apart)
        return MultiplicityReport(found.solutions, exhaustive=True, continuum=found.continuum)
    answers = [run(ProximalPoint(), problem, limits, start) for start in _starts(problem, starts)]
    return MultiplicityReport(distinct([a for a in answers if a.converged], apart), exhaustive=False)
