"""What a page shows of the element types: heads and rows of its tables, from the results file alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from bipot.errors import ResultsError
from studies.element_types import ElementType
from studies.elements import NAME, REFINED, Order, Row, orders
from studies.tables import read_rows

Lines = tuple[list[str], list[list[str]]]
ELASTIC = "cook"
"""How names of problems that are no limit loads begin."""


def of_series(results: Path) -> Lines:
    """Errors of the extrapolated limit loads, and the orders."""
    found = [order for order in orders(_rows(results)) if not order.problem.startswith(ELASTIC)]
    shown = [f"{_percent(order.error)} ({order.order:.2f})".removesuffix(" (nan)") for order in found]
    return _table(found, {(_of(order), order.problem): cell for order, cell in zip(found, shown, strict=True)})


def of_refined(results: Path) -> Lines:
    """Errors of the limit loads on refined meshes."""
    found = [row for row in _rows(results) if row.n == REFINED]
    return _table(found, {(_of(row), row.problem): _percent(row.error) for row in found})


def of_membrane(results: Path) -> Lines:
    """Deflections of Cook's membranes on the meshes of a series, and extrapolated."""
    rows = [row for row in _rows(results) if row.problem.startswith(ELASTIC)]
    problems, grids = (list(dict.fromkeys(getattr(row, name) for row in rows)) for name in ("problem", "n"))
    cells = {(_of(row), row.problem, row.n): row.value for row in rows}
    cells |= {(_of(order), order.problem, None): order.extrapolated for order in orders(rows)}
    head = [f"{problem}, {f'n = {n}' if n else 'extrapolated'}" for problem in problems for n in (*grids, None)]
    shown = [
        [of, *(_number(cells[of, problem, n]) for problem in problems for n in (*grids, None))]
        for of in dict.fromkeys(map(_of, rows))
    ]
    return ["element", *head], shown


def _table(lines: Sequence[Row | Order], cells: dict[tuple[str, str], str]) -> Lines:
    """A row an element with its rule, a column a problem."""
    problems = list(dict.fromkeys(line.problem for line in lines))
    rows = [[of, *(cells[of, problem] for problem in problems)] for of in dict.fromkeys(map(_of, lines))]
    return ["element", *problems], rows


def _of(line: Row | Order) -> str:
    """The element, with its rule where that is not its own."""
    own = line.quadrature == ElementType(line.element).quadrature.value
    return line.element if own else f"{line.element}, {line.quadrature}"


def _percent(error: float) -> str:
    if math.isinf(error):
        return "locks"
    return "–" if math.isnan(error) else f"{100 * error:+.3f} %"


def _number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.4f}"


def _rows(results: Path) -> list[Row]:
    path = results / f"{NAME}.csv"
    if not path.is_file():
        raise ResultsError(f"{path}: no results; run: python -m studies.{NAME} --out {results}")
    return read_rows(path, Row)
