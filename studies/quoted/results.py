"""Rows of the results files, read once, chosen by their columns, and numbers as a text shows them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from bipot.errors import ResultsError
from studies.tables import Value, read_csv

Line = dict[str, Value]

WORDS = ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


@dataclass(frozen=True)
class Results:
    """A folder of results files."""

    folder: Path
    kept: dict[str, list[Line]] = field(default_factory=dict, compare=False, repr=False)

    def rows(self, name: str, /, **where: Value | tuple[Value, ...]) -> list[Line]:
        """Rows of ``NAME.csv`` whose columns have these values, or one of them where several are given.

        Raises:
            ResultsError: there is no such file, column or row.
        """
        if name not in self.kept:
            self.kept[name] = read_csv(self.folder / f"{name}.csv", "the study that its page names")
        if lacking := set(where) - set(self.kept[name][0]):
            raise ResultsError(f"{name}.csv: no columns {sorted(lacking)}")
        asked = {key: value if isinstance(value, tuple) else (value,) for key, value in where.items()}
        found = [row for row in self.kept[name] if all(row[key] in values for key, values in asked.items())]
        if not found:
            raise ResultsError(f"{name}.csv: no row with {where}")
        return found

    def column(self, name: str, column: str, /, **where: Value | tuple[Value, ...]) -> list[float]:
        """One column of numbers of these rows."""
        return [float(row[column]) for row in self.rows(name, **where)]

    def one(self, name: str, column: str, /, **where: Value | tuple[Value, ...]) -> float:
        """The number in the one row with these values.

        Raises:
            ResultsError: there is not one such row.
        """
        found = self.column(name, column, **where)
        if len(found) != 1:
            raise ResultsError(f"{name}.csv: {len(found)} rows with {where}: must be one")
        return found[0]


def digits(value: float, count: int = 2) -> str:
    """So many digits, without an exponent.

    >>> digits(0.0123456), digits(1234.5), digits(0.997)
    ('0.012', '1200', '1')
    """
    rounded = float(f"{value:.{count}g}")
    return f"{rounded:.0f}" if abs(rounded) >= 10 ** (count - 1) else f"{rounded:.12f}".rstrip("0").rstrip(".")


def percent(value: float, count: int = 2) -> str:
    """A part of one in per cent, in so many digits.

    >>> percent(-0.0123456), percent(0.5)
    ('-1.2', '50')
    """
    return digits(100 * value, count)


def power(value: float, count: int = 1) -> str:
    """So many digits and an exponent.

    >>> power(0.00084), power(0.00084, 2)
    ('8e-4', '8.4e-4')
    """
    first, exponent = f"{value:.{count - 1}e}".split("e")
    return f"{first}e{int(exponent)}"


def word(count: float) -> str:
    """A small whole number as a word.

    >>> word(3.0)
    'three'
    """
    return WORDS[int(count)] if count == int(count) and 0 <= count < len(WORDS) else digits(count, 6)


def spread(values: Iterable[float]) -> float:
    """Largest less smallest over their mean."""
    known = list(values)
    return (max(known) - min(known)) / (sum(known) / len(known))


def within(value: float, count: int = 1) -> float:
    """The size of a number, rounded up to so many digits: what the number is within.

    >>> within(-0.00275), within(0.0093, 2), within(0.093, 2)
    (0.003, 0.0093, 0.093)
    """
    size = abs(value)
    rounded = float(f"{size:.{count - 1}e}")
    if rounded >= size * (1 - 1e-12) or size == 0:
        return rounded
    exponent = int(f"{rounded:e}".split("e")[1])
    return float(f"{rounded + 10.0 ** (exponent - count + 1):.{count - 1}e}")
