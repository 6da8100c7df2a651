"""Lines of the benchmarks' tables."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

from studies.files import replacing


@dataclass(frozen=True)
class Row:
    """One line of bench.csv."""

    name: str
    form: str
    mu: float
    elements: int
    kappa_s: float
    seconds: float
    ratio: float


@dataclass(frozen=True)
class Error:
    """One line of bench_errors.csv: a history's force against the reference's, relative."""

    form: str
    mu: float
    elements: int
    increments: int
    passes: int
    left_out: int
    worst: float
    rms: float

    def rows(self) -> list[Row]:
        """Its measures as rows of bench.csv, in the column ``ratio``."""
        measures = {"worst error": self.worst, "rms error": self.rms}
        return [Row(name, self.form, self.mu, self.elements, 0.0, 0.0, value) for name, value in measures.items()]


def write(path: Path, kind: type, rows: Iterable[Any]) -> None:
    """A CSV of dataclasses, in the place of what was there."""
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f.name for f in fields(kind)])
        writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in astuple(row)] for row in rows)


def read(path: Path) -> list[Row]:
    """The rows of a bench.csv."""
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Row(r["name"], r["form"], float(r["mu"]), int(r["elements"]), *(float(r[k]) for k in TIMES))
            for r in csv.DictReader(file)
        ]


TIMES = ("kappa_s", "seconds", "ratio")
