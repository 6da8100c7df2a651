"""What a page shows of the total error: heads and rows of its tables, from the results files alone."""

from __future__ import annotations

from pathlib import Path

from bipot.fem.elements import Quadrature
from studies.accuracy.choice import FOREIGN, OWN
from studies.accuracy.tables import Lines
from studies.accuracy.total_row import MARKS, SOLVED, Ratio, Row, front, named
from studies.element_types import ElementType
from studies.tables import read_rows

SAME = ((ElementType.Q8.value, Quadrature.GAUSS2.value), "CAX8R")
"""The same element by its names in both programs."""

SHORT = 90
"""Characters of a reason that a page shows."""


def of_ratios(results: Path, name: str = "total_ratio.csv") -> Lines:
    """Fastest run of each program within an error, by a table of :class:`~studies.accuracy.total_row.Ratio`."""
    head = ["mu", "error", "bipot", "error", "s (process)", "CalculiX", "error", "s", "ratio", "ratio of processes"]
    rows = [
        [
            f"{one.mu:g}",
            _percent(one.error),
            one.own,
            _percent(one.own_error),
            f"{one.own_seconds:.2f} ({one.own_process_seconds:.2f})",
            one.foreign,
            _percent(one.foreign_error),
            f"{one.foreign_seconds:.2f}",
            f"{one.ratio:.1f}",
            f"{one.process_ratio:.1f}",
        ]
        for one in read_rows(results / name, Ratio)
    ]
    return head, rows


def of_fronts(results: Path) -> Lines:
    """Of each program the runs than which none is faster and at least as accurate."""
    rows = read_rows(results / "total.csv", Row)
    head = ["mu", "program", "run", "unknowns", "increments", "passes", "error", "at 45 %", "s", "whole process [s]"]
    lines = list[list[str]]()
    for mu in sorted({row.mu for row in rows}):
        for program in (OWN, FOREIGN):
            for row in front((r for r in rows if (r.mu, r.program) == (mu, program)), "seconds"):
                counts = map(str, (row.unknowns, row.increments, row.passes))
                within = " (within the band)" if row.force_error < row.band else ""
                error = f"{_percent(row.force_error)}{within}"
                costs = f"{row.seconds:.2f}", f"{row.process_seconds:.2f}"
                lines.append([f"{mu:g}", program, named(row), *counts, error, _percent(row.end_error), *costs])
    return head, lines


def of_same_mesh(results: Path) -> Lines:
    """Both programs with the same element, Q8 with 2 x 2 points, on the same mesh: the fastest run of each."""
    rows = [row for row in read_rows(results / "total.csv", Row) if row.outcome == SOLVED]
    own = [row for row in rows if (row.program, row.element, row.quadrature) == (OWN, *SAME[0])]
    other = [row for row in rows if (row.program, row.element) == (FOREIGN, SAME[1])]
    lines = list[list[str]]()
    for mu, elements in sorted({(row.mu, row.elements) for row in own} & {(row.mu, row.elements) for row in other}):
        best = [
            min((row for row in found if (row.mu, row.elements) == (mu, elements)), key=lambda row: row.seconds)
            for found in (own, other)
        ]
        cells = [cell for row in best for cell in (_percent(row.force_error), f"{row.seconds:.2f}")]
        ratio = best[1].seconds / best[0].seconds
        lines.append([f"{mu:g}", str(elements), *cells, f"{ratio:.1f}"])
    return ["mu", "a side", "bipot: error", "s", "CalculiX: error", "s", "ratio"], lines


def of_stopped(results: Path) -> Lines:
    """Runs that did not come to the last mark, and why."""
    rows = [row for row in read_rows(results / "total.csv", Row) if row.outcome != SOLVED]
    lines = [[f"{r.mu:g}", r.program, named(r), f"{r.seconds:.1f}", _short(r.outcome)] for r in rows]
    return ["mu", "program", f"does not come to {100 * MARKS[-1]:g} %", "s", "reason"], lines


def _percent(error: float) -> str:
    return f"{100 * error:.2g} %"


def _short(reason: str) -> str:
    words = reason.replace("|", "/")
    return words if len(words) <= SHORT else f"{words[:SHORT]} ..."
