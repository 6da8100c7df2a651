"""What ``speed_vs_error`` concludes from its rows: the fastest of each family, and limits over the mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.convergence import observed_order
from studies.methods import Method
from studies.speed_jobs import Knob

LIMITS = (1e-3, 1e-5)


@dataclass(frozen=True)
class Row:
    """A line of the table (module docstring). ``relative_gap`` is the largest of the run; nan: does not apply."""

    mu: float
    method: str
    knob: str
    value: float
    elements: int
    quadrature: str
    increments: int
    force_20_N: float
    force_end_N: float
    force_error: float
    force_end_error: float
    curve_error: float
    algebraic_error: float
    work_error: float
    radius_error: float
    traction_error: float
    velocity_error: float
    relative_gap: float
    passes: int
    cuts: int
    seconds: float
    assembly_s: float
    compile_s: float
    solve_s: float
    other_s: float
    repeats: int
    outcome: str


@dataclass(frozen=True)
class Fastest:
    """The fastest measured run of a family within a limit on an error; nan where none came that near."""

    mu: float
    family: str
    measure: str
    limit: float
    method: str
    knob: str
    value: float
    increments: int
    seconds: float
    error: float
    relative_gap: float


FAMILIES: dict[str, tuple[Method, ...]] = {
    "conic": (Method.TANGENT, Method.FROZEN, Method.DISSIPATION),
    "newton": (Method.NEWTON,),
    "penalty": (Method.PENALTY,),
    "uzawa": (Method.UZAWA,),
    "paper": (Method.WRITTEN, Method.UNRETURNED),
}


def fastest(rows: list[Row]) -> list[Fastest]:
    """For each mu, family, measure and limit."""
    none = float("nan")
    found = []
    for mu in sorted({row.mu for row in rows}):
        for measure in ("curve_error", "algebraic_error"):
            for limit in LIMITS:
                for family, methods in FAMILIES.items():
                    names = [m.value for m in methods]
                    within = [r for r in rows if r.mu == mu and r.method in names and getattr(r, measure) <= limit]
                    within = [r for r in within if r.knob not in (Knob.ELEMENTS.value, Knob.SCATTER.value)]
                    head = (mu, family, measure, limit)
                    if within:
                        r = min(within, key=lambda row: row.seconds)
                        tail = (r.method, r.knob, r.value, r.increments, r.seconds, getattr(r, measure), r.relative_gap)
                        found.append(Fastest(*head, *tail))
                    else:
                        found.append(Fastest(*head, "none measured", "", none, 0, none, none, none))
    return found


@dataclass(frozen=True)
class Extrapolation:
    """Observed order of a quantity over the mesh and its limit by Richardson; nan where three values show none."""

    mu: float
    quadrature: str
    quantity: str
    values: str
    order: float
    limit: float


def extrapolations(rows: list[Row]) -> list[Extrapolation]:
    """Forces over doubling meshes."""
    found = []
    meshed = [row for row in rows if row.knob == Knob.ELEMENTS.value]
    for mu, quadrature in dict.fromkeys((row.mu, row.quadrature) for row in meshed):
        group = [row for row in meshed if (row.mu, row.quadrature) == (mu, quadrature)]
        for quantity in ("force_20_N", "force_end_N"):
            values = [getattr(row, quantity) for row in group]
            order = observed_order(values)
            limit = float("nan")
            if order is not None:
                limit = values[-1] + (values[-1] - values[-2]) / (2**order - 1)
            shown = " ".join(f"{row.elements}:{v:.2f}" for row, v in zip(group, values, strict=True))
            found.append(Extrapolation(mu, quadrature, quantity, shown, order or float("nan"), limit))
    return found


def summary(found: list[Fastest]) -> str:
    """The table of the fastest."""
    lines = []
    for f in found:
        what = "none measured" if np.isnan(f.error) else f"{f.method} ({f.knob} {f.value:g}), {f.seconds:.3g} s"
        gap = "" if np.isnan(f.error) else f", error {f.error:.1e}, gap {f.relative_gap:.1e}"
        lines.append(f"mu {f.mu:g}  {f.measure} <= {f.limit:g}  {f.family:8s} {what}{gap}")
    return "\n".join(lines)
