"""How far along its travel a tool is: points (tau, multiple) of a piecewise linear path, checked and read."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np

from bipot.errors import require, require_magnitude
from bipot.typing import Floats

Multiple = float | tuple[float, float]
"""Of the whole travel, or of each of its components."""

Path = tuple[tuple[float, Multiple], ...]

LARGEST_MULTIPLE = 1e100

POINTS = (
    "pairs (tau, multiple) with tau increasing from 0 to 1, the first multiple 0; a multiple is a number, or a pair"
)


def checked(path: object, field: str) -> Path:
    """``path`` as plain numbers; raises SceneError unless it leads from (0, 0) to tau = 1.

    >>> checked([(0, 0), (0.5, (0, 1)), (1, [1, 1])], "path")
    ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    """
    require(isinstance(path, tuple | list), field, path, POINTS)
    points: Path = tuple(_point(point, field) for point in path)  # type: ignore[attr-defined]
    taus = np.array([tau for tau, _ in points])
    rising = len(taus) > 1 and taus[0] == 0 and taus[-1] == 1 and bool((np.diff(taus) > 0).all())
    require(rising and not np.any(points[0][1]), field, path, POINTS)
    for multiple in np.ravel([np.broadcast_to(multiple, 2) for _, multiple in points]).tolist():
        require_magnitude(multiple, f"{field}, a multiple", LARGEST_MULTIPLE)
    return points


def multiples(path: Path) -> tuple[Floats, Floats]:
    """Pseudo-times (k,) and multiples (k, d) of a path."""
    return np.array([tau for tau, _ in path]), np.array([np.broadcast_to(multiple, 2) for _, multiple in path])


def pair(value: object, field: str, allowed: str) -> tuple[float, float]:
    """``value`` as two finite numbers."""
    given: list[Any] = list(value) if isinstance(value, tuple | list | np.ndarray) else []
    require(len(given) == 2 and all(map(_finite, given)), field, value, allowed)
    return float(given[0]), float(given[1])


def _finite(x: object) -> bool:
    """Whether ``x`` is a number that a float can hold."""
    try:
        return isinstance(x, Real) and not isinstance(x, bool) and bool(np.isfinite(float(x)))
    except OverflowError:
        return False


def _point(point: object, field: str) -> tuple[float, Multiple]:
    """One point of a path."""
    if isinstance(point, tuple | list) and len(point) == 2 and isinstance(point[1], tuple | list | np.ndarray):
        return pair((point[0], 0.0), field, POINTS)[0], pair(point[1], field, POINTS)
    return pair(point, field, POINTS)
