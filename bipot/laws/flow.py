r"""How plastic flow is integrated over an increment: backward Euler, or two-step backward differences (BDF2).

A radial return takes the direction of the flow from the whole increment but the stress from its end, which is backward
Euler: of first order wherever the direction turns, as friction makes it. BDF2 with increments of length ratio rho,

    de_p = a de_p0 + gamma n,    a = rho^2/(1 + 2 rho),    de_p0 the flow of the increment before,

lets the last flow go on by the fraction a, at fixed strain, before the increment starts:

    sigma* = sigma_n - 2 mu a de_p0,    e_p* = e_p + a de_p0,    p* = p + a dp_0.

The increment from that state is an ordinary one: the same convex programs, return map, tangent and certificate.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FARTHEST = 1.0
"""Largest fraction a carried on: growth above 1 + sqrt(2) is unstable in BDF2, less than a is still consistent."""


class Integration(Enum):
    """Order one with the stress of one increment, or order two with the flow of the last one carried on."""

    BACKWARD_EULER = "backward Euler"
    BDF2 = "BDF2"


@dataclass(frozen=True)
class Flow:
    """Plastic flow of an increment in which the tools moved by ``travel`` (tools, d): strain (e, q, s), turned with the
    body to its end, and peeq (e, q), both zero at points that stayed elastic.
    """

    travel: Floats
    strain: Floats
    peeq: Floats

    def carried(self, travel: Floats) -> tuple[Floats, Floats]:
        """(a de_p0, a dp_0) for a next increment with ``travel`` (tools, d).

        The law knows no time: rho is how far the tools go on along their last travel, 0 where they stop or turn back.
        """
        before = float(np.vdot(self.travel, self.travel))
        ratio = max(float(np.vdot(self.travel, travel)), 0.0) / before if before > 0 else 0.0
        a = min(ratio**2 / (1 + 2 * ratio), FARTHEST)
        return a * self.strain, a * self.peeq
