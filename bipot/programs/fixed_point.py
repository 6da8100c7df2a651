r"""The coupling of friction with contact: what a program freezes, and how that is updated from pass to pass.

Coulomb's law is not the optimum of one convex program, but the fixed point of two sequences of them:

    threshold   s <- mu r_n(s)               (Tresca's law in each program),
    shift       sigma <- mu |du_t|(sigma)    (De Saxce's shift of the gap: the associated law in each program).

Either contracts by 0.1 to 0.3 a pass in upsetting, and either can cycle although the solution is unique. A
:class:`Coupling` therefore starts with plain steps. If the residual |G(x) - x| does not fall, it is damped where it
oscillates. Anderson mixing of the last steps (restarted whenever the residual grows) follows where it does not
oscillate or damping is not enough, and the other sequence follows after some passes without progress.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from bipot.coulomb.acceleration import Anderson, Past
from bipot.errors import require_count, require_type
from bipot.programs.data import ContactRows
from bipot.typing import Floats, make_floats

SETTLED = 1e-10
"""Relative residual below which the rest is the accuracy of the programs, from which nothing is concluded."""

LAGS, STRAIGHT = 0.4, 0.9
"""A damped residual above LAGS times the last one lags. With steps in one direction (cosine above STRAIGHT) the damping
holds it back and is dropped; otherwise Anderson mixing takes over."""

LAST = 3
"""Number of ratios of residuals whose geometric mean is the reported contraction."""


class Frozen(Enum):
    """The quantity that a program freezes."""

    THRESHOLD = "threshold"
    SHIFT = "shift"

    @property
    def other(self) -> Frozen:
        """The other sequence."""
        return Frozen.SHIFT if self is Frozen.THRESHOLD else Frozen.THRESHOLD


class Route(Enum):
    """How friction was coupled in a pass: exact (nothing frozen), or by threshold or shift, each in three ways."""

    EXACT = "exact"
    PLAIN = "plain"
    DAMPED = "damped"
    ANDERSON = "anderson"
    DE_SAXCE = "de_saxce"
    DE_SAXCE_DAMPED = "de_saxce_damped"
    DE_SAXCE_ANDERSON = "de_saxce_anderson"


class Mixing(Enum):
    """How a step mixes x and G(x); the values number the routes of each sequence."""

    PLAIN = 0
    DAMPED = 1
    ANDERSON = 2


ROUTES = {
    Frozen.THRESHOLD: (Route.PLAIN, Route.DAMPED, Route.ANDERSON),
    Frozen.SHIFT: (Route.DE_SAXCE, Route.DE_SAXCE_DAMPED, Route.DE_SAXCE_ANDERSON),
}


@dataclass(frozen=True)
class Safeguard:
    """When the coupling leaves the plain step.

    Programs freeze the threshold or De Saxce's shift, whichever is ``first``. A residual above ``falls`` times the last
    one counts as not falling. ``patience`` passes without progress, a fall to ``falls`` times the residual of the last
    progress, change to the other (twice as many the next time). Anderson mixes ``depth`` steps, damping halves the step
    down to ``least``. ``falls = inf`` is the plain, unsafeguarded fixed point.
    """

    first: Frozen = Frozen.THRESHOLD
    falls: float = 0.7
    patience: int = 4
    depth: int = 3
    least: float = 0.1

    def __post_init__(self) -> None:
        require_type(self.first, Frozen, "safeguard.first")
        make_floats(self, of="safeguard.", falls="> 0", least="in (0, 1]")
        require_count(self.patience, "safeguard.patience")
        require_count(self.depth, "safeguard.depth")


@dataclass(frozen=True)
class Coupled:
    """How friction was coupled: the route of the last pass, the observed contraction, the number of steps.

    ``contraction`` is the geometric mean of the last ratios of successive residuals, NaN before there are two.
    """

    route: Route = Route.PLAIN
    contraction: float = float("nan")
    steps: int = 0


Image = Callable[[Frozen], Floats]
"""The image G(x) (f,) of a pass in either sequence, on the friction rows."""


def image(rows: ContactRows, r: Floats, x: Floats) -> Image:
    """The image for forces r (c, d) and displacement x (n,): mu r_n, inf where tied, or mu |du_t|."""
    return lambda frozen: rows.threshold(r) if frozen is Frozen.THRESHOLD else rows.shift(x)


@dataclass(frozen=True, eq=False)
class Coupling:
    """The value (f,) that the next program freezes, and the memory of the safeguard.

    ``residual`` is |G(x) - x| of the last pass over the larger of |G(x)| and |x|, ``best`` that of the last progress in
    this sequence, ``waited`` the passes since. Without ``second`` only the threshold is ever frozen.
    """

    rule: Safeguard
    frozen: Frozen
    value: Floats
    second: bool
    mixing: Mixing = Mixing.PLAIN
    weight: float = 1.0
    memory: Past = Past()
    ratios: tuple[float, ...] = ()
    residual: float = np.inf
    best: float = np.inf
    waited: int = 0
    switches: int = 0
    report: Coupled = Coupled()

    @staticmethod
    def start(image: Image, rule: Safeguard = Safeguard(), second: bool = True) -> Coupling:
        """The coupling before the first pass; ``second`` says whether the programs can use both sequences."""
        frozen = rule.first if second else Frozen.THRESHOLD
        return Coupling(rule, frozen, image(frozen), second)

    @property
    def shift(self) -> Floats | None:
        """The frozen shift (f,), None while the threshold is frozen."""
        return self.value if self.frozen is Frozen.SHIFT else None

    def update(self, image: Image, exact: bool = False) -> Coupling:
        """The coupling after a pass; if it ended ``exact``, with nothing frozen, it restarts at its image."""
        if exact:
            return self._anew(image, self.frozen, Coupled(Route.EXACT, self.report.contraction, self.report.steps))
        target = image(self.frozen)
        step, residual = self._residual(target)
        ratios = self.ratios
        if SETTLED < self.residual < np.inf:
            ratios = (*ratios, residual / self.residual)[-LAST:]
        contraction = float(np.exp(np.log(np.maximum(ratios, np.finfo(float).tiny)).mean())) if ratios else np.nan
        report = Coupled(ROUTES[self.frozen][self.mixing.value], contraction, self.report.steps + 1)
        better = residual <= max(self.rule.falls * self.best, SETTLED)
        waited = 0 if better else self.waited + 1
        if self.second and waited >= self.rule.patience << self.switches:
            return replace(self._anew(image, self.frozen.other, report), switches=self.switches + 1)
        mixing, weight = self._choose(step, residual)
        memory, value = self._move(target, mixing, weight)
        best = min(residual, self.best) if better else self.best
        return replace(
            self,
            value=value,
            mixing=mixing,
            weight=weight,
            memory=memory,
            ratios=ratios,
            residual=residual,
            best=best,
            waited=waited,
            report=report,
        )

    def _anew(self, image: Image, frozen: Frozen, report: Coupled) -> Coupling:
        return Coupling(self.rule, frozen, image(frozen), self.second, switches=self.switches, report=report)

    def _residual(self, target: Floats) -> tuple[Floats, float]:
        """G(x) - x, zero where x is inf, and its relative length."""
        x, target = _finite(self.value), _finite(target)
        size = max(float(np.linalg.norm(x)), float(np.linalg.norm(target)))
        step = target - x
        return step, float(np.linalg.norm(step)) / size if size > 0 else 0.0

    def _choose(self, step: Floats, residual: float) -> tuple[Mixing, float]:
        """The mixing of the next step and its damping (module docstring)."""
        turn = _cosine(step, self.memory.steps[-1]) if self.memory.steps else 0.0
        if residual <= max(self.rule.falls * self.residual, SETTLED):
            lags = self.mixing is Mixing.DAMPED and residual > max(LAGS * self.residual, SETTLED)
            if lags and turn > STRAIGHT:
                return Mixing.PLAIN, 1.0
            return (Mixing.ANDERSON if lags else self.mixing), self.weight
        weight = max(self.weight / 2, self.rule.least) if turn < 0 else self.weight
        damped = turn < 0 and self.mixing is not Mixing.ANDERSON
        return (Mixing.DAMPED if damped else Mixing.ANDERSON), weight

    def _move(self, target: Floats, mixing: Mixing, weight: float) -> tuple[Past, Floats]:
        """The memory with this step in it, and the next value: never negative, inf where it was."""
        x, target = _finite(self.value), _finite(target)
        memory, mixed = Anderson(self.rule.depth, weight, growth=1.0).advance(self.memory, x, target)
        moved = mixed if mixing is Mixing.ANDERSON else x + weight * (target - x)
        return memory, np.where(np.isfinite(self.value), np.maximum(moved, 0.0), self.value)


def _cosine(a: Floats, b: Floats) -> float:
    """Cosine of the angle between two steps, 0 if one vanishes."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0 else 0.0


def _finite(value: Floats) -> Floats:
    return np.where(np.isfinite(value), value, 0.0)
