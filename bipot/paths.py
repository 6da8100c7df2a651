"""Piecewise linear multiples through points (tau, multiple): how far a tool has moved, how large a load is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real

import numpy as np

from bipot.errors import NO_NUMBERS, require, require_magnitude, require_number, require_type
from bipot.schedule import ROUND_OFF, SAME
from bipot.typing import Floats, listed, max_abs

Multiple = float | tuple[float, ...]
"""One multiple of the whole, or one for each component."""

Path = tuple[tuple[float, Multiple], ...]

POINTS = f"pairs (tau, multiple) with tau increasing from 0 to 1, by more than {ROUND_OFF:g} from the second point on"

LARGEST_MULTIPLE = 1e100
"""Products of larger multiples with lengths and forces could overflow."""

STRAIGHT = 1e-12
"""Distance of a point from the line of its neighbours, over the largest multiple, up to which it is no corner."""


def checked(path: object, field: str, allowed: str) -> Path:
    """``path`` as plain numbers; raises SceneError, saying what is ``allowed``, unless it leads from tau = 0 to 1.

    >>> checked([(0, 0), (0.5, (0, 1)), (1, [1, 1])], "path", POINTS)
    ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    """
    require(isinstance(path, tuple | list), field, path, allowed)
    points: Path = tuple(_point(point, field, allowed) for point in path)  # type: ignore[attr-defined]
    taus = np.array([tau for tau, _ in points])
    # In no time at all it may rise from zero alone: a march lands on every other corner.
    rising = len(taus) > 1 and taus[0] == 0 and taus[-1] == 1 and taus[1] > 0
    require(rising and bool((np.diff(taus[1:]) > ROUND_OFF).all()), field, path, allowed)
    for multiple in np.concatenate([np.ravel(multiple) for _, multiple in points]).tolist():
        require_magnitude(multiple, f"{field}, a multiple", LARGEST_MULTIPLE)
    return points


def multiples(path: Path, dimension: int) -> tuple[Floats, Floats]:
    """Pseudo-times (k,) and multiples (k, d) of a path, one for each component."""
    every = [np.broadcast_to(multiple, dimension) for _, multiple in path]
    return np.array([tau for tau, _ in path]), np.array(every)


def corners(path: Path) -> tuple[float, ...]:
    """Pseudo-times in (0, 1) at which the rate changes.

    What is there at once at the beginning, and changes from there, has a corner right behind it, at :data:`SAME`.

    >>> corners(((0.0, 0.0), (0.2, 0.2), (0.5, 0.5), (1.0, 0.0)))
    (0.5,)
    >>> corners(((0.0, 1.0), (1.0, 1.0))), corners(((0.0, 1.0), (1.0, 0.0)))
    ((), (1e-09,))
    """
    taus, values = multiples(path, max(np.size(multiple) for _, multiple in path))
    least = STRAIGHT * np.abs(values).max()
    part = ((taus[1:-1] - taus[:-2]) / (taus[2:] - taus[:-2]))[:, None]
    off = np.abs(values[1:-1] - (values[:-2] + part * (values[2:] - values[:-2]))).max(axis=1)
    turns = taus[1:-1][off > least]
    begun = np.flatnonzero(taus <= ROUND_OFF)[-1]
    change = max_abs(values[begun + 1] - values[begun])
    at_once = [SAME] if values[begun].any() and change > least else []
    return (*at_once, *turns[turns > ROUND_OFF].tolist())


def pair(value: object, field: str, allowed: str) -> tuple[float, float]:
    """``value`` as two finite numbers."""
    first, second = _numbers(value, (2,), field, allowed)
    return first, second


def vector(value: object, field: str, largest: float = math.inf) -> tuple[float, ...]:
    """``value`` as a vector, two finite numbers in a plane or three in space, of magnitudes to the ``largest``."""
    found = _numbers(value, (2, 3), field, "two finite numbers, or three in space")
    require_magnitude(max(map(abs, found)), field, largest)
    return found


def require_components(value: Sequence[float], dimension: int, field: str) -> None:
    """Refuse a vector of so many components on a body of another ``dimension``."""
    allowed = f"of {dimension} numbers, as the other vectors and the nodes of the mesh"
    require(len(value) == dimension, field, value, allowed)


def _numbers(value: object, counts: tuple[int, ...], field: str, allowed: str) -> tuple[float, ...]:
    """``value`` as so many finite numbers."""
    given = list(value) if listed(value) else []
    require(len(given) in counts and all(map(_finite, given)), field, value, allowed)
    return tuple(map(float, given))


def _finite(x: object) -> bool:
    """Whether ``x`` is a number that a float can hold."""
    try:
        return isinstance(x, Real) and not isinstance(x, NO_NUMBERS) and bool(np.isfinite(float(x)))
    except OverflowError:
        return False


def _point(point: object, field: str, allowed: str) -> tuple[float, Multiple]:
    """One point of a path."""
    if isinstance(point, tuple | list) and len(point) == 2 and isinstance(point[1], tuple | list | np.ndarray):
        return pair((point[0], 0.0), field, allowed)[0], _numbers(point[1], (2, 3), field, allowed)
    return pair(point, field, allowed)


@dataclass(frozen=True)
class Amplitude:
    """A multiple of pseudo-time, piecewise linear through the ``points`` (tau, multiple), tau rising from 0 to 1.

    >>> Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 0.2))).at(0.75)
    0.6
    """

    points: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 1.0))

    def __post_init__(self) -> None:
        points = checked(self.points, "amplitude.points", POINTS)
        require(all(isinstance(m, float) for _, m in points), "amplitude.points", self.points, POINTS)
        object.__setattr__(self, "points", points)

    def at(self, tau: float) -> float:
        """The multiple at ``tau``; raises SceneError if that is no number."""
        require_number(tau, "tau")
        taus, values = self._table
        return float(np.interp(tau, taus, values[:, 0]))

    @property
    def largest(self) -> float:
        """The largest multiple without its sign."""
        return max_abs(self._table[1])

    @cached_property
    def _table(self) -> tuple[Floats, Floats]:
        return multiples(self.points, 1)


RAMP = Amplitude()


def require_bounded(size: float, amplitude: object, field: str, largest: float) -> None:
    """Refuse what is no amplitude of a ``size``, or a size out of range, by itself or at its largest multiple."""
    require_type(amplitude, Amplitude, f"{field.split('.', maxsplit=1)[0]}.amplitude")
    require(math.isfinite(size), field, size, "finite")
    for value in (size, size * amplitude.largest):  # type: ignore[attr-defined]
        require_magnitude(value, f"{field}, its amplitude with it", largest)
