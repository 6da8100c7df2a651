"""Attempts at an increment and its halves until one is solved, with the passes and reasons of all attempts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from bipot.control.attempt import Attempt
from bipot.control.landing import Landing
from bipot.control.reason import Reason, ReasonKind
from bipot.increment import Solved
from bipot.iterate import Increment


class Found(NamedTuple):
    """An increment and the attempt that solved it, after ``cuts``; passes and reasons are those of all attempts.

    ``estimate`` is the estimated error of ``solved`` (:mod:`bipot.control.estimate`), NaN where it is not asked for.
    """

    increment: Increment
    attempt: Attempt
    solved: Solved
    uncut: float
    cuts: int
    passes: int
    reasons: tuple[Reason, ...]
    landing: Landing | None = None
    estimate: float = math.nan


class Halving:
    """Attempts at increments of the length ``uncut`` or less, by ``attempt(part, sparing, halves)``, and their sums.

    ``spared`` are increments that failed while a program was left out (:mod:`bipot.control.attempting`).
    """

    def __init__(self, attempt: Callable[[Increment, bool, bool], Attempt], uncut: float) -> None:
        self.attempt, self.uncut = attempt, uncut
        self.cuts, self.passes, self.reasons = 0, 0, list[Reason]()
        self.spared = list[Increment]()

    def tried(self, increment: Increment, sparing: bool = False, halves: bool = False) -> Found | Attempt:
        """What an attempt found; the attempt itself if it has failed."""
        attempt = self.attempt(increment, sparing, halves)
        self.passes += attempt.passes
        self.reasons += attempt.failures
        if attempt.spared:
            self.spared.append(increment)
        if attempt.solved is None:
            return attempt
        return Found(increment, attempt, attempt.solved, self.uncut, self.cuts, self.passes, tuple(self.reasons))

    def cut(self, tau: float) -> None:
        """Count a cut of the increment that ends at ``tau``."""
        self.cuts += 1
        self.reasons.append(Reason(ReasonKind.CUT, "cut", measures={"tau": tau}))

    def unspared(self) -> Found | None:
        """What a program finds in the increments for which it was left out: it may fail on the shorter ones alone."""
        tried = (self.tried(increment) for increment in tuple(self.spared))
        return next((found for found in tried if isinstance(found, Found)), None)
