"""The picture of a sweep: the force over mu at every asked reduction, a line for each mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from studies.sweep_point import Status
from studies.sweep_table import force_column

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Okabe and Ito's, one a reduction."""
LOOKS = (("-", "o"), ("--", "s"), ("-.", "^"), (":", "D"))
"""Line and marker, one a mesh."""


def draw(figure: Figure, rows: Sequence[Any], at: Sequence[float]) -> None:
    """Fill the figure with the rows, sorted by mu; points that did not end are marked at its foot."""
    axes = figure.subplots()
    finite = [row for row in rows if not math.isinf(row.mu)]
    for number, side in enumerate(dict.fromkeys(row.elements for row in finite)):
        own = [row for row in finite if row.elements == side]
        line, marker = LOOKS[number % len(LOOKS)]
        for colour, reduction in enumerate(at):
            force = [getattr(row, force_column(reduction)) / 1e3 for row in own]
            look = {"color": COLOURS[colour % len(COLOURS)], "ls": line, "marker": marker, "ms": 4, "mfc": "white"}
            label = f"{100 * reduction:g} %, {side} elements a side"
            axes.plot([row.mu for row in own], force, label=label, **look)
    failed = [row.mu for row in finite if row.status != Status.SOLVED.value]
    if failed:
        # Just inside the frame, whatever its limits.
        foot = axes.get_xaxis_transform()
        axes.plot(failed, [0.02] * len(failed), "kx", ms=6, transform=foot, label="not solved to the end")
    left_out = len(rows) - len(finite)
    axes.set(xlabel="mu" + (" (welded: in the table)" if left_out else ""), ylabel="force on the punch [kN]")
    axes.legend(fontsize="small", title="reduction, mesh", frameon=False)
