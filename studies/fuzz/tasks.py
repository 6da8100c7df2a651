"""What the fuzz study hands to its processes; not beside its command line, which processes cannot import by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from typing import NamedTuple

from studies.command import say
from studies.fuzz.coulomb import judge_coulomb
from studies.fuzz.judge import judge_regional, judge_scene, judge_shaped
from studies.fuzz.parts_judge import judge_parts
from studies.fuzz.row import FAILURES, Row, Table
from studies.fuzz.solid import judge_solid, judge_solid_regional, judge_solid_shaped
from studies.fuzz.solid_parts_judge import judge_solid_parts
from studies.pool import completed
from studies.progress import Progress


class Task(NamedTuple):
    """A scene or a problem by its seed."""

    kind: str
    seed: int


JUDGES: dict[str, Callable[[int], Row]] = {
    "scene": judge_scene,
    "shaped": judge_shaped,
    "solid": judge_solid,
    "solid shaped": judge_solid_shaped,
    "regional": judge_regional,
    "solid regional": judge_solid_regional,
    "parts": judge_parts,
    "solid parts": judge_solid_parts,
    "coulomb": judge_coulomb,
}


def judged(task: Task) -> Row:
    """The row of a task: what a process is given."""
    return JUDGES[task.kind](task.seed)


def tasks(seed: int, numbers: Mapping[str, int]) -> Iterator[Task]:
    """The ``numbers`` of each kind from ``seed`` on, one after the other."""
    for kind, number in numbers.items():
        yield from (Task(kind, seed + k) for k in range(number))


def study(table: Table, seed: int, numbers: Mapping[str, int], jobs: int, progress: Progress) -> None:
    """Fill the table with what it lacks, from ``jobs`` processes (one: this one); failures are shown as they come."""
    todo = (task for task in tasks(seed, numbers) if task not in table.done)
    left = sum(numbers.values()) - table.has(seed, numbers)
    progress.start("fuzz")
    try:
        with closing(completed(judged, todo, jobs if jobs > 1 else 0)) as rows:
            for done, row in enumerate(rows, 1):
                table.add(row)
                if row.outcome.value in FAILURES:
                    say(f"{row.outcome.value}: {row.kind}, seed {row.seed}, {row.form}: {row.reason[:160]}")
                progress.advance(done / left)
    finally:
        progress.close()
