r"""The tables of the pages in ``docs``, from the results files alone.

    python -m studies.comparison_page [--results docs/results] [--write docs/comparison.md]

Prints every table; with ``--write`` puts those of the page into it, each between its ``<!-- table: NAME -->`` and the
next ``<!-- end -->``.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from bipot.errors import ResultsError
from studies import (
    comparison_tables,
    coulomb_tables,
    element_tables,
    robustness_tables,
    site_tables,
)
from studies.accuracy import block_die, clad, die, domed, total_tables
from studies.accuracy import tables as mesh_tables
from studies.command import command, say
from studies.files import replacing
from studies.fuzz import table as fuzz_table
from studies.speed_tables import MEASURES

RESULTS, PAGE = Path("docs/results"), Path("docs/comparison.md")
BLOCK = "<!-- table: {name} -->\n{table}\n<!-- end -->"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown."""
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows))


def tabled(columns: Callable[[Path], tuple[Sequence[str], Sequence[Sequence[str]]]]) -> Callable[[Path], str]:
    """Markdown of what ``columns`` finds in the results: a head and rows."""
    return lambda results: table(*columns(results))


TABLES: dict[str, Callable[[Path], str]] = {
    "optimisers": tabled(comparison_tables.of_optimisers),
    "solvers": tabled(comparison_tables.of_solvers),
    "penalty_errors": tabled(comparison_tables.of_penalty_errors),
    "penalty_fields": tabled(comparison_tables.of_penalty_fields),
    "exact_forms": tabled(comparison_tables.of_exact_forms),
    "round_off": tabled(comparison_tables.of_round_off),
    **{f"fastest_{measure}": tabled(partial(comparison_tables.of_fastest, measure=measure)) for measure in MEASURES},
    "runs": tabled(comparison_tables.of_runs),
    "meshes": tabled(comparison_tables.of_meshes),
    "scatter": tabled(comparison_tables.of_scatter),
    "total_ratio": tabled(total_tables.of_ratios),
    "total_front": tabled(total_tables.of_fronts),
    "total_same_mesh": tabled(total_tables.of_same_mesh),
    "total_stopped": tabled(total_tables.of_stopped),
    **{
        study.name: tabled(partial(comparison_tables.of_foreign, study=study))
        for study in (domed.STUDY, clad.STUDY, die.STUDY, block_die.STUDY)
    },
}
PAGES: dict[str, dict[str, Callable[[Path], str]]] = {
    "comparison.md": TABLES,
    "scenes.md": {"paced": tabled(comparison_tables.of_paced)},
    "robustness.md": {
        "faults": tabled(robustness_tables.of_faults),
        "fuzz": tabled(fuzz_table.of_outcomes),
        "coupling": tabled(robustness_tables.of_coupling),
        "landings": tabled(robustness_tables.of_landings),
        "energy": tabled(robustness_tables.of_energy),
        "corner": tabled(robustness_tables.of_corner),
    },
    "coulomb.md": {
        "solvers": tabled(coulomb_tables.of_solvers),
        "one": tabled(coulomb_tables.of_one),
    },
    "conic_set.md": {"conic_solved": tabled(site_tables.of_conic_solved)},
    "theory.md": {"convergence": tabled(site_tables.of_convergence)},
    "glossary.md": {
        "columns": tabled(site_tables.of_columns),
        "fields": tabled(site_tables.of_fields),
    },
    "benchmarks.md": {
        "space": tabled(site_tables.of_space),
        "block_ratio": tabled(partial(total_tables.of_ratios, name="block_ratio.csv")),
        "provenance": tabled(site_tables.of_provenance),
    },
    "elements.md": {
        "series": tabled(element_tables.of_series),
        "refined": tabled(element_tables.of_refined),
        "membrane": tabled(element_tables.of_membrane),
        "limits": tabled(mesh_tables.of_limits),
        "upsetting": tabled(mesh_tables.of_meshes),
        "scatter": tabled(mesh_tables.of_scatter),
        "rolling": tabled(mesh_tables.of_rolling),
        "block_pressure": tabled(mesh_tables.of_block_pressure),
        "sampling": tabled(mesh_tables.of_sampling),
    },
}


def written(page: str, results: Path, tables: dict[str, Callable[[Path], str]] = TABLES) -> str:
    """The page with its ``tables`` made anew.

    Raises:
        ResultsError: a results file or a table's place in the page is missing, or a table has no row.
    """
    for name, make in tables.items():
        place = re.compile(re.escape(f"<!-- table: {name} -->") + ".*?" + re.escape("<!-- end -->"), re.DOTALL)
        if not place.search(page):
            raise ResultsError(f"the page has no place for the table {name}: <!-- table: {name} --> ... <!-- end -->")
        text = make(results)
        if text.count("\n") < 2:
            raise ResultsError(f"the table {name} has no row: what it shows is not in {results}")
        block = BLOCK.format(name=name, table=text)
        page = place.sub(lambda found, block=block: block, page)
    return page


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the tables or write the page."""
    parser = argparse.ArgumentParser(
        prog="studies.comparison_page", description="Tables of the comparison page.", allow_abbrev=False
    )
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--write", type=Path, help="page whose tables are replaced")
    asked = parser.parse_args(argv)
    page: Path | None = asked.write
    if page is None:
        every = [item for tables in PAGES.values() for item in tables.items()]
        say("\n\n".join(BLOCK.format(name=name, table=make(asked.results)) for name, make in every))
        return 0
    if page.name not in PAGES:
        parser.error(f"--write {page}: must be one of the pages {', '.join(PAGES)}")
    text = written(page.read_text(encoding="utf-8"), asked.results, PAGES[page.name])
    with replacing(page) as part:
        part.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
