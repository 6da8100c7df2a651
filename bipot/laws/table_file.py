"""Two columns of numbers from a text file, with their line numbers."""

from __future__ import annotations

from pathlib import Path

from bipot.errors import SceneError, require, require_path

LARGEST = 2**22
"""Most bytes of a file that is read."""


def two_columns(
    path: str | Path, names: tuple[str, str], delimiter: str | None
) -> tuple[tuple[int, ...], tuple[float, ...], tuple[float, ...]]:
    """The numbers of a table's lines, from 1, and its two columns; ``names`` are those of these in messages.

    The first line may be a header, without a number in it. What follows a #, and empty lines, are comments. Columns are
    parted by ``delimiter``, by white space where that is None; decimals have a point.

    Raises:
        SceneError: a file that cannot be read as text or is larger than LARGEST, a line without two columns, a value
            that is no number (named with file and line), fewer than two rows of numbers.
    """
    require_path(path)
    given = delimiter is None or (isinstance(delimiter, str) and len(delimiter) == 1 and delimiter not in "#.+-\r\n")
    require(given, "delimiter", delimiter, "one character that is in no number or comment, or None")
    rows: list[tuple[int, float, float]] = []
    begun = False
    for number, line in enumerate(_text(path).splitlines(), start=1):
        text = line.partition("#")[0]
        if not text.strip():
            continue
        cells = [cell.strip().strip('"') for cell in text.split(delimiter)]
        place = f"{path}, line {number}"
        parted = "white space" if delimiter is None else f"the delimiter {delimiter!r}"
        require(len(cells) == 2, f"{place}: columns", len(cells), f"2, parted by {parted}: {' and '.join(names)}")
        header = not begun and all(_number(cell) is None for cell in cells)
        begun = True
        if not header:
            first, second = (_required(cell, f"{place}: {name}") for cell, name in zip(cells, names, strict=True))
            rows.append((number, first, second))
    require(len(rows) >= 2, f"{path}: rows of numbers", len(rows), "at least two")
    lines, first, second = zip(*rows, strict=True)
    return lines, first, second


def _text(path: str | Path) -> str:
    try:
        # A pipe or a device would be waited for, or read without end.
        if Path(path).exists() and not Path(path).is_file():
            raise SceneError(f"{path}: cannot be read as text (it is no regular file)")
        size = Path(path).stat().st_size
        require(size <= LARGEST, f"{path}: bytes", size, f"at most {LARGEST}")
        # Spreadsheets begin a file with a byte order mark.
        return Path(path).read_text(encoding="utf-8-sig")
    except SceneError:
        raise
    except (OSError, ValueError) as error:
        raise SceneError(f"{path}: cannot be read as text ({error})") from error


def _required(cell: str, field: str) -> float:
    found = _number(cell)
    require(found is not None, field, cell, "a number, with a point for decimals")
    return float(cell)


def _number(cell: str) -> float | None:
    """The cell's number, or None; 1_000 is a number to Python alone, and refused."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
