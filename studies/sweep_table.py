"""The table of a sweep: a row a point, with a column for the force at each asked reduction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields, make_dataclass
from functools import cache
from pathlib import Path
from typing import Any

from bipot.results import Existing
from studies.outputs import Table, opened
from studies.sweep_point import Outcome, Point, Status

KEY = ("mu", "elements")
MEASURED = [field for field in fields(Outcome) if field.name != "forces"]
TYPES = {"Status": "str"}
"""What a table holds of a field."""


def force_column(reduction: float) -> str:
    """The name of the column of the force at a reduction.

    >>> force_column(0.2)
    'force_20_N'
    """
    return f"force_{100 * reduction:g}_N"


@cache
def row_kind(at: tuple[float, ...]) -> type[Any]:
    """The dataclass of the rows of a sweep that tells the forces ``at`` these reductions."""
    columns = [("mu", "float"), ("elements", "int"), *((force_column(reduction), "float") for reduction in at)]
    columns += [(field.name, TYPES.get(str(field.type), str(field.type))) for field in MEASURED]
    return make_dataclass("Row", columns, frozen=True)


def row_of(point: Point, found: Outcome) -> Any:
    """A point with what came of it."""
    told = [getattr(found, field.name) for field in MEASURED]
    return row_kind(point.at)(*point.key, *found.forces, *(getattr(value, "value", value) for value in told))


def table_of(folder: Path, name: str, points: Sequence[Point], policy: Existing, derived: Sequence[str]) -> Table[Any]:
    """The table of the points of one sweep, which differ by their keys alone; raises as :func:`opened`."""
    first = points[0]
    shared = {name: value for name, value in first.case.parameters().items() if name not in KEY}
    return opened(
        folder,
        name,
        row_kind(first.at),
        lambda row: tuple(getattr(row, column) for column in KEY),
        policy,
        # A file's name does not tell what is in it.
        parameters=shared | {"at": first.at, "curve": repr(first.case.curve())},
        order=sorted(point.key for point in points),
        derived=derived,
    )


def missing(points: Iterable[Point], table: Table[Any]) -> list[Point]:
    """The points without a row, and those of which nothing came."""
    return [point for point in points if point.key not in table or table[point.key].status == Status.LOST.value]
