"""When: the pseudo-times that a march lands on exactly, small increments first where friction asks for them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bipot.errors import require, require_count, require_number

SAME = 1e-9
"""Pseudo-times nearer to each other are one."""

MOST = 1_000_000
"""Pseudo-times: all are known before the march, in some hundred megabytes, and are months of it."""


@dataclass(frozen=True)
class Schedule:
    """Pseudo-times to land on: ``increments`` uniform ones after a start-up.

    ``first`` is the size (in pseudo-time) of the ``settling`` equal start-up increments; the next grow by
    ``growth`` up to the uniform size. ``first = 0`` means no start-up. ``landings`` are further pseudo-times to land
    on exactly; the uniform increments are then shared out between them, each stretch with its nearest whole number.

    Raises:
        SceneError: a count below one or above :data:`MOST`, a start-up that does not fit into [0, 1), a landing outside
            (start-up, 1).
    """

    increments: int
    first: float = 0.0
    settling: int = 5
    growth: float = 1.6
    landings: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require_count(self.increments, "increments", most=MOST)
        require_count(self.settling, "settling", most=MOST)
        require_number(self.growth, "growth")
        require_number(self.first, "first")
        require(isinstance(self.landings, tuple | list), "landings", self.landings, "a tuple of numbers")
        object.__setattr__(self, "landings", tuple(self.landings))
        require(1 < self.growth <= 10, "growth", self.growth, "in (1, 10]")
        require(self.first == 0 or self.first >= SAME, "first", self.first, f"zero, or at least {SAME:g}")
        length = self.first * self.settling
        require(length < 1, "start-up", length, "below 1, the whole path: ask for a larger reduction")
        begin = self._start_up()[-1]
        for landing in self.landings:
            require_number(landing, "landing")
            require(begin < landing < 1, "landing", landing, f"in ({begin:.4g}, 1), after the start-up")
        require(len(set(self.landings)) == len(self.landings), "landings", self.landings, "different")

    def landing_on(self, kinks: Iterable[float]) -> list[float]:
        """The scheduled pseudo-times, and the ``kinks`` that they leave out: between two nothing changes its rate."""
        times = self.times()
        # Zero is where the march starts: a rise in no time at all is one of the first increment.
        known = np.array([0.0, *times])
        return sorted([*times, *(kink for kink in kinks if np.abs(known - kink).min() > SAME)])

    def times(self) -> list[float]:
        """The scheduled pseudo-times, the last one exactly 1."""
        times = self._start_up()
        rest = 1 - times[-1]
        for end in (*sorted(self.landings), 1.0):
            count = max(1, round(self.increments * (end - times[-1]) / rest))
            times += np.linspace(times[-1], end, count + 1)[1:].tolist()
        return times[1:]

    def _start_up(self) -> list[float]:
        """Zero and the start-up's pseudo-times."""
        start = [0.0]
        if self.first > 0:
            start += [self.first * k for k in range(1, self.settling + 1)]
            size = self.first * self.growth
            while size < (1 - start[-1]) / self.increments:
                start.append(start[-1] + size)
                size *= self.growth
                allowed = f"such that the start-up has at most {MOST} increments"
                require(len(start) <= MOST, "growth", self.growth, allowed)
        return start
