"""The search for a landing by itself: where it looks next, on gaps that are known functions of time."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.control.landing import Locate, locate

HOW = Locate(tolerance=1e-3, solves=12, margin=0.02)


@dataclass(frozen=True)
class Until:
    """An increment from zero of one candidate at the node 7, whose gap is one and is ``expected`` to close so fast.

    Of that a third is the body's, the rest the tool's.
    """

    expected: float
    tau: float = 1.0

    start = SimpleNamespace(tau=0.0, gap=np.ones(1))
    units = SimpleNamespace(length=1.0)
    system = SimpleNamespace(
        body=SimpleNamespace(space=SimpleNamespace(gather=lambda rates: rates)),
        candidates=SimpleNamespace(node=np.array([7])),
    )

    @property
    def rows(self):
        return SimpleNamespace(G_n=sp.csr_matrix([[1.0]]), gap=np.array([1.0 - 2 / 3 * self.expected * self.tau]))

    @property
    def past(self):
        return SimpleNamespace(rates=np.array([-self.expected / 3]))


def found(gap, expected):
    """The landing of a candidate that has the ``gap`` (a function of time), and where it was looked for."""
    looked = []

    def solve(increment):
        looked.append(increment.tau)
        left = gap(increment.tau)
        motion, r = np.array([[max(left, 0.0), 0.0]]), np.array([[max(-left, 0.0), 0.0]])
        solved = SimpleNamespace(iterate=SimpleNamespace(motion=motion), r=r)
        return SimpleNamespace(solved=solved, passes=3)

    whole = Until(expected)
    landing, passes = locate(whole, solve(whole).solved, solve, HOW, np.zeros(1, dtype=bool))
    assert passes == 3 * (len(looked) - 1)
    return landing, looked[1:]


def test_a_gap_that_closes_as_expected_is_found_at_once():
    """With half of the tolerance left."""
    landing, looked = found(lambda tau: 1 - 2 * tau, 2.0)
    assert looked == pytest.approx([(1 - 0.5e-3) / 2])
    assert (landing.tau, landing.candidate, landing.node) == (looked[0], 0, 7)


def test_where_the_expected_rate_is_too_slow_it_looks_late_first():
    """At nine tenths of the way from the margin; where that is too late as well, in the middle of what is left."""
    landing, looked = found(lambda tau: 1 - 2 * tau, 0.5)
    late = 0.02 + 0.9 * 0.98
    assert looked[:2] == pytest.approx([late, 0.02 + 0.9 * (late - 0.02)])
    assert 0 < 1 - 2 * landing.tau <= 1e-3


@pytest.mark.parametrize("expected", [0.5, 1.5, 3.0])
def test_a_gap_that_closes_faster_and_faster_is_left_open_by_no_more_than_the_tolerance(expected):
    """By secants, of which those that overshoot are halved; where too fast a rate is expected it looks early first."""

    def gap(tau):
        return 1 - 0.8 * tau - tau**2

    landing, looked = found(gap, expected)
    assert 0 < gap(landing.tau) <= 1e-3
    assert len(looked) <= HOW.solves
    if expected == 3.0:
        first, second = looked[:2]
        rate = (1 - gap(first)) / first
        assert second == pytest.approx(first + (gap(first) - 0.5e-3) / rate)
