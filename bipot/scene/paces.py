r"""Changes of pace: kinks of the paths at which everything goes on as before, only faster or slower.

Between two kinks tools, turns, supports and loads change at constant rates. At most kinks the proportions of these
rates change: the path turns. Where all rates are multiplied by one factor, a body of a rate-independent material does
not notice: it goes on as if the path before the kink had been followed at the pace after it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from bipot.paths import STRAIGHT, Path, corners, multiples
from bipot.schedule import ROUND_OFF, SAME
from bipot.tensors import norm
from bipot.typing import Floats, Vector, max_abs

LEAST = 1e-9
"""Norm of the changes over a stretch, each over its path's largest value, below which they have no clear direction."""

Moved = tuple[Path, Vector]
"""A path and the components that its multiples multiply, all by one multiple or each by its own."""


@dataclass(frozen=True)
class Paces:
    """Pseudo-times ``kinks`` (k,) at which rates change, and the factor ``quicker`` (k,) of all rates, NaN at a turn.

    Kinks that are apart by round-off only count as one.
    """

    kinks: tuple[float, ...]
    quicker: tuple[float, ...]

    def is_turn(self, tau: float) -> bool:
        """Whether the proportions of rates change at ``tau``."""
        return any(math.isnan(quicker) for quicker in self._at(tau))

    def factor(self, tau: float) -> float:
        """How many times as fast everything goes on from ``tau``: 1 between kinks and at turns."""
        return 1.0 if self.is_turn(tau) else math.prod(self._at(tau))

    def since_turn(self, begun: float, tau: float) -> tuple[float, float]:
        """The last turn up to ``begun``, 0 without one, and the time from there to ``tau`` at the pace of its end.

        There must be no kink between ``begun`` and ``tau``.

        >>> Paces((0.25, 0.5), (2.0, 4.0)).since_turn(0.5, 0.75)
        (0.0, 0.34375)
        """
        end, pace, passed = tau, 1.0, 0.0
        for kink, quicker in reversed(list(zip(self.kinks, self.quicker, strict=True))):
            if kink <= begun + ROUND_OFF:
                passed += (end - kink) / pace
                if math.isnan(quicker):
                    return kink, passed
                end, pace = kink, pace * quicker
        return 0.0, passed + end / pace

    def _at(self, tau: float) -> list[float]:
        """The factors of the kinks at ``tau``."""
        return [factor for kink, factor in zip(self.kinks, self.quicker, strict=True) if abs(kink - tau) <= ROUND_OFF]


BEGINNING = Paces((0.0,), (math.nan,))
"""The beginning of a path, which turns what led there, if anything did."""


@lru_cache(maxsize=64)
def paces_of(moved: tuple[Moved, ...]) -> Paces:
    """The kinks of these paths, and at which of them the pace alone changes.

    >>> there_and_on = ((0.0, 0.0), (0.25, 0.5), (0.5, 0.75), (1.0, 0.5))
    >>> paces_of(((there_and_on, (10.0,)),))
    Paces(kinks=(0.25, 0.5), quicker=(0.5, nan))
    """
    kinks = np.array(sorted({tau for path, _ in moved for tau in corners(path)}))
    if not kinks.size:
        return Paces((), ())
    apart = np.diff(kinks) > ROUND_OFF
    first, last = kinks[np.append(True, apart)], kinks[np.append(apart, True)]
    # What changes at once at the beginning has no rate.
    begins, ends = np.append(SAME, last), np.append(first, 1.0)
    ways = np.hstack([_ways(path, size, begins, ends) for path, size in moved])
    stretches = zip(pairwise(ways), pairwise((ends - begins).tolist()), strict=True)
    quicker = [_quicker(*way, before / after) for way, (before, after) in stretches]
    turns = np.where(first > SAME, quicker, math.nan)
    return Paces(tuple(first.tolist()), tuple(turns.tolist()))


def _ways(path: Path, size: Vector, begins: Floats, ends: Floats) -> Floats:
    """How far (s, d) a path goes in each stretch, over its largest component from rest."""
    taus, values = multiples(path, len(size))
    values = values * size
    start, end = (np.transpose([np.interp(times, taus, part) for part in values.T]) for times in (begins, ends))
    largest = max_abs(values)
    return (end - start) / largest if largest > 0 else end


def _quicker(before: Floats, after: Floats, shorter: float) -> float:
    """The factor of rates from one way (m,) to the next, if it takes 1/``shorter`` times as long; NaN at a turn."""
    sizes = float(norm(before)), float(norm(after))
    if min(sizes) <= LEAST:
        return math.nan
    off = float(norm(after / sizes[1] - before / sizes[0]))
    return sizes[1] / sizes[0] * shorter if off <= STRAIGHT * (1 / sizes[0] + 1 / sizes[1]) else math.nan
