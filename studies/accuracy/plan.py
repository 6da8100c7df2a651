"""What the mesh study runs: series of meshes, each of one discretisation, at several coefficients."""

from __future__ import annotations

from dataclasses import dataclass

from bipot.meshes.layout import Layout
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.tools.tool import Sampling
from studies.accuracy.row import Discretisation
from studies.element_types import ElementType

SIDES = (5, 10, 20, 40)
"""Elements a side of a quadratic element; of a linear one twice as many."""

COARSE = SIDES[:2]


@dataclass(frozen=True)
class Series:
    """A discretisation, with the sides that a quadratic element of it would have."""

    of: Discretisation
    sides: tuple[int, ...] = SIDES


@dataclass(frozen=True)
class Job:
    """One run: ``elements`` are those of a far side, ``increments`` those after the start-up."""

    mu: float
    of: Discretisation
    elements: int
    increments: int

    def scene(self) -> Scene:
        """The cylinder."""
        kind, layout, sampling = self.of
        return upsetting(
            mu=self.mu,
            elements=self.elements,
            element=kind.element,
            volume=kind.volume,
            layout=layout,
            sampling=sampling,
        )


ALL = (
    Series(Discretisation(ElementType.Q8)),
    Series(Discretisation(ElementType.Q4P0)),
    Series(Discretisation(ElementType.Q8P1), COARSE),
    Series(Discretisation(ElementType.Q9P1), COARSE),
    Series(Discretisation(ElementType.T6), COARSE),
    Series(Discretisation(ElementType.Q4P0, Layout.FANNED)),
    Series(Discretisation(ElementType.Q8P1, Layout.FANNED)),
    Series(Discretisation(ElementType.Q9P1, Layout.FANNED)),
    Series(Discretisation(ElementType.T6, Layout.FANNED), COARSE),
    Series(Discretisation(ElementType.Q8, Layout.TENSOR, Sampling.WEIGHTED), SIDES[:3]),
    Series(Discretisation(ElementType.Q8P1, Layout.FANNED, Sampling.WEIGHTED), SIDES[:3]),
    Series(Discretisation(ElementType.Q9P1, Layout.FANNED, Sampling.WEIGHTED), SIDES[:3]),
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
            Job(mu, one.of, side * (1 if one.of.element.element.quadratic else 2), self.increments)
            for side in sides
            for mu in self.mus
            for one in self.series
            if side in one.sides and (mu > 0 or side == sides[0])
        ]


FAST = Plan(
    mus=(0.1,),
    series=(
        Series(Discretisation(ElementType.Q8), (3, 6)),
        Series(Discretisation(ElementType.Q4P0), (3, 6)),
        Series(Discretisation(ElementType.Q4P0, Layout.FANNED), (3, 6)),
        Series(Discretisation(ElementType.Q8P1, Layout.FANNED), (3, 6)),
        Series(Discretisation(ElementType.Q8P1, Layout.FANNED, Sampling.WEIGHTED), (4,)),
    ),
    increments=18,
)
