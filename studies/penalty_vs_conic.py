r"""What the penalties cost: the penalised forms against the conic one on the same mesh and increments.

    python -m studies.penalty_vs_conic [--fast] [--workers 2] [--resume | --overwrite] [--out DIR]

For each mu the cylinder is upset to 45 %, landing on 20 %, by the ``tangent`` form, by ``uzawa``, and by ``penalty``
with K_n = K_t = (K_over_E_h) E A/(m h) a node over eleven decades. Equilibrium is held to 1e-10 of the largest nodal
force, or to 1e-14 K_over_E_h where round-off in the penalised forces allows no less.

``penalty_vs_conic.csv``, one row a run and reduction: errors against the conic run (force: relative; tractions:
relative L2 on its contact line), largest penetration, ``stick_creep_mm`` (longest path slipped while the conic run
sticks), gap of the last increment over its work, condition estimate of the last tangent, cost up to there, the
equilibrium ``tolerance``, and ``order`` = minus the slope of log error over log K from the K before.
``penalty_vs_conic.h5`` has the same columns and the force-stroke and traction curves.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from bipot.forms import FormName
from studies.command import command, say
from studies.expected import Expected
from studies.options import processes
from studies.outputs import Curves, Table, exact, opened, parser_of
from studies.penalty_cases import EARLY, FAST, REDUCTION, Case, Done, Plan, cases, schedule_of, solve, system_at
from studies.pool import completed
from studies.runs import Run, stick_creep, traction_errors

NAME = "penalty_vs_conic"
SHOWN = ("mu", "reduction", "form", "K_over_E_h", "force_N", "force_error", "order", "condition", "passes", "outcome")
COMMAND = f"python -m studies.{NAME} --out {{out}}"
REDUCTIONS = (EARLY, REDUCTION)
Key = tuple[float, float, str, float | None]


@dataclass(frozen=True)
class Row:
    """A line of the table (module docstring); what a run did not reach is nan."""

    mu: float
    reduction: float
    form: str
    K_over_E_h: float
    force_N: float
    force_error: float
    normal_traction_error: float
    tangential_traction_error: float
    penetration_mm: float
    stick_creep_mm: float
    relative_gap: float
    condition: float
    passes: int
    iterations: int
    cuts: int
    seconds: float
    tolerance: float
    order: float
    outcome: str


def key(row: Row) -> Key:
    """What tells one row from another."""
    return row.mu, row.reduction, row.form, exact(row.K_over_E_h)


def keys(case: Case) -> list[Key]:
    """Of the rows that a case makes."""
    return [(case.mu, reduction, case.form.value, exact(case.factor)) for reduction in REDUCTIONS]


def curve_name(mu: float, form: str, factor: float) -> str:
    """Of a case's curves in the results."""
    return f"{mu!r}_{form}_{factor!r}"


def planned(plan: Plan) -> list[Key]:
    """All rows, the runs of one coefficient and reduction beside each other."""
    return sorted((key for case in cases(plan) for key in keys(case)), key=lambda key: key[:2])


def missing(plan: Plan, table: Table[Row]) -> list[Case]:
    """What is left to do: cases whose rows are not in the table, and the conic run that they are measured by."""
    every = cases(plan)
    left = [not all(key in table for key in keys(case)) for case in every]
    mus = {case.mu for case, needed in zip(every, left, strict=True) if needed}
    conic = [case.form is FormName.TANGENT and case.mu in mus for case in every]
    return [case for case, *needed in zip(every, left, conic, strict=True) if any(needed)]


def rows(done: list[Done], plan: Plan) -> list[Row]:
    """Two rows a run whose conic run is there."""
    conic = {d.case.mu: d.run for d in done if d.case.form is FormName.TANGENT}
    return [_row(d, conic[d.case.mu], r, plan) for d in done if d.case.mu in conic for r in REDUCTIONS]


def with_orders(found: list[Row]) -> list[Row]:
    """The rows of a table, each with its order against the one before, where that is of the same form."""
    pairs = zip([None, *found], found, strict=False)
    return [replace(row, order=_order(last, row)) for last, row in pairs]


def _row(done: Done, conic: Run, reduction: float, plan: Plan) -> Row:
    """Measures of a run at a reduction against the conic run there."""
    case, run, tau = done.case, done.run, reduction / REDUCTION
    here, there = run.at(tau), conic.at(tau)
    head: dict[str, Any] = {
        "mu": case.mu,
        "reduction": reduction,
        "form": case.form.value,
        "K_over_E_h": case.factor,
    }
    if here is None or there is None:
        spent = {"passes": int(run.total("passes", len(run.snapshots))), "iterations": 0, "cuts": 0}
        measured = dict.fromkeys([f for f in Row.__dataclass_fields__ if f not in head | spent], float("nan"))
        return Row(**head, **spent, **{**measured, "outcome": f"failed: {run.failure}"})
    snapshot, exact = run.snapshots[here], conic.snapshots[there]
    normal, tangential = traction_errors(system_at(case.mu, plan), snapshot, exact)
    cuts = int(run.total("cuts", here))
    return Row(
        **head,
        force_N=snapshot.force,
        force_error=abs(snapshot.force / exact.force - 1),
        normal_traction_error=normal,
        tangential_traction_error=tangential,
        penetration_mm=float(np.maximum(-snapshot.gap, 0).max()),
        stick_creep_mm=stick_creep(run, conic, schedule_of(plan).times(), tau),
        relative_gap=snapshot.relative_gap,
        condition=snapshot.condition,
        passes=int(run.total("passes", here)),
        iterations=int(run.total("iterations", here)),
        cuts=cuts,
        seconds=run.total("seconds", here),
        tolerance=done.tolerance,
        order=float("nan"),
        outcome=f"{cuts} cuts" if cuts else "solved",
    )


def _order(last: Row | None, row: Row) -> float:
    if last is None or key(last)[:3] != key(row)[:3] or not (last.force_error > 0 and row.force_error > 0):
        return float("nan")
    return float(np.log(last.force_error / row.force_error) / np.log(row.K_over_E_h / last.K_over_E_h))


def curves(done: list[Done]) -> Curves:
    """Force over pseudo-time and the tractions that the consistent mass recovers at the end of each run, if any."""
    arrays: Curves = {}
    for d in done:
        tau, force = d.run.curve(len(d.run.snapshots) - 1)
        end = d.run.snapshots[-1:]
        pressure, shear = ([getattr(s, name) for s in end] for name in ("pressure", "shear"))
        arrays[curve_name(d.case.mu, d.case.form.value, d.case.factor)] = {
            "tau": tau,
            "force_N": force,
            "consistent_pressure_MPa": np.concatenate([*pressure, np.zeros(0)]),
            "consistent_shear_MPa": np.concatenate([*shear, np.zeros(0)]),
        }
    return arrays


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run all cases, rewriting the table after each."""
    parser = parser_of(NAME, "What the penalties cost.", fast="a small mesh, one mu, two penalties")
    parser.add_argument("--workers", type=processes(0), default=2, help="processes; 0 runs in this one")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    fixed = {name: getattr(plan, name) for name in ("elements", "increments", "start")}
    table = opened(
        asked.out,
        NAME,
        Row,
        key,
        asked.policy,
        parameters=fixed,
        order=planned(plan),
        curve=lambda row: curve_name(row.mu, row.form, row.K_over_E_h),
    )
    todo, done = missing(plan, table), list[Done]()
    clock = Expected(len(todo))
    with closing(completed(partial(solve, plan=plan), todo, 0 if asked.fast else asked.workers)) as found:
        for one in found:
            done.append(one)
            if fresh := [row for row in rows(done, plan) if key(row) not in table]:
                table.add(*fresh, curves=curves(done))
                table.add(*with_orders(table.rows))
            clock.done()
            case = one.case
            say(f"{len(done)}/{len(todo)}, {clock}: {case.form.value} {case.factor:g}, mu {case.mu:g}", sys.stderr)
    say(table.words(SHOWN))
    return 0


if __name__ == "__main__":
    sys.exit(main())
