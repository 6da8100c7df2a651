r"""What the penalty costs: errors against the conic run, condition and passes over K, for each friction coefficient.

python -m paper_figs.fig_penalty_vs_conic [--results results/penalty_vs_conic] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from paper_figs.common import BLUE, GREEN, GREY, PURPLE, VERMILLION, WIDTH, from_table, lettered
from studies.penalty_vs_conic import COMMAND, NAME
from studies.tables import Value

Rows = list[dict[str, Value]]

CURVES: dict[str, dict[str, Any]] = {
    "force_error": {"color": BLUE, "marker": "o", "label": "force"},
    "normal_traction_error": {"color": VERMILLION, "marker": "s", "label": "recovered pressure, $L_2$"},
    "tangential_traction_error": {"color": GREEN, "marker": "^", "label": "recovered shear, $L_2$"},
}
MARKS: dict[str, Any] = {"ms": 3.5, "mew": 0.8, "mfc": "none"}
COSTS: dict[str, dict[str, Any]] = {
    "condition": {"color": "black", "marker": "x", "label": "condition of the tangent"},
    "passes": {"color": PURPLE, "marker": "D", "label": "passes (right axis)"},
}
LINES = {0.2: "-", 0.45: "--"}
SLOPE: dict[str, Any] = {"color": GREY, "lw": 0.7, "ls": ":"}


def draw(rows: Rows) -> Figure:
    """Upper row: errors; lower row: condition and passes; a column a friction coefficient."""
    mus = sorted({float(row["mu"]) for row in rows})
    figure = Figure(figsize=(WIDTH, 5.2), layout="constrained")
    axes = figure.subplots(2, len(mus), sharex=True, sharey="row", squeeze=False)
    for column, mu in zip(axes.T, mus, strict=True):
        mine = [row for row in rows if row["mu"] == mu and row["form"] == "penalty"]
        errors(column[0], mine)
        costs(column[1], mine)
        column[0].set_title(rf"$\mu$ = {mu:g}")
        column[1].set_xlabel("$K$ over $E/h$")
    axes[0, 0].set_ylabel("error against the conic run")
    axes[1, 0].set_ylabel("condition of the tangent")
    lettered(axes.flat)
    figure.legend(handles=legend(), loc="outside lower center", ncols=3)
    return figure


def legend() -> list[Line2D]:
    """Handles, column by column: what is measured, and where."""
    measured = [Line2D([], [], **style, **MARKS) for style in CURVES.values()]
    places = [Line2D([], [], color="black", ls=ls, label=f"at {100 * at:.0f} %") for at, ls in LINES.items()]
    costs = [Line2D([], [], **style, **MARKS) for style in COSTS.values()]
    return [*measured, *places, Line2D([], [], **SLOPE, label="first order"), *costs]


def errors(ax: Axes, rows: Rows) -> None:
    """Errors over K at 20 % (full) and 45 % (dashed), with the slope of first order."""
    for reduction, line in LINES.items():
        chosen = [row for row in rows if row["reduction"] == reduction]
        for name, style in CURVES.items():
            ax.loglog(*_series(chosen, name), **style, **MARKS, ls=line)
    K, error = _series([row for row in rows if row["reduction"] == 0.2], "force_error")
    if len(K) > 1:
        middle = len(K) // 2
        ax.loglog(K, error[middle] * K[middle] / K, **SLOPE)


def costs(ax: Axes, rows: Rows) -> None:
    """Condition of the tangent and passes of the whole run."""
    chosen = [row for row in rows if row["reduction"] == 0.45]
    ax.loglog(*_series(chosen, "condition"), **COSTS["condition"], **MARKS)
    passes = ax.twinx()
    passes.semilogx(*_series(chosen, "passes"), **COSTS["passes"], **MARKS)
    passes.set_ylim(0, None)
    passes.tick_params(axis="y", colors=PURPLE)
    if lost := sorted(float(row["K_over_E_h"]) for row in chosen if not np.isfinite(float(row["force_error"]))):
        said = "stopped before the end:\n" + ", ".join(f"$K$ = $10^{{{np.log10(K):.3g}}}$ $E/h$" for K in lost)
        ax.text(0.04, 0.45, said, transform=ax.transAxes, va="bottom", fontsize=7, color=GREY)


def _series(rows: Rows, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Finite positive values over K."""
    pairs = np.array([[row["K_over_E_h"], row[name]] for row in rows], dtype=float).reshape(-1, 2)
    K, value = pairs[np.isfinite(pairs).all(axis=1) & (pairs[:, 1] > 0)].T
    return K, value


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    from_table(argv, __doc__, NAME, COMMAND, draw)


if __name__ == "__main__":
    main()
