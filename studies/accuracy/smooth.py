r"""A smooth curve through the sawtooth of a course: as nodes of the side land one by one, its quantities jump.

At a reduction x the logarithm of q (1 - x)^a is fitted by a quadratic function over a share of the increments, the
nearest half, weighted by (1 - (d/D)^3)^3 at a distance d of at most D (a local regression, Cleveland 1979). Without
friction the quantity follows (1 - x)^-a, a = 1 of the force and 1/2 of a radius. What is before :data:`SETTLED` is left
out: first yield is no part of the curve.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from bipot.typing import Floats

EXPONENTS: Mapping[str, float] = {"force_N": 1.0, "max_radius_mm": 0.5, "contact_radius_mm": 0.5}
"""a by quantity: all of which limits are told."""

QUANTITIES = tuple(EXPONENTS)
AT = "at"
"""The reductions of a course."""

SHARE, WIDER = 0.5, 0.75
"""Of the increments: what a curve is fitted over, and what it is fitted over to see how much that matters."""

SETTLED = 0.02
FEWEST = 12
"""Increments of a course that is smoothed: half of them fit three coefficients."""

Course = Mapping[str, Floats]


def smoothed(course: Course, quantity: str, reduction: float, share: float = SHARE) -> float:
    """The curve's value at a reduction; NaN of a course that does not come so far or has fewer than FEWEST increments.

    >>> x = np.linspace(0.0, 0.4, 41)
    >>> value = smoothed({"at": x, "force_N": np.exp(x**2) / (1 - x)}, "force_N", 0.3)
    >>> abs(value - math.exp(0.09) / 0.7) < 1e-12
    True
    """
    kept = course[AT] >= SETTLED
    x = course[AT][kept]
    if len(x) < FEWEST or not x[0] <= reduction <= x[-1]:
        return math.nan
    exponent = EXPONENTS[quantity]
    y = np.log(course[quantity][kept]) + exponent * np.log1p(-x)
    offset = x - reduction
    reach = np.sort(np.abs(offset))[math.ceil(share * len(x))]
    root = np.sqrt(np.clip(1 - np.abs(offset / reach) ** 3, 0, None) ** 3)
    coefficients = np.linalg.lstsq(root[:, None] * np.vander(offset / reach, 3), root * y, rcond=None)[0]
    return float(np.exp(coefficients[-1] - exponent * np.log1p(-reduction)))
