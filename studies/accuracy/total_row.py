r"""A run's total error, what it costs, and what two programs cost at the same error.

With F_k the force at the marks 10, 20, 30, 40 and 45 % and L_k +- b_k its mesh-converged limit and band
(:mod:`studies.accuracy.limits`),

    force_error = max_k |F_k / L_k - 1|,    end_error = |F / L - 1| at 45 %,    band = max_k b_k / L_k.

Mesh, increments, contact and equation solving are all in it. An error below the band is known no better than the band:
it counts as the band.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from bipot.errors import ResultsError
from studies.accuracy.choice import FOREIGN, OWN, Choice
from studies.accuracy.limits import Limit
from studies.tables import read_rows

MARKS = (0.10, 0.20, 0.30, 0.40, 0.45)
SOLVED = "solved"
LEVELS = (0.05, 0.02, 0.01, 0.005, 0.0025, 0.001)
"""Errors at which programs are compared."""


@dataclass(frozen=True)
class Row(Choice):
    """Row of total.csv: ``seconds`` without the start of the program, ``process_seconds`` with it, medians of runs."""

    unknowns: int
    increments: int
    passes: int
    end_force_N: float
    force_error: float
    end_error: float
    band: float
    seconds: float
    process_seconds: float
    runs: int
    version: str
    outcome: str

    @property
    def known(self) -> float:
        """The error, at least the band; NaN of a run that did not come to the end."""
        return math.nan if math.isnan(self.force_error) else max(self.force_error, self.band)


def key(row: Row) -> Choice:
    """What tells one row from another."""
    return Choice(*(getattr(row, field.name) for field in fields(Choice)))


def limits_of(path: Path, mu: float, marks: Sequence[float] = MARKS) -> list[Limit]:
    """The force's limits at the marks.

    Raises:
        ResultsError: the file lacks one.
    """
    found = {one.reduction: one for one in read_rows(path, Limit) if (one.mu, one.quantity) == (mu, "force_N")}
    if missing := [mark for mark in marks if mark not in found]:
        raise ResultsError(f"{path}: no limit of the force for mu = {mu:g} at the reductions {missing}")
    return [found[mark] for mark in marks]


def errors(forces: Sequence[float], limits: Sequence[Limit]) -> tuple[float, float, float]:
    """Force error, error at the end and band; the first two NaN where a mark was not reached.

    >>> limits = [Limit(0.1, 0.1, "force_N", 100.0, 1.0, ""), Limit(0.1, 0.45, "force_N", 200.0, 1.0, "")]
    >>> errors([150.0, 250.0], limits)
    (0.5, 0.25, 0.01)
    """
    band = max(one.band / one.value for one in limits)
    if len(forces) < len(limits):
        return math.nan, math.nan, band
    off = [abs(force / one.value - 1) for force, one in zip(forces, limits, strict=True)]
    return max(off), off[-1], band


@dataclass(frozen=True)
class Ratio:
    """Row of total_ratio.csv: the fastest run of each program whose known error is at most ``error``.

    ``ratio`` is the foreign process over our run without the start of Python, ``process_ratio`` over our process.
    """

    mu: float
    error: float
    own: str
    own_error: float
    own_seconds: float
    own_process_seconds: float
    foreign: str
    foreign_error: float
    foreign_seconds: float
    ratio: float
    process_ratio: float


def named(row: Row) -> str:
    """A row's choices in words."""
    form = f"{row.form}, " if row.program == OWN else ""
    kind = f"{row.element} {row.quadrature} {row.layout}" if row.program == OWN else row.element
    return f"{form}{kind} {row.elements}, {row.contact}, {row.schedule}"


def ratios(rows: Iterable[Row]) -> list[Ratio]:
    """At the levels that both programs reach."""
    rows, out = list(rows), list[Ratio]()
    for mu in sorted({row.mu for row in rows}):
        for level in LEVELS:
            within = [row for row in rows if row.mu == mu and row.known <= level]
            own = min((r for r in within if r.program == OWN), key=lambda r: r.seconds, default=None)
            whole = min((r.process_seconds for r in within if r.program == OWN), default=math.nan)
            other = min((r for r in within if r.program == FOREIGN), key=lambda r: r.process_seconds, default=None)
            if own is None or other is None:
                continue
            out.append(
                Ratio(
                    mu,
                    level,
                    named(own),
                    own.force_error,
                    own.seconds,
                    whole,
                    named(other),
                    other.force_error,
                    other.process_seconds,
                    other.process_seconds / own.seconds,
                    other.process_seconds / whole,
                )
            )
    return out


def front(rows: Iterable[Row], seconds: str) -> list[Row]:
    """The rows than which no faster one is at least as accurate, the fastest first; those that ended early left out."""
    out = list[Row]()
    for row in sorted(rows, key=lambda row: getattr(row, seconds)):
        if not math.isnan(row.known) and (not out or row.known < out[-1].known):
            out.append(row)
    return out
