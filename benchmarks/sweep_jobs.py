r"""What a second process brings to a sweep: thirteen coefficients by one and by two, as whole commands.

    python -m benchmarks.sweep_jobs [--elements 10] [--repeats 1] [--least 1.7] [--out DIR]

Seconds are those of the clock, from the command to its end, the best of the repeats, so the machine must be quiet and
have two cores. ``sweep_jobs.csv`` has a row a command. Exit code 1 where the ratio is below the least.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from bipot.errors import BipotError
from studies.command import command, say
from studies.options import count, positive
from studies.tables import write_csv

MU = "0:0.6:13"
JOBS = (1, 2)
LEAST = 1.7
REFUSED = 2


@dataclass(frozen=True)
class Row:
    """One command: number of processes and of elements a side, seconds."""

    jobs: int
    elements: int
    repeat: int
    seconds: float


def swept(jobs: int, elements: int, repeat: int) -> Row:
    """Time one sweep.

    Raises:
        BipotError: it was refused; a point that was not solved is computed all the same.
    """
    with tempfile.TemporaryDirectory() as out:
        asked = ["--mu", MU, "--elements", str(elements), "--jobs", str(jobs), "--out", out]
        began = perf_counter()
        done = subprocess.run([sys.executable, "-m", "studies.sweep", *asked], capture_output=True, text=True)
        seconds = perf_counter() - began
    if done.returncode == REFUSED:
        raise BipotError(f"a sweep ended with {done.returncode}: {done.stderr.strip()}")
    return Row(jobs, elements, repeat, seconds)


def ratio(rows: Sequence[Row]) -> float:
    """How many times the most processes are faster than the fewest, each at its best."""
    best = {jobs: min(row.seconds for row in rows if row.jobs == jobs) for jobs in {row.jobs for row in rows}}
    return best[min(best)] / best[max(best)]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Time, write, print."""
    p = argparse.ArgumentParser(prog="benchmarks.sweep_jobs", description="One process or two.", allow_abbrev=False)
    p.add_argument("--elements", type=count(1), default=10, help="a side (default %(default)s)")
    p.add_argument("--repeats", type=count(1), default=1, help="of both (default %(default)s)")
    p.add_argument("--least", type=positive, default=LEAST, help="ratio that is asked (default %(default)s)")
    p.add_argument("--out", type=Path, default=Path("results/sweep_jobs"))
    asked = p.parse_args(argv)
    rows = []
    for repeat in range(asked.repeats):
        for jobs in JOBS:
            rows.append(swept(jobs, asked.elements, repeat))
            say(f"{jobs} processes: {rows[-1].seconds:.1f} s", sys.stderr)
            write_csv(asked.out / "sweep_jobs.csv", rows)
    found = ratio(rows)
    say(f"{found:.2f} times faster with {max(JOBS)} processes than with {min(JOBS)}, at least {asked.least:g} asked")
    return int(found < asked.least)


if __name__ == "__main__":
    sys.exit(main())
