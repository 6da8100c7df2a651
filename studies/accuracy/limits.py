r"""What mesh series tend to, with a band: by Richardson's extrapolation of two elements of different families.

Of the values v_1, v_2, v_3 of the three finest meshes h, h/2, h/4 of an element, with q = (v_2 - v_1)/(v_3 - v_2),

    v = v_3 + (v_3 - v_2)/(q - 1)    where q is in [2, 16], orders one to four,    v = v_3 elsewhere,

and the element's own uncertainty is |v - v_3| there, |v_3 - v_2| elsewhere. The limit is the mean of the two elements
of least uncertainty, the band (to either side) what they are from it or the smaller of their uncertainties, if larger.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.accuracy.row import Row
from studies.element_types import ElementType

QUANTITIES = ("force_N", "max_radius_mm", "contact_radius_mm")
TRUSTED = tuple(kind.value for kind in (ElementType.Q4P0, ElementType.Q8P1, ElementType.Q9P1))
"""Elements that do not lock, of two families: linear and quadratic."""

ORDERS = 2.0, 16.0


@dataclass(frozen=True)
class Limit:
    """Row of limits.csv: the value and half the width of its band."""

    mu: float
    reduction: float
    quantity: str
    value: float
    band: float
    elements: str


def richardson(values: Sequence[float]) -> tuple[float, float]:
    """Limit and uncertainty of the values on meshes h, h/2, h/4.

    >>> richardson([5.0, 2.0, 1.25])
    (1.0, 0.25)
    >>> richardson([1.0, 2.0, 1.5])
    (1.5, 0.5)
    """
    first, second, third = values
    step, before = third - second, second - first
    if step == 0:
        return third, abs(before)
    ratio = before / step
    if not ORDERS[0] <= ratio <= ORDERS[1]:
        return third, abs(step)
    limit = third + step / (ratio - 1)
    return limit, abs(limit - third)


def extrapolated(rows: Sequence[Row]) -> list[Limit]:
    """The limits of all quantities that two elements of different families tell."""
    out = list[Limit]()
    for mu, reduction in sorted({(row.mu, row.reduction) for row in rows}):
        for quantity in QUANTITIES:
            told = dict[str, tuple[float, float]]()
            for element in TRUSTED:
                mine = [r for r in rows if (r.mu, r.reduction, r.element) == (mu, reduction, element)]
                finest = sorted(mine, key=lambda row: row.elements)[-3:]
                sides = [row.elements for row in finest]
                if len(sides) == 3 and sides == [sides[0], 2 * sides[0], 4 * sides[0]]:
                    told[element] = richardson([getattr(row, quantity) for row in finest])
            best = sorted(told, key=lambda element: told[element][1])[:2]
            if len(best) == 2:
                ends = np.array([told[element][0] for element in best])
                value = float(ends.mean())
                band = max(float(np.abs(ends - value).max()), min(told[element][1] for element in best))
                out.append(Limit(mu, reduction, quantity, value, band, " and ".join(best)))
    return out
