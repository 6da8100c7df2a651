r"""What locating the landings of side nodes does: the force at 45 %, and the reduction at which the second node lands.

python -m paper_figs.fig_landings [--results results/landings] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from bipot.laws.flow import Integration
from paper_figs.common import BLUE, GREY, VERMILLION, WIDTH, from_table, lettered
from studies.landings import COMMAND, NAME
from studies.tables import Value

Rows = list[dict[str, Value]]

# Colour tells the integration, line and marker tell whether landings are located.
COLOURS = {Integration.BACKWARD_EULER: VERMILLION, Integration.BDF2: BLUE}
LOOKS: dict[int, dict[str, Any]] = {0: {"ls": ":", "marker": "o", "mfc": "none"}, 1: {"ls": "-", "marker": "s"}}
WORDS = {0: "inside increments", 1: "located"}
TICKS = (22, 45, 90, 180, 360, 720, 1440)
JUDGED = 45.0


def draw(rows: Rows) -> Figure:
    """Force at 45 % (left) and second landing (right) over the number of increments."""
    figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    panel(left, rows, "force_45_N", 1e-3)
    panel(right, [row for row in rows if row["located"]], "second_landing", 100.0)
    right.axhline(JUDGED, color=GREY, lw=0.8, zorder=0)
    right.annotate("reduction of (a)", (TICKS[-1], JUDGED), va="top", ha="right", fontsize=7, color=GREY)
    left.set(ylabel="force at 45 % [kN]", title="force")
    right.set(ylabel="reduction [%]", title="second landing, located")
    lettered((left, right))
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def panel(ax: Axes, rows: Rows, name: str, factor: float) -> None:
    """One column, times ``factor``, a line an integration and a treatment of landings."""
    for integration, colour in COLOURS.items():
        for located, look in LOOKS.items():
            chosen = [r for r in rows if (r["integration"], r["located"]) == (integration.value, located)]
            if not chosen:
                continue
            pairs = np.array([[r["increments"], r[name]] for r in chosen], dtype=float)
            label = f"{integration.value}, {WORDS[located]}"
            ax.semilogx(pairs[:, 0], factor * pairs[:, 1], ms=3.5, mew=0.8, lw=1.0, color=colour, label=label, **look)
    ax.set(xlabel="uniform increments")
    ax.set_xticks(TICKS, [str(n) for n in TICKS])
    ax.xaxis.set_minor_formatter(NullFormatter())


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    from_table(argv, __doc__, NAME, COMMAND, draw)


if __name__ == "__main__":
    main()
