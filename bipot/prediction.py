"""The start of an increment's iteration, predicted from the last motion."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from bipot.certificate import Bounds
from bipot.checks.examined import Examined
from bipot.checks.refusals import MOST_STRAINED
from bipot.errors import InvertedElement, NotConverged
from bipot.forms.memory import Pace
from bipot.iterate import Increment, Iterate
from bipot.tensors import equivalent_strain
from bipot.typing import Floats

SHORT = 0.01
"""Motion over the body's size up to which a start is examined: in longer increments even a good start is far off."""

FAR = 0.3
"""Imbalance (:class:`bipot.certificate.Balance`) of a start above which another one is tried."""

NEARER = 0.7
"""Fraction of the first imbalance below which the other start is taken: both leave out the tools' remaining travel."""


def begin(increment: Increment, pace: Pace, bounds: Bounds) -> Iterate:
    """The predicted iterate; if it is far from balance in a short increment, another one that is nearer to balance.

    The other start is that of the last velocity: near a landing the velocity changes direction from increment to
    increment, and extrapolating it may lead away from the answer. Where loads go on faster, which may be because the
    body resists more, the other start is a body carried by its supports and tools, in increments of any length. This
    is the start, too, where the prediction folds an element or strains it by more than an answer may.

    Raises:
        InvertedElement: the body carried by its supports and tools folds an element, too.
    """
    start = increment.start

    def unbalanced(iterate: Iterate) -> float:
        return Examined(iterate, start.forces, 0.0, bounds).balance.equilibrium

    try:
        going = increment.at(predicted(increment, pace))
    except InvertedElement:
        return increment.at(_carried(increment))
    if _strain(going) > MOST_STRAINED:
        with suppress(InvertedElement):
            carried = increment.at(_carried(increment))
            return carried if _strain(carried) < MOST_STRAINED else going
    leaps = increment.past.quicker > 1 and increment.loads.changes
    short = increment.units.length <= SHORT * increment.units.size
    if not (start.rates.any() and going.x.any() and (leaps or short)):
        return going
    off = unbalanced(going)
    if off > max(FAR, bounds.equilibrium):
        with suppress(InvertedElement, NotConverged):
            kept = increment.past.rates * (increment.tau - start.tau)
            other = increment.at(_carried(increment) if leaps else increment.system.body.space.gather(kept))
            if unbalanced(other) < NEARER * off:
                return other
    return going


def _strain(iterate: Iterate) -> float:
    """The largest equivalent strain."""
    return float(equivalent_strain(iterate.response.kinematics.strain).max())


def _carried(increment: Increment) -> Floats:
    """The displacement (n,) of a body that is carried by its supports and tools, and of driven tools with it."""
    return increment.system.body.space.gather(np.concatenate([increment.tools.rest.ravel(), increment.tools.led]))


def predicted(increment: Increment, pace: Pace) -> Floats:
    """Starting displacement (n,): the last motion continued, or a body that only supports and tools carry along.

    The latter, rest as they see it, is the start where no tool, support or load moves or changes, because the material
    is rate-independent, or where only tools do that neither touch the body nor come to it. So it is where the path
    turns, because the last motion says nothing of the next one.
    """
    start, rows, rest = increment.start, increment.rows, _carried(increment)
    x = increment.system.body.space.gather(pace.predict(increment))
    if increment.past.turns or not x.any():
        return rest
    same = np.array_equal(rows.gap, start.gap) and not rows.slip.any()
    untouched = not start.forces.any() and bool((rows.gap >= 0).all())
    stays = (same or untouched) and not increment.loads.changes and not increment.tools.driven.any()
    return rest if stays else x
