r"""The condensed penalised program solved by external optimisers, where the paper used MINOS.

SciPy's trust-region method takes value, gradient and generalised Hessian; L-BFGS the first two only. Both work in
y = L' x with L L' the condensed stiffness plus the penalties, a change of variables that leaves the contact's kinks
as the only difficulty. Clarabel, through cvxpy, takes (29) as stated, with the fictitious increments as variables.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from functools import partial
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


def trust_region(program: PenaltyProgram, start: Floats) -> Minimum:
    """Minimise with gradient and generalised Hessian. Raises ProgramError."""
    return _optimise(program, start, "trust-exact", gtol=TOLERANCE, maxiter=500)


def gradient_only(program: PenaltyProgram, start: Floats) -> Minimum:
    """Minimise with gradients only (L-BFGS). Raises ProgramError."""
    return _optimise(program, start, "L-BFGS-B", gtol=TOLERANCE, ftol=0.0, maxiter=5000, maxfun=20000, maxcor=40)


def _optimise(program: PenaltyProgram, start: Floats, method: str, **options: float) -> Minimum:
    """Minimise Psi in y = L' x, measured from its value at the start; raises ProgramError."""
    # scipy.optimize takes long to import, and no other optimiser needs it.
    from scipy.optimize import minimize

    began = time.perf_counter()
    small, condensed = program.condensed()
    u = start[condensed.kept]
    L, level = la.cholesky(_metric(small), lower=True), small.value(u)
    built = time.perf_counter()
    x, inner = partial(la.solve_triangular, L, lower=True, trans=1), partial(la.solve_triangular, L, lower=True)
    derivatives: dict[str, Any] = {"jac": lambda y: inner(small.gradient(x(y)))}
    if method == "trust-exact":
        derivatives["hess"] = lambda y: inner(inner(small.hessian(x(y)).toarray()).T)
        derivatives["callback"] = _ending_refused(L.T @ u)
    answer: Any = minimize(lambda y: small.value(x(y)) - level, L.T @ u, method=method, options=options, **derivatives)
    found = condensed.recover(x(answer.x))
    error = max_abs(program.gradient(found)) / program.largest(found)
    if not error <= LOST:
        raise ProgramError(f"the optimiser left a residual of {error:.1e} ({answer.message})")
    outcome = Claim.SOLVED if error <= SOLVED else Claim.ALMOST
    return Minimum(found, outcome, int(answer.nit), Timing(built - began, time.perf_counter() - built))


def _metric(program: PenaltyProgram) -> Floats:
    """L L' (n, n): the stiffness plus the penalties."""
    terms = program.contact
    G_n, G_t = terms.rows.G_n.toarray(), terms.rows.G_t.toarray()
    k_t = np.repeat(terms.k_t, terms.rows.tangents)
    return program.K + G_n.T @ (terms.k_n[:, None] * G_n) + G_t.T @ (k_t[:, None] * G_t)


def _ending_refused(start: Floats) -> Callable[[Floats], None]:
    """Ends a trust-region run whose steps are rejected: at round-off of Psi its radius would shrink for ever."""
    last = deque([start], maxlen=REFUSALS + 1)

    def seen(y: Floats) -> None:
        last.append(y)
        if len(last) > REFUSALS and all(np.array_equal(y, other) for other in last):
            raise StopIteration

    return seen


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
