r"""What a solver's certificate proves of a program, measured on the program's own numbers.

*Infeasible* (Farkas): multipliers z in the dual cones give z . (A x + b) >= 0 at every feasible x. Where z . b = -g < 0
these have |A' z|_1 |x| >= g, so none is shorter than the *reach* g / |A' z|_1; and every x misses some row by about
g / sum |z| (1 + |b|), which has to be more than what a solver may miss anyway.

*Unbounded*: along a ray x the cost falls by its gain g = -q . x and rises by t^2/2 x' P x, to its least at
t = g / x' P x. That has to be out of reach, and the rows have to stay in their cones on the way.

Programs are dimensionless: variables are of order one, or of the largest b. The reach is measured by these.
"""

from __future__ import annotations

import numpy as np

from bipot.conic.problem import Cone, ConicProgram, Rows
from bipot.typing import Floats, max_abs

FAR = 1e6
"""Nothing that a program is asked for is as far as that, over its numbers."""

MISSED = 1e-8
"""What rows may be missed by, over their numbers, where a solver says that it has solved a program."""


def infeasible(program: ConicProgram, z: Floats) -> bool:
    """Whether multipliers z (m,) of all rows prove that nothing in reach is feasible."""
    gain, left, size, largest = 0.0, np.zeros(len(program.q)), 0.0, 1.0
    for rows, own in zip(program.rows, program.split(z).values(), strict=True):
        own = _dual(rows, own).ravel()
        gain -= float(own @ rows.b)
        left += rows.A.T @ own
        size += float(np.abs(own) @ (1.0 + np.abs(rows.b)))
        largest = max(largest, max_abs(rows.b))
    return gain > MISSED * size and gain >= FAR * largest * float(np.abs(left).sum())


def unbounded(program: ConicProgram, x: Floats, far: float = FAR) -> bool:
    """Whether the cost falls along the ray x (n,) as ``far`` as anything is in reach."""
    gain, size = -float(program.q @ x), max_abs(x)
    largest = max([1.0, *(max_abs(rows.b) for rows in program.rows)])
    curvature = float(x @ (program.P @ x))
    stays = all(_left(rows, rows.A @ x) <= size / FAR for rows in program.rows)
    return gain > 0 and stays and gain * size >= far * largest * curvature


def _left(rows: Rows, motion: Floats) -> float:
    """How far the motion A x of rows leaves their cones."""
    if rows.cone is Cone.ZERO:
        return max_abs(motion)
    motion = motion.reshape(-1, rows.width)
    return float((np.linalg.norm(motion[:, 1:], axis=1) - motion[:, 0]).max(initial=0.0))


def _dual(rows: Rows, z: Floats) -> Floats:
    """Multipliers z (m, width) in the dual cones: the first of each raised to where it has to be."""
    if rows.cone is Cone.ZERO:
        return z
    least = np.linalg.norm(z[:, 1:], axis=1)
    return np.column_stack([np.maximum(z[:, 0], least), z[:, 1:]])
