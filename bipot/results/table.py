"""The text of ``history.csv``: one line for each row, with numbers that are read back to the last digit."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bipot.errors import LARGEST_COUNT, ResultsError, require
from bipot.results.columns import Value, encodes


def require_value(value: object, name: str) -> None:
    """Refuse values that a column cannot hold, which would be stored as Python's text for them."""
    fits = encodes(value) if isinstance(value, str) else isinstance(value, int | float | np.integer | np.floating)
    shown = f"an array of shape {value.shape}" if isinstance(value, np.ndarray) else value
    require(fits and not isinstance(value, bool), f"column {name!r}", shown, "a number or a string, of every increment")
    if isinstance(value, int):
        field, small = f"column {name!r}: bits of a whole number", abs(value) <= LARGEST_COUNT
        require(small, field, value.bit_length(), "at most 63; or give a float")


def line(values: Sequence[Value]) -> str:
    """One row as a line of CSV."""
    out = io.StringIO()
    # float() first, because NumPy's scalars print their type.
    csv.writer(out).writerow([float(v) if isinstance(v, np.floating) else v for v in values])
    return out.getvalue()


def columns(text: str, place: str) -> Mapping[str, NDArray[Any]]:
    """Columns (n,) by name: integers if all are, else floats if all are, else strings.

    Raises:
        ResultsError: the text is no table; the message names the ``place`` and the row.
    """
    try:
        header, *rows = csv.reader(io.StringIO(text, newline=""))
    except (ValueError, csv.Error) as error:
        raise ResultsError(f"{place}: is no table ({error})") from error
    if not header:
        raise ResultsError(f"{place}: is no table (it has no columns)")
    if len(set(header)) != len(header):
        raise ResultsError(f"{place}: has two columns of one name among {header}")
    for number, row in enumerate(rows, 1):
        if len(row) != len(header):
            raise ResultsError(f"{place}: row {number} has {len(row)} values, and there are {len(header)} columns")
    return {name: _typed([row[k] for row in rows]) for k, name in enumerate(header)}


def _typed(texts: list[str]) -> NDArray[Any]:
    with suppress(ValueError):
        numbers = [_number(text) for text in texts]
        for kind in (int, float) if all(isinstance(number, int) for number in numbers) else (float,):
            with suppress(OverflowError):
                return np.array(numbers, dtype=kind)
    return np.array(texts, dtype=str)


def _number(text: str) -> float:
    """The number that :func:`line` writes as ``text``; ValueError for any other text, such as "007"."""
    for kind in (int, float):
        with suppress(ValueError):
            if str(number := kind(text)) == text:
                return number
    raise ValueError(text)
