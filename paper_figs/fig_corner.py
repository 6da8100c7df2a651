r"""Contact pressure along the punch by quadrature rule, and how its oscillation falls with the mesh.

python -m paper_figs.fig_corner [--results results/corner] [--out DIR]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from bipot.errors import ResultsError
from bipot.fem.elements import Quadrature
from paper_figs.common import BLUE, GREEN, STYLE, VERMILLION, WIDTH, save
from studies.corner import COMMAND, NAME, curve_name
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
    """A column a coefficient: pressure on the middle mesh above, oscillations over the mesh below."""
    mus = sorted({float(row["mu"]) for row in rows})
    meshes = sorted({int(row["elements"]) for row in rows})
    figure = Figure(figsize=(WIDTH, 5.2), layout="constrained")
    axes = figure.subplots(2, len(mus), squeeze=False)
    for column, mu in enumerate(mus):
        top, bottom = axes[:, column]
        pressures(top, profiles, mu, meshes[len(meshes) // 2])
        oscillations(bottom, [row for row in rows if row["mu"] == mu])
        top.set(xlabel="radius [mm]", title=rf"$\mu$ = {mu:g}, {meshes[len(meshes) // 2]} elements a side")
        bottom.set(xlabel="elements a side")
        bottom.set_xticks(meshes, [str(n) for n in meshes])
        bottom.xaxis.set_minor_formatter(NullFormatter())
    axes[0, 0].set_ylabel("nodal contact pressure [MPa]")
    axes[1, 0].set_ylabel("oscillation, relative")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    axes[1, 0].legend(*_measure_keys(), loc="best")
    return figure


def pressures(ax: Axes, profiles: Path, mu: float, elements: int) -> None:
    """Nodal pressure over radius, a line a rule."""
    with h5py.File(profiles, "r") as file:
        for rule, look in LOOKS.items():
            group: Any = file[f"curves/{curve_name(mu, rule.value, elements)}"]
            ax.plot(group["radius"][...], group["pressure"][...], ms=3, lw=0.9, label=WORDS[rule], **look)


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


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0], allow_abbrev=False)
    parser.add_argument("--results", type=Path, default=Path(f"results/{NAME}"))
    parser.add_argument("--out", type=Path, help="folder of the figures (default: RESULTS/figures)")
    asked = parser.parse_args(argv)
    command = COMMAND.format(out=asked.results)
    profiles = asked.results / f"{NAME}.h5"
    try:
        rows = read_csv(asked.results / f"{NAME}.csv", command)
        if not profiles.is_file():
            raise ResultsError(f"{profiles}: no results; run: {command}")
    except ResultsError as error:
        raise SystemExit(str(error)) from error
    with mpl.rc_context(STYLE):
        for path in save(draw(rows, profiles), asked.out or asked.results / "figures", f"fig_{NAME}"):
            print(path)


if __name__ == "__main__":
    main()
