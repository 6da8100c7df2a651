"""Tables of docs/coulomb.md, from the results of :mod:`studies.coulomb_profiles` alone."""

from __future__ import annotations

from pathlib import Path

from bipot.errors import ResultsError
from studies.coulomb_profiles import Row
from studies.performance import TOLERANCES, solved_table
from studies.tables import read_rows

FOLDER = "coulomb"
"""Of ``docs/results``."""

ONE = "pile_mu1p0-00060-nc53"
"""A problem of 53 contacts, hyperstatic, mu = 1."""


def of_solvers(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: how many problems each solver solves at each tolerance, and its time."""
    return ["solver", *(f"{tol:g}" for tol in TOLERANCES), "of", "median s", "total s"], solved_table(_rows(results))


def of_one(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: what each solver takes for :data:`ONE` and comes to, the quickest first."""
    rows = sorted((row for row in _rows(results) if row.id == ONE), key=lambda row: row.seconds)
    lines = [
        [row.solver, f"{1e3 * row.seconds:.3g} ms", f"{row.residual:.0e}", f"{row.iterations}", row.status]
        for row in rows
    ]
    return ["solver", "time", "residual reached", "steps", "ended"], lines


def _rows(results: Path) -> list[Row]:
    path = results / FOLDER / "solved.csv"
    if not path.is_file():
        raise ResultsError(f"{path}: is missing: run python -m studies.coulomb_profiles as docs/coulomb.md says")
    return read_rows(path, Row)
