"""Memory of a run: python -m benchmarks.memory [--elements 80] [--increments 6]. Prints two numbers in GB.

The peak of the process over the increments, and what the last half of them added to it: nothing may grow with the
number of increments but what is saved, and nothing is saved here.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, Schedule, march
from bipot.scene import upsetting

GB = 1e9
KILO = 1024


def peak() -> float:
    """Largest resident size of this process so far, GB, as Linux tells it.

    Not ``getrusage``: there a process counts from the size of the one that started it.
    """
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    kilobytes = next(line.split()[1] for line in lines if line.startswith("VmHWM"))
    return int(kilobytes) * KILO / GB


def measured(elements: int, increments: int) -> tuple[float, float]:
    """(peak, growth over the last half) in GB of a run in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.memory", "--elements", str(elements), "--increments", str(increments)]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return float(out[0]), float(out[1])


def main(argv: list[str] | None = None) -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.memory", description="Memory of a run", allow_abbrev=False)
    parser.add_argument("--elements", type=int, default=80)
    parser.add_argument("--increments", type=int, default=6)
    asked = parser.parse_args(argv)
    scene = upsetting(mu=0.1, reduction=0.01 * asked.increments, elements=asked.elements)
    control = Control(Newton(), fallbacks=(Tangent(), Dissipation()))
    schedule = Schedule(asked.increments, first=0.1 / asked.increments, settling=2, growth=2)
    half, count = 0.0, len(schedule.times())
    for accepted in march(scene, schedule, control):
        if accepted.number == (count + 1) // 2:
            half = peak()
    print(f"{peak():.4f} {peak() - half:.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
