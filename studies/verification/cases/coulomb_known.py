"""Discrete Coulomb problems whose solutions are all known."""

from __future__ import annotations

import numpy as np

from bipot import coulomb
from bipot.errors import InfeasibleProgram
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.discrete import HYPERSTATIC, UNDAMPED, UNIQUE, Known, opposed, three_solutions

FINE = coulomb.Limits(tol=1e-12)
HYPER = "singular W"
KNOWN = UNIQUE | {HYPER: HYPERSTATIC}


def error(known: Known) -> float:
    """Largest error of forces and velocities over the largest of each."""
    answer = coulomb.solve(known.problem, FINE)
    pairs = ((answer.r, known.r), (answer.u, known.u))
    return max(float(np.abs(found - exact).max() / np.abs(exact).max()) for found, exact in pairs)


def refused() -> bool:
    """Whether the dof between contacts that overlap is said to have no solution."""
    try:
        coulomb.solve(opposed(-1.0).reduced())
    except InfeasibleProgram:
        return True
    return False


def run(contacts: int, watch: Watch) -> list[float]:
    """Errors, whether the damped fixed point converges, solutions of the problem that has three, and the refusal."""
    damped = coulomb.run(
        coulomb.DeSaxceFixedPoint(coulomb.Damped(0.5)), UNIQUE[UNDAMPED].problem, coulomb.Limits(tol=1e-10)
    )
    found = coulomb.multiplicity(three_solutions()).solutions
    return [*map(error, KNOWN.values()), float(damped.converged), float(len(found)), float(refused())]


CASE = Case(
    name="coulomb_known",
    subject=Subject.DISCRETE,
    source="derived: all modes of contact enumerated",
    purpose=(
        "The discrete problem alone, where common methods fail: Gauss-Seidel cycles, the undamped sequence of convex"
        " programs cycles, W is singular, or there are three solutions or none. The solver must find the solutions "
        "that exist and report where there is none."
    ),
    setup=(
        "Plane problems u = W r + q of one or two contacts (their numbers: `studies/verification/discrete.py`),"
        " solved by `coulomb.solve`. Errors are those of forces and velocities over the largest of each; the numbers"
        " of the problem with a singular W are known to seven digits."
    ),
    asked=(
        *(Asked(f"error, {name}", 0.0, known.digits) for name, known in KNOWN.items()),
        Asked("convex programs, damped by one half, converge (1: yes)", 1, 0.0),
        Asked("solutions, mu above the bound", 3, 0.0),
        Asked("no solution is refused (1: yes)", 1, 0.0),
    ),
    counted="contacts at most",
    meshes=(2,),
    run=run,
    marched=False,
)
