"""How far Newton goes along a step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.errors import require, require_count
from bipot.iterate import Iterate
from bipot.programs.frames import SOFTENED
from bipot.programs.pieces import Pieces
from bipot.typing import Floats, make_floats, vdot


@dataclass(frozen=True)
class Search:
    """How far to go along Newton's step: all of it where the merit falls to ``fall`` of itself, else by trials.

    The work of the body's forces against the new ones of the contacts, g(t) = dx . (rho - G' r) at x + t dx, r + dr, is
    - dx . K dx at the start, however far contacts are from their law, and goes linearly to zero at t = 1 where
    everything is linear; where a landing unloads the body or brings much of it to yield, the whole step goes too far
    and g changes its sign. Then t is found by false position such that |g(t)| is at most ``work`` times |g(0)|. A whole
    step that is too short is not lengthened. A step to a larger merit is halved: contacts have met what it was not made
    for. Where there are no contacts, as in a body that loads alone deform, it is not: a load beyond the limit, of which
    the steps grow without end, is then given up soon. A step of less merit next to one that was halved so, along which
    g has hardly begun to fall, is as good as any between them: these are as far from g = 0. A step is halved, too,
    until the merit falls, where g(0) is not below zero and says nothing. If ``trials`` do not get there the one of
    least merit is taken: active sets change past a bump.

    A tool that a force drives and that few contacts resist would go through all others. Those that were open are taken
    to push it where it comes upon them, by ``landing`` times the elastic stiffness there, less than all of it as they
    yield together, and g counts the work of that. How deep they lie in it then says more than how the merit falls.
    """

    fall: float = 0.1
    work: float = 0.3
    landing: float = 0.1
    trials: int = 5

    def __post_init__(self) -> None:
        make_floats(self, "fall", "work", "landing", of="newton.search.")
        for name in ("fall", "work", "landing"):
            value = getattr(self, name)
            require(0 <= value < 1, f"newton.search.{name}", value, "in [0, 1)")
        require_count(self.trials, "newton.search.trials", 0)


UNBEGUN = 0.8
"""g(t)/g(0) above which g has hardly begun to fall."""

NARROWED = 0.15, 0.75
"""Part of its bracket that a false position leaves and takes, at least and at most."""

FOLDED = -4.0
"""Stands for g(t)/g(0) of a step that folds an element: it is much too long."""


class Point(NamedTuple):
    """An iterate with contact forces r (c, d) as Newton sees it: motion (c, d), pieces of the law, ``miss``, merit.

    The merit is |(rho - G' r, miss)|, in units of force; ``miss`` (c, d) is the law's value.
    """

    iterate: Iterate
    r: Floats
    motion: Floats
    pieces: Pieces
    miss: Floats
    merit: float

    @property
    def error(self) -> float:
        """The merit over the norm of the forces; inf where there are none."""
        present = math.sqrt(vdot(self.r, self.r))
        return self.merit / present if present else np.inf

    def work(self, along: Floats, r: Floats) -> float:
        """Work along a step (n,) of the body's forces that contact forces r (c, d) leave unbalanced."""
        return float(along @ (self.iterate.residual - self.iterate.rows.forces(r)))

    def landing(self, before: Pieces, driven: Floats) -> float:
        """Work of the elastic stiffness at contacts open ``before`` on what tools went ``driven`` (n,) into them."""
        depth = np.where(before.closed, 0.0, np.maximum(-self.motion[:, 0], 0.0))
        deeper = -(self.iterate.rows.G_n @ driven)
        return float((before.scale / SOFTENED * depth) @ deeper)


class Aim:
    """How far to go along a step: what has been tried of it."""

    def __init__(self, search: Search, here: Point, along: Floats, r: Floats) -> None:
        self.search, self.here, self.along, self.r = search, here, along, r
        self.work = here.work(along, r)
        # What of the step tools that are driven go by themselves.
        self.driven = along.copy()
        self.driven[: len(here.iterate.increment.system.body.space.free)] = 0.0
        self.halves = not self.work < 0
        # Whether the last trial was too long because contacts met something.
        self.met = False
        # Step lengths with g(t)/g(0) above and below zero.
        self.short, self.long = (0.0, 1.0), (1.0, FOLDED)

    def rest(self, trial: Point) -> float:
        """g(t)/g(0) of a trial, zero where it says nothing, -1 where it has the larger merit and is to be halved."""
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
        before = self.met and rest > UNBEGUN and trial.merit <= self.here.merit
        return whole or before or abs(rest) <= self.search.work

    def _landing(self, trial: Point) -> float:
        """What the work of the unbalanced forces grows by where driven tools come upon open contacts."""
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
