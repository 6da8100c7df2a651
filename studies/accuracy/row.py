"""What the mesh study writes of a run at a reduction, and what tells one series of meshes from another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from bipot.meshes.layout import Layout
from bipot.tools.tool import Sampling
from studies.element_types import ElementType


class Discretisation(NamedTuple):
    """An element in a layout, and where its contact is posed."""

    element: ElementType
    layout: Layout = Layout.TENSOR
    sampling: Sampling = Sampling.NODES

    def __str__(self) -> str:
        return " ".join(word.value for word in self)


@dataclass(frozen=True)
class Row:
    """Row of mesh.csv."""

    mu: float
    element: str
    sampling: str
    elements: int
    layout: str
    unknowns: int
    increments: int
    reduction: float
    force_N: float
    max_radius_mm: float
    contact_radius_mm: float
    line: float
    corner: float
    p_min_MPa: float
    p_max_MPa: float
    overlap_mm: float
    passes: int
    cuts: int
    fallbacks: int
    seconds: float

    @property
    def of(self) -> Discretisation:
        """What it is a mesh of."""
        return Discretisation(ElementType(self.element), Layout(self.layout), Sampling(self.sampling))
