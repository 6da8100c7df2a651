"""This tree against another commit, in pairs of processes.

    python -m benchmarks.paired COMMIT [--pairs 20] [--only TASK ...] [--fast] [--out DIR]

The tasks of :mod:`benchmarks.paired_tasks` run on a worktree of COMMIT and on this tree, each in a fresh process of one
thread, alternating A B B A after one of each that is not counted. Measured are processor seconds. Of the ratios of the
pairs (this tree over the other, or one form over another on this tree) the median is reported, with an interval that
holds the true median with 95 %, whatever the distribution: two of the ratios themselves, counted by the binomial law.

Writes ``DIR/paired.csv`` (name, size, against, pairs, seconds, seconds_against, passes, passes_against, ratio, low,
high, most); ends with exit code 1 where a median exceeds its limit ``most``.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from scipy.stats import binom

from benchmarks.rows import write

ROOT = Path(__file__).parents[1]
TASKS = ROOT / "benchmarks" / "paired_tasks.py"
THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
PAIRS, LEVEL = 20, 0.95


@dataclass(frozen=True)
class Measure:
    """A task at a ``size`` in elements (``small`` with --fast), and the largest ratio allowed.

    ``against`` is another task on this tree, or None for the same task on the other tree.
    """

    name: str
    task: str
    size: int
    small: int
    most: float
    against: str | None = None


MEASURES = (
    Measure("import bipot", "importing", 0, 0, 0.5),
    Measure("newton pass", "newton", 10, 3, 1.05),
    Measure("tangent pass, 2 size + 1 contact nodes", "tangent_wide", 100, 5, 3.0, against="newton_wide"),
    Measure("delassus pass, 4 size rows", "delassus", 7, 2, float("inf")),
)


class Taken(NamedTuple):
    """Processor seconds of a pass, and how many there were."""

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


def taken(tree: Path, task: str, size: int) -> Taken:
    """Run a task on the library of ``tree`` in a process of its own.

    Raises:
        CalledProcessError: the task failed; what it said is on stderr.
        RuntimeError: it measured a library from elsewhere.
    """
    command = [sys.executable, "-P", str(TASKS), task, str(size)]
    env = os.environ | THREADS | {"PYTHONPATH": str(tree)}
    done = subprocess.run(command, env=env, cwd=tree, stdout=subprocess.PIPE, text=True, check=True)
    seconds, passes, measured = done.stdout.strip().split(maxsplit=2)
    if not Path(measured).resolve().is_relative_to(tree.resolve()):
        raise RuntimeError(f"{task} measured {measured}, which is not in {tree}")
    return Taken(float(seconds), int(passes))


def compared(measure: Measure, other: Path, commit: str, pairs: int, fast: bool = False) -> Row:
    """Run the pairs of a measure: this tree, or this form, first in every other one."""
    size = measure.small if fast else measure.size
    sides = (ROOT, measure.task), (other if measure.against is None else ROOT, measure.against or measure.task)
    for tree, task in sides:
        taken(tree, task, size)
    found = list[tuple[Taken, Taken]]()
    for k in range(pairs):
        turn = (0, 1) if k % 2 == 0 else (1, 0)
        times = {side: taken(*sides[side], size) for side in turn}
        found.append((times[0], times[1]))
    ratios = [ours.seconds / theirs.seconds for ours, theirs in found]
    seconds = np.median([[one.seconds for one in pair] for pair in found], axis=0)
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


def git(*arguments: str | Path) -> str:
    """What git says of this repository; raises CalledProcessError."""
    command = ["git", "-C", str(ROOT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


@contextmanager
def worktree(commit: str) -> Iterator[Path]:
    """A tree of ``commit`` for as long as it lasts."""
    with TemporaryDirectory(prefix="bipot-paired-") as folder:
        tree = Path(folder) / "tree"
        git("worktree", "add", "--detach", tree, commit)
        try:
            yield tree
        finally:
            git("worktree", "remove", "--force", tree)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="benchmarks.paired", description=__doc__.splitlines()[0] if __doc__ else "", allow_abbrev=False
    )
    p.add_argument("commit", help="the state to compare with")
    p.add_argument("--pairs", type=int, default=PAIRS, help=f"of processes (default {PAIRS}; below 6 no interval)")
    p.add_argument("--only", nargs="+", choices=[m.task for m in MEASURES], help="these tasks (default all)")
    p.add_argument("--out", type=Path, default=Path("results"))
    p.add_argument("--fast", action="store_true", help="small meshes: to try the command, not for a verdict")
    return p


def main(argv: list[str] | None = None) -> int:
    """Run, print and write; 1 where a limit is exceeded."""
    asking = parser()
    asked = asking.parse_args(argv)
    if asked.pairs < 1:
        asking.error(f"--pairs {asked.pairs}: must be >= 1")
    try:
        commit = git("rev-parse", "--verify", "--short", f"{asked.commit}^{{commit}}")
    except subprocess.CalledProcessError:
        asking.error(f"{asked.commit}: no commit of this repository")
    asked.out.mkdir(parents=True, exist_ok=True)
    rows = list[Row]()
    with worktree(commit) as other:
        for measure in MEASURES:
            if asked.only is None or measure.task in asked.only:
                rows.append(compared(measure, other, commit, asked.pairs, asked.fast))
                write(asked.out / "paired.csv", Row, rows)
                print(line(rows[-1]), flush=True)
    return int(not all(row.met for row in rows))


def line(row: Row) -> str:
    """One measure in words."""
    verdict = f"{'met ' if row.met else 'MISS'} " if row.most < float("inf") else "     "
    ratio = f"{row.ratio:.3f} ({row.low:.3f} .. {row.high:.3f})"
    limit = f", at most {row.most:g}" if row.most < float("inf") else ""
    times = f"{1e3 * row.seconds:.3g} ms to {1e3 * row.seconds_against:.3g} ms"
    return f"{verdict}{row.name} (size {row.size}) / {row.against}: {ratio}{limit}; {times}"


if __name__ == "__main__":
    sys.exit(main())
