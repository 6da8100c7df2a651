r"""Time against the error of the force-stroke curve, every method over its own knob: a figure a friction coefficient.

Left: against very many increments (what increments and algebra leave out); right: against exact algebra on the same
increments (what penalty or tolerance leave out).

python -m paper_figs.fig_speed_vs_error [--results results/speed_vs_error] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from paper_figs.common import BLUE, GREEN, GREY, VERMILLION, WIDTH, from_results, legend_below, lettered
from studies.methods import Method
from studies.speed_jobs import Knob
from studies.speed_vs_error import COMMAND, NAME
from studies.tables import Value, read_csv

Rows = list[dict[str, Value]]

LOOKS: dict[Method, dict[str, Any]] = {
    Method.NEWTON: {"color": "black", "marker": "x"},
    Method.EULER: {"color": "black", "marker": "+", "alpha": 0.5},
    Method.TANGENT: {"color": BLUE, "marker": "o"},
    Method.FROZEN: {"color": BLUE, "marker": "v"},
    Method.DISSIPATION: {"color": BLUE, "marker": "D"},
    Method.PENALTY: {"color": VERMILLION, "marker": "s"},
    Method.UZAWA: {"color": GREEN, "marker": "^"},
    Method.WRITTEN: {"color": GREY, "marker": "P"},
    Method.UNRETURNED: {"color": GREY, "marker": "*"},
}
MARKS: dict[str, Any] = {"ms": 4, "mew": 0.8, "mfc": "none"}
LINES = {Knob.INCREMENTS: "-", Knob.PENALTY: ":", Knob.TOLERANCE: "--"}
KNOBS = {
    Knob.INCREMENTS: "over the number of increments",
    Knob.PENALTY: "over the penalty",
    Knob.TOLERANCE: "over the tolerance",
}
PANELS = {"curve_error": "against very many increments", "algebraic_error": "against the same increments, exact"}


def draw(rows: Rows) -> Figure:
    """Two panels of time against error."""
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for ax, (measure, title) in zip(axes, PANELS.items(), strict=True):
        panel(ax, rows, measure)
        ax.set(xlabel="relative $L_2$ error of the force-stroke curve", title=title)
        ax.invert_xaxis()
    axes[0].set_ylabel("processor time [s]")
    lettered(axes)
    methods, knobs = {row["method"] for row in rows}, {row["knob"] for row in rows}
    marks = [Line2D([], [], ls="", label=m.value, **MARKS, **look) for m, look in LOOKS.items() if m.value in methods]
    lines = [Line2D([], [], color=GREY, ls=LINES[k], label=said) for k, said in KNOBS.items() if k.value in knobs]
    legend_below(figure, [*marks, *lines], 3)
    return figure


def panel(ax: Axes, rows: Rows, measure: str) -> None:
    """A line a method and knob: increments full, penalty dotted, tolerance dashed."""
    for method, look in LOOKS.items():
        for knob, line in LINES.items():
            chosen = [r for r in rows if r["method"] == method.value and r["knob"] == knob.value]
            pairs = np.array([[r[measure], r["seconds"]] for r in chosen], dtype=float).reshape(-1, 2)
            kept = pairs[np.isfinite(pairs).all(axis=1) & (pairs > 0).all(axis=1)]
            if len(kept):
                ax.loglog(*kept.T, ls=line, **MARKS, **look)


def figures(results: Path) -> dict[str, Figure]:
    """One a coefficient, by its name."""
    rows = read_csv(results / f"{NAME}.csv", COMMAND.format(out=results))
    by_mu = {mu: [row for row in rows if row["mu"] == mu] for mu in sorted({row["mu"] for row in rows})}
    return {f"fig_speed_vs_error_mu{mu:g}": draw(chosen) for mu, chosen in by_mu.items()}


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    from_results(argv, __doc__, f"results/{NAME}", figures)


if __name__ == "__main__":
    main()
