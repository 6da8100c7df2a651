r"""What the penalties cost: the penalised forms against the conic one on the same mesh and increments.

    python -m studies.penalty_vs_conic [--fast] [--workers 2] [--out DIR]

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

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bipot.certificate import Bounds
from bipot.errors import BipotError
from bipot.forms import Form, FormName, Penalty, Tangent, Uzawa, contact_penalty
from bipot.increment import Limits, System
from bipot.marching import Control, Schedule, system_of
from bipot.scene import Scene, upsetting
from studies.expected import Expected
from studies.runs import Run, record, stick_creep, traction_errors
from studies.tables import text, write_csv, write_hdf5
from studies.upsetting_case import FIRST

NAME = "penalty_vs_conic"
SHOWN = ("mu", "reduction", "form", "K_over_E_h", "force_N", "force_error", "order", "condition", "passes", "outcome")
COMMAND = f"python -m studies.{NAME} --out {{out}}"
REDUCTION, EARLY = 0.45, 0.20
UZAWA = 1e2
TOLERANCE = 1e-10
ROUND_OFF = 1e-14
"""Equilibrium that round-off leaves attainable, for each unit of K over E/h."""


@dataclass(frozen=True)
class Plan:
    """What is run."""

    mus: tuple[float, ...] = (0.1, 0.3, 0.6)
    decades: tuple[int, ...] = tuple(range(-3, 9))
    elements: int = 10
    increments: int = 15
    start: float = FIRST


FAST = Plan(mus=(0.3,), decades=(0, 2), elements=2, increments=3)


class Case(NamedTuple):
    """One run: friction, form, and its penalty over E/h (nan: none)."""

    mu: float
    form: FormName
    factor: float


class Done(NamedTuple):
    """A case with its run and the equilibrium tolerance it met."""

    case: Case
    run: Run
    tolerance: float


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


def cases(plan: Plan) -> list[Case]:
    """The conic run of each mu first: the others are measured by it."""
    none = float("nan")
    return [
        case
        for mu in plan.mus
        for case in (
            Case(mu, FormName.TANGENT, none),
            Case(mu, FormName.UZAWA, UZAWA),
            *(Case(mu, FormName.PENALTY, 10.0**k) for k in plan.decades),
        )
    ]


@cache
def system_at(mu: float, plan: Plan) -> System:
    """The system of :func:`scene_of`."""
    return system_of(scene_of(mu, plan))


def scene_of(mu: float, plan: Plan) -> Scene:
    """The paper's cylinder on the plan's mesh."""
    return upsetting(mu=mu, reduction=REDUCTION, elements=plan.elements)


def schedule_of(plan: Plan) -> Schedule:
    """The increments of every run."""
    return Schedule(plan.increments, plan.start / REDUCTION, landings=(EARLY / REDUCTION,))


def form_of(case: Case, scene: Scene) -> Form:
    """The form with its penalties in physical units."""
    if case.form is FormName.TANGENT:
        return Tangent()
    K = contact_penalty(system_of(scene).candidates, case.factor)
    return Uzawa(K, K) if case.form is FormName.UZAWA else Penalty(K, K)


def solve(case: Case, plan: Plan) -> Done:
    """Run a case at the tightest tolerance that round-off lets it meet."""
    scene = scene_of(case.mu, plan)
    tolerance = TOLERANCE if np.isnan(case.factor) else max(TOLERANCE, ROUND_OFF * case.factor)
    cone = min(Bounds().cone_violation, tolerance)
    limits = Limits(replace(Bounds(), equilibrium=tolerance, cone_violation=cone), passes=60)
    control = Control(form_of(case, scene), (), limits)
    return Done(case, record(scene, schedule_of(plan), control, (EARLY / REDUCTION, 1.0)), tolerance)


def rows(done: list[Done], plan: Plan) -> list[Row]:
    """Two rows a run whose conic run is there, in the order of :func:`cases`."""
    runs = {_key(d.case): d for d in done}
    found = []
    for reduction in (EARLY, REDUCTION):
        last: Row | None = None
        for case in cases(plan):
            conic = runs.get(_key(Case(case.mu, FormName.TANGENT, float("nan"))))
            if _key(case) in runs and conic is not None:
                row = _row(runs[_key(case)], conic.run, reduction, plan)
                consecutive = last is not None and (last.mu, last.form) == (row.mu, row.form)
                last = replace(row, order=_order(last, row)) if consecutive and last else row
                found.append(last)
    return sorted(found, key=lambda row: (row.mu, row.reduction))


def _key(case: Case) -> tuple[float, str, str]:
    return case.mu, case.form.value, f"{case.factor:g}"


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


def _order(last: Row, row: Row) -> float:
    if not (last.force_error > 0 and row.force_error > 0):
        return float("nan")
    return float(np.log(last.force_error / row.force_error) / np.log(row.K_over_E_h / last.K_over_E_h))


def curves(done: list[Done]) -> dict[str, dict[str, Any]]:
    """Force over pseudo-time and the tractions that the consistent mass recovers at the end of each run."""
    arrays = {}
    for d in done:
        if d.run.snapshots:
            last = len(d.run.snapshots) - 1
            tau, force = d.run.curve(last)
            end = d.run.snapshots[last]
            name = "_".join(str(part) for part in _key(d.case))
            line = {"consistent_pressure_MPa": end.pressure, "consistent_shear_MPa": end.shear}
            arrays[name] = {"tau": tau, "force_N": force, **line}
    return arrays


def completed(plan: Plan, workers: int) -> Iterator[Done]:
    """Cases as they finish, in this process when ``workers`` is 0."""
    if workers == 0:
        yield from (solve(case, plan) for case in cases(plan))
        return
    pool: Executor
    with ProcessPoolExecutor(workers) as pool:
        for future in as_completed([pool.submit(solve, case, plan) for case in cases(plan)]):
            yield future.result()


def main(argv: list[str] | None = None) -> int:
    """Run all cases, rewriting the table after each."""
    parser = argparse.ArgumentParser(prog=f"studies.{NAME}", description="What the penalties cost.", allow_abbrev=False)
    parser.add_argument("--out", type=Path, default=Path(f"results/{NAME}"))
    parser.add_argument("--workers", type=int, default=2, help="processes; 0 runs in this one")
    parser.add_argument("--fast", action="store_true", help="a small mesh, one mu, two penalties")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    done: list[Done] = []
    clock = Expected(len(cases(plan)))
    try:
        for one in completed(plan, 0 if asked.fast else asked.workers):
            done.append(one)
            case = one.case
            write_csv(asked.out / f"{NAME}.csv", rows(done, plan))
            clock.done()
            said = f"{case.form.value} {case.factor:g}, mu {case.mu:g}"
            print(f"{len(done)}/{len(cases(plan))}, {clock}: {said}", file=sys.stderr)
        write_hdf5(asked.out / f"{NAME}.h5", rows(done, plan), curves(done))
    except BipotError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(text(rows(done, plan), SHOWN))
    print(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
