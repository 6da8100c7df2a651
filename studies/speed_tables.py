"""What ``speed_vs_error`` concludes from its rows: the fastest of each family, and limits over the mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.convergence import observed_order
from studies.methods import Method
from studies.speed_jobs import Knob

LIMITS = (1e-3, 1e-5)
MEASURES = ("curve_error", "algebraic_error")
SOLVED = "solved"


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
    runs: int
    outcome: str


@dataclass(frozen=True)
class Fastest:
    """The fastest measured run of a family within a limit on an error.

    Where none came that near, error and seconds are those of the nearest run of the knob ``increments``, ``order`` is
    the order of its error in the increments against the run before, and ``needed`` how many would do at that order.
    """

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
    order: float
    needed: float


FAMILIES: dict[str, tuple[Method, ...]] = {
    "conic": (Method.TANGENT, Method.FROZEN, Method.DISSIPATION),
    "newton": (Method.NEWTON, Method.EULER),
    "penalty": (Method.PENALTY,),
    "uzawa": (Method.UZAWA,),
    "paper": (Method.WRITTEN, Method.UNRETURNED),
}


def fastest(rows: list[Row]) -> list[Fastest]:
    """For each mu, family, measure and limit; families without a run are left out."""
    special = (Knob.ELEMENTS.value, Knob.SCATTER.value)
    found = []
    for mu in sorted({row.mu for row in rows}):
        here = [r for r in rows if r.mu == mu and r.knob not in special and r.outcome == SOLVED]
        for measure in MEASURES:
            for limit in LIMITS:
                for family, methods in FAMILIES.items():
                    mine = [r for r in here if r.method in [m.value for m in methods]]
                    if mine:
                        found.append(_fastest(mine, family, measure, limit))
    return found


def _fastest(rows: list[Row], family: str, measure: str, limit: float) -> Fastest:
    within = [r for r in rows if getattr(r, measure) <= limit]
    order = needed = float("nan")
    if within:
        r = min(within, key=lambda row: row.seconds)
    else:
        r, order = _nearest(rows, measure)
        needed = r.increments * (getattr(r, measure) / limit) ** (1 / order) if order > 0 else needed
    end = (r.seconds, getattr(r, measure), r.relative_gap, order, needed)
    return Fastest(r.mu, family, measure, limit, r.method, r.knob, r.value, r.increments, *end)


def _nearest(rows: list[Row], measure: str) -> tuple[Row, float]:
    """The run of least error, and the order in the increments that leads there from the next coarser one.

    There is none, nan, where a finer run was worse.
    """
    known = [r for r in rows if np.isfinite(getattr(r, measure))]
    stepped = [r for r in known if r.knob == Knob.INCREMENTS.value] or known
    best = min(stepped, key=lambda row: getattr(row, measure))
    if any(r.method == best.method and r.increments > best.increments for r in stepped):
        return best, float("nan")
    coarser = [r for r in stepped if r.method == best.method and r.increments < best.increments]
    if not coarser:
        return best, float("nan")
    last = max(coarser, key=lambda row: row.increments)
    ratio = getattr(last, measure) / getattr(best, measure)
    return best, float(np.log(ratio) / np.log(best.increments / last.increments))


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
        short = "" if f.error <= f.limit else f"  not reached: order {f.order:.2g}, about {f.needed:.2g} increments"
        what = f"{f.method} ({f.knob} {f.value:g}), {f.seconds:.3g} s, error {f.error:.1e}, gap {f.relative_gap:.1e}"
        lines.append(f"mu {f.mu:g}  {f.measure} <= {f.limit:g}  {f.family:8s} {what}{short}")
    return "\n".join(lines)
