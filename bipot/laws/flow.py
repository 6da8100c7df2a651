r"""How plastic flow is integrated over an increment: backward Euler, or two-step backward differences (BDF2).

A radial return takes the direction of the flow from the whole increment but the stress from its end, which is backward
Euler: of first order wherever the direction turns, as friction makes it. BDF2 with flows of length ratio rho,

    de_p = a de_p0 + gamma n,    a = rho^2/(1 + 2 rho),    de_p0 the flow of the increment before,

continues the last flow by the fraction a, at fixed strain, before the increment starts:

    sigma* = sigma_n - 2 G a de_p0,    e_p* = e_p + a de_p0,    p* = p + a dp_0.

Where there is no increment before, its own first half may stand for it: with de_ph the flow of that half, solved by
backward Euler, de_p = (1 + a) de_ph + gamma n, rho the ratio of the flows of the halves.

The increment from that state is an ordinary one: the same convex programs, return map, tangent and certificate.
The law is rate-independent: rho is the ratio of the flows themselves, measured by :mod:`bipot.control.carrying`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from bipot.typing import EqualByNumbers, Floats, make_arrays

FARTHEST = 1.0
"""Largest fraction a carried on: BDF2 is unstable for rho > 1 + sqrt(2), where a > 1; a smaller a is consistent too."""


class Integration(Enum):
    """First order, from this increment alone, or second order, with the flow of the last increment carried on."""

    BACKWARD_EULER = "backward Euler"
    BDF2 = "BDF2"


@dataclass(frozen=True, eq=False)
class Flow(EqualByNumbers):
    """Plastic flow of an increment: strain (e, q, s), turned with the body to its end, and peeq (e, q).

    Both are zero at points that stayed elastic, and read-only.
    """

    strain: Floats
    peeq: Floats

    def __post_init__(self) -> None:
        make_arrays(self, "flow.", strain="(e, q, s)", peeq="(e, q)")

    def times(self, fraction: Floats) -> Flow:
        """The flow times ``fraction`` (e, q)."""
        return Flow(fraction[..., None] * self.strain, fraction * self.peeq)


def fraction(ratio: float) -> float:
    """a = rho^2/(1 + 2 rho), at most FARTHEST, of the ratio rho of a flow to the last one; 0 where it turned back.

    >>> fraction(1.0) == 1 / 3
    True
    """
    rho = max(ratio, 0.0)
    return min(rho**2 / (1 + 2 * rho), FARTHEST)
