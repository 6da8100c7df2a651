r"""The condensed penalised program solved by external optimisers, where the paper used MINOS.

SciPy's trust-region method takes value, gradient and generalised Hessian; L-BFGS the first two only. Both work in
y = L' x with L L' the condensed stiffness plus the penalties, a change of variables that leaves the contact's kinks
as the only difficulty. Clarabel, through cvxpy, takes (29) as stated, with the fictitious increments as variables.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import scipy.linalg as la

from bipot.conic.problem import Claim, Timing
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import solve_stated
from bipot.errors import ProgramError
from bipot.programs.data import Block
from bipot.programs.penalty import LOST, Minimum, PenaltyProgram
from bipot.typing import Floats, max_abs

SOLVED = 1e-7
"""Residual over the largest force up to which an answer is claimed solved."""

TOLERANCE = 1e-9
"""Gradient of the whitened program at which the optimisers are asked to end."""

REFUSALS = 12
"""Steps in a row that a trust region does not take after which it has stalled."""


class Whitened:
    """Psi with its derivatives in y = L' x, measured from its value at the start."""

    def __init__(self, program: PenaltyProgram, start: Floats) -> None:
        self.program = program
        terms = program.contact
        G_n, G_t = terms.rows.G_n.toarray(), terms.rows.G_t.toarray()
        k_t = np.repeat(terms.k_t, terms.rows.tangents)
        metric = program.K + G_n.T @ (terms.k_n[:, None] * G_n) + G_t.T @ (k_t[:, None] * G_t)
        self.L = la.cholesky(metric, lower=True)
        self.level = program.value(start)

    def x(self, y: Floats) -> Floats:
        """L'^-1 y."""
        return la.solve_triangular(self.L, y, lower=True, trans=1)

    def y(self, x: Floats) -> Floats:
        """L' x."""
        return self.L.T @ x

    def value(self, y: Floats) -> float:
        """Psi - Psi(start)."""
        return self.program.value(self.x(y)) - self.level

    def gradient(self, y: Floats) -> Floats:
        """L^-1 g."""
        return la.solve_triangular(self.L, self.program.gradient(self.x(y)), lower=True)

    def hessian(self, y: Floats) -> Floats:
        """L^-1 H L'^-1."""
        half = la.solve_triangular(self.L, self.program.hessian(self.x(y)).toarray(), lower=True)
        return la.solve_triangular(self.L, half.T, lower=True)


class _Stalled:
    """Ends a trust-region run whose steps are rejected: at round-off of Psi its radius would shrink for ever."""

    def __init__(self, y: Floats) -> None:
        self.last, self.refused = y, 0

    def __call__(self, y: Floats) -> None:
        self.refused = self.refused + 1 if np.array_equal(y, self.last) else 0
        self.last = y
        if self.refused == REFUSALS:
            raise StopIteration


def trust_region(program: PenaltyProgram, start: Floats) -> Minimum:
    """Minimise with gradient and generalised Hessian. Raises ProgramError."""
    return _optimise(program, start, "trust-exact", gtol=TOLERANCE, maxiter=500)


def gradient_only(program: PenaltyProgram, start: Floats) -> Minimum:
    """Minimise with gradients only (L-BFGS). Raises ProgramError."""
    return _optimise(program, start, "L-BFGS-B", gtol=TOLERANCE, ftol=0.0, maxiter=5000, maxfun=20000, maxcor=40)


def _optimise(program: PenaltyProgram, start: Floats, method: str, **options: float) -> Minimum:
    # scipy.optimize takes long to import, and no other optimiser needs it.
    from scipy.optimize import minimize

    began = time.perf_counter()
    small, condensed = program.condensed()
    u = start[condensed.kept]
    psi = Whitened(small, u)
    built = time.perf_counter()
    y = psi.y(u)
    second: dict[str, Any] = {"hess": psi.hessian, "callback": _Stalled(y)} if method == "trust-exact" else {}
    answer: Any = minimize(psi.value, y, jac=psi.gradient, method=method, options=options, **second)
    x = condensed.recover(psi.x(answer.x))
    error = max_abs(program.gradient(x)) / program.largest(x)
    if not error <= LOST:
        raise ProgramError(f"the optimiser left a residual of {error:.1e} ({answer.message})")
    outcome = Claim.SOLVED if error <= SOLVED else Claim.ALMOST
    return Minimum(x, outcome, int(answer.nit), Timing(built - began, time.perf_counter() - built))


def fictitious(program: PenaltyProgram, accuracies: tuple[Accuracy, ...]) -> Minimum:
    """Minimise through cvxpy and Clarabel to the first of ``accuracies`` that is claimed met.

    If none is, the answer of least residual is returned as almost solved. Iterations and seconds are those of all
    attempts. Raises ProgramError and its kin when no attempt gave an answer.
    """
    began = time.perf_counter()
    small, condensed = program.condensed()
    stated = small.statement()
    iterations, timing = 0, Timing(build=time.perf_counter() - began)
    answers: list[Floats] = []
    failure = ProgramError("no accuracy was asked for")
    for accuracy in accuracies:
        try:
            outcome, count, spent = solve_stated(stated, accuracy)
        except ProgramError as failed:
            failure = failed
            continue
        iterations, timing = iterations + count, timing + spent
        answers.append(np.asarray(stated.blocks[Block.DISPLACEMENT].value))
        if outcome is Claim.SOLVED:
            return Minimum(condensed.recover(answers[-1]), outcome, iterations, timing)
    if not answers:
        raise failure
    best = min(answers, key=lambda u: max_abs(small.gradient(u)))
    return Minimum(condensed.recover(best), Claim.ALMOST, iterations, timing)
