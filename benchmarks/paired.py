"""This tree against another commit, in pairs of processes.

    python -m benchmarks.paired COMMIT [--pairs 20] [--only TASK ...] [--fast] [--out DIR]

The tasks of :mod:`benchmarks.paired_tasks` run on a worktree of COMMIT and on this tree, each pair in two fresh
processes of one thread, after a pair that is not counted. Within a pair and from pair to pair they take turns, A B B A,
because the speed of a shared machine drifts by the second. Measured are processor seconds. A pair's ratio (this tree
over the other, or one form over another on this tree) is the median of its turns. Of these the median is reported, and
an interval that holds the true one with 95 %, whatever the distribution: two of the ratios, by the binomial law.

Writes ``DIR/paired.csv`` (name, size, against, pairs, seconds, seconds_against, passes, passes_against, ratio, low,
high, most); ends with exit code 1 where a median exceeds its limit ``most``.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from scipy.stats import binom

from benchmarks.rows import write
from bipot.basics.undisturbed import undisturbed
from bipot.errors import BipotError
from studies.accuracy.spent import COMPILED
from studies.command import command, say
from studies.files import require_writable
from studies.options import count

ROOT = Path(__file__).parents[1]
TASKS = ROOT / "benchmarks" / "paired_tasks.py"
THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
PAIRS, LEVEL = 20, 0.95


@dataclass(frozen=True)
class Measure:
    """A task at a ``size`` in elements (``small`` with --fast), turns in a pair, and the largest ratio allowed.

    ``against`` is another task on this tree, or None for the same task on the other tree.
    """

    name: str
    task: str
    size: int
    small: int
    turns: int
    most: float
    against: str | None = None


MEASURES = (
    Measure("import bipot", "importing", 0, 0, 1, 0.5),
    Measure("newton pass", "newton", 10, 3, 12, 1.05),
    Measure("newton march", "newton_march", 10, 3, 12, 1.05),
    Measure("tangent pass, 2 size + 1 contact nodes", "tangent_wide", 100, 5, 1, 3.0, against="newton_wide"),
    Measure("delassus pass, 4 size rows", "delassus", 7, 2, 2, float("inf")),
)


class Failed(BipotError, RuntimeError):
    """A process that had to be run for the comparison ended otherwise than it must."""


class Taken(NamedTuple):
    """Processor seconds of a pass or of a march, and how many passes there were."""

    seconds: float
    passes: int


@dataclass(frozen=True)
class Row:
    """One line of paired.csv."""

    name: str
    size: int
    against: str
    pairs: int
    seconds: float
    seconds_against: float
    passes: int
    passes_against: int
    ratio: float
    low: float
    high: float
    most: float

    @property
    def met(self) -> bool:
        """Whether the limit is kept."""
        return self.ratio <= self.most


def interval(values: Sequence[float], level: float = LEVEL) -> tuple[float, float]:
    """The k-th smallest and the k-th largest, k as large as holds the true median with probability ``level``.

    P(median below the k-th smallest) = P(fewer than k of n fall below it), binomial of n and 1/2; where even k = 1 is
    too bold, nothing is known of a ratio: (0, inf).
    """
    ordered = sorted(values)
    k = int(binom.ppf((1 - level) / 2, len(ordered), 0.5))
    return (ordered[k - 1], ordered[-k]) if k > 0 else (0.0, float("inf"))


@contextmanager
def started(tree: Path, task: str, size: int) -> Iterator[Callable[[], Taken]]:
    """A process that has the library of ``tree``; called, it runs the task once.

    The call raises Failed where the process failed (it says why on stderr) or has a library from elsewhere.
    """
    asked = [sys.executable, "-P", str(TASKS), task, str(size)]
    env = os.environ | COMPILED | THREADS | {"PYTHONPATH": str(tree)}
    # Ctrl-C is this process's to answer; the one started would print where it was.
    with undisturbed():
        run = subprocess.Popen(asked, env=env, cwd=tree, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    with run:
        try:
            yield partial(answer, run, tree, task)
        except BaseException:
            run.kill()
            raise


def answer(run: subprocess.Popen[str], tree: Path, task: str) -> Taken:
    """Let the process run its task once."""
    asked, told = run.stdin, run.stdout
    assert asked is not None
    assert told is not None
    print(file=asked, flush=True)
    said = told.readline()
    if not said:
        raise Failed(f"{task} failed on {tree}")
    seconds, passes, measured = said.strip().split(maxsplit=2)
    if not Path(measured).resolve().is_relative_to(tree.resolve()):
        raise Failed(f"{task} measured {measured}, which is not in {tree}")
    return Taken(float(seconds), int(passes))


def compared(measure: Measure, other: Path, commit: str, pairs: int, fast: bool = False) -> Row:
    """Run the pairs of a measure; who begins changes from turn to turn and from pair to pair."""
    size, count = (measure.small, 1) if fast else (measure.size, measure.turns)
    tree, task = (other, measure.task) if measure.against is None else (ROOT, measure.against)
    found, ratios = list[tuple[Taken, Taken]](), list[float]()
    for pair in range(-1, pairs):
        with started(ROOT, measure.task, size) as ours, started(tree, task, size) as theirs:
            turns = [in_turn(ours, theirs, pair + turn) for turn in range(count if pair >= 0 else 1)]
        if pair >= 0:
            found += turns
            ratios.append(float(np.median([mine.seconds / its.seconds for mine, its in turns])))
    seconds = np.median([[side.seconds for side in turn] for turn in found], axis=0)
    return Row(
        measure.name,
        size,
        measure.against or commit,
        pairs,
        float(seconds[0]),
        float(seconds[1]),
        found[-1][0].passes,
        found[-1][1].passes,
        float(np.median(ratios)),
        *interval(ratios),
        measure.most,
    )


def in_turn(ours: Callable[[], Taken], theirs: Callable[[], Taken], turn: int) -> tuple[Taken, Taken]:
    """What each of the two takes; ours begins in every other turn."""
    if turn % 2 == 0:
        return ours(), theirs()
    first = theirs()
    return ours(), first


def git(*arguments: str | Path) -> str:
    """What git says of this repository; raises Failed."""
    asked = ["git", "-C", str(ROOT), *map(str, arguments)]
    with undisturbed():
        done = subprocess.run(asked, capture_output=True, text=True, check=False)
    if done.returncode:
        raise Failed(f"git {arguments[0]}: {done.stderr.strip()}")
    return done.stdout.strip()


@contextmanager
def worktree(commit: str) -> Iterator[Path]:
    """A tree of ``commit`` for as long as it lasts."""
    with TemporaryDirectory(prefix="bipot-paired-") as folder:
        tree = Path(folder) / "tree"
        try:
            git("worktree", "add", "--detach", tree, commit)
            yield tree
        finally:
            if tree.exists():
                git("worktree", "remove", "--force", tree)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="benchmarks.paired", description=__doc__.splitlines()[0] if __doc__ else "", allow_abbrev=False
    )
    p.add_argument("commit", help="the state to compare with")
    p.add_argument("--pairs", type=count(1), default=PAIRS, help=f"of processes (default {PAIRS}; below 6 no interval)")
    p.add_argument("--only", nargs="+", choices=[m.task for m in MEASURES], help="these tasks (default all)")
    p.add_argument("--out", type=Path, default=Path("results"))
    p.add_argument("--fast", action="store_true", help="small meshes: to try the command, not for a verdict")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, print and write; 1 where a limit is exceeded."""
    asking = parser()
    asked = asking.parse_args(argv)
    try:
        commit = git("rev-parse", "--verify", "--short", f"{asked.commit}^{{commit}}")
    except Failed:
        asking.error(f"{asked.commit}: no commit of this repository")
    require_writable(asked.out)
    rows = list[Row]()
    with worktree(commit) as other:
        for measure in MEASURES:
            if asked.only is None or measure.task in asked.only:
                rows.append(compared(measure, other, commit, asked.pairs, asked.fast))
                write(asked.out / "paired.csv", Row, rows)
                say(line(rows[-1]))
    return int(not all(row.met for row in rows))


def line(row: Row) -> str:
    """One measure in words."""
    verdict = f"{'met ' if row.met else 'MISS'} " if row.most < float("inf") else "     "
    ratio = f"{row.ratio:.3f} ({row.low:.3f} .. {row.high:.3f})"
    limit = f", at most {row.most:g}" if row.most < float("inf") else ""
    sides = ((row.seconds, row.passes), (row.seconds_against, row.passes_against))
    times = " to ".join(f"{1e3 * seconds:.3g} ms ({passes} passes)" for seconds, passes in sides)
    return f"{verdict}{row.name} (size {row.size}) / {row.against}: {ratio}{limit}; {times}"


if __name__ == "__main__":
    sys.exit(main())
