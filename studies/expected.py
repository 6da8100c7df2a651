"""How far a study is and how long it will go on, in words."""

from __future__ import annotations

import time


class Expected:
    """Seconds gone, and those left if the rest goes at the pace so far; ``total`` is in any unit of cost."""

    def __init__(self, total: float) -> None:
        self.began, self.spent, self.total = time.perf_counter(), 0.0, total

    def done(self, cost: float = 1.0) -> None:
        """A part of the total is over."""
        self.spent += cost

    def __str__(self) -> str:
        """In words."""
        gone = time.perf_counter() - self.began
        left = gone * (self.total - self.spent) / self.spent if self.spent else float("nan")
        return f"{gone:.0f} s gone, about {left:.0f} s left"
