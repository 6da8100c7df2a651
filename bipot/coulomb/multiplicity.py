"""Whether a problem has more than one solution: two starts, two answers; or every mode of a small plane
problem."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from time import perf_counter

import numpy as np

from bipot.coulomb.problem import CoulombProblem
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.solution import CoulombSolution, Outcome, residual
from bipot.coulomb.solver import Limits, run
from bipot.errors import require
from bipot.laws import coulomb
from bipot.laws.coulomb import Status
from bipot.laws.tensors import FloatArray

_MOST_CONTACTS = 6


@dataclass(frozen=True, eq=False)
class MultiplicityReport:
    """Solutions with different velocities u. ``exhaustive`` says whether every mode was tried.

    Forces may differ at the same u where W is singular: that is hyperstatic, not multiple, and not counted.
    """

    solutions: tuple[CoulombSolution, ...]
    exhaustive: bool

    @property
    def multiple(self) -> bool:
        """Whether two different answers to the same problem were found."""
        return len(self.solutions) > 1

    @property
    def reason(self) -> str:
        """One sentence."""
        how = "all modes enumerated" if self.exhaustive else "from several starts"
        found = len(self.solutions)
        word = "solution" if found == 1 else "solutions with different velocities"
        return f"{found} {word} found ({how}); a solver returns one of them, by its start."


def _starts(problem: CoulombProblem, count: int) -> list[FloatArray]:
    """No force, full stick, and ``count`` random forces in the cone, of the size that stops u = q."""
    stick = np.linalg.lstsq(problem.W.toarray(), -problem.q, rcond=1e-10)[0]
    size = float(np.abs(stick).max(initial=0.0)) or problem.force_scale
    rng = np.random.default_rng(0)
    random = [rng.normal(size=(problem.contacts, problem.dim)) * size for _ in range(count)]
    guesses = [problem.by_contact(stick), *random]
    return [np.zeros(problem.size), *(coulomb.project_cone(r, problem.mu).ravel() for r in guesses)]


def _distinct(answers: list[CoulombSolution], apart: float) -> tuple[CoulombSolution, ...]:
    """The first answer of each u, velocities differing by more than ``apart`` relative to |q|."""
    kept: list[CoulombSolution] = []
    for answer in answers:
        size = apart * max(float(np.linalg.norm(answer.problem.q)), float(np.finfo(np.float64).tiny))
        if all(float(np.linalg.norm(answer.u - other.u)) > size for other in kept):
            kept.append(answer)
    return tuple(kept)


def enumerate_modes(problem: CoulombProblem, tol: float = 1e-10) -> tuple[CoulombSolution, ...]:
    """Every solution of a plane problem, one for each mode (open, stick, slip either way at each contact).

    4^c linear systems, so c <= 6 and dim = 2, else SceneError. A mode with a singular system contributes its
    least-norm force only, so a continuum of solutions shows as one of its points.
    """
    require(problem.dim == 2, "dim", problem.dim, "2, where modes are finite in number")
    require(problem.contacts <= _MOST_CONTACTS, "contacts", problem.contacts, f"<= {_MOST_CONTACTS}")
    W, q, c, began = problem.W.toarray(), problem.q, problem.contacts, perf_counter()
    answers: list[CoulombSolution] = []
    for mode in product(((Status.OPEN, 0), (Status.STICK, 0), (Status.SLIP, 1), (Status.SLIP, -1)), repeat=c):
        A, b = np.eye(2 * c), np.zeros(2 * c)
        for k, (status, way) in enumerate(mode):
            n, t = 2 * k, 2 * k + 1
            if status is not Status.OPEN:
                A[n], b[n] = W[n], -q[n]
            if status is Status.STICK:
                A[t], b[t] = W[t], -q[t]
            elif status is Status.SLIP:
                A[t, n] = way * problem.mu[k]
        r = np.asarray(np.linalg.lstsq(A, b, rcond=1e-12)[0], dtype=np.float64)
        if residual(problem, r) <= tol:
            name = " ".join(status.name.lower() for status, _ in mode)
            seconds = perf_counter() - began
            answers.append(
                CoulombSolution(problem, r, Outcome.CONVERGED, "modes", f"Mode {name}.", len(answers), seconds)
            )
    return _distinct(answers, 1e-6)


def multiplicity(
    problem: CoulombProblem, starts: int = 8, limits: Limits | None = None, apart: float = 1e-6
) -> MultiplicityReport:
    """Solve from no force, from full stick and from ``starts`` random forces; plane problems of c <= 6 by
    all modes."""
    if problem.dim == 2 and problem.contacts <= _MOST_CONTACTS:
        return MultiplicityReport(enumerate_modes(problem), exhaustive=True)
    answers = [run(ProximalPoint(), problem, limits, start) for start in _starts(problem, starts)]
    return MultiplicityReport(_distinct([a for a in answers if a.converged], apart), exhaustive=False)
