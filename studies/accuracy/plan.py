"""What the mesh study runs: series of meshes, each of one element in one layout, at several coefficients."""

from __future__ import annotations

from dataclasses import dataclass

from bipot.layout import Layout
from bipot.scene import Scene, upsetting
from studies.element_types import ElementType

SIDES = (5, 10, 20, 40)
"""Elements a side of a quadratic element; of a linear one twice as many."""

COARSE = SIDES[:2]


@dataclass(frozen=True)
class Series:
    """An element in a layout, with the sides that a quadratic element of it would have."""

    kind: ElementType
    layout: Layout
    sides: tuple[int, ...] = SIDES


@dataclass(frozen=True)
class Job:
    """One run: ``elements`` are those of a far side, ``increments`` those after the start-up."""

    mu: float
    kind: ElementType
    elements: int
    increments: int
    layout: Layout = Layout.TENSOR

    def scene(self) -> Scene:
        """The cylinder."""
        element, volume = self.kind.element, self.kind.volume
        return upsetting(mu=self.mu, elements=self.elements, element=element, volume=volume, layout=self.layout)


ALL = (
    Series(ElementType.Q8, Layout.TENSOR),
    Series(ElementType.Q4P0, Layout.TENSOR),
    Series(ElementType.Q8P1, Layout.TENSOR, COARSE),
    Series(ElementType.Q9P1, Layout.TENSOR, COARSE),
    Series(ElementType.T6, Layout.TENSOR, COARSE),
    Series(ElementType.Q4P0, Layout.FANNED),
    Series(ElementType.Q8P1, Layout.FANNED),
    Series(ElementType.Q9P1, Layout.FANNED),
    Series(ElementType.T6, Layout.FANNED, COARSE),
)
"""Of what would fold in the corner only coarse meshes: finer ones end earlier."""


@dataclass(frozen=True)
class Plan:
    """What is run: coefficients, series of meshes, increments."""

    mus: tuple[float, ...] = (0.0, 0.1, 0.3)
    series: tuple[Series, ...] = ALL
    increments: int = 90

    def jobs(self) -> list[Job]:
        """All runs, the short ones first; without friction the field is homogeneous, and a small mesh tells."""
        sides = sorted({side for series in self.series for side in series.sides})
        return [
            Job(mu, one.kind, side * (1 if one.kind.element.quadratic else 2), self.increments, one.layout)
            for side in sides
            for mu in self.mus
            for one in self.series
            if side in one.sides and (mu > 0 or side == sides[0])
        ]


FAST = Plan(
    mus=(0.1,),
    series=(
        Series(ElementType.Q8, Layout.TENSOR, (3, 6)),
        Series(ElementType.Q4P0, Layout.TENSOR, (3, 6)),
        Series(ElementType.Q4P0, Layout.FANNED, (3, 6)),
        Series(ElementType.Q8P1, Layout.FANNED, (3, 6)),
    ),
    increments=18,
)
