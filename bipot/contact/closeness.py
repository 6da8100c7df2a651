"""What counts as closed, and as near.

A candidate is *closed* where it carries a force (:func:`carries`) or has no gap (:func:`touches`). Which of them is
asked depends on what is known and what for:

* by force alone: tractions and landings, for what touches without a force has no traction and has not landed;
* by gap alone: the start of an increment, where a weld takes hold, for forces there are those of the last increment;
* by either: what keeps the body where it is, for what touches without a force still stops a motion one way.

The pieces of Newton (:mod:`bipot.programs.pieces`) are guesses on the way to a solution, not statements about one.
"""

from __future__ import annotations

import numpy as np

from bipot.laws.coulomb import force_threshold
from bipot.programs.data import ContactRows
from bipot.typing import Bools, Floats

TOUCHES = 1e-9
"""A gap below this fraction of the body's size is none: round-off of the geometry, not physics."""

NEAR = 4.0
"""A candidate within this many lengths of the increment is near its tool: it may close where the prediction is off."""

LEAST_MOTION = 1e-6
"""Of the body's size: the length of an increment in which tools and body rest."""


def carries(r: Floats, noise: float = 0.0) -> Bools:
    """Which candidates (c,) push by contact forces r (c, d), of which those up to ``noise`` are none."""
    return r[:, 0] > max(force_threshold(r), noise)


def touches(gap: Floats, size: float) -> Bools:
    """Which gaps (c,) are none in a body of ``size``."""
    return gap <= TOUCHES * size


def near_tools(rows: ContactRows, x: Floats, length: float) -> Bools:
    """Candidates (c,) near their tool, by the ``length`` of the increment, at its displacement x (n,), and those tied.

    At least one where there is any, so that programs have contact rows: an open one changes nothing.
    """
    gap = rows.gap + rows.G_n @ x
    return (gap <= max(NEAR * length, float(gap.min(initial=np.inf)))) | rows.tied
