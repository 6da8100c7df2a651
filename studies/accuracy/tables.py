"""What a page shows of the mesh study: heads and rows of its tables, from the results files alone."""

from __future__ import annotations

from pathlib import Path

from studies.accuracy.limits import Limit
from studies.accuracy.mesh import NAME
from studies.accuracy.row import Row
from studies.tables import read_rows

Lines = tuple[list[str], list[list[str]]]
SHOWN = (0.2, 0.45)
NONE = "–"


def of_limits(results: Path) -> Lines:
    """Limits of the force and of the radii, a row a coefficient and reduction."""
    limits = read_rows(results / "limits.csv", Limit)
    told = {(limit.mu, limit.reduction, limit.quantity): limit for limit in limits}
    quantities = list(dict.fromkeys(limit.quantity for limit in limits))
    rows = [
        [f"{mu:g}", f"{100 * reduction:g} %", *(_with_band(told.get((mu, reduction, name))) for name in quantities)]
        for mu, reduction in dict.fromkeys((limit.mu, limit.reduction) for limit in limits)
    ]
    return ["mu", "reduction", *map(_in_words, quantities)], rows


def _in_words(quantity: str) -> str:
    name, unit = quantity.rsplit("_", 1)
    return f"{name.replace('_', ' ')} [{unit}]"


def _with_band(limit: Limit | None) -> str:
    return NONE if limit is None else f"{limit.value:.6g} ({100 * limit.band / limit.value:.2f} %)"


def of_meshes(results: Path) -> Lines:
    """Force and evenness of the pressure, a row a mesh."""
    rows = read_rows(results / f"{NAME}.csv", Row)
    found = {(row.element, row.elements, row.mu, row.reduction): row for row in rows}
    columns = [(mu, part) for mu in sorted({row.mu for row in rows if row.mu > 0}) for part in SHOWN]
    head = [f"mu {mu:g}, {100 * part:g} %: {what}" for mu, part in columns for what in ("force [N]", "line")]
    meshes = dict.fromkeys((row.element, row.elements) for row in sorted(rows, key=lambda row: row.elements))
    lines = list[list[str]]()
    for element in dict.fromkeys(element for element, _ in meshes):
        for side in (side for of, side in meshes if of == element):
            cells = [_shown(found.get((element, side, *column))) for column in columns]
            lines.append([element, str(side), *(cell for pair in cells for cell in pair)])
    return ["element", "a side", *head], lines


def _shown(row: Row | None) -> tuple[str, str]:
    return (NONE, NONE) if row is None else (f"{row.force_N:.0f}", f"{row.line:.3f}")
