"""Isotropic hardening: the yield stress σ_Y(p) of (7) as a function of the equivalent plastic strain p.

Each curve gives σ_Y and its slope H = dσ_Y/dp. The slope is never negative: the energy of an increment is then
convex in the plastic strain, which every conic form of the increment needs. A new curve is a class here, or
anywhere, and its line in :data:`CURVES`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from inspect import signature
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from bipot.errors import LARGEST_STRESS, require, require_magnitude, require_number
from bipot.laws.tensors import FloatArray

_SOFTENING = "finite and >= 0 (softening makes the energy of an increment non-convex)"


@runtime_checkable
class Hardening(Protocol):
    """A hardening curve; arrays in, arrays out, peeq >= 0."""

    def yield_stress(self, peeq: ArrayLike) -> FloatArray:
        """σ_Y(p)."""
        ...

    def slope(self, peeq: ArrayLike) -> FloatArray:
        """H = dσ_Y/dp, the right-hand one at a kink."""
        ...


def _require_positive(field: str, value: float) -> None:
    require_number(value, field)
    require(math.isfinite(value) and value > 0, field, value, "finite and > 0")
    require_magnitude(value, field, LARGEST_STRESS)


def _require_rising(field: str, value: float) -> None:
    require_number(value, field)
    require(math.isfinite(value) and value >= 0, field, value, _SOFTENING)
    require(value <= LARGEST_STRESS, field, value, f"at most {LARGEST_STRESS:g}: choose other units")


def _require_numbers(field: str, values: tuple[float, ...]) -> tuple[float, ...]:
    """The values as a tuple of numbers."""
    require(isinstance(values, tuple | list | np.ndarray), field, values, "a tuple of numbers")
    for value in values:
        require_number(value, field)
    return tuple(float(value) for value in values)


@dataclass(frozen=True)
class Perfect:
    """Perfect plasticity, σ_Y(p) = sigma_y (stress units).

    >>> float(Perfect(300.0).yield_stress(0.1))
    300.0
    """

    sigma_y: float

    def __post_init__(self) -> None:
        _require_positive("sigma_y", self.sigma_y)

    def yield_stress(self, peeq: ArrayLike) -> FloatArray:
        """σ_Y(p) = sigma_y."""
        return np.full(np.shape(peeq), self.sigma_y)

    def slope(self, peeq: ArrayLike) -> FloatArray:
        """H = 0."""
        return np.zeros(np.shape(peeq))


@dataclass(frozen=True)
class Linear:
    """Linear hardening, σ_Y(p) = sigma_y + modulus p (stress units).

    >>> float(Linear(300.0, 1000.0).yield_stress(0.1))
    400.0
    """

    sigma_y: float
    modulus: float

    def __post_init__(self) -> None:
        _require_positive("sigma_y", self.sigma_y)
        _require_rising("modulus", self.modulus)

    def yield_stress(self, peeq: ArrayLike) -> FloatArray:
        """σ_Y(p) = sigma_y + modulus p."""
        return self.sigma_y + self.modulus * np.asarray(peeq, float)

    def slope(self, peeq: ArrayLike) -> FloatArray:
        """H = modulus."""
        return np.full(np.shape(peeq), float(self.modulus))


@dataclass(frozen=True)
class Voce:
    """Saturating hardening, σ_Y(p) = sigma_y + saturation (1 - exp(-rate p)) + modulus p (stress units).

    >>> round(float(Voce(300.0, 100.0, 10.0).yield_stress(10.0)), 9)
    400.0
    """

    sigma_y: float
    saturation: float
    rate: float
    modulus: float = 0.0

    def __post_init__(self) -> None:
        _require_positive("sigma_y", self.sigma_y)
        _require_rising("saturation", self.saturation)
        _require_positive("rate", self.rate)
        _require_rising("modulus", self.modulus)

    def yield_stress(self, peeq: ArrayLike) -> FloatArray:
        """σ_Y(p) = sigma_y + saturation (1 - exp(-rate p)) + modulus p."""
        p = np.asarray(peeq, float)
        return self.sigma_y - self.saturation * np.expm1(-self.rate * p) + self.modulus * p

    def slope(self, peeq: ArrayLike) -> FloatArray:
        """H = saturation rate exp(-rate p) + modulus."""
        p = np.asarray(peeq, float)
        return self.saturation * self.rate * np.exp(-self.rate * p) + self.modulus


@dataclass(frozen=True)
class Swift:
    """Swift's power law, σ_Y(p) = strength (offset + p)^exponent (stress units; strain; a number in [0, 1]).

    >>> round(float(Swift(500.0, 0.01, 0.25).yield_stress(0.15)), 9)
    316.227766017
    """

    strength: float
    offset: float
    exponent: float

    def __post_init__(self) -> None:
        _require_positive("strength", self.strength)
        _require_positive("offset", self.offset)
        require_number(self.exponent, "exponent")
        require(0 <= self.exponent <= 1, "exponent", self.exponent, "in [0, 1]")
        _require_positive("sigma_y", float(self.yield_stress(0.0)))

    def yield_stress(self, peeq: ArrayLike) -> FloatArray:
        """σ_Y(p) = strength (offset + p)^exponent."""
        return self.strength * (self.offset + np.asarray(peeq, float)) ** self.exponent

    def slope(self, peeq: ArrayLike) -> FloatArray:
        """H = exponent σ_Y(p)/(offset + p)."""
        p = np.asarray(peeq, float)
        return self.exponent * self.yield_stress(p) / (self.offset + p)


@dataclass(frozen=True)
class Tabulated:
    """Piecewise linear curve through (peeq_i, stress_i), constant beyond the last (stress units).

    >>> curve = Tabulated((0.0, 0.1), (300.0, 350.0))
    >>> [float(curve.yield_stress(p)) for p in (0.0, 0.05, 1.0)]
    [300.0, 325.0, 350.0]
    """

    peeq: tuple[float, ...]
    stress: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("peeq", "stress"):
            object.__setattr__(self, name, _require_numbers(name, getattr(self, name)))
        require(len(self.peeq) >= 2, "peeq", self.peeq, "at least two values")
        require(
            len(self.stress) == len(self.peeq),
            "stress",
            self.stress,
            f"as long as peeq ({len(self.peeq)} values)",
        )
        x, y = np.array(self.peeq, float), np.array(self.stress, float)
        rising = bool(np.isfinite(x).all() and x[0] == 0 and (np.diff(x) > 0).all())
        require(rising, "peeq", self.peeq, "finite, strictly increasing from 0")
        _require_positive("sigma_y", float(y[0]))
        _require_rising("stress", float(y[-1]))
        hardening = bool(np.isfinite(y).all() and (np.diff(y) >= 0).all())
        require(
            hardening,
            "stress",
            self.stress,
            "finite and non-decreasing (softening makes the energy of an increment non-convex)",
        )

    @cached_property
    def _knots(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Ends of the segments (the last one open), stresses at the points, slopes of the segments."""
        x, y = np.array(self.peeq, float), np.array(self.stress, float)
        return np.append(x, np.inf), y, np.append(np.diff(y) / np.diff(x), 0.0)

    def yield_stress(self, peeq: ArrayLike) -> FloatArray:
        """σ_Y(p) by linear interpolation."""
        ends, stress, _ = self._knots
        return np.asarray(np.interp(np.asarray(peeq, float), ends[:-1], stress))

    def slope(self, peeq: ArrayLike) -> FloatArray:
        """H of the segment that starts at or before p."""
        ends, _, slopes = self._knots
        return slopes[np.maximum(np.searchsorted(ends, np.asarray(peeq, float), side="right") - 1, 0)]


CURVES: dict[str, Callable[..., Hardening]] = {
    "perfect": Perfect,
    "linear": Linear,
    "voce": Voce,
    "swift": Swift,
    "table": Tabulated,
}
"""What a command line calls the curves. Their numbers follow in the order of their fields; a table's are pairs."""


def _numbers(text: str, separator: str) -> list[float]:
    try:
        return [float(word) for word in text.split(separator)]
    except ValueError:
        require(False, "hardening", text, f"numbers separated by '{separator}'")
        raise


def _fields(make: Callable[..., Hardening]) -> tuple[list[str], int]:
    """Names of a curve's numbers, and how many of them must be given."""
    given = signature(make).parameters.values()
    return [field.name for field in given], sum(field.default is field.empty for field in given)


def hardening_from_text(text: str) -> Hardening:
    """Read a hardening curve from one word, as a command line gives it; raises SceneError if it cannot.

    >>> hardening_from_text("linear:300,1000")
    Linear(sigma_y=300.0, modulus=1000.0)
    """
    name, _, rest = text.partition(":")
    require(name in CURVES, "hardening", name, "one of " + ", ".join(sorted(CURVES)))
    make = CURVES[name]
    if make is Tabulated:
        pairs = [_numbers(pair, "/") for pair in rest.split(",")]
        require(all(len(pair) == 2 for pair in pairs), "hardening", rest, "pairs peeq/stress separated by ','")
        return Tabulated(*zip(*pairs, strict=True))
    numbers, (names, least) = _numbers(rest, ","), _fields(make)
    counts = range(least, len(names) + 1)
    allowed = " or ".join(str(count) for count in counts) + " numbers separated by ','"
    require(len(numbers) in counts, "hardening", rest, allowed)
    return make(*numbers)


def hardening_usage() -> str:
    """What :func:`hardening_from_text` reads, for a command line's help.

    >>> hardening_usage().split("; ")[2]
    'voce:sigma_y,saturation,rate[,modulus]'
    """
    words = list[str]()
    for name, make in CURVES.items():
        names, least = _fields(make)
        rest = "".join(f"[,{field}]" for field in names[least:])
        words.append(f"{name}:" + ("peeq/stress,..." if make is Tabulated else ",".join(names[:least]) + rest))
    return "; ".join(words)
