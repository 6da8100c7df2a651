"""Results as tables: rows of one dataclass, written to CSV and HDF5 as they come."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from bipot.errors import ResultsError
from studies.files import replacing

Value = float | int | str
Row = TypeVar("Row")


def write_csv(path: Path, rows: Sequence[Any]) -> None:
    """All rows (dataclasses of one kind), replacing what was there in one step; numbers are exact when read again.

    Raises:
        ResultsError: the file cannot be written.
    """
    if not rows:
        return
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(f.name for f in fields(rows[0]))
        out.writerows([_plain(v) for v in asdict(row).values()] for row in rows)


def write_hdf5(path: Path, rows: Sequence[Any], curves: dict[str, dict[str, Any]]) -> None:
    """The same columns as datasets of ``table``, and arrays by name under ``curves``, replacing what was there.

    Raises:
        ResultsError: the file cannot be written.
    """
    # In memory first: what HDF5 does on a full disk is no OSError, and not always an end.
    made = io.BytesIO()
    with h5py.File(made, "w") as file:
        group = file.create_group("table")
        for f in fields(rows[0]):
            column = [getattr(row, f.name) for row in rows]
            group[f.name] = np.array(column, dtype=object if isinstance(column[0], str) else None)
        for name, arrays in curves.items():
            for key, array in arrays.items():
                file[f"curves/{name}/{key}"] = array
    with replacing(path) as part:
        part.write_bytes(made.getbuffer())


def read_csv(path: Path, command: str) -> list[dict[str, Value]]:
    """Rows as dictionaries, numbers as numbers.

    Raises:
        ResultsError: no such file; the message names the ``command`` that makes it.
    """
    if not path.is_file():
        raise ResultsError(f"{path}: no results; run: {command}")
    with path.open(newline="", encoding="utf-8") as file:
        return [{k: _typed(v) for k, v in row.items()} for row in csv.DictReader(file)]


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """Rows of a dataclass of numbers and strings, as :func:`write_csv` wrote them; none where there is no file."""
    if not path.is_file():
        return []
    kinds = {f.name: {"int": int, "float": float}.get(str(f.type), str) for f in fields(kind)}  # type: ignore[arg-type]
    with path.open(newline="", encoding="utf-8") as file:
        return [kind(**{k: kinds[k](v) for k, v in row.items()}) for row in csv.DictReader(file)]


def text(rows: Sequence[Any], names: Sequence[str]) -> str:
    """Chosen columns as one reads them."""
    lines = [" ".join(f"{name:>11}" for name in names)]
    for row in rows:
        values = [getattr(row, name) for name in names]
        lines.append(" ".join(f"{v[:40]:>11}" if isinstance(v, str) else f"{v:>11.6g}" for v in values))
    return "\n".join(lines)


def _plain(value: Any) -> Value:
    # The shortest text that is the same number again; float() first, because NumPy's scalars print their type.
    return repr(float(value)) if isinstance(value, float) else value


def _typed(text: str) -> Value:
    try:
        return float(text)
    except ValueError:
        return text
