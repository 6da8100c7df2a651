"""Random scenes and discrete Coulomb problems, each judged by an independent recomputation.

    python -m studies.fuzz [--scenes 600] [--coulomb 2000] [--seed S] [--jobs J] [--out DIR] [--fast]

Scenes and problems have the seeds S, S + 1, ...: one seed again is ``--seed THAT --scenes 1 --coulomb 0``. Every scene
is marched as drawn, in other units, mirrored, renumbered and, about each of its planes of symmetry, unfolded.
``DIR/fuzz.csv`` (seed, kind, form, outcome, reason, increments, worst_residual, worst_law, worst_disagreement, seconds)
gets a row as each is done; rows that it has are not run again. ``kind`` says what is driven by force or by supports.
The outcome is one of

* certified: to the end, and no independent measure above ten times the library's bound;
* refused: ended by the library in words (``reason``), and nothing wrong with what it accepted until then;
* wrong: accepted with a measure above that, with energies or forces of whole tools other than their sums, or with such
  or nodal forces that differ by more than 1e-5 of the largest between the variants where the answer was not reported as
  undetermined; ended with a claim of collapse that the inequalities of ``studies/independent_limit.py`` do not prove;
  or a discrete problem called solved that is not;
* raw exception, warning: what no user should see.

The last line counts them. Exit code 1 where one of the last three kinds is in the file, 130 after Ctrl-C.
"""

from __future__ import annotations

import argparse
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path
from typing import NamedTuple

from bipot.progress import Progress, terminal
from studies.fuzz_coulomb import judge_coulomb
from studies.fuzz_judge import judge_scene
from studies.fuzz_row import FAILURES, Outcome, Row, Table

INTERRUPTED = 130
AHEAD = 4
"""Tasks handed out per process before their results are asked for: few, so that Ctrl-C is soon obeyed."""


class Task(NamedTuple):
    """A scene or a problem by its seed."""

    kind: str
    seed: int


JUDGES: dict[str, Callable[[int], Row]] = {"scene": judge_scene, "coulomb": judge_coulomb}


def judged(task: Task) -> Row:
    """The row of a task: what a process is given."""
    return JUDGES[task.kind](task.seed)


def tasks(seed: int, scenes: int, problems: int, done: set[tuple[str, int]]) -> list[Task]:
    """What is left to do of ``scenes`` and ``problems`` from ``seed`` on."""
    every = [Task("scene", seed + k) for k in range(scenes)] + [Task("coulomb", seed + k) for k in range(problems)]
    return [task for task in every if task not in done]


def rows(todo: Sequence[Task], jobs: int) -> Iterator[Row]:
    """Rows as they come, from ``jobs`` processes (one: this process)."""
    if jobs == 1:
        yield from map(judged, todo)
        return
    # The processes leave Ctrl-C to this one, which then hands out nothing more.
    ignore = (signal.SIGINT, signal.SIG_IGN)
    with ProcessPoolExecutor(jobs, initializer=signal.signal, initargs=ignore) as pool:
        waiting, left = set[Future[Row]](), iter(todo)
        try:
            for task in left:
                waiting.add(pool.submit(judged, task))
                if len(waiting) >= AHEAD * jobs:
                    finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in finished)
            while waiting:
                finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in finished)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def study(table: Table, todo: Sequence[Task], jobs: int, progress: Progress) -> None:
    """Fill the table; failures are shown as they come."""
    progress.start("fuzz")
    try:
        for count, row in enumerate(rows(todo, jobs), 1):
            table.add(row)
            if row.outcome.value in FAILURES:
                print(f"{row.outcome.value}: {row.kind}, seed {row.seed}, {row.form}: {row.reason[:160]}", flush=True)
            progress.advance(count / len(todo))
    finally:
        progress.close()


def counts(table: Table) -> str:
    """How often each outcome is in the file."""
    return ", ".join(f"{table.outcomes[outcome.value]} {outcome.value}" for outcome in Outcome)


def _count(text: str) -> int:
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{number}: must be >= 0")
    return number


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number}: must be >= 1")
    return number


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(prog="studies.fuzz", description=(__doc__ or "").splitlines()[0], allow_abbrev=False)
    p.add_argument("--scenes", type=_count, default=600, help="random scenes (default %(default)s)")
    p.add_argument("--coulomb", type=_count, default=2000, help="random discrete problems (default %(default)s)")
    p.add_argument("--seed", type=_count, default=0, help="of the first scene and problem (default %(default)s)")
    p.add_argument("--jobs", type=_positive, default=1, help="processes (default %(default)s)")
    p.add_argument("--out", type=Path, default=Path("results/fuzz"))
    p.add_argument("--fast", action="store_true", help="at most 10 scenes and 50 problems")
    return p


def main(argv: Sequence[str] | None = None) -> int:
    """Run what is not in the file yet."""
    given = parser().parse_args(argv)
    scenes, problems = (min(given.scenes, 10), min(given.coulomb, 50)) if given.fast else (given.scenes, given.coulomb)
    table = Table(given.out / "fuzz.csv")
    todo = tasks(given.seed, scenes, problems, table.done)
    try:
        study(table, todo, given.jobs, terminal())
    except KeyboardInterrupt:
        print(counts(table))
        return INTERRUPTED
    print(counts(table))
    return 1 if table.failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
