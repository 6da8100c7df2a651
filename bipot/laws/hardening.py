"""Isotropic hardening: the yield stress σ_Y(p) of (7) as a function of the equivalent plastic strain p.

Each curve gives σ_Y, its slope H = dσ_Y/dp and its energy ∫ σ_Y. The slope is never negative: the energy of
an increment is then convex in the plastic strain, which every conic form of the increment needs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from bipot.errors import LARGEST_STRESS, require, require_magnitude, require_number
from bipot.laws.tensors import FloatArray

_SOFTENING = "finite and >= 0 (softening makes the energy of an increment non-convex)"


@runtime_checkable
class Hardening(Protocol):
    """A hardening curve; arrays in, arrays out, peeq >= 0 and dp >= 0 broadcast together."""

    def yield_stress(self, peeq: ArrayLike) -> FloatArray:
        """σ_Y(p)."""
        ...

    def slope(self, peeq: ArrayLike) -> FloatArray:
        """H = dσ_Y/dp, the right-hand one at a kink."""
        ...

    def energy(self, peeq: ArrayLike, dp: ArrayLike) -> FloatArray:
        """∫_0^dp σ_Y(p + s) ds, the plastic energy of an increment per volume."""
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

    >>> float(Perfect(300.0).energy(0.1, 0.5))
    150.0
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

    def energy(self, peeq: ArrayLike, dp: ArrayLike) -> FloatArray:
        """sigma_y dp."""
        return self.yield_stress(peeq) * np.asarray(dp, float)


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

    def energy(self, peeq: ArrayLike, dp: ArrayLike) -> FloatArray:
        """σ_Y(p + dp/2) dp, exact for a straight line."""
        p, dp = np.asarray(peeq, float), np.asarray(dp, float)
        return self.yield_stress(p + 0.5 * dp) * dp


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

    def energy(self, peeq: ArrayLike, dp: ArrayLike) -> FloatArray:
        """(sigma_y + modulus (p + dp/2)) dp + saturation (dp - exp(-rate p) (1 - exp(-rate dp))/rate)."""
        p, dp = np.asarray(peeq, float), np.asarray(dp, float)
        lost = -np.exp(-self.rate * p) * np.expm1(-self.rate * dp) / self.rate
        return (self.sigma_y + self.modulus * (p + 0.5 * dp)) * dp + self.saturation * (dp - lost)


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

    def energy(self, peeq: ArrayLike, dp: ArrayLike) -> FloatArray:
        """Sum over segments of overlap length times midpoint stress, exact and free of cancellation."""
        ends, _, _ = self._knots
        p, dp = np.asarray(peeq, float)[..., None], np.asarray(dp, float)[..., None]
        start, stop = np.clip(ends[:-1] - p, 0.0, dp), np.clip(ends[1:] - p, 0.0, dp)
        return np.sum((stop - start) * self.yield_stress(p + 0.5 * (start + stop)), axis=-1)


def _numbers(text: str, separator: str) -> list[float]:
    try:
        return [float(word) for word in text.split(separator)]
    except ValueError:
        require(False, "hardening", text, f"numbers separated by '{separator}'")
        raise


def _table(text: str) -> Tabulated:
    pairs = [_numbers(pair, "/") for pair in text.split(",")]
    require(all(len(pair) == 2 for pair in pairs), "hardening", text, "pairs peeq/stress separated by ','")
    return Tabulated(tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs))


def _curve(make: Callable[..., Hardening], counts: tuple[int, ...]) -> Callable[[str], Hardening]:
    def parse(text: str) -> Hardening:
        numbers = _numbers(text, ",")
        allowed = " or ".join(str(count) for count in counts) + " numbers separated by ','"
        require(len(numbers) in counts, "hardening", text, allowed)
        return make(*numbers)

    return parse


_PARSERS: dict[str, Callable[[str], Hardening]] = {
    "perfect": _curve(Perfect, (1,)),
    "linear": _curve(Linear, (2,)),
    "voce": _curve(Voce, (3, 4)),
    "table": _table,
}


def hardening_from_text(text: str) -> Hardening:
    """Read a hardening curve from one word, as a command line gives it; raises SceneError if it cannot.

    Forms: ``perfect:σ``, ``linear:σ,H``, ``voce:σ,saturation,rate[,H]``, ``table:p0/σ0,p1/σ1,…``.

    >>> hardening_from_text("linear:300,1000")
    Linear(sigma_y=300.0, modulus=1000.0)
    """
    name, _, rest = text.partition(":")
    require(name in _PARSERS, "hardening", name, "one of " + ", ".join(sorted(_PARSERS)))
    return _PARSERS[name](rest)
