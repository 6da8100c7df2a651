"""What is left of a run when its process is killed, its disk is full, or somebody is in its way.

    python -m studies.faults [--fast] [--out DIR]

Each case runs :mod:`studies.upsetting` in a process of its own and does something to it:

* ``killed writing``: SIGKILL at a system call of the writing, one after the other; a write is cut in its middle;
* ``killed anywhere``: SIGKILL after a random time;
* ``disk full``: the system allows files of so many bytes only;
* ``two writers``: a second study in the same folder;
* ``folder removed``: after some increments.

Then the run is read, resumed with ``--resume`` to its end, and its table compared with that of an undisturbed run.
``faults.csv`` says how often it was tried, increments were lost that had been reported on disk, a run was unreadable
or did not resume to the same table (``unreadable``), a study ended in a traceback or with another exit code
(``raw``), or in a crash of the interpreter (``crashed``). Exit code 1 where any of these is not zero.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bipot.errors import BipotError
from bipot.results import open as open_results
from studies import upsetting
from studies.command import command, say
from studies.fault_process import FOLDER, RUN, Study, killing, limited
from studies.outputs import opened, parser_of
from studies.tables import text

NAME = "faults"
SIZES = (1, 4_000, 30_000, 100_000, 150_000, 200_000, 300_000, 400_000)
"""Bytes of the largest file, from none of a run to most of it."""


@dataclass(frozen=True)
class Plan:
    """How often each is tried."""

    aimed: int = 200
    anywhere: int = 50
    sizes: tuple[int, ...] = SIZES
    writers: int = 10
    removed: int = 10


FAST = Plan(aimed=12, anywhere=4, sizes=SIZES[::3], writers=1, removed=1)


@dataclass
class Row:
    """One kind of fault: how often it was tried, and what went wrong how often."""

    fault: str
    tried: int = 0
    lost: int = 0
    unreadable: int = 0
    raw: int = 0
    crashed: int = 0

    @property
    def sound(self) -> bool:
        """Whether nothing went wrong."""
        return not any(astuple(self)[2:])


@dataclass(frozen=True)
class Bench:
    """A folder for the cases, and the table of an undisturbed run."""

    folder: Path
    expected: dict[str, Any]

    @staticmethod
    def of(folder: Path) -> Bench:
        """March undisturbed; raises BipotError where even that fails."""
        # In this process, so that those forked from it have imported everything.
        with contextlib.redirect_stdout(io.StringIO()):
            code = upsetting.main([*RUN, "--out", str(folder / "whole")])
        if code:
            raise BipotError(f"the undisturbed study ended with {code}")
        return Bench(folder, dict(open_results(folder / "whole" / FOLDER).columns))

    def fresh(self) -> Path:
        """An output folder that is not there yet."""
        return Path(tempfile.mkdtemp(dir=self.folder)) / "out"

    def judge(self, row: Row, out: Path, reported: int) -> None:
        """Read what is left, go on with it, and count what is wrong."""
        row.tried += 1
        try:
            there = len(open_results(out / FOLDER)) if (out / FOLDER / "run.vtkhdf").exists() else 0
        except BipotError:
            row.unreadable += 1
            return
        row.lost += there < reported
        ended = Study(out, "--resume").ended()
        row.crashed += ended.crashed
        row.raw += not ended.refused(0)
        try:
            row.unreadable += not self._same(out)
        except BipotError:
            row.unreadable += 1
        shutil.rmtree(out.parent)

    def _same(self, out: Path) -> bool:
        found = open_results(out / FOLDER).columns
        same = found.keys() == self.expected.keys() and all(
            found[name].tolist() == self.expected[name].tolist()
            or np.array_equal(found[name], self.expected[name], equal_nan=True)
            for name in found.keys() - {"seconds"}
        )
        table = (out / FOLDER / "history.csv").read_text(encoding="utf-8")
        return same and table.count("\n") == 1 + len(self.expected["increment"])


def aimed(bench: Bench, plan: Plan, row: Row) -> None:
    """Kills at every so many-th system call of the writing of a run."""
    number = 0
    while row.tried < plan.aimed:
        # The same places again where a run has fewer of them.
        number += 1 + number % 5
        out = bench.fresh()
        ended = Study(out, before=killing(number)).ended()
        row.crashed += ended.crashed
        if ended.killed:
            bench.judge(row, out, ended.reported)
        else:
            row.raw += not ended.refused(0)
            number = 0


def anywhere(bench: Bench, plan: Plan, row: Row) -> None:
    """Kills after random times."""
    rng = random.Random(1)
    began = time.perf_counter()
    Study(bench.fresh()).ended()
    whole = time.perf_counter() - began
    for _ in range(plan.anywhere):
        out = bench.fresh()
        study = Study(out)
        time.sleep(rng.uniform(0, whole))
        os.kill(study.process, signal.SIGKILL)
        ended = study.ended()
        row.crashed += ended.crashed
        bench.judge(row, out, ended.reported)


def full(bench: Bench, plan: Plan, row: Row) -> None:
    """Disks that hold files of some sizes."""
    for size in plan.sizes:
        out = bench.fresh()
        ended = Study(out, before=limited(size)).ended()
        row.crashed += ended.crashed
        row.raw += not ended.refused(2)
        bench.judge(row, out, ended.reported)


def two_writers(bench: Bench, plan: Plan, row: Row) -> None:
    """A second study where a first one writes: it is refused, and the first one is not disturbed."""
    for _ in range(plan.writers):
        out = bench.fresh()
        first = Study(out)
        first.report()
        os.kill(first.process, signal.SIGSTOP)
        second = Study(out, "--overwrite").ended()
        os.kill(first.process, signal.SIGCONT)
        row.crashed += second.crashed
        row.raw += not (second.refused(2) and f"process {first.process}" in second.said)
        ended = first.ended()
        row.raw += not ended.refused(0)
        bench.judge(row, out, ended.reported)


def removed(bench: Bench, plan: Plan, row: Row) -> None:
    """The folder of a run is removed meanwhile: the study ends in words."""
    for _ in range(plan.removed):
        row.tried += 1
        out = bench.fresh()
        study = Study(out)
        for _ in range(3):
            study.report()
        shutil.rmtree(out / FOLDER, ignore_errors=True)
        ended = study.ended()
        row.crashed += ended.crashed
        row.raw += not (ended.refused(2) or (ended.refused(0) and (out / FOLDER).exists()))


FAULTS: dict[str, Callable[[Bench, Plan, Row], None]] = {
    "killed writing": aimed,
    "killed anywhere": anywhere,
    "disk full": full,
    "two writers": two_writers,
    "folder removed": removed,
}
"""What is done how often, and counted in its row."""


@command
def main(argv: list[str] | None = None) -> int:
    """Do all, rewriting the table after each kind."""
    parser = parser_of(NAME, "Kills and full disks.", fast="a few of each")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    found = opened(asked.out, NAME, Row, lambda row: row.fault, asked.policy, parameters=vars(plan), order=FAULTS)
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench.of(Path(folder))
        for fault, times in FAULTS.items():
            if fault not in found:
                row = Row(fault)
                times(bench, plan, row)
                found.add(row)
                say(str(row), to=sys.stderr)
    say(text(found.rows, ["tried", "lost", "unreadable", "raw", "crashed", "fault"]))
    return 0 if all(row.sound for row in found.rows) else 1


if __name__ == "__main__":
    sys.exit(main())
