"""Schedules: the pseudo-times at which increments end exactly, small increments first where friction needs them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bipot.errors import require, require_count, require_number
from bipot.typing import Floats, make_floats

SAME = 1e-9
"""Pseudo-times of a schedule nearer than this to each other, or to a corner of a path, count as one."""

ROUND_OFF = 1e-12
"""Pseudo-times nearer than this, absolutely or relatively, are the same: sums differ in the last bit."""

MOST = 1_000_000
"""Largest number of pseudo-times, which are all stored before the march, in some hundred megabytes."""

FINEST, COARSEST = 1e-4, 0.1
"""Range of accuracies: first yield leaves an error of 1e-4 to 3e-4 of the force, whatever the later increments."""


@dataclass(frozen=True)
class Schedule:
    """Where increments end: at ``increments`` uniform pseudo-times after a start-up, or as an ``accuracy`` requires.

    ``first`` is the size (in pseudo-time) of the ``settling`` equal start-up increments; the next grow by
    ``growth`` up to the uniform size. ``first = 0`` means no start-up. ``landings`` are further pseudo-times at which
    an increment ends; the uniform increments are then distributed between them, rounded to whole numbers.

    ``accuracy`` is an allowed error of the force, as a fraction: the march then chooses the lengths of all increments
    (:mod:`bipot.control.pacing`), and is bound only to end some at the landings, the kinks and the end.

    Raises:
        SceneError: a count below one or above :data:`MOST`, a start-up that does not fit into [0, 1), a landing outside
            (start-up, 1) or within :data:`SAME` of its ends or of another, an accuracy outside [:data:`FINEST`,
            :data:`COARSEST`], both or none of increments and accuracy.
    """

    increments: int | None = None
    first: float = 0.0
    settling: int = 5
    growth: float = 1.6
    landings: tuple[float, ...] = ()
    accuracy: float | None = None

    def __post_init__(self) -> None:
        make_floats(self, "first", growth="in (1, 10]")
        if self.accuracy is None:
            require(self.increments is not None, "increments", None, "given, unless an accuracy is")
            require_count(self.increments, "increments", most=MOST)
        else:
            make_floats(self, accuracy=f"in [{FINEST:g}, {COARSEST:g}]")
            alone = "left out with an accuracy, which finds the lengths of increments"
            require(self.increments is None, "increments", self.increments, alone)
            require(self.first == 0, "first", self.first, alone)
        require_count(self.settling, "settling", most=MOST)
        require(isinstance(self.landings, tuple | list), "landings", self.landings, "a tuple of numbers")
        for landing in self.landings:
            require_number(landing, "landing")
        object.__setattr__(self, "landings", tuple(float(landing) for landing in self.landings))
        require(self.first == 0 or SAME <= self.first < 1, "first", self.first, f"zero, or in [{SAME:g}, 1)")
        length = self.first * self.settling
        require(length < 1, "start-up", length, "below 1, the whole path: begin by smaller increments, or fewer")
        begin = self._start_up()[-1]
        for landing in self.landings:
            allowed = f"in ({begin:.4g}, 1), after the start-up, and {SAME:g} from its ends"
            require(begin + SAME < landing < 1 - SAME, "landing", landing, allowed)
        apart = float(np.diff(sorted(self.landings)).min(initial=1.0))
        require(apart > SAME, "landings", self.landings, f"different by more than {SAME:g}")

    def landing_on(self, kinks: Iterable[float]) -> list[float]:
        """The scheduled pseudo-times with the ``kinks``, so that all rates are constant between two of them.

        A kink replaces the scheduled pseudo-time next to it, because a path may turn twice there.
        """
        times = np.array(self.times())
        turns = np.array(sorted(kinks))
        off = _nearest(times, turns)
        scheduled = times[(times == 1) | (off <= ROUND_OFF) | (off > SAME)]
        return sorted([*scheduled.tolist(), *turns[_nearest(turns, times) > ROUND_OFF].tolist()])

    def times(self) -> list[float]:
        """The scheduled pseudo-times, the last one exactly 1; with an accuracy the landings and 1 alone."""
        times = self._start_up()
        if self.increments is None:
            return [*sorted(self.landings), 1.0]
        rest = 1 - times[-1]
        for end in (*sorted(self.landings), 1.0):
            count = max(1, round(self.increments * (end - times[-1]) / rest))
            times += np.linspace(times[-1], end, count + 1)[1:].tolist()
        return times[1:]

    def _start_up(self) -> list[float]:
        """Zero and the pseudo-times of the start-up."""
        start = [0.0]
        if self.first > 0 and self.increments is not None:
            start += [self.first * k for k in range(1, self.settling + 1)]
            size = self.first * self.growth
            while size < (1 - start[-1]) / self.increments:
                start.append(start[-1] + size)
                size *= self.growth
                allowed = f"such that the start-up has at most {MOST} increments"
                require(len(start) <= MOST, "growth", self.growth, allowed)
        return start


def _nearest(values: Floats, others: Floats) -> Floats:
    """Distance (n,) of each of the ``values`` (n,) from the nearest of the ``others`` (m,), which are sorted."""
    around, after = np.concatenate([[-np.inf], others, [np.inf]]), np.searchsorted(others, values)
    return np.minimum(values - around[after], around[after + 1] - values)
