r"""What a solver's certificate proves of a program, measured on the program's own numbers.

*Infeasible* (Farkas): multipliers z in the dual cones give z . (A x + b) >= 0 at every feasible x. If z . b = -g < 0,
such an x has |A' z|_1 |x| >= g, so that none is nearer than g / |A' z|_1, which has to be out of reach. Every x nearby
misses some row by about g / sum |z| (1 + |b|), which has to be more than a solver may miss anyway.

*Unbounded*: at t along a ray x the cost has fallen by t g, g = -q . x, and risen by t^2/2 x' P x. Its least is at
t = g / x' P x. This has to be out of reach, and the rows have to stay in their cones on the way.

Programs are dimensionless: variables are of order one, or of the largest b. What is FAR times that is out of reach.
"""

from __future__ import annotations

import numpy as np

from bipot.conic.problem import Cone, ConicProgram, Rows, excess
from bipot.typing import Floats, max_abs

FAR = 1e6
"""Size of an answer, over the program's numbers, from which on it is out of reach."""

MISSED = 1e-8
"""Distance by which rows may be missed, over their numbers, in a program that a solver calls solved."""


def infeasible(program: ConicProgram, z: Floats) -> bool:
    """Whether multipliers z (m,) of all rows prove that nothing in reach is feasible."""
    gain, unbalanced, size, largest = 0.0, np.zeros(len(program.q)), 0.0, 1.0
    for rows, part in zip(program.rows, program.split(z).values(), strict=True):
        dual = _dual(rows, part).ravel()
        gain -= float(dual @ rows.b)
        unbalanced += rows.A.T @ dual
        size += float(np.abs(dual) @ (1.0 + np.abs(rows.b)))
        largest = max(largest, max_abs(rows.b))
    return gain > MISSED * size and gain >= FAR * largest * float(np.abs(unbalanced).sum())


def unbounded(program: ConicProgram, x: Floats, far: float = FAR) -> bool:
    """Whether the cost falls along the ray x (n,) up to ``far`` times the program's numbers."""
    gain, size = -float(program.q @ x), max_abs(x)
    largest = max([1.0, *(max_abs(rows.b) for rows in program.rows)])
    curvature = float(x @ (program.P @ x))
    stays = all(excess(rows, (rows.A @ x).reshape(-1, rows.width)) <= size / FAR for rows in program.rows)
    return gain > 0 and stays and gain * size >= far * largest * curvature


def _dual(rows: Rows, z: Floats) -> Floats:
    """Multipliers z (m, width) in the dual cones: the first of each raised to where it has to be."""
    if rows.cone is Cone.ZERO:
        return z
    least = np.linalg.norm(z[:, 1:], axis=1)
    return np.column_stack([np.maximum(z[:, 0], least), z[:, 1:]])
