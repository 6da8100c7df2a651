"""What the figures share: style, writing of PDF and PNG, the command line of those drawn from a folder of results."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path
from string import ascii_lowercase
from typing import Any, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bipot.errors import BipotError, ResultsError
from bipot.fem.reduction import Geometry
from bipot.results import History
from paper_figs.stamp import KEY, stamp
from studies.tables import Value, read_csv, read_rows

Row = TypeVar("Row")

# Okabe and Ito: told apart by the colour-blind; line style and marker tell the curves apart in grey.
BLUE, VERMILLION, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"

PUNCH: dict[str, Any] = {"facecolor": "0.9", "edgecolor": "0.35", "hatch": "////", "lw": 0.8}

LANDED: dict[str, Any] = {"ls": "", "marker": "v", "ms": 6, "mew": 0.9, "mfc": "#F0E442", "mec": "black", "zorder": 5}
"""Where nodes of the side have come onto the punch."""

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


def letters() -> Iterator[str]:
    """Of panels: a, b, .. z, a1, b1, .."""
    return (f"{letter}{turn or ''}" for turn in count() for letter in ascii_lowercase)


def lettered(axes: Iterable[Axes]) -> None:
    """Put a letter before the title of every panel, in their order."""
    for letter, ax in zip(letters(), axes, strict=False):
        ax.set_title(f"({letter}) {ax.get_title()}".rstrip())


def legend_below(figure: Figure, handles: Sequence[Any], columns: int) -> None:
    """A legend of labelled handles below the panels, in as many of these columns as stand side by side."""
    for side_by_side in range(columns, 0, -1):
        legend = figure.legend(handles=handles, loc="outside lower center", ncols=side_by_side)
        if side_by_side == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def require_run(run: History, study: str, geometry: Geometry, columns: Sequence[str], bounds: Sequence[str]) -> None:
    """Refuse a run of another kind than a figure is made of, by its file and what it lacks.

    It needs one tool, the ``geometry``, ``columns`` of its table, and ``bounds``, the names of boundaries.
    """
    tools, known = run.scene.get("tools"), run.mesh.boundaries
    has = {
        "a single tool": isinstance(tools, list) and len(tools) == 1,
        f"the geometry {geometry.value}": run.geometry is geometry,
        **{f"the column {name}": name in run.columns for name in columns},
        **{f"the boundary {name}": name in known for name in bounds},
    }
    lacks = ", ".join(what for what, there in has.items() if not there)
    if lacks:
        raise ResultsError(f"{run.file}: is no run of {study}, of which this figure is made: lacks {lacks}")


def save(figure: Figure, out: Path, name: str) -> list[Path]:
    """Write the figure as PDF and PNG into ``out``; the PNG says by its stamp what it shows."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        paths = [out / f"{name}.{kind}" for kind in ("pdf", "png")]
        for path in paths:
            figure.savefig(path, metadata={KEY: stamp(figure)} if path.suffix == ".png" else None)
    except OSError as error:
        raise SystemExit(f"{out}: cannot be written ({error})") from error
    return paths


def from_results(
    argv: Sequence[str] | None,
    about: str | None,
    folder: str,
    figures: Callable[[Path], Mapping[str, Figure]],
    holds: str = "folder of the study",
) -> None:
    """The command line of figures drawn from a folder that ``holds`` results, each written by its name.

    ``figures`` makes them from the folder; where it raises an error of the library, that is the one sentence said.
    """
    parser = argparse.ArgumentParser(description=(about or "").splitlines()[0], allow_abbrev=False)
    parser.add_argument("--results", type=Path, default=Path(folder), help=f"{holds} (default: {folder})")
    parser.add_argument("--out", type=Path, help="folder of the figures (default: RESULTS/figures)")
    asked = parser.parse_args(argv)
    try:
        with mpl.rc_context(STYLE):
            for name, figure in figures(asked.results).items():
                for path in save(figure, asked.out or asked.results / "figures", name):
                    print(path)
    except BipotError as error:
        raise SystemExit(str(error)) from error


def from_table(
    argv: Sequence[str] | None,
    about: str | None,
    name: str,
    command: str,
    draw: Callable[[list[dict[str, Value]]], Figure],
) -> None:
    """The command line of a figure drawn from ``name``.csv alone, ``fig_name``; ``command`` makes the table."""

    def figures(results: Path) -> dict[str, Figure]:
        return {f"fig_{name}": draw(read_csv(results / f"{name}.csv", command.format(out=results)))}

    from_results(argv, about, f"results/{name}", figures)


def rows_of(path: Path, kind: type[Row], command: str) -> list[Row]:
    """Rows of a dataclass from a table that ``command`` makes.

    Raises:
        ResultsError: there are none, and the message names the command; or it is no such table.
    """
    rows = read_rows(path, kind)
    if not rows:
        raise ResultsError(f"{path}: no results; run: {command.format(out=path.parent)}")
    return rows
