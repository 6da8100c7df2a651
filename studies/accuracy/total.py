r"""Total error of the paper's upsetting over time: every element and form, and CalculiX in the same run.

    python -m studies.accuracy.total [--fast] [--resume | --overwrite] [--limits FILE] [--out DIR]

``DIR/total.csv`` has a row a run: its error against the mesh-converged limits of the force, so of mesh, increments and
all else together (:mod:`studies.accuracy.total_row` has the formula), and processor seconds of one thread.
Each run is a process of its own, one after the other. ``process_seconds`` are all of it; ``seconds`` of ``bipot`` leave
out the start of Python and its imports, those of CalculiX nothing. ``DIR/total_ratio.csv`` says what both cost at the
same error.

CalculiX is run where ``ccx`` is installed, on a deck that :mod:`studies.accuracy.deck` writes; elsewhere one sentence
says that it is left out, and ``--resume`` adds it later. Its contact and friction are penalised, and its ``passes`` are
those of increments that it cut, too.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from statistics import median

from studies.accuracy import calculix
from studies.accuracy.alone import Came
from studies.accuracy.calculix import Calculation
from studies.accuracy.choice import FOREIGN, Choice
from studies.accuracy.deck import Deck
from studies.accuracy.spent import ended
from studies.accuracy.total_plan import FAST, Plan
from studies.accuracy.total_row import SOLVED, Row, errors, key, limits_of, named, ratios
from studies.command import command, progressing, say
from studies.outputs import opened, parser_of
from studies.tables import text, write_csv

NAME, RATIOS = "total", "total_ratio.csv"
LIMITS = Path("docs/results/limits.csv")
SHOWN = ("mu", "error", "own_error", "own_seconds", "foreign_error", "foreign_seconds", "ratio", "process_ratio")
PENALISED = "penalty"


@dataclass(frozen=True)
class Task:
    """A run to be timed; ``ccx`` is where CalculiX is, for a deck."""

    job: Choice | Deck
    plan: Plan
    limits: Path
    ccx: str = ""


def key_of(job: Choice | Deck) -> Choice:
    """The key of the row that a job makes."""
    if isinstance(job, Choice):
        return job
    pace = f"at most {job.longest:g}, penalty {job.stiffness:g}, {job.sticking:g}"
    return Choice(job.mu, FOREIGN, PENALISED, job.element, "", "tensor", job.contact.lower(), job.elements, pace)


def run(task: Task) -> Row:
    """Run as often as the plan allows; times are medians."""
    plan, found = task.plan, list[tuple[Came | Calculation, float]]()
    while len(found) < plan.repeats:
        found.append(alone(task.job, plan) if isinstance(task.job, Choice) else foreign(task.job, plan, task.ccx))
        if plan.repeats * found[0][1] > plan.row:
            break
    came = found[0][0]
    error, end, band = errors(came.forces, limits_of(task.limits, task.job.mu, plan.marks))
    return Row(
        **asdict(key_of(task.job)),
        unknowns=came.unknowns,
        increments=came.increments,
        passes=came.passes,
        end_force_N=came.forces[-1] if len(came.forces) == len(plan.marks) else float("nan"),
        force_error=error,
        end_error=end,
        band=band,
        seconds=median(one.seconds for one, _ in found),
        process_seconds=median(whole for _, whole in found),
        runs=len(found),
        version=version("bipot") if isinstance(task.job, Choice) else calculix.version(task.ccx),
        outcome=f"stopped: {came.stopped}" if came.stopped else SOLVED,
    )


def alone(job: Choice, plan: Plan) -> tuple[Came, float]:
    """What came of a job in a process of its own, and all its processor seconds."""
    asked = json.dumps([asdict(job), *plan.marks])
    done = ended([sys.executable, "-m", plan.alone, asked])
    if done.code is None:
        return Came([], 0, 0, 0, done.seconds, calculix.LATE), done.seconds
    if done.code:
        raise RuntimeError(f"{job}: {done.said}")
    return Came(**json.loads(done.said.splitlines()[-1])), done.seconds


def foreign(deck: Deck, plan: Plan, ccx: str) -> tuple[Calculation, float]:
    """The same of CalculiX."""
    calculation = calculix.calculated(deck, plan.marks, ccx)
    return calculation, calculation.seconds


def runs(tasks: Sequence[Task]) -> Iterator[Row]:
    """These runs, with progress."""
    with progressing(f"accuracy.{NAME}") as progress:
        for done, row in enumerate(map(run, tasks), 1):
            yield row
            progress.advance(done / len(tasks), f"mu = {row.mu:g}, {row.program}, {named(row)}")


def tasks_of(plan: Plan, limits: Path) -> list[Task]:
    """All runs, those of one coefficient together; without CalculiX where it is not installed."""
    ccx = calculix.executable()
    if ccx is None:
        say(calculix.ABSENT, sys.stderr)
    jobs = [*plan.jobs(), *(plan.decks() if ccx else ())]
    return [Task(job, plan, limits, ccx or "") for job in sorted(jobs, key=lambda job: job.mu)]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    parser = parser_of(f"accuracy.{NAME}", "Total error over time, and CalculiX.", fast="tiny meshes, two forms, once")
    parser.add_argument("--limits", type=Path, default=LIMITS, help=f"of studies.accuracy.mesh (default {LIMITS})")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    tasks, fixed = tasks_of(plan, asked.limits), {"repeats": plan.repeats, "row": plan.row}
    for mu in plan.mus:
        limits_of(asked.limits, mu)
    order = [key_of(job) for job in (*plan.jobs(), *plan.decks())]
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=order, derived=(RATIOS,))
    for row in runs([task for task in tasks if key_of(task.job) not in table]):
        table.add(row)
    found = ratios(table.rows)
    write_csv(asked.out / RATIOS, found)
    say(text(found, SHOWN) if found else "no error is reached by two programs")
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
