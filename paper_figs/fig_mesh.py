r"""Tractions along the punch with the paper's element and with the best one, and the mesh's error of the force.

Above recovered pressure and shear at 45 % with as many unknowns as in the paper, and on the finest mesh of the best
element; below the distance of the force from its limit, with the half width of that limit's band, over the unknowns.

python -m paper_figs.fig_mesh [--results results/accuracy] [--out DIR]
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bipot.errors import ResultsError
from paper_figs.common import BLUE, GREEN, GREY, STYLE, VERMILLION, WIDTH, save
from studies.accuracy.mesh import NAME, named
from studies.element_types import ElementType
from studies.outputs import read_curves
from studies.tables import Value, read_csv

Rows = list[dict[str, Value]]
Curves = Mapping[str, Mapping[str, Any]]

COMMAND = "python -m studies.accuracy.mesh --out {out}"
SHOWN, EARLY = 0.45, 0.2
PAPERS, BEST = ElementType.Q8, ElementType.Q4P0
PURPLE, ORANGE = "#CC79A7", "#E69F00"
LOOKS: dict[ElementType, dict[str, Any]] = {
    ElementType.Q8: {"color": VERMILLION, "marker": "o", "label": "Q8, 7 points (the paper's)"},
    ElementType.Q8P1: {"color": GREEN, "marker": "^", "label": "Q8/P1"},
    ElementType.Q9P1: {"color": PURPLE, "marker": "D", "label": "Q9/P1"},
    ElementType.T6: {"color": ORANGE, "marker": "v", "label": "T6/P0"},
    ElementType.Q4P0: {"color": BLUE, "marker": "s", "label": "Q4/P0"},
}


def draw(rows: Rows, limits: Rows, curves: Curves) -> Figure:
    """A column a coefficient with friction."""
    mus = sorted({float(row["mu"]) for row in rows if row["mu"] != 0})
    figure = Figure(figsize=(WIDTH, 7.0), layout="constrained")
    axes = figure.subplots(3, len(mus), squeeze=False, height_ratios=(1, 1, 1.15))
    for (pressure, shear, error), mu in zip(axes.T, mus, strict=True):
        tractions(pressure, shear, [row for row in rows if row["mu"] == mu], curves, mu)
        errors(error, [row for row in rows if row["mu"] == mu], [row for row in limits if row["mu"] == mu])
        pressure.set_title(rf"$\mu$ = {mu:g}")
    axes[0, 0].set_ylabel("recovered pressure\nat 45 % [MPa]")
    axes[1, 0].set_ylabel("recovered shear, size,\nat 45 % [MPa]")
    axes[2, 0].set_ylabel("force from its limit, relative")
    axes[1, 0].legend(loc="upper left")
    figure.legend(*_keys(axes[2]), loc="outside lower center", ncols=3)
    return figure


WORDS = {PAPERS: "Q8", BEST: "Q4/P0"}


def tractions(pressure: Axes, shear: Axes, rows: Rows, curves: Curves, mu: float) -> None:
    """Of the paper's mesh, of one of about as many unknowns of the best element, and of its finest."""
    papers = next((r for r in _of(rows, PAPERS) if r["elements"] == 10), None) or _of(rows, PAPERS)[-1]
    best = _of(rows, BEST)
    near = min(best, key=lambda row: abs(int(row["unknowns"]) - int(papers["unknowns"])))
    chosen = (
        (papers, PAPERS, {"ms": 3.5, "lw": 0.9}),
        (near, BEST, {"ms": 3, "lw": 0.9}),
        (best[-1], BEST, {"marker": "", "color": "black", "lw": 1.0, "ls": "--"}),
    )
    for row, kind, look in chosen:
        along = curves[named(mu, kind.value, int(row["elements"]), SHOWN)]
        said = f"{WORDS[kind]}, {row['elements']:g} x {row['elements']:g}"
        style: dict[str, Any] = LOOKS[kind] | look | {"label": said}
        pressure.plot(along["radius"], along["pressure"], **style)
        shear.plot(along["radius"], np.abs(along["shear"]), **style)
    largest = max(float(curves[named(mu, BEST.value, int(row["elements"]), SHOWN)]["pressure"].max()) for row in best)
    pressure.set(ylim=(0, 1.05 * largest), xlim=(0, None))
    _say_outside(pressure, curves[named(mu, PAPERS.value, int(papers["elements"]), SHOWN)]["pressure"])
    pressure.tick_params(labelbottom=False)
    shear.set(xlabel="radius [mm]", xlim=pressure.get_xlim(), ylim=(0, None))


def _say_outside(ax: Axes, values: Any) -> None:
    """How many values are above the frame, and up to where."""
    top = ax.get_ylim()[1]
    above = np.asarray(values)[np.asarray(values) > top]
    if above.size:
        said = f"{above.size} of the paper's above,\nup to {above.max():.0f} MPa"
        ax.text(0.03, 0.95, said, transform=ax.transAxes, va="top", fontsize=7, color=GREY)


def errors(ax: Axes, rows: Rows, limits: Rows) -> None:
    """Over the unknowns: hollow markers at 20 %, full ones at 45 %; the bands of the limits in grey."""
    for reduction, fill, dashes in ((EARLY, "none", ":"), (SHOWN, "full", "-")):
        found = [r for r in limits if r["reduction"] == reduction and r["quantity"] == "force_N"]
        if not found:
            continue
        limit, band = float(found[0]["value"]), float(found[0]["band"])
        ax.axhline(
            band / limit, color=GREY, lw=0.8, ls=dashes, zorder=0, label=f"band of the limit, {100 * reduction:g} %"
        )
        for kind, look in LOOKS.items():
            mine = [r for r in rows if (r["element"], r["reduction"]) == (kind.value, reduction)]
            pairs = np.array([[r["unknowns"], abs(float(r["force_N"]) / limit - 1)] for r in mine], dtype=float)
            if len(pairs):
                said = f"{look['label']}, {100 * reduction:g} %"
                ax.loglog(*pairs.T, ms=4, lw=0.9, **(look | {"label": said}), fillstyle=fill, ls=dashes)
    ax.set(xlabel="unknowns")


def _keys(axes: Sequence[Axes]) -> tuple[list[Any], list[str]]:
    """Of all axes, each once."""
    found = dict[str, Any]()
    for ax in axes:
        found |= {label: handle for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    return list(found.values()), list(found)


def _of(rows: Rows, kind: ElementType) -> Rows:
    """Those of an element at 45 %, from coarse to fine."""
    mine = [row for row in rows if (row["element"], row["reduction"]) == (kind.value, SHOWN)]
    return sorted(mine, key=lambda row: int(row["elements"]))


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0], allow_abbrev=False)
    parser.add_argument("--results", type=Path, default=Path("results/accuracy"))
    parser.add_argument("--out", type=Path, help="folder of the figures (default: RESULTS/figures)")
    asked = parser.parse_args(argv)
    command = COMMAND.format(out=asked.results)
    try:
        rows = read_csv(asked.results / f"{NAME}.csv", command)
        limits = asked.results / "limits.csv"
        told = read_csv(limits, command) if limits.is_file() else []
        curves = read_curves(asked.results / f"{NAME}.h5")
    except ResultsError as error:
        raise SystemExit(str(error)) from error
    with mpl.rc_context(STYLE):
        for path in save(draw(rows, told, curves), asked.out or asked.results / "figures", f"fig_{NAME}"):
            print(path)


if __name__ == "__main__":
    main()
