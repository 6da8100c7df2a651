"""Tables of the documentation that are no study's own: the columns of a history, and where results were made."""

from __future__ import annotations

from pathlib import Path

from bipot.errors import ResultsError
from bipot.results.names import FIELDS, FIXED
from studies import conic_profiles, provenance
from studies.performance import TOLERANCES, solved_table
from studies.tables import read_csv, read_rows
from studies.upsetting_columns import history_columns

UNKNOWN = "not stored"
SHOWN = (("elements", 5), ("elements", 10), ("elements", 20), ("increments", 15), ("increments", 120))
"""Knobs and their values in the table of what mesh and increments cost."""


def of_convergence(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: the force at two reductions over the mesh, and over the increments on 10 x 10."""
    lines = read_csv(results / "convergence.csv", f"python -m studies.convergence --out {results}")
    found = {(line["mu"], line["knob"], line["value"]): line for line in lines}
    named = {"elements": "{0} x {0}", "increments": "10 x 10 in {0} increments"}
    rows = [
        [f"{mu:g}, {reduction} %", *(f"{found[mu, *knob][f'force_{reduction}_N']:.0f}" for knob in SHOWN)]
        for reduction in (20, 45)
        for mu in dict.fromkeys(line["mu"] for line in lines)
    ]
    return ["mu", *(named[knob].format(value) for knob, value in SHOWN)], rows


def of_space(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: what a march in space costs, by coefficient and mesh."""
    head = ["mu", "to", "layout", "elements a side", "unknowns", "contacts", "passes an increment", "kappa [s]"]
    head += ["pass / kappa", "s", "peak [MB]", "growth of a pass", "of a factorisation"]
    counts = "elements", "unknowns", "contacts"
    places = {"passes_an_increment": ".2f", "kappa_s": ".3f", "pass_over_kappa": ".2f", "seconds": ".0f"}
    places |= {"peak_MB": ".0f", "time_growth": ".2f", "factorisation_growth": ".2f"}
    rows = [
        [
            f"{line['mu']:g}",
            f"{100 * float(line['reduction']):.0f} %",
            line["layout"],
            *(f"{line[name]:.0f}" for name in counts),
            *("–" if line[name] != line[name] else f"{line[name]:{digits}}" for name, digits in places.items()),
        ]
        for line in read_csv(results / "space.csv", f"python -m benchmarks.space --out {results}")
    ]
    return head, rows


def of_columns(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: every column of the main study's histories, with its meaning."""
    return ["column", "meaning"], [[f"`{column.name}`", column.meaning] for column in history_columns(1.0)]


def of_fields(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: every field of a run by place and name, with what it is."""
    rows = [
        [f"`{name}`", place.value, field.rank.value, field.quantity.value, field.meaning]
        for place, fields in FIELDS.items()
        for name, field in {**fields, **FIXED[place]}.items()
    ]
    return ["field", "at", "rank", "quantity", "meaning"], rows


def of_conic_solved(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: how many programs of the conic test set each solver solves at each tolerance."""
    rows = read_rows(results / "conic_solved.csv", conic_profiles.Row)
    shown = [line[: 1 + len(TOLERANCES)] for line in solved_table(rows)]
    return ["solver", *(f"{tol:.0e}" for tol in TOLERANCES)], shown


def of_provenance(results: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows: day, commit, machine and versions of every table.

    Raises:
        ResultsError: a table has no row.
    """
    rows = provenance.stored(results)
    if missing := [name for name in provenance.tables(results) if name not in rows]:
        raise ResultsError(f"{results / missing[0]}: has no row in {provenance.NAME}.csv: see studies.provenance")
    head = ["table", "day", "commit", "machine", "versions"]
    return head, [
        [f"[{row.table}](results/{row.table})", row.day, row.commit, row.machine or UNKNOWN, row.versions or UNKNOWN]
        for row in rows.values()
    ]
