r"""What series of meshes tend to, with a band that holds what refinement still changes and how far elements differ.

Where the side rolls onto the punch, its nodes land one after the other, and force and radii go up and down by a
sawtooth of the mesh's size, which is much the same for all elements of one node spacing. So the values here are those
of the smooth curve through each run (:mod:`studies.accuracy.smooth`). Let v_e be the value of the series e on its
finest mesh, w_e that on twice the size, both of one node spacing in all series, V and W their means. Errors of first
order or of a higher one leave what the means tend to between V and the extrapolation V + (V - W) of first order. What
the teeth leave of a smooth curve is told by V', the mean on the finest meshes of curves fitted over more increments. So

    value = V + (V - W) / 2,    band = |V - W| / 2 + max_e |v_e - V| + |V' - V|,

the band to either side. Series are those of :data:`TRUSTED`, and there is no limit where they are not of a linear and
of a quadratic element, on the same two spacings. Left out is what all of them share: the error of the increments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.meshes.layout import Layout
from studies.accuracy.row import Discretisation, Row
from studies.accuracy.smooth import QUANTITIES, WIDER, Course, smoothed
from studies.element_types import ElementType

TRUSTED = (
    Discretisation(ElementType.Q4P0),
    Discretisation(ElementType.Q4P0, Layout.FANNED),
    Discretisation(ElementType.Q8P1, Layout.FANNED),
    Discretisation(ElementType.Q9P1, Layout.FANNED),
)
"""What does not lock, and what only a fine mesh may fold."""

Pair = tuple[float, float]


class Level(NamedTuple):
    """A discretisation, and how many elements of it lie along a side."""

    of: Discretisation
    elements: int

    @property
    def edges(self) -> int:
        """Edges between nodes a side."""
        return self.elements * (2 if self.of.element.element.quadratic else 1)

    def __str__(self) -> str:
        return f"{self.of} {self.elements}"


@dataclass(frozen=True)
class Limit:
    """Row of limits.csv: the value, half the width of its band, and the finest meshes that tell."""

    mu: float
    reduction: float
    quantity: str
    value: float
    band: float
    meshes: str


def bracketed(finest: Sequence[float], coarser: Sequence[float], smoother: Sequence[float]) -> Pair:
    """Value and band of the values of each series: on the finest mesh, on twice the size, of the wider fit.

    >>> bracketed([1.5, 1.5], [2.0, 2.0], [1.5, 1.5])
    (1.25, 0.25)
    >>> bracketed([1.0, 2.0], [1.0, 2.0], [1.0, 2.5])
    (1.5, 0.75)
    """
    mean = float(np.mean(finest))
    left, rest = mean - float(np.mean(coarser)), float(np.mean(smoother)) - mean
    return mean + left / 2, abs(left) / 2 + float(np.abs(np.array(finest) - mean).max()) + abs(rest)


def told(values: Mapping[Level, float]) -> dict[Level, Pair]:
    """Of each series its value and that on twice the size, by the finer mesh, all of one node spacing.

    It is the finest spacing on which, and on whose double, series of both families have a value; series that have none
    there are left out. Empty where there is no such spacing.
    """
    spaced = {(mesh.of, mesh.edges): value for mesh, value in values.items()}
    for fine in sorted({mesh.edges for mesh in values}, reverse=True):
        both = {
            mesh: (value, spaced[mesh.of, fine // 2])
            for mesh, value in values.items()
            if mesh.edges == fine and fine % 2 == 0 and (mesh.of, fine // 2) in spaced
        }
        if len({mesh.of.element.element.quadratic for mesh in both}) == 2:
            return both
    return {}


def limit(courses: Mapping[Level, Course], quantity: str, reduction: float) -> tuple[float, float, str]:
    """Value and band, and the meshes that tell them in words; NaN and no word where none do."""
    values = {mesh: smoothed(course, quantity, reduction) for mesh, course in courses.items()}
    pairs = told({mesh: value for mesh, value in values.items() if not math.isnan(value)})
    if not pairs:
        return math.nan, math.nan, ""
    wider = [smoothed(courses[mesh], quantity, reduction, WIDER) for mesh in pairs]
    finest, coarser = zip(*pairs.values(), strict=True)
    return *bracketed(finest, coarser, wider), ", ".join(map(str, pairs))


def courses_of(rows: Sequence[Row], curves: Mapping[Row, Course]) -> dict[float, dict[Level, Course]]:
    """The courses of what is trusted by coefficient, each as far as the last row of its run."""
    out = dict[float, dict[Level, Course]]()
    for row in sorted(rows, key=lambda row: row.reduction):
        if row.of in TRUSTED and row.mu > 0:
            out.setdefault(row.mu, {})[Level(row.of, row.elements)] = curves[row]
    return out


def extrapolated(rows: Sequence[Row], curves: Mapping[Row, Course]) -> list[Limit]:
    """The limits of all quantities under friction that a linear and a quadratic element tell, at the rows' reductions.

    ``curves`` holds the course until each row. Without friction every element has the exact answer.
    """
    return [
        Limit(mu, reduction, quantity, value, band, meshes)
        for mu, courses in sorted(courses_of(rows, curves).items())
        for reduction in sorted({row.reduction for row in rows})
        for quantity in QUANTITIES
        for value, band, meshes in [limit(courses, quantity, reduction)]
        if meshes
    ]
