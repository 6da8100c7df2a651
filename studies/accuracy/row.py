"""What the mesh study writes of a run at a reduction."""

from __future__ import annotations

from dataclasses import dataclass


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
