"""Which closed contacts a rigid motion can open, by a linear program."""

from __future__ import annotations

import numpy as np

from bipot.typing import Bools, Floats

PIVOTS = 1000
"""Steps of a linear program per row and column; a program that takes more is cycling."""


def openable(normal: Floats) -> tuple[Bools, Floats] | None:
    """Which contacts (c,) a motion v (m,) with ``normal`` (c, m) v >= 0 opens, and v, which opens as many as possible.

    It maximises sum_c t_c over 0 <= t_c <= 1, t_c <= normal_c v / |normal_c|: scaled up, v opens every contact that any
    such motion opens. None if the solver does not decide.
    """
    count, free = normal.shape
    if not free:
        return np.zeros(count, dtype=bool), np.zeros(0)
    # scipy.optimize takes long to import, and most runs never come here.
    from scipy.optimize import linprog

    length = np.linalg.norm(normal, axis=1, keepdims=True)
    found = linprog(
        np.concatenate([np.zeros(free), -np.ones(count)]),
        A_ub=np.hstack([-normal / np.where(length > 0, length, 1.0), np.eye(count)]),
        b_ub=np.zeros(count),
        bounds=[(None, None)] * free + [(0, 1)] * count,
        options={"maxiter": PIVOTS * (count + free)},
    )
    return None if found.x is None else (found.x[free:] > 0.5, found.x[:free])
