"""Results as tables: rows of one dataclass, written to CSV and HDF5 as they come."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, fields
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from bipot.errors import ResultsError
from studies.files import replacing

LARGEST, MOST = 2**24, 300_000
"""Bytes and values of a table that is read."""

Value = float | int | str
Row = TypeVar("Row")


def write_csv(path: Path, rows: Sequence[Any]) -> None:
    """All rows (dataclasses of one kind), replacing what was there in one step; numbers are exact when read again.

    Raises:
        ResultsError: the file cannot be written.
    """
    if not rows:
        return
    content = StringIO(newline="")
    out = csv.writer(content)
    out.writerow(f.name for f in fields(rows[0]))
    out.writerows([_plain(v) for v in asdict(row).values()] for row in rows)
    _write(path, content.getvalue().encode())


def write_hdf5(path: Path, rows: Sequence[Any], curves: dict[str, dict[str, Any]]) -> None:
    """The same columns as datasets of ``table``, and arrays by name under ``curves``.

    Raises:
        ResultsError: the file cannot be written.
    """
    content = BytesIO()
    with h5py.File(content, "w") as file:
        group = file.create_group("table")
        for f in fields(rows[0]):
            column = [getattr(row, f.name) for row in rows]
            group[f.name] = np.array(column, dtype=object if isinstance(column[0], str) else None)
        for name, arrays in curves.items():
            for key, array in arrays.items():
                file[f"curves/{name}/{key}"] = array
    _write(path, content.getvalue())


def _write(path: Path, content: bytes) -> None:
    with replacing(path) as part:
        part.write_bytes(content)


def read_csv(path: Path, command: str) -> list[dict[str, Value]]:
    """Rows as dictionaries, numbers as numbers.

    Raises:
        ResultsError: no such file, and the message names the ``command`` that makes it; or no table, by file and line.
            When a row is asked for a column that the table has not, by file and column.
    """
    if not path.is_file():
        raise ResultsError(f"{path}: no results; run: {command}")
    header, lines = _lines(path)
    return [_Line(path, command, zip(header, map(_typed, values), strict=True)) for _, values in lines]


class _Line(dict[str, Value]):
    """The values of a line of a table by their columns; one that it has not is refused by the table's ``path``."""

    def __init__(self, path: Path, command: str, values: Iterable[tuple[str, Value]]) -> None:
        super().__init__(values)
        self.path, self.command = path, command

    def __missing__(self, name: str) -> Value:
        raise ResultsError(
            f"{self.path}: has no column {name!r}: it is of another study or version; run: {self.command}"
        )


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """Rows of a dataclass of numbers and strings, as :func:`write_csv` wrote them; none where there is no file.

    Raises:
        ResultsError: it is none of these rows; names file, line, field and value.
    """
    if not path.exists():
        return []
    kinds = {f.name: {"int": int, "float": float}.get(str(f.type), str) for f in fields(kind)}  # type: ignore[arg-type]
    header, lines = _lines(path)
    if header != list(kinds):
        raise ResultsError(f"{path}, line 1: columns {header!s:.200}: must be {list(kinds)}")
    rows = []
    for number, values in lines:
        row = zip(kinds.items(), values, strict=True)
        rows.append(kind(**{name: _of(own, value, f"{path}, line {number}: {name}") for (name, own), value in row}))
    return rows


def _of(kind: Callable[[str], Value], value: str, field: str) -> Value:
    try:
        return kind(value)
    except ValueError as failure:
        raise ResultsError(f"{field} = {value:.40}: must be of type {kind.__name__}") from failure


def _lines(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Names of the columns, and the values of every row by the number of its line."""
    if not path.is_file() or path.stat().st_size > LARGEST:
        found = f"of {path.stat().st_size} bytes" if path.is_file() else "no file"
        raise ResultsError(f"{path}: is {found}: must be a table of at most {LARGEST} bytes")
    lines: list[tuple[int, list[str]]] = []
    count = number = 0
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.reader(file, strict=True)
            for values in filter(None, reader):
                number, count = reader.line_num, count + len(values)
                if count > MOST or any("\0" in value for value in values):
                    words = f"more than {MOST} values" if count > MOST else "a null character"
                    raise ResultsError(f"{path}, line {number}: {words}: must be a table of text with at most {MOST}")
                lines.append((number, values))
    except (OSError, ValueError, csv.Error) as error:
        raise ResultsError(f"{path}, line {number + 1}: cannot be read ({error})") from error
    header = lines.pop(0)[1] if lines else []
    if not header or len(set(header)) != len(header):
        raise ResultsError(f"{path}, line 1: columns {header!s:.200}: must be names, each once")
    for number, values in lines:
        if len(values) != len(header):
            raise ResultsError(f"{path}, line {number}: {len(values)} values: must be {len(header)}, one a column")
    return header, lines


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
