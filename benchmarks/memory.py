"""Memory of a run: python -m benchmarks.memory [--elements 80] [--increments 6]. Prints two numbers in GB.

The peak of the process over the increments, and what the last half of them added to it: nothing may grow with the
number of increments but what is saved, and nothing is saved here.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from studies.command import command, say
from studies.options import count
from studies.pool import processes

GB = 1e9
KILO = 1024
MOST = 90


def peak() -> float:
    """Largest resident size of this process so far, GB, as Linux tells it.

    Not ``getrusage``: there a process counts from the size of the one that started it.
    """
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    kilobytes = next(line.split()[1] for line in lines if line.startswith("VmHWM"))
    return int(kilobytes) * KILO / GB


def measured(elements: int, increments: int) -> tuple[float, float]:
    """(peak, growth over the last half) in GB of a run in a process of its own."""
    with processes(1) as pool:
        return pool.submit(run, elements, increments).result()


def run(elements: int, increments: int) -> tuple[float, float]:
    """(peak, growth over the last half) in GB of a run in this process."""
    scene = upsetting(mu=0.1, reduction=0.01 * increments, elements=elements)
    control = Control(Newton(), fallbacks=(Tangent(), Dissipation()))
    schedule = Schedule(increments, first=0.1 / increments, settling=2, growth=2)
    half, count = 0.0, len(schedule.times())
    for accepted in march(scene, schedule, control):
        if accepted.number == (count + 1) // 2:
            half = peak()
    return peak(), peak() - half


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.memory", description="Memory of a run", allow_abbrev=False)
    parser.add_argument("--elements", type=count(1), default=80)
    parser.add_argument("--increments", type=count(2, MOST), default=6, help=f"at most {MOST}, each 1 %% of the height")
    asked = parser.parse_args(argv)
    largest, grown = run(asked.elements, asked.increments)
    say(f"{largest:.4f} {grown:.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
