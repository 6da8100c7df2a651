r"""Errors of the verification suite over the mesh, a figure a case with a series; dashed: what is allowed.

python -m paper_figs.fig_verification [--results results/verification] [--out DIR]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

from bipot.errors import ResultsError
from paper_figs.common import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, VERMILLION, WIDTH
from paper_figs.stamp import KEY, stamp
from studies.tables import read_rows
from studies.verification.case import Case, Row
from studies.verification.cases import all_cases
from studies.verification.page import NAME, RUN

COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, GREY)
MARKERS = "os^Dv<>PXph*"
MOST = 4
"""Tolerances that are drawn each by its line."""

HEIGHT, LINE = 2.9, 0.17
"""Inches: of a figure, and of a line of its legend, which may ask for more."""


def draw(case: Case, rows: Sequence[Row]) -> Figure:
    """Absolute errors of a case, over what is allowed where this is many things; of bounds where they are missed."""
    shown = [asked for asked in case.asked if any(row.error for row in _of(asked.quantity, rows))]
    figure = Figure(figsize=(WIDTH, max(HEIGHT, LINE * len(shown))), layout="constrained")
    ax = figure.subplots()
    tolerances = {asked.tolerance for asked in shown}
    over = len(tolerances) > MOST and 0.0 not in tolerances
    for number, asked in enumerate(shown):
        own, unit = _of(asked.quantity, rows), asked.tolerance if over else 1.0
        style = {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)], "ms": 4.5}
        ax.plot([r.mesh for r in own], [abs(r.error) / unit or math.nan for r in own], label=asked.quantity, **style)
    for tolerance in [1.0] if over else sorted(tolerances - {0.0}):
        ax.axhline(tolerance, color=GREY, ls="--", lw=0.9)
        ax.annotate(
            "allowed", (1.0, tolerance), xycoords=("axes fraction", "data"), ha="right", va="bottom", color=GREY
        )
    if any(row.error == 0 for asked in shown for row in _of(asked.quantity, rows)):
        ax.text(0.02, 0.03, "errors of zero are not drawn", transform=ax.transAxes, color=GREY, fontsize=7)
    ax.margins(y=0.12)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xticks(case.meshes, [str(mesh) for mesh in case.meshes])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(case.counted)
    ax.set_ylabel("error over what is allowed" if over else "error")
    ax.grid(True, lw=0.4, color="0.9")
    figure.legend(loc="outside right upper")
    return figure


def _of(quantity: str, rows: Sequence[Row]) -> list[Row]:
    return sorted((row for row in rows if row.quantity == quantity), key=lambda row: row.mesh)


def figures(rows: Sequence[Row]) -> Iterator[tuple[str, Figure]]:
    """Of every case in the rows that has more than one mesh, with its name."""
    for case in all_cases():
        own = [row for row in rows if row.case == case.name]
        if len({row.mesh for row in own}) > 1:
            yield case.name, draw(case, own)


def main(argv: Sequence[str] | None = None) -> None:
    """Draw every case of the table that has more than one mesh."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0], allow_abbrev=False)
    parser.add_argument("--results", type=Path, default=Path(f"results/{NAME}"))
    parser.add_argument("--out", type=Path, help="folder of the figures (default: RESULTS/figures)")
    asked = parser.parse_args(argv)
    path, out = asked.results / f"{NAME}.csv", asked.out or asked.results / "figures"
    try:
        rows = read_rows(path, Row)
    except ResultsError as error:
        raise SystemExit(str(error)) from error
    if not rows:
        raise SystemExit(f"{path}: no results; run: {RUN} --out {asked.results}")
    out.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for name, figure in figures(rows):
            figure.savefig(out / f"{name}.png", dpi=130, metadata={KEY: stamp(figure)})
            print(out / f"{name}.png")


if __name__ == "__main__":
    main()
