"""CalculiX, where it is installed: a deck is run in a folder of its own, and what it printed is read.

The calculation is CalculiX's own ``ccx`` of the path (Debian: ``calculix-ccx``), on one thread.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from studies.accuracy.deck import PUNCH, Deck
from studies.accuracy.spent import Ended, ended

COMMAND, JOB = "ccx", "upsetting"
ABSENT = f"CalculiX is not installed (no {COMMAND} on the path; Debian's package is calculix-ccx): it is left out"

LATE = "out of time"

TOTAL = re.compile(rf"total force \(fx,fy,fz\) for set {PUNCH} and time.*\n\s*\n\s*(\S+)\s+(\S+)\s+(\S+)")
ERROR = re.compile(r"\*ERROR[: ]*(.*)")
EQUATIONS = re.compile(r"number of equations\s+(\d+)")
PASS = re.compile(r"^ iteration \d+", re.MULTILINE)


@dataclass(frozen=True)
class Calculation:
    """Forces (N) at the marks that were reached, cost, and why it stopped, if it did."""

    forces: tuple[float, ...]
    unknowns: int
    increments: int
    passes: int
    seconds: float
    stopped: str


def executable() -> str | None:
    """Where ``ccx`` is."""
    return shutil.which(COMMAND)


def version(command: str) -> str:
    """As it says: ``2.20``."""
    found = re.search(r"Version\s+(\S+)", ended([command, "-v"]).said)
    return found[1] if found else "unknown"


def calculated(deck: Deck, marks: Sequence[float], command: str) -> Calculation:
    """Write the deck, run it, read it."""
    with tempfile.TemporaryDirectory(prefix="ccx") as name:
        folder = Path(name)
        (folder / f"{JOB}.inp").write_text(deck.text(marks), encoding="ascii")
        done = ended([command, JOB], folder)
        printed, courses = (_read(folder / f"{JOB}.{end}") for end in ("dat", "sta"))
    return read(done, printed, courses, len(marks), deck.force)


def read(done: Ended, printed: str, courses: str, marks: int, force: Callable[[Sequence[float]], float]) -> Calculation:
    """What a run says on standard output, in its ``.dat`` and in its ``.sta``; ``force`` is that of a printed total."""
    forces = tuple(force([float(word) for word in found.groups()]) for found in TOTAL.finditer(printed))[:marks]
    equations = EQUATIONS.search(done.said)
    increments = sum(line.split()[:1] != [] and line.split()[0].isdigit() for line in courses.splitlines())
    stopped = "" if len(forces) == marks else _reason(done)
    passes = len(PASS.findall(done.said))
    return Calculation(forces, int(equations[1]) if equations else 0, increments, passes, done.seconds, stopped)


def _reason(done: Ended) -> str:
    """Why there are fewer forces than asked."""
    if done.code is None:
        return LATE
    found = ERROR.search(done.said)
    return " ".join(found[1].split()) if found and found[1].strip() else f"exit code {done.code}"


def _read(path: Path) -> str:
    return path.read_text(encoding="ascii", errors="replace") if path.exists() else ""
