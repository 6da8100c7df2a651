"""``history.csv`` as a text: a line a row, read back to the last digit."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bipot.results.columns import Value
from bipot.errors import ResultsError


def line(values: Sequence[Value]) -> str:
    """One row as a line of CSV."""
    out = io.StringIO()
    # float() first, because NumPy's scalars print their type.
    csv.writer(out).writerow([float(v) if isinstance(v, np.floating) else v for v in values])
    return out.getvalue()


def columns(text: str, place: str) -> Mapping[str, NDArray[Any]]:
    """Columns (n,) by name: integers if all are, else floats if all are, else strings.

    Raises:
        ResultsError: no table, naming the ``place`` and the row.
    """
    try:
        header, *rows = csv.reader(io.StringIO(text, newline=""))
    except (ValueError, csv.Error) as error:
        raise ResultsError(f"{place}: is no table ({error})") from error
    if len(set(header)) != len(header):
        raise ResultsError(f"{place}: has two columns of one name among {header}")
    for number, row in enumerate(rows, 1):
        if len(row) != len(header):
            raise ResultsError(f"{place}: row {number} has {len(row)} values, and there are {len(header)} columns")
    return {name: _typed([row[k] for row in rows]) for k, name in enumerate(header)}


def _typed(texts: list[str]) -> NDArray[Any]:
    for kind in (int, float):
        try:
            return np.array([kind(text) for text in texts], dtype=kind)
        except (ValueError, OverflowError):
            continue
    return np.array(texts, dtype=str)
