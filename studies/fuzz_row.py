"""One line of the fuzz study's table, and the table on disk."""

from __future__ import annotations

import csv
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields, replace
from enum import Enum
from pathlib import Path


class Outcome(Enum):
    """How a scene or problem ended. WRONG, RAW (an exception the library did not raise on purpose) and WARNING fail."""

    CERTIFIED = "certified"
    REFUSED = "refused"
    WRONG = "wrong"
    RAW = "raw exception"
    WARNING = "warning"


FAILURES = (Outcome.WRONG.value, Outcome.RAW.value, Outcome.WARNING.value)


@dataclass(frozen=True)
class Row:
    """One scene or problem. The worst numbers are those of the run as drawn, ``worst_disagreement`` of its variants."""

    seed: int
    kind: str
    form: str
    outcome: Outcome
    reason: str
    increments: int
    worst_residual: float
    worst_law: float
    worst_disagreement: float
    seconds: float


def ended(known: Iterator[Row]) -> Row:
    """The last row of those that tell ever more of one scene or problem, with its time; what is raised ends it."""
    began, row = time.perf_counter(), next(known)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for told in known:
                row = told
    except Exception as error:
        outcome = Outcome.WARNING if isinstance(error, Warning) else Outcome.RAW
        row = replace(row, outcome=outcome, reason=f"{type(error).__name__}: {error}")
    return replace(row, seconds=time.perf_counter() - began)


HEADER = [f.name for f in fields(Row)]


class Table:
    """Rows appended to a file as they come; a file that exists is gone on with."""

    def __init__(self, path: Path) -> None:
        self.path, self.outcomes = path, Counter[str]()
        self.done: set[tuple[str, int]] = set()
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists():
            self._read()
        else:
            self._write(HEADER)

    def _read(self) -> None:
        with self.path.open(newline="", encoding="utf-8") as file:
            lines = csv.DictReader(file)
            if lines.fieldnames != HEADER:
                raise SystemExit(f"{self.path} has other columns: give another --out")
            for line in lines:
                self.done.add((line["kind"].split()[0], int(line["seed"])))
                self.outcomes[line["outcome"]] += 1

    def _write(self, line: list[str]) -> None:
        with self.path.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(line)

    def add(self, row: Row) -> None:
        """Append a row."""
        values = [v.value if isinstance(v, Enum) else v for v in astuple(row)]
        # A reason is one line of the table, whatever the exception wrote.
        self._write([f"{v:.3g}" if isinstance(v, float) else " ".join(str(v).split()) for v in values])
        self.done.add((row.kind.split()[0], row.seed))
        self.outcomes[row.outcome.value] += 1

    @property
    def failed(self) -> bool:
        """Whether a row of the file is a wrong answer, a raw exception or a warning."""
        return any(self.outcomes[name] for name in FAILURES)
