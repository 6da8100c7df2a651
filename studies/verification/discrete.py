"""Small discrete Coulomb problems u = W r + q of which every solution is known: all modes were enumerated.

Forces and velocities are (normal, tangential) contact by contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from bipot import coulomb
from bipot.typing import Floats


class Known(NamedTuple):
    """A problem with its one solution, and to how many digits that is known."""

    problem: coulomb.CoulombProblem
    r: Floats
    u: Floats
    digits: float = 1e-10


NODE = np.linalg.inv([[2.0, -1.0], [-1.0, 1.0]])


def plane(W: ArrayLike, q: ArrayLike, mu: float) -> coulomb.CoulombProblem:
    """The problem of these numbers, with one coefficient."""
    load = np.asarray(q, dtype=np.float64)
    return coulomb.CoulombProblem(sp.csr_array(np.asarray(W, dtype=np.float64)), load, np.full(load.size // 2, mu), 2)


CYCLED = "Gauss-Seidel cycles"
UNDAMPED = "convex programs cycle"
UNIQUE = {
    "one node": Known(
        plane(NODE, NODE @ [-1, -1.2], 0.5),
        np.array([1.466666666666667, 0.733333333333333]),
        np.array([0, -0.466666666666667]),
    ),
    CYCLED: Known(
        plane([[15, 11, 4, 7], [11, 17, 11, 8], [4, 11, 11, 4], [7, 8, 4, 9]], [-1, 0, -1, -3], 1.0),
        np.array([4, -4, 11, 11]) / 137,
        np.array([0, 185, 0, -272]) / 137,
    ),
    UNDAMPED: Known(
        plane([[28, -5, -12, -10], [-5, 17, -12, -5], [-12, -12, 22, 7], [-10, -5, 7, 10]], [-4, 1, -4, -4], 1.0),
        np.array([204, 204, 188, 188]) / 139,
        np.array([0, -609, 0, -420]) / 139,
    ),
}

_A, _B, _C, _D = -464.2665883420583, 236.5081445699369, -464.2662921766746, 461.6596337492515
HYPERSTATIC = Known(
    plane(
        [
            [936.5610022253570, _A, -915.2908496264952, _A],
            [_C, _B, _D, _B],
            [-915.2908496264952, 461.6593375138678, 936.5610022253570, 461.6593375138678],
            [_C, _B, _D, _B],
        ],
        2 * [-1.179087309965789, -8.407368208001527],
        0.01,
    ),
    np.array([0.05577943, 0.00055779, 0.05522441, 0.00055224]),
    np.array([0, -8.546463, 0, -8.546463]),
    5e-7,
)
"""W is singular: its tangential rows are one."""


def three_solutions() -> coulomb.CoulombProblem:
    """The node at a coefficient above one, where forces are not unique: free, stuck and sliding."""
    return plane(NODE, NODE @ [-1, 1.2], 1.5)


THREE = {"u": [(0, 0), (0, 0.6), (0.2, 1.4)], "r": [(0, 0), (0.4, -0.6), (1, -1.2)]}
"""Its solutions, each list sorted."""


def opposed(clearance: float) -> coulomb.GlobalCoulombProblem:
    """One dof and its tangent between two opposed contacts; ``clearance`` is the sum of both gaps."""
    H = np.array([[1.0, 0, -1, 0], [0, 1, 0, 1]])
    w = np.array([clearance / 2, 0.0, clearance / 2, 0.0])
    M, load = sp.csr_array(np.eye(2)), np.array([0.3, 0.5])
    return coulomb.GlobalCoulombProblem(M, sp.csr_array(H), load, w, np.full(2, 0.2), 2)
