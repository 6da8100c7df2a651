"""Which candidates count as closed, and which as near.

A candidate may be closed because it carries a force (:func:`carries`) or because it has no gap (:func:`touches`). The
criterion depends on its use:

* force alone for tractions and landings, because a point that touches without a force has no traction and has not
  landed;
* force or gap for what holds the body in place, because a point that touches without a force still prevents a motion;
* at the start of an increment, where welds hold or form and slips begin, no gap, or a force and no more gap than a
  solver leaves (:func:`closed`).

The pieces of Newton (:mod:`bipot.programs.pieces`) are guesses on the way to a solution, not statements about one.
"""

from __future__ import annotations

import numpy as np

from bipot.laws.coulomb import force_threshold
from bipot.programs.data import ContactRows
from bipot.tensors import norm
from bipot.typing import Bools, Floats, Ints

ROUND_OFF = 8 * float(np.finfo(float).eps)
"""Relative round-off of a component of a motion."""

REACH = 10.0
"""A tool farther from the body than this many sizes of the whole body is out of reach."""

NEXT_TO = 0.1
"""A tool is felt in an increment if it comes nearer than this part of what the body's nodes move."""

TOUCHES = 1e-9
"""A gap below this fraction of the body's size counts as none: it is round-off of the geometry."""

LEFT = 1e-6
"""A gap below this fraction of the body's size may be left by a solver where there is a force: the law, whose natural
map sees both, is met to this fraction of the largest force."""

NEAR = 4.0
"""A candidate within this many lengths of the increment is near its tool: it may close if the prediction is wrong."""

LEAST_MOTION = 1e-6
"""Length, over the body's size, of an increment in which tools and body rest."""


def carries(r: Floats, noise: float = 0.0) -> Bools:
    """Which candidates (c,) push by contact forces r (c, d); forces up to ``noise`` count as none."""
    return r[:, 0] > max(force_threshold(r), noise)


def touches(gap: Floats, size: float) -> Bools:
    """Which gaps (c,) count as closed, by the ``size`` of the whole body, so that half a model says the same."""
    return gap <= TOUCHES * size


def closed(gap: Floats, r: Floats, size: float) -> Bools:
    """Which candidates (c,) with the gaps (c,) and contact forces r (c, d) of one state are in touch.

    A weld that pulls is in touch, too. ``size`` is as in :func:`touches`.
    """
    return touches(gap, size) | ((norm(r) > force_threshold(r)) & (gap <= LEFT * size))


def newly_closed(start_gap: Floats, r: Floats, none: float) -> Ints:
    """Candidates with a gap (c,) above ``none`` at the start of an increment, which carry force r (c, d) at its end.

    >>> newly_closed(np.array([0.1, 0.1, 0.0]), np.array([[2.0, 0.0], [0.0, 0.0], [3.0, 0.0]]), 1e-3)
    array([0])
    """
    return np.flatnonzero((start_gap > none) & carries(r))


def near_tools(rows: ContactRows, x: Floats, length: float) -> Bools:
    """Candidates (c,) that are tied, or near their tool at the displacement x (n,), by the ``length`` of the increment.

    At least one if there is any, so that programs have contact rows: a row that stays open changes nothing.
    """
    gap = rows.gap + rows.G_n @ x
    return (gap <= max(NEAR * length, float(gap.min(initial=np.inf)))) | rows.tied


def until_closed(gap: Floats, rate: Floats) -> float:
    """How long it takes at these rates until the first of the gaps closes; inf if none closes.

    >>> until_closed(np.array([1.0, 2.0, 0.5]), np.array([-1.0, -4.0, 0.0]))
    0.5
    """
    closing = rate < 0
    return float(np.min(gap[closing] / -rate[closing], initial=np.inf))
