r"""Recovered contact pressure along the punch by quadrature rule, and how its oscillation falls with the mesh.

Above the edge means, in the middle the nodal values of the consistent mass, which leave sign and cone and whose
oscillation is measured below.

python -m paper_figs.fig_corner [--results results/corner] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from bipot.errors import ResultsError
from bipot.fem.elements import Quadrature
from paper_figs.common import BLUE, GREEN, VERMILLION, WIDTH, from_results, lettered
from studies.corner import COMMAND, NAME, curve_name
from studies.outputs import read_curves
from studies.tables import Value, read_csv

Rows = list[dict[str, Value]]

LOOKS: dict[Quadrature, dict[str, Any]] = {
    Quadrature.RADON7: {"color": VERMILLION, "ls": "-", "marker": "o"},
    Quadrature.GAUSS3: {"color": GREEN, "ls": "--", "marker": "^"},
    Quadrature.GAUSS2: {"color": BLUE, "ls": "-", "marker": "s"},
}
WORDS = {Quadrature.RADON7: "7 points", Quadrature.GAUSS3: "3 x 3", Quadrature.GAUSS2: "2 x 2"}
MEASURES = {"line": "contact line", "inside": "inside"}
FILLS: dict[str, Any] = {"line": "full", "inside": "none"}


def draw(rows: Rows, profiles: Path) -> Figure:
    """A column a coefficient: edge means and nodal pressure on the middle mesh, oscillations over the mesh below."""
    mus = sorted({float(row["mu"]) for row in rows})
    meshes = sorted({int(row["elements"]) for row in rows})
    figure = Figure(figsize=(WIDTH, 7.4), layout="constrained")
    axes = figure.subplots(3, len(mus), squeeze=False)
    shown = meshes[len(meshes) // 2]
    for column, mu in enumerate(mus):
        top, middle, bottom = axes[:, column]
        edge_means(top, profiles, mu, shown)
        nodal(middle, profiles, mu, shown)
        oscillations(bottom, [row for row in rows if row["mu"] == mu])
        top.set(ylim=(0, None), title=rf"$\mu$ = {mu:g}, {shown} elements a side")
        middle.axhline(0, color="0.5", lw=0.5, zorder=0)
        middle.set(xlabel="radius [mm]", xlim=top.get_xlim())
        top.tick_params(labelbottom=False)
        bottom.set(xlabel="elements a side")
        bottom.set_xticks(meshes, [str(n) for n in meshes])
        bottom.xaxis.set_minor_formatter(NullFormatter())
    lettered(axes.flat)
    axes[0, 0].set_ylabel("recovered pressure,\nedge means [MPa]")
    axes[1, 0].set_ylabel("recovered pressure, nodal\nby consistent mass [MPa]")
    axes[2, 0].set_ylabel("oscillation, relative")
    figure.legend(*axes[1, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    axes[2, 0].legend(*_measure_keys(), loc="best")
    return figure


def edge_means(ax: Axes, profiles: Path, mu: float, elements: int) -> None:
    """Mean pressure over each edge as steps, a line a rule, marked in the middle of the edges."""
    for rule, along in _profiles(profiles, mu, elements):
        look, ends, mean = LOOKS[rule], along["ends"], along["mean_pressure"]
        steps = np.append(ends[:, 0], ends[-1, 1])
        ax.stairs(mean, steps, baseline=None, lw=1.2, color=look["color"], ls=look["ls"])
        ax.plot(ends.mean(axis=1), mean, ms=3.5, ls="", marker=look["marker"], color=look["color"])
    ax.margins(y=0.1)


def nodal(ax: Axes, profiles: Path, mu: float, elements: int) -> None:
    """Nodal pressure by the consistent mass over radius, a line a rule."""
    for rule, along in _profiles(profiles, mu, elements):
        ax.plot(along["radius"], along["consistent_pressure"], ms=3, lw=0.9, label=WORDS[rule], **LOOKS[rule])


def _profiles(profiles: Path, mu: float, elements: int) -> Iterator[tuple[Quadrature, dict[str, Any]]]:
    """The arrays of each rule's profile."""
    curves = read_curves(profiles)
    for rule in LOOKS:
        yield rule, curves[curve_name(mu, rule.value, elements)]


def oscillations(ax: Axes, rows: Rows) -> None:
    """Both measures over the elements a side: full markers on the contact line, hollow ones inside."""
    for rule, look in LOOKS.items():
        chosen = [row for row in rows if row["quadrature"] == rule.value]
        for measure, fill in FILLS.items():
            pairs = np.array([[row["elements"], row[measure]] for row in chosen], dtype=float)
            ax.loglog(*pairs.T, ms=4, lw=0.9, fillstyle=fill, **look)


def _measure_keys() -> tuple[list[Any], list[str]]:
    """Handles and words that say what full and hollow markers are."""
    handles = [Line2D([], [], color="black", marker="o", ls="", ms=4, fillstyle=f) for f in FILLS.values()]
    return handles, list(MEASURES.values())


def figures(results: Path) -> dict[str, Figure]:
    """The one, by its name."""
    command, profiles = COMMAND.format(out=results), results / f"{NAME}.h5"
    rows = read_csv(results / f"{NAME}.csv", command)
    if not profiles.is_file():
        raise ResultsError(f"{profiles}: no results; run: {command}")
    return {f"fig_{NAME}": draw(rows, profiles)}


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    from_results(argv, __doc__, f"results/{NAME}", figures)


if __name__ == "__main__":
    main()
