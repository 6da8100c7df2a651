r"""Time against error: every method over its own accuracy knob, then over mesh and quadrature.

    python -m studies.speed_vs_error [--fast] [--resume | --overwrite] [--out DIR]

The cylinder is upset to 45 % (mu = 0.1) and 20 % (mu = 0.3). Two references tell the errors apart:

* ``curve_error``, ``force_error``, ``work_error``, ... are against the ``reference``: Newton to 1e-10 on the same
  mesh with very many increments, start-up included. They hold what the increments and what the algebra leave out.
* ``algebraic_error`` is that of the force-stroke curve against Newton to 1e-10 on the *same* increments with the same
  integration: what the penalty or the tolerance leaves out. (For ``paper as written`` it holds its configuration too.)
  Rows of more increments than the reference has are compared with the reference.

Rows of the knob ``start_up`` divide the steps of the start-up (0.1 % of the height) by fewer than their increments
ask for. Rows of ``elements`` compare with the finest mesh of their quadrature on the same increments to 20 %;
``scatter`` gives F at 45 % for mu = 0.3 over the increments. ``seconds`` is the median processor time of ``runs`` runs
in one process of one thread (three where they take less than 60 s together, else one; rows of more increments than the
reference run once in a second process beside the others), as accepted increments tell it:
``assembly_s`` responses and tangents, ``compile_s`` statement and transfer, ``solve_s`` inside the solvers (split in
proportion to wall time), ``other_s`` the rest with failed attempts.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from statistics import median
from typing import Any

import numpy as np

from bipot.marching import system_of
from studies.command import command, say
from studies.expected import Expected
from studies.methods import Method, Setting, configured
from studies.outputs import opened, parser_of
from studies.pool import processes
from studies.runs import Run, curve_error, record, traction_errors
from studies.speed_jobs import EARLY, FAST, Course, Job, Knob, Plan, cost, finer, jobs, key
from studies.speed_tables import SOLVED, Row, extrapolations, fastest, summary
from studies.tables import write_csv, write_hdf5

NAME = "speed_vs_error"
COMMAND = f"python -m studies.{NAME} --out {{out}}"
DERIVED = ("fastest.csv", "extrapolation.csv")
TIGHT = Setting(tolerance=1e-10)


@cache
def reference(path: Course, increments: int, division: int, method: Method = Method.NEWTON) -> Run:
    """Newton on the path to a tight tolerance."""
    scene, control = configured(method, path.scene(), TIGHT)
    return record(scene, path.schedule(increments, division), control)


@dataclass(frozen=True)
class Timed:
    """A run with the medians of its repetitions: whole, assembly, compile, solve (seconds)."""

    run: Run
    seconds: float
    assembly: float
    compile: float
    solve: float
    runs: int


@cache
def timed(job: Job, plan: Plan) -> Timed:
    """Run a job as often as the plan allows."""
    path = Course.of(job)
    scene, control = configured(job.method, path.scene(), job.setting)
    runs, spent = [], []
    for number in range(plan.repeats):
        if number and plan.repeats * spent[0][0] > plan.row:
            break
        wall, cpu = time.perf_counter(), time.process_time()
        run = record(scene, path.schedule(job.increments, job.finer), control)
        # One thread: its share of the processor turns wall time into what a quiet machine would show.
        share = (time.process_time() - cpu) / (time.perf_counter() - wall)
        timings = [s.timing for s in run.snapshots]
        whole = run.total("seconds", len(timings))
        parts = (whole, *(sum(getattr(t, part) for t in timings) for part in ("assembly", "build", "solve")))
        runs.append(run)
        spent.append([share * part for part in parts])
    seconds, responses, stated, solved = (median(column) for column in zip(*spent, strict=True))
    return Timed(runs[0], seconds, responses, stated, solved, len(runs))


def measured(job: Job, plan: Plan) -> Row:
    """A row of the table."""
    path = Course.of(job)
    meshed = job.knob is Knob.ELEMENTS
    t = timed(job, plan)
    run, last = t.run, len(t.run.snapshots) - 1
    early = run.at(EARLY / path.reduction)
    common: dict[str, Any] = {
        "mu": job.mu,
        "method": job.method.value,
        "knob": job.knob.value,
        "value": float(job.value),
        "elements": job.elements,
        "quadrature": job.quadrature.value,
        "increments": job.increments,
        "force_20_N": float("nan") if early is None else run.snapshots[early].force,
        "force_end_N": float("nan") if run.failure else run.snapshots[last].force,
        "relative_gap": max((s.relative_gap for s in run.snapshots), default=float("nan")),
        "passes": int(run.total("passes", last)),
        "cuts": int(run.total("cuts", last)),
        "seconds": t.seconds,
        "assembly_s": t.assembly,
        "compile_s": t.compile,
        "solve_s": t.solve,
        "other_s": t.seconds - t.assembly - t.compile - t.solve,
        "runs": t.runs,
        "outcome": f"failed: {run.failure}" if run.failure else SOLVED,
    }
    errors: dict[str, Any] = dict.fromkeys((f for f in Row.__dataclass_fields__ if f.endswith("_error")), float("nan"))
    if not run.failure:
        errors |= mesh_errors(run, job, plan) if meshed else step_errors(run, job, plan)
    return Row(**common, **errors)


def step_errors(run: Run, job: Job, plan: Plan) -> dict[str, float]:
    """Errors against very many increments, and against the same ones."""
    path = Course.of(job)
    exact = reference(path, plan.reference, finer(plan.reference))
    # Beyond its increments the reference itself stands for exact algebra on the same ones.
    fine = aside(job, plan)
    same = exact if fine else reference(path, job.increments, job.finer, job.method.exactly)
    last = len(run.snapshots) - 1
    end, there = run.snapshots[-1], exact.snapshots[-1]
    pressure, _ = traction_errors(system_of(path.scene()), end, there)
    change = np.linalg.norm(end.velocity - there.velocity) / np.linalg.norm(there.velocity)
    return scalar_errors(run, exact, path) | {
        "curve_error": curve_error(run, exact, last),
        "algebraic_error": curve_error(run, same, last),
        "traction_error": pressure,
        "velocity_error": float(change),
    }


def mesh_errors(run: Run, job: Job, plan: Plan) -> dict[str, float]:
    """Errors against the finest mesh of the quadrature at the same increments; fields are not compared."""
    finest = max(dict(plan.meshes)[job.quadrature])
    best = job._replace(value=finest, elements=finest)
    path, exact = Course.of(best), timed(best, plan).run
    return scalar_errors(run, exact, path) | {"curve_error": curve_error(run, exact, len(run.snapshots) - 1)}


def scalar_errors(run: Run, exact: Run, path: Course) -> dict[str, float]:
    """Relative errors of force at 20 % and at the end, of the work and of the largest radius at the end."""
    early = EARLY / path.reduction
    here, there = run.at(early), exact.at(early)
    at_early = float("nan")
    if here is not None and there is not None:
        at_early = abs(run.snapshots[here].force / exact.snapshots[there].force - 1)
    end, last = run.snapshots[-1], exact.snapshots[-1]
    return {
        "force_error": at_early,
        "force_end_error": abs(end.force / last.force - 1),
        "work_error": abs(end.work / last.work - 1),
        "radius_error": abs(end.nodes[:, 0].max() / last.nodes[:, 0].max() - 1),
    }


def aside(job: Job, plan: Plan) -> bool:
    """Whether a row is so long that it runs in a process of its own beside the others, once."""
    return job.increments > plan.reference


def row_key(row: Row) -> tuple[float, str, str, float, int, str, int]:
    """What :func:`studies.speed_jobs.key` is of a row's job."""
    return row.mu, row.method, row.knob, row.value, row.elements, row.quadrature, row.increments


def told(row: Row) -> str:
    """A row in words."""
    what = f"{row.mu:g} {row.method} {row.knob} {row.value:g}"
    return f"{what}: {row.curve_error:.1e}, {row.seconds:.2f} s"


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run all jobs, rewriting the tables after each."""
    parser = parser_of(NAME, "Time against error.", fast="small meshes, few increments, one repetition")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    every = sorted(jobs(plan), key=lambda job: aside(job, plan))
    table = opened(
        asked.out,
        NAME,
        Row,
        row_key,
        asked.policy,
        parameters={name: getattr(plan, name) for name in ("reference", "repeats", "row", "meshes")},
        order=map(key, every),
        derived=DERIVED,
    )
    todo = [job for job in every if key(job) not in table]
    clock = Expected(sum(map(cost, todo)))
    with processes(1) as pool:
        longest = {job: pool.submit(measured, job, plan) for job in todo if aside(job, plan)}
        for number, job in enumerate(todo, 1):
            row = longest[job].result() if job in longest else measured(job, plan)
            table.add(row)
            clock.done(cost(job))
            say(f"{number}/{len(todo)}, {clock}: {told(row)}", sys.stderr)
    for name, found in zip(DERIVED, (fastest(table.rows), extrapolations(table.rows)), strict=True):
        write_csv(asked.out / name, found)
    write_hdf5(asked.out / f"{NAME}.h5", table.rows, {})
    say(summary(fastest(table.rows)))
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
