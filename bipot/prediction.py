"""Where the iteration of an increment starts: where the last motion leads."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from bipot.certificate import Bounds
from bipot.checks.examined import Examined
from bipot.errors import InvertedElement, NotConverged
from bipot.forms.memory import Pace
from bipot.iterate import Increment, Iterate
from bipot.schedule import SAME
from bipot.typing import Floats

SHORT = 0.01
"""Motion over the body's size up to which a start is looked at: in longer increments a smooth motion is as far off."""

FAR = 0.3
"""Equilibrium (:class:`bipot.certificate.Balance`) from which on a start is so far off that another one is tried."""

NEARER = 0.7
"""What that must be of it to be taken: equilibrium does not tell how far the tools have still to go."""


def begin(increment: Increment, pace: Pace, bounds: Bounds) -> Iterate:
    """The iterate predicted; of a short increment, where that is far off, the last velocity kept if nearer to balance.

    Next to a landing the velocity turns from increment to increment: extrapolated, it may lead away from the answer.

    Raises:
        InvertedElement: what is predicted folds an element.
    """

    def unbalanced(iterate: Iterate) -> float:
        return Examined(iterate, start.forces, 0.0, bounds).balance.equilibrium

    start = increment.start
    going = increment.at(predicted(increment, pace))
    if not going.x.any() or increment.units.length > SHORT * increment.units.size:
        return going
    off = unbalanced(going)
    if off > max(FAR, bounds.equilibrium):
        with suppress(InvertedElement, NotConverged):
            kept = increment.at(increment.system.body.space.gather(start.rates * (increment.tau - start.tau)))
            if unbalanced(kept) < NEARER * off:
                return kept
    return going


def predicted(increment: Increment, pace: Pace) -> Floats:
    """Displacement (n,) to start from: the last motion goes on, unless the contacts tell that it does not.

    Where no tool, support or load moves or changes, nothing drives it: it stays, for its material knows no time. Where
    tools turn back, the forces of the start do work over no motion, which leaves gaps that they push open; and more of
    it over the last motion, which opens them further. From a corner of a path or an amplitude on, the last motion says
    nothing of the next: what was fast may be slow.
    """
    start, rows = increment.start, increment.rows
    x = increment.system.body.space.gather(pace.predict(start, increment.tau))
    if any(abs(kink - start.tau) <= SAME for kink in increment.system.body.scene.kinks):
        return np.zeros_like(x)
    same = np.array_equal(rows.gap, start.gap) and not increment.new_load.any()
    if same and not rows.slip.any() and not increment.driven.any():
        return np.zeros_like(x)
    carried = float(start.forces[:, 0] @ start.gap)
    going_on, staying = (float(np.vdot(start.forces, rows.motion(y))) - carried for y in (x, np.zeros_like(x)))
    return np.zeros_like(x) if going_on > staying > 0 else x
