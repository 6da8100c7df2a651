r"""Where and when the tables of ``docs/results`` were made: ``provenance.csv``, a row a table.

    python -m studies.provenance NAME.csv [NAME.csv ...] [--results docs/results]
    python -m studies.provenance --from-history [--results docs/results]

The first is said where a table has just been made: it stores this machine, these versions and today. The second gives
tables without a row the day and commit of their last change; machine and versions are then not known, and stay empty.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path

from bipot.errors import ResultsError
from studies.command import command
from studies.tables import read_rows, write_csv

NAME = "provenance"
RESULTS = Path("docs/results")
PACKAGES = ("bipot", "numpy", "scipy", "clarabel", "cvxpy", "scikit-fem")
CPU = Path("/proc/cpuinfo")


@dataclass(frozen=True)
class Row:
    """Of one table; what is not known is empty."""

    table: str
    day: str
    commit: str
    machine: str
    versions: str


def machine() -> str:
    """Processor and number of cores."""
    names = [line.partition(":")[2].strip() for line in _lines(CPU) if line.startswith("model name")]
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def here(table: str, results: Path) -> Row:
    """Of a table that was made on this machine today."""
    versions = [f"Python {platform.python_version()}", *(f"{name} {version(name)}" for name in PACKAGES)]
    return Row(
        table, date.today().isoformat(), _git(results, "rev-parse", "--short", "HEAD"), machine(), ", ".join(versions)
    )


def from_history(table: str, results: Path) -> Row:
    """Of a table by its last commit.

    Raises:
        ResultsError: it was never committed.
    """
    found = _git(results, "log", "-1", "--format=%as %h", "--", table).split()
    if not found:
        raise ResultsError(f"{results / table}: is not in the history: name it on the command line where it was made")
    return Row(table, found[0], found[1], "", "")


def stored(results: Path) -> dict[str, Row]:
    """The rows by table."""
    path = results / f"{NAME}.csv"
    return {row.table: row for row in read_rows(path, Row)} if path.is_file() else {}


def tables(results: Path) -> list[str]:
    """The tables that there are, by their paths in the folder."""
    return sorted(path.relative_to(results).as_posix() for path in results.rglob("*.csv") if path.stem != NAME)


def _lines(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines() if path.is_file() else []


def _git(folder: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=False)
    return done.stdout.strip()


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Write the rows asked for."""
    parser = argparse.ArgumentParser(
        prog=f"studies.{NAME}", description=(__doc__ or "").splitlines()[0], allow_abbrev=False
    )
    parser.add_argument("tables", nargs="*", help="tables that were made on this machine today")
    parser.add_argument("--from-history", action="store_true", help="rows of tables without one, by their last commit")
    parser.add_argument("--results", type=Path, default=RESULTS)
    asked = parser.parse_args(argv)
    there, rows = tables(asked.results), stored(asked.results)
    if unknown := [name for name in asked.tables if name not in there]:
        parser.error(f"{unknown[0]}: must be one of {', '.join(there)}")
    rows |= {name: here(name, asked.results) for name in asked.tables}
    if asked.from_history:
        rows |= {name: from_history(name, asked.results) for name in there if name not in rows}
    write_csv(asked.results / f"{NAME}.csv", [rows[name] for name in sorted(rows) if name in there])
    return 0


if __name__ == "__main__":
    sys.exit(main())
