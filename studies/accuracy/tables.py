"""What a page shows of the mesh study: heads and rows of its tables, from the results files alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from bipot.tools.tool import Sampling
from studies.accuracy import block_pressure, rolling
from studies.accuracy.limits import Limit
from studies.accuracy.mesh import NAME
from studies.accuracy.row import Row
from studies.accuracy.scatter import Scatter
from studies.tables import read_rows

Lines = tuple[list[str], list[list[str]]]
Mesh = tuple[str, str, str, int]
SHOWN = (0.2, 0.45)
BESIDE = 0.4
"""Reduction at which both samplings are shown: the last that nearly all runs come to."""

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
    found = {(*_mesh(row), row.mu, row.reduction): row for row in rows}
    columns = [(mu, part) for mu in sorted({row.mu for row in rows if row.mu > 0}) for part in SHOWN]
    head = [f"mu {mu:g}, {100 * part:g} %: {what}" for mu, part in columns for what in ("force [N]", "line")]
    lines = list[list[str]]()
    for mesh in _by_series(rows):
        cells = [_shown(found.get((*mesh, *column))) for column in columns]
        lines.append([*map(str, mesh), *(cell for pair in cells for cell in pair)])
    return ["element", "layout", "contact", "a side", *head], lines


def of_sampling(results: Path) -> Lines:
    """Where both were run, contact at nodes beside that in weighted means: what pressures do, and edges in between."""
    rows = read_rows(results / f"{NAME}.csv", Row)
    limits = {
        (one.mu, one.reduction): one.value
        for one in read_rows(results / "limits.csv", Limit)
        if one.quantity == "force_N"
    }
    both = {row.of for row in rows if row.of.sampling is Sampling.WEIGHTED}
    both |= {of._replace(sampling=Sampling.NODES) for of in both}
    found = {(*_mesh(row), row.mu): row for row in rows if row.reduction == BESIDE and row.of in both}
    told = ("force from its limit", "least and largest pressure [MPa]", "overlap [mm]")
    columns = sorted({mu for mu, _ in limits})
    head = [f"mu {mu:g}: {what}" for mu in columns for what in told]
    lines = list[list[str]]()
    for mesh in _by_series(list(found.values())):
        cells = [_beside(found.get((*mesh, mu)), limits[mu, BESIDE]) for mu in columns]
        lines.append([*map(str, mesh), *(cell for told in cells for cell in told)])
    return ["element", "layout", "contact", "a side", *head], lines


def _beside(row: Row | None, limit: float) -> tuple[str, str, str]:
    if row is None:
        return NONE, NONE, NONE
    off = 100 * (row.force_N / limit - 1)
    return f"{off:+.2f} %", f"{row.p_min_MPa:.0f}, {row.p_max_MPa:.0f}", f"{row.overlap_mm:.1g}"


def of_scatter(results: Path) -> Lines:
    """Landings and the largest jump of the force at the largest coefficient, a row a mesh that comes to the end."""
    rows = read_rows(results / "scatter.csv", Scatter)
    shown = [row for row in rows if row.mu == max(row.mu for row in rows)]
    found = {_mesh(row): row for row in shown}
    lines = [
        [*map(str, mesh), f"{100 * row.first_landing:.1f} %", str(row.landings), f"{100 * row.scatter:.1f} %"]
        for mesh in _by_series(shown)
        for row in [found[mesh]]
    ]
    return ["element", "layout", "contact", "a side", "first landing", "nodes landed", "largest jump"], lines


def of_rolling(results: Path) -> Lines:
    """The same of meshes that are fine where the side lands, how far the force is off, and what the run costs."""
    head = ["along the radius", "along the side", "of these fine", "first landing", "nodes landed", "largest jump"]
    head += ["force off at 20 %", "at 45 %", "passes an increment", "cuts", "conic increments"]
    lines = [
        [
            *map(str, (row.radial, row.axial, row.fine)),
            f"{100 * row.first_landing:.1f} %",
            str(row.landings),
            f"{100 * row.scatter:.2f} %",
            *(f"{100 * off:+.2f} %" for off in (row.off_20, row.off_45)),
            f"{row.passes / row.increments:.1f}",
            str(row.cuts),
            str(row.fallbacks),
        ]
        for row in read_rows(results / f"{rolling.NAME}.csv", rolling.Row)
    ]
    return head, lines


def of_block_pressure(results: Path) -> Lines:
    """Pressure on the upper face of the cube: where runs end, and the largest values on the way."""
    head = ["mu", "layout", "a side", "reached", "line", "edge", "inner", "written"]
    head += [f"largest {name}" for name in head[4:]]
    head += ["least Jacobian", "passes an increment"]
    lines = [
        [
            f"{row.mu:g}",
            row.layout,
            str(row.elements),
            f"{100 * row.reached:.1f} %",
            *map(_three, (row.line, row.edge, row.inner, row.written)),
            f"{_three(row.largest_line)} at {100 * row.at:.0f} %",
            *map(_three, (row.largest_edge, row.largest_inner, row.largest_written)),
            # Zero to round-off where the corner lies down on the platen.
            _three(round(row.min_jacobian, 9) + 0.0),
            f"{row.passes_an_increment:.1f}",
        ]
        for row in read_rows(results / f"{block_pressure.NAME}.csv", block_pressure.Row)
    ]
    return head, lines


def _three(value: float) -> str:
    """Three digits, or what stands for none."""
    return f"{value:.3g}" if math.isfinite(value) else NONE


def _by_series(rows: Sequence[Row] | Sequence[Scatter]) -> list[Mesh]:
    """Every mesh: series after series, each from coarse to fine."""
    meshes = dict.fromkeys(map(_mesh, rows))
    series = list(dict.fromkeys(mesh[:-1] for mesh in meshes))
    return sorted(meshes, key=lambda mesh: (series.index(mesh[:-1]), mesh[-1]))


def _mesh(row: Row | Scatter) -> Mesh:
    """Element, layout, sampling of contact and elements a side."""
    return row.element, row.layout, row.sampling, row.elements


def _shown(row: Row | None) -> tuple[str, str]:
    return (NONE, NONE) if row is None else (f"{row.force_N:.0f}", f"{row.line:.3f}")
