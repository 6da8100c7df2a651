r"""Location of landings: an increment in which an open candidate closes is cut at the event.

A candidate lands in the increment from tau_0 to tau_1 when its gap at the start is above ``tolerance`` times the
increment's unit of length (:attr:`bipot.iterate.Increment.units`) and it carries force at the end. Its gap g(tau) at
the end of an increment solved from the same start to tau is known only while it stays open, so the root is approached
from the open side: by the velocity that led to the start, then by the secant of the last two open trials, cut back
where they overshoot.
The increment then ends at the event with the candidate still open by less than the tolerance; in the next one the
candidate is closed. A candidate is located once in a scheduled increment, so cuts cannot accumulate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bipot.contact.closeness import newly_closed, until_closed
from bipot.control.attempt import Attempt
from bipot.errors import require_count
from bipot.increment import Solved
from bipot.iterate import Increment
from bipot.typing import Bools, make_floats

FIRST_LOOK = 0.9
"""Where, between an open start and an end with the candidate closed, to look if the expected rate overshoots."""


@dataclass(frozen=True)
class Locate:
    """Options for locating landings.

    ``tolerance`` is the gap left at the event over the unit of length of the uncut increment, ``solves`` the most
    increments solved for one event. Events in the first or last ``margin`` of an increment leave it whole.
    """

    tolerance: float = 1e-3
    solves: int = 12
    margin: float = 0.02

    def __post_init__(self) -> None:
        make_floats(self, of="locate.", tolerance="in (0, 1)", margin="in (0, 0.5)")
        require_count(self.solves, "locate.solves")


@dataclass(frozen=True)
class Landing:
    """The increment that ends where the first candidate lands: its end, how it was solved, candidate and node."""

    tau: float
    attempt: Attempt
    solved: Solved
    candidate: int
    node: int


def locate(
    increment: Increment,
    solved: Solved,
    solve: Callable[[Increment], Attempt],
    how: Locate,
    known: Bools,
) -> tuple[Landing | None, int]:
    """The first landing in the ``increment`` solved by ``solved``, and the passes spent on the search.

    ``solve`` attempts the increment with another end; ``known`` (c,) marks candidates not to be located again. The
    landing is None, and the increment stays whole, if nothing lands, the event is in a margin, or the search fails.
    """
    system, state, tau = increment.system, increment.start, increment.tau
    length = tau - state.tau
    none = how.tolerance * increment.units.length
    # Candidates that are not to be located count as closed from the start.
    apart = np.where(known, -np.inf, state.gap)
    landed, passes, latest = newly_closed(apart, solved.r, none), 0, tau - how.margin * length
    # Sought between ``low``, the margin or an end with all still open, and ``high``, an end with a candidate closed.
    low, high = state.tau + how.margin * length, tau
    # dg/dtau (c,) by the body's velocity that led to the start and the tools' paths.
    rates, rows = increment.system.body.space.gather(increment.past.rates), increment.rows
    last, gap, rate = state.tau, state.gap, rows.G_n @ rates + (rows.gap - state.gap) / length
    for _ in range(how.solves if landed.size else 0):
        end = max(low, last + until_closed(gap[landed] - none / 2, rate[landed]))
        if end >= high:
            # Where the expected rate overshoots the event is often late; where a secant does, bisection is safe.
            end = low + (high - low) * (0.5 if last > state.tau else FIRST_LOOK)
        attempt = solve(replace(increment, tau=end))
        passes += attempt.passes
        if attempt.solved is None:
            break
        earlier = newly_closed(apart, attempt.solved.r, none)
        if earlier.size:
            landed, high = earlier, end
        else:
            end_gap = attempt.solved.iterate.motion[:, 0]
            rate, last, gap, low = (end_gap - gap) / (end - last), end, end_gap, end
            first = int(landed[np.argmin(gap[landed])])
            if gap[first] <= none and end <= latest:
                return Landing(end, attempt, attempt.solved, first, int(system.candidates.node[first])), passes
        if low >= latest or high - low <= how.tolerance * length / 4:
            break
    return None, passes
