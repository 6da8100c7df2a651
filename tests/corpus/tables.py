"""A table of a study, valid, and what only tables can have wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from studies import tables


@dataclass(frozen=True)
class Row:
    """A line of the table."""

    method: str
    increments: int
    force: float


def valid(path: Path) -> Path:
    """Three lines."""
    tables.write_csv(path, [Row("newton", 10, 1.5), Row("a, b", 20, float("nan")), Row('say "so"', 30, 2.5)])
    return path


def read_rows(path: Path) -> list[Row]:
    """By the types of the columns."""
    return tables.read_rows(path, Row)


def read_csv(path: Path) -> list[dict[str, tables.Value]]:
    """Numbers as numbers."""
    return tables.read_csv(path, "python -m studies.none")


def line(number: int, new: str) -> Callable[[Path], None]:
    """Another line, counted from 1."""

    def damage(path: Path) -> None:
        lines = path.read_text(encoding="utf-8").splitlines()
        lines[number - 1] = new
        path.write_text("\n".join(lines), encoding="utf-8")

    return damage


def raw(content: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(content)


HEAD = b"method,increments,force\n"
TABLES = {
    "line 3": {
        "too few values": line(3, "newton,10"),
        "too many values": line(3, "newton,10,1.5,2.5"),
        "a null character": line(3, "new\0ton,10,1.5"),
    },
    "line 1": {
        "a column twice": line(1, "method,increments,increments"),
        "empty lines": raw(b"\n\n\n"),
    },
    "cannot be read": {
        "no end of a quotation": line(4, 'newton,10,"1.5'),
        "a quotation inside": line(4, 'newton,10,"1.5"6'),
        "bytes of no text": raw(HEAD + b"newton,10,\xff\xfe\n"),
        "a word of a megabyte": raw(HEAD + b"a" * 2**20 + b",1,1\n"),
    },
    "must be": {
        "two million values": raw(b"a\n" + b"1\n" * 2_000_000),
        "a hundred megabytes": raw(HEAD + bytes(10**8)),
    },
}
"""By what a message must name: wrong for any reader."""

TYPED = {
    "line 2: increments = 1.5": {"a fraction of increments": line(2, "newton,1.5,1.5")},
    "line 2: increments = nan": {"NaN increments": line(2, "newton,nan,1.5")},
    "line 2: increments = inf": {"infinitely many increments": line(2, "newton,inf,1.5")},
    "line 2: increments = ": {"no increments": line(2, "newton,,1.5")},
    "line 4: force = much": {"a word for a number": line(4, "newton,10,much")},
    "line 2: increments = 9": {"an integer of many digits": line(2, "newton," + "9" * 5000 + ",1.5")},
    "line 1": {
        "another column": line(1, "method,increments,work"),
        "another order": line(1, "increments,method,force"),
    },
}
"""By what a message must name: wrong for who knows the types."""
