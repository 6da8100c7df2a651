r"""Semismooth Newton with line search on the penalised program: the fast route, on the sparse system.

    H(x) d = -g(x),    x <- x + a d,

H the generalised Hessian. Psi is convex and once differentiable, so a is sought where the slope g(x + a d) . d
changes sign: slopes stay meaningful down to round-off, where differences of Psi no longer are. In d = 2 Psi is
piecewise quadratic and the iteration ends after finitely many steps.
"""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.errors import ProgramError
from bipot.programs.condensation import factorise
from bipot.programs.data import Outcome, Timing
from bipot.programs.penalty import Minimum, PenaltyProgram

Floats = NDArray[np.float64]

ITERATIONS = 100
SOLVED = 1e-9
EXACT = 1e-13
LOST = 1e-3
"""Residuals over the largest force: claimed solved below, ended at once below, given up above."""
FLATTER = 0.5
BISECTIONS = 100
SHIFT = 1e-13


def newton(program: PenaltyProgram, start: Floats) -> Minimum:
    """Minimise from ``start`` (n,) until the residual stops falling at round-off.

    Raises:
        ProgramError: the residual stays above 1e-3 of the largest force, or the stiffness is singular.
    """
    began = time.perf_counter()
    x = best = start
    least, iterations = np.inf, 0
    while iterations < ITERATIONS:
        g = program.gradient(x)
        error = float(np.abs(g).max()) / program.largest(x)
        stalled = least <= SOLVED and error >= FLATTER * least
        if error < least:
            best, least = x, error
        if stalled or least <= EXACT:
            break
        d = _direction(program.hessian(x), g)
        iterations += 1
        slope = float(g @ d)
        if slope >= 0:
            break
        x = x + _step(program, x, d, slope) * d
    if not least <= LOST:
        raise ProgramError(f"penalised Newton left a residual of {least:.1e}: use a smaller penalty or increment")
    outcome = Outcome.SOLVED if least <= SOLVED else Outcome.ALMOST
    return Minimum(best, outcome, iterations, Timing(solve=time.perf_counter() - began))


def _direction(H: sp.csc_matrix, g: Floats) -> Floats:
    """-H^-1 g. In homogeneous perfect flow H is singular; a shift at round-off then leaves the minimum where it is."""
    try:
        lu = factorise(H)
    except ProgramError:
        lu = factorise(sp.csc_matrix(H + SHIFT * abs(H).max() * sp.identity(len(g))))
    return lu.solve(-g)


def _step(program: PenaltyProgram, x: Floats, d: Floats, slope: float) -> float:
    """a in (0, 1] with |slope(a)| at most half the first: 1 if that will do, else by bisection on its sign."""

    def at(a: float) -> float:
        return float(program.gradient(x + a * d) @ d)

    if at(1.0) <= -FLATTER * slope:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        a = (low + high) / 2
        now = at(a)
        if abs(now) <= -FLATTER * slope:
            return a
        low, high = (a, high) if now < 0 else (low, a)
    return low
