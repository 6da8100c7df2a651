"""What the figures share: style, reading of results, writing of PDF and PNG, the command line."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from bipot.errors import ResultsError
from bipot.results import History
from bipot.results import open as open_results
from paper_figs.closed_forms import Cylinder
from studies.tables import Value, read_csv

MU = (0.1, 0.3)
COMMAND = "python -m studies.upsetting --mu 0.1 0.3 --out {results}"

# Okabe and Ito: told apart by the colour-blind; line style and marker tell the curves apart in grey.
BLUE, VERMILLION, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"
COLOUR = dict(zip(MU, (BLUE, VERMILLION), strict=True))
MARKER = dict(zip(MU, ("o", "s"), strict=True))
DASHES = dict(zip(MU, (":", (0, (4, 1.2, 1, 1.2, 1, 1.2))), strict=True))

PUNCH: dict[str, Any] = {"facecolor": "0.9", "edgecolor": "0.35", "hatch": "////", "lw": 0.8}

WIDTH = 7.0
"""Of the figures that fill a page, inches."""

STYLE: dict[Any, Any] = {
    "font.size": 8.5,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "legend.fontsize": 8,
    "axes.linewidth": 0.7,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42,
    "savefig.dpi": 300,
}


def runs(results: Path) -> list[History]:
    """The complete runs ``mu0.1`` and ``mu0.3`` under ``results``.

    Raises:
        ResultsError: one is missing or incomplete; the message names the command that makes them.
    """
    command = COMMAND.format(results=results)
    found = [open_results(results / f"mu{mu:g}", command) for mu in MU]
    for run in found:
        if not run.complete:
            raise ResultsError(f"{run.folder}: the run is incomplete; run: {command}")
    return found


def friction(run: History) -> float:
    """The Coulomb coefficient of the run."""
    return float(run.scene["tools"][0]["mu"])


def punch_travel(run: History) -> float:
    """How far the modelled punch travels over the stroke, mm."""
    return abs(float(run.scene["tools"][0]["travel"][1]))


def cylinder_of(run: History) -> Cylinder:
    """The whole cylinder of which the run models a quarter."""
    radius, half_height = run.mesh.nodes.max(axis=0)
    scene = run.scene
    return Cylinder(2 * half_height, radius, scene["young"], scene["poisson"], scene["yield_stress"])


def make(draw: Callable[[list[History]], Figure], name: str, title: str, argv: Sequence[str] | None) -> None:
    """Read the results, draw, write ``name.pdf`` and ``name.png``; the whole command line of a figure."""
    parser = argparse.ArgumentParser(description=title, allow_abbrev=False)
    parser.add_argument("--results", type=Path, default=Path("results/upsetting"), help="folder of mu0.1, mu0.3")
    parser.add_argument("--out", type=Path, help="folder of the figures (default: RESULTS/figures)")
    asked = parser.parse_args(argv)
    try:
        found = runs(asked.results)
    except ResultsError as error:
        raise SystemExit(str(error)) from error
    out = asked.out or asked.results / "figures"
    with mpl.rc_context(STYLE):
        figure = draw(found)
        for path in save(figure, out, name):
            print(path)


def save(figure: Figure, out: Path, name: str) -> list[Path]:
    """Write the figure as PDF and PNG into ``out``."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        paths = [out / f"{name}.{kind}" for kind in ("pdf", "png")]
        for path in paths:
            figure.savefig(path)
    except OSError as error:
        raise SystemExit(f"{out}: cannot be written ({error})") from error
    return paths


def from_table(
    argv: Sequence[str] | None,
    about: str | None,
    name: str,
    command: str,
    draw: Callable[[list[dict[str, Value]]], Figure],
) -> None:
    """The command line of a figure drawn from ``name``.csv alone, ``fig_name``; ``command`` makes the table."""
    parser = argparse.ArgumentParser(description=(about or "").splitlines()[0], allow_abbrev=False)
    parser.add_argument("--results", type=Path, default=Path(f"results/{name}"))
    parser.add_argument("--out", type=Path, help="folder of the figure (default: RESULTS/figures)")
    asked = parser.parse_args(argv)
    try:
        rows = read_csv(asked.results / f"{name}.csv", command.format(out=asked.results))
    except ResultsError as error:
        raise SystemExit(str(error)) from error
    with mpl.rc_context(STYLE):
        for path in save(draw(rows), asked.out or asked.results / "figures", f"fig_{name}"):
            print(path)
