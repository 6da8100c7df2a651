"""The line search of Newton: how far to go along a step."""

from __future__ import annotations

from dataclasses import dataclass

from bipot.errors import require_count
from bipot.forms.point import Point
from bipot.typing import Floats, make_floats


@dataclass(frozen=True)
class Search:
    """How far to go along Newton's step: all of it if the merit falls to ``fall`` of itself, else by trials.

    The work of the body's forces against the new forces of the contacts, g(t) = dx . (rho - G' r) at x + t dx, r + dr,
    is - dx . K dx at the start, however far contacts are from their law, and goes linearly to zero at t = 1 if
    everything is linear. Where a landing unloads the body or brings much of it to yield, the whole step goes too far
    and g changes its sign. Then t is found by false position such that |g(t)| is at most ``work`` times |g(0)|. A whole
    step that is too short is not lengthened.

    A step to a larger merit is halved, because contacts have met what it was not made for; but not if there are no
    contacts, so that a load beyond the limit, with steps that grow without end, is soon given up. Next to a step that
    was halved in this way, one of less merit along which g has hardly begun to fall is taken: no step between the two
    is much nearer to g = 0. If g(0) is not negative it means nothing, and the step is halved until the merit falls.
    If ``trials`` do not suffice, the one of least merit is taken, because active sets may change beyond it.

    A tool that a force drives and that few contacts resist would go through all other candidates. Where it comes upon
    open ones, these are taken to push it by ``landing`` times the elastic stiffness there (less than one, because they
    yield together), and g includes the work of this. The merit's fall does not decide then.
    """

    fall: float = 0.1
    work: float = 0.3
    landing: float = 0.1
    trials: int = 5

    def __post_init__(self) -> None:
        make_floats(self, of="newton.search.", fall="in [0, 1)", work="in [0, 1)", landing="in [0, 1)")
        require_count(self.trials, "newton.search.trials", 0)


UNBEGUN = 0.8
"""g(t)/g(0) above which g has hardly begun to fall."""

NARROWED = 0.15, 0.75
"""Least and largest part of its bracket that a false position goes."""

FOLDED = -4.0
"""The value of g(t)/g(0) assumed for a step that folds an element, which is much too long."""


class Aim:
    """The step length sought: what the trials along one step have shown."""

    def __init__(self, search: Search, here: Point, along: Floats, r: Floats) -> None:
        self.search, self.here, self.along, self.r = search, here, along, r
        self.work = here.work(along, r)
        # The part of the step that driven tools go.
        self.driven = along.copy()
        self.driven[: len(here.iterate.increment.system.body.space.free)] = 0.0
        self.halves = not self.work < 0
        # Whether the last trial was halved for its merit.
        self.met = False
        # Step lengths with g(t)/g(0) above and below zero.
        self.short, self.long = (0.0, 1.0), (1.0, FOLDED)

    def rest(self, trial: Point) -> float:
        """g(t)/g(0) of a trial; zero if g says nothing, -1 if contacts made the merit larger and it is to be halved."""
        if self.halves:
            return 0.0
        rest = (trial.work(self.along, self.r) + self._landing(trial)) / self.work
        return -1.0 if trial.merit > self.here.merit and trial.miss.size else rest

    def meets(self, t: float, trial: Point, rest: float) -> bool:
        """Whether the trial of length t is good enough."""
        if self.halves:
            return trial.merit <= self.here.merit
        falls = trial.merit <= self.search.fall * self.here.merit and not self._landing(trial)
        whole = t == 1.0 and (rest > 0 or falls)
        before_halved = self.met and rest > UNBEGUN and trial.merit <= self.here.merit
        return whole or before_halved or abs(rest) <= self.search.work

    def _landing(self, trial: Point) -> float:
        """The work that is added to that of the unbalanced forces where driven tools come upon open contacts."""
        return self.search.landing * trial.landing(self.here.pieces, self.driven) if self.driven.any() else 0.0

    def shorter(self, t: float, rest: float) -> float:
        """The length to try after t."""
        if self.halves:
            return t / 2
        self.met = rest == -1.0
        if rest > 0:
            self.short = t, rest
        else:
            self.long = t, rest
        (a, at_a), (b, at_b) = self.short, self.long
        return a + (b - a) * min(max(at_a / (at_a - at_b), NARROWED[0]), NARROWED[1])
