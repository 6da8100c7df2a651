"""Isotropic hardening: the yield stress σ_Y(p) of (7) as a function of the equivalent plastic strain p.

Each curve gives σ_Y and its slope H = dσ_Y/dp. The slope is never negative: the energy of an increment is then
convex in the plastic strain, which every conic form of the increment needs. A new curve is a class here, or anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from bipot.errors import LARGEST_STRESS, SceneError, require, require_magnitude, require_number, require_positive
from bipot.laws.table_file import two_columns
from bipot.typing import Floats, make_floats

_WHY = "(softening makes the energy of an increment non-convex)"

_ROUND_OFF = 4.0 * float(np.finfo(float).eps)
"""Part of itself by which a stress may fall and still count as not falling."""


@runtime_checkable
class Hardening(Protocol):
    """A hardening curve; arrays in, arrays of their shape out, peeq >= 0."""

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """σ_Y(p)."""
        ...

    def slope(self, peeq: ArrayLike) -> Floats:
        """H = dσ_Y/dp, the right-hand one at a kink."""
        ...


TRIED = (0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Plastic strains at which a curve is tried when a material is made."""


def require_hardening(curve: Hardening) -> None:
    """Raise :class:`SceneError` unless the stress is finite, positive and not falling, the slope finite and >= 0.

    Both are tried on the array of plastic strains :data:`TRIED`, and have to be arrays of its shape.
    """
    stress, slope = (_tried(curve, name) for name in ("yield_stress", "slope"))
    last = 0.0
    for k, p in enumerate(TRIED):
        sigma, H = float(stress[k]), float(slope[k])
        require(0 < sigma < math.inf, f"hardening.yield_stress({p})", sigma, "finite and > 0")
        require(sigma >= last, f"hardening.yield_stress({p})", sigma, f"not falling {_WHY}")
        require(0 <= H < math.inf, f"hardening.slope({p})", H, f"finite and >= 0 {_WHY}")
        last = sigma * (1.0 - _ROUND_OFF)


def _tried(curve: Hardening, name: str) -> Floats:
    """The values of the curve's method ``name`` at :data:`TRIED`, asked by elements and points."""
    peeq, field = np.array(TRIED).reshape(2, -1), f"hardening.{name}"
    allowed = "an array of peeq's shape, of numbers: peeq is the array of all integration points"
    try:
        out = getattr(curve, name)(peeq)
    except (TypeError, ValueError) as scalar:
        # So do functions of a single number, such as math.sqrt, and an `if` that asks for one.
        raise SceneError(f"{field} = {type(scalar).__name__}: {scalar}: must be {allowed}") from scalar
    fits = isinstance(out, np.ndarray) and out.shape == peeq.shape and out.dtype.kind in "fiu"
    require(fits, field, out, allowed)
    return out.ravel()


def _require_positive(field: str, value: float) -> None:
    require_positive(**{field: value})
    require_magnitude(value, field, LARGEST_STRESS)


def _require_rising(field: str, value: float) -> None:
    require(math.isfinite(value) and value >= 0, field, value, f"finite and >= 0 {_WHY}")
    require(value <= LARGEST_STRESS, field, value, f"at most {LARGEST_STRESS:g}: choose other units")


def _require_numbers(field: str, values: tuple[float, ...]) -> tuple[float, ...]:
    """The values as a tuple of numbers."""
    listed = isinstance(values, tuple | list) or (isinstance(values, np.ndarray) and values.ndim == 1)
    require(listed, field, values, "a tuple of numbers")
    for value in values:
        require_number(value, field)
    return tuple(float(value) for value in values)


def _require_curve(peeq: Sequence[float], stress: Sequence[float], name: Callable[[int, int], str]) -> None:
    """Strain rises from 0, stress is positive and does not fall; messages call a value ``name(column, k)``."""
    for k, (p, sigma) in enumerate(zip(peeq, stress, strict=True)):
        rising = math.isfinite(p) and (p > peeq[k - 1] if k else p == 0)
        require(rising, name(0, k), p, "finite, strictly increasing from 0")
        _require_positive(name(1, k), sigma)
        require(k == 0 or sigma >= stress[k - 1], name(1, k), sigma, f"finite and non-decreasing {_WHY}")
        slope = (sigma - stress[k - 1]) / (p - peeq[k - 1]) if k else 0.0
        require(slope <= LARGEST_STRESS, name(0, k), p, f"so far from the one before that H <= {LARGEST_STRESS:g}")


@dataclass(frozen=True)
class Linear:
    """Linear hardening, σ_Y(p) = sigma_y + modulus p (stress units).

    >>> float(Linear(300.0, 1000.0).yield_stress(0.1))
    400.0
    """

    sigma_y: float
    modulus: float

    def __post_init__(self) -> None:
        make_floats(self, "sigma_y", "modulus")
        _require_positive("sigma_y", self.sigma_y)
        _require_rising("modulus", self.modulus)

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """σ_Y(p) = sigma_y + modulus p."""
        return self.sigma_y + self.modulus * np.asarray(peeq, float)

    def slope(self, peeq: ArrayLike) -> Floats:
        """H = modulus."""
        return np.full(np.shape(peeq), float(self.modulus))


@dataclass(frozen=True)
class Perfect(Linear):
    """Perfect plasticity, σ_Y(p) = sigma_y (stress units).

    >>> float(Perfect(300.0).yield_stress(0.1))
    300.0
    """

    modulus: float = field(default=0.0, init=False, repr=False)


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
        make_floats(self, "sigma_y", "saturation", "rate", "modulus")
        _require_positive("sigma_y", self.sigma_y)
        _require_rising("saturation", self.saturation)
        _require_positive("rate", self.rate)
        _require_rising("modulus", self.modulus)

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """σ_Y(p) = sigma_y + saturation (1 - exp(-rate p)) + modulus p."""
        p = np.asarray(peeq, float)
        return self.sigma_y - self.saturation * np.expm1(-self.rate * p) + self.modulus * p

    def slope(self, peeq: ArrayLike) -> Floats:
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
        make_floats(self, "strength", "offset", exponent="in [0, 1]")
        _require_positive("strength", self.strength)
        _require_positive("offset", self.offset)
        _require_positive("sigma_y", float(self.yield_stress(0.0)))

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """σ_Y(p) = strength (offset + p)^exponent."""
        return self.strength * (self.offset + np.asarray(peeq, float)) ** self.exponent

    def slope(self, peeq: ArrayLike) -> Floats:
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
        same = len(self.stress) == len(self.peeq)
        require(same, "stress", self.stress, f"as long as peeq ({len(self.peeq)} values)")
        _require_curve(self.peeq, self.stress, lambda column, k: f"{('peeq', 'stress')[column]}[{k}]")

    @staticmethod
    def from_csv(path: str | Path, delimiter: str | None = ",") -> Tabulated:
        """The curve of a text file: plastic strain, then yield stress, one point a line, a header or none, # comments.

        Columns are parted by ``delimiter``, by white space where that is None. Stresses are in the units of the scene.

        Raises:
            SceneError: a file that cannot be read, a line without two numbers, a curve that :class:`Tabulated` refuses;
                the message names file, line and value.
        """
        names = "plastic strain", "yield stress"
        lines, peeq, stress = two_columns(path, names, delimiter)
        _require_curve(peeq, stress, lambda column, k: f"{path}, line {lines[k]}: {names[column]}")
        return Tabulated(peeq, stress)

    @cached_property
    def _knots(self) -> tuple[Floats, Floats, Floats]:
        """Ends of the segments (the last is endless), stresses at the points, slopes of the segments."""
        x, y = np.array(self.peeq), np.array(self.stress)
        return np.append(x, np.inf), y, np.append(np.diff(y) / np.diff(x), 0.0)

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """σ_Y(p) by linear interpolation."""
        ends, stress, _ = self._knots
        return np.asarray(np.interp(np.asarray(peeq, float), ends[:-1], stress))

    def slope(self, peeq: ArrayLike) -> Floats:
        """H of the segment that starts at or before p."""
        ends, _, slopes = self._knots
        return slopes[np.maximum(np.searchsorted(ends, np.asarray(peeq, float), side="right") - 1, 0)]
