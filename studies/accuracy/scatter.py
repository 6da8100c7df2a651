r"""How far the force jumps as nodes of the side land on the punch, beside the smooth curve.

With F_i after increment i, its reduction x_i, and r_i = ln(F_i / F_{i-1}) / (x_i - x_{i-1}), the change beyond the
smooth one is

    |ln(F_i / F_{i-1}) - (x_i - x_{i-1}) median(r_{i-7} .. r_{i+7})|,

of the increments that there are; the scatter is the largest of it from the increment on in which the first node lands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from bipot.typing import Floats
from studies.accuracy.row import Row

HALF = 7
"""Increments on either side over which the smooth rate is found."""


@dataclass(frozen=True)
class Scatter:
    """Row of scatter.csv: reduction at the first landing, how many nodes landed, the largest jump and where it is."""

    mu: float
    element: str
    layout: str
    sampling: str
    elements: int
    first_landing: float
    landings: int
    scatter: float
    reduction: float


def jumps(reduction: Floats, force: Floats) -> Floats:
    """Changes (i,) of ln force beyond the smooth ones, of increments between points (i + 1,).

    >>> jumps(np.arange(4.0), np.exp(np.arange(4.0))).round(12).tolist()
    [0.0, 0.0, 0.0]
    """
    change, length = np.diff(np.log(force)), np.diff(reduction)
    rate = change / length
    smooth = [np.median(rate[max(0, i - HALF) : i + HALF + 1]) for i in range(len(rate))]
    return np.abs(change - length * smooth)


@dataclass(frozen=True)
class Largest:
    """Reduction at the first landing, how many nodes landed, the largest jump from there on and where it is."""

    first_landing: float
    landings: int
    scatter: float
    reduction: float

    @staticmethod
    def of(course: Mapping[str, Floats]) -> Largest | None:
        """That of a course, by ``at``, ``force_N`` and ``landed``; None where no node lands."""
        landed = course["landed"]
        if not landed.any():
            return None
        first = int(np.flatnonzero(landed)[0])
        begin = max(first - 1, 0)
        sizes = jumps(course["at"], course["force_N"])[begin:]
        largest = begin + int(sizes.argmax())
        at = course["at"]
        return Largest(float(at[first]), int(landed.max()), float(sizes.max()), float(at[largest + 1]))


def scatters(rows: Sequence[Row], courses: Mapping[Row, Mapping[str, Floats]], end: float) -> list[Scatter]:
    """Of the runs that come to the ``end`` and in which a node lands."""
    found = ((row, Largest.of(courses[row])) for row in rows if row.reduction == end)
    return [
        Scatter(row.mu, row.element, row.layout, row.sampling, row.elements, *astuple(largest))
        for row, largest in found
        if largest is not None
    ]
