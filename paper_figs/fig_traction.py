r"""Pressure and shear on the contact line, at 20 % and at the end of the stroke, with stick and slip marked.

Tractions are recovered from nodal contact forces (:mod:`bipot.traction`): the mean over each edge is drawn as a step,
the nodal values r/A as marks. Both obey sign and cone as the forces do. Nodal values alternate between corner and
mid-side nodes where the element locks; their range, wider than the frame, is written. The envelope is mu p of the edge
means.

python -m paper_figs.fig_traction [--results results/upsetting] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from bipot import plot
from bipot.contact import frames
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.coulomb import Status
from bipot.results import History
from bipot.traction import edge_tractions
from paper_figs.common import BLUE, GREY, VERMILLION, WIDTH, friction, make

EARLY = 0.2
STRIP = 0.11
"""Height of the strip of statuses, as a fraction of a panel."""

ENVELOPE: dict[str, Any] = {"lw": 1.0, "ls": (0, (2, 1.5))}
EDGED: dict[str, Any] = {"mec": "black", "ms": 3.8, "mew": 0.8, "zorder": 3}
MARKS: dict[Status, dict[str, Any]] = {
    Status.STICK: {**EDGED, "marker": "s", "mfc": "black", "label": "stick"},
    Status.SLIP: {**EDGED, "marker": "o", "mfc": "white", "label": "slip"},
    Status.OPEN: {**EDGED, "marker": "|", "label": "open"},
    Status.UNDECIDED: {**EDGED, "marker": "x", "label": "undecided"},
}


@dataclass(frozen=True)
class Line:
    """The contact line of one increment: radius, recovered tractions, status (m,) of its nodes, ends (f, 2) and means
    (f,) of its edges, and the radius of the top corner; mm and MPa.
    """

    radius: np.ndarray
    pressure: np.ndarray
    shear: np.ndarray
    status: np.ndarray
    ends: np.ndarray
    mean_pressure: np.ndarray
    mean_shear: np.ndarray
    corner: float


def contact_line(run: History, row: int) -> Line:
    """Read the contact line after the increment of ``row``."""
    state, mesh, tool = run.state(row), run.mesh, run.scene["tools"][0]
    at_start = run.scene["configuration"] == Configuration.PAPER.value
    nodes = state.nodes - state.du if at_start else state.nodes
    pressure, shear, status = (run.nodal(name, row) for name in ("recovered_pressure", "recovered_shear", "status"))
    edges = mesh.edges(*tool["candidates"])
    edges = edges[~np.isnan(pressure[edges]).any(axis=1)]
    line = np.unique(edges)
    along = run.nodal("contact_force", row)[:, :2] @ frames(np.array(tool["normal"])).T
    means = edge_tractions(nodes, edges, Geometry(run.scene["geometry"]), along)
    return Line(
        radius=nodes[line, 0],
        pressure=pressure[line],
        shear=shear[line],
        status=status[line],
        ends=nodes[edges[:, [0, 2]], 0],
        mean_pressure=means[:, 0],
        mean_shear=means[:, 1],
        corner=float(nodes[mesh.boundary_nodes("top"), 0].max()),
    )


def draw(found: list[History]) -> Figure:
    """Rows: early and end of the stroke; columns: friction coefficients."""
    figure = Figure(figsize=(WIDTH, 5.2), layout="constrained")
    axes = figure.subplots(2, len(found), sharex=True, sharey=True)
    rows = [[int(np.abs(run["reduction"] - EARLY).argmin()) for run in found], [-1] * len(found)]
    lines = [[contact_line(run, row) for run, row in zip(found, pair, strict=True)] for pair in rows]
    for k, ax in enumerate(axes.flat):
        i, j = divmod(k, len(found))
        panel(ax, friction(found[j]), lines[i][j])
        reduction = 100 * found[j]["reduction"][rows[i][j]]
        ax.set_title(rf"({'abcd'[k]}) $\mu$ = {friction(found[j]):g}, reduction {reduction:.1f} %")
    highest = max(line.mean_pressure.max() for pair in lines for line in pair)
    axes[0, 0].set(xlim=(-0.15, None), ylim=(-0.36 * highest, 1.6 * highest))
    # No ticks in the strip of statuses.
    axes[0, 0].set_yticks([tick for tick in axes[0, 0].get_yticks() if 0 <= tick <= 1.6 * highest])
    for ax in axes[-1]:
        ax.set_xlabel("current radius $r$ [mm]")
    for ax in axes[:, 0]:
        ax.set_ylabel("recovered traction [MPa]")
    figure.legend(handles=legend(), loc="outside lower center", ncols=4)
    return figure


def panel(ax: Axes, mu: float, line: Line) -> None:
    """Steps, nodal marks, envelope, and a strip of statuses below."""
    plot.traction_profile(line.ends, line.mean_pressure, line.radius, line.pressure, ax, "o", color=BLUE)
    plot.traction_profile(line.ends, line.mean_shear, line.radius, line.shear, ax, "+", color=VERMILLION)
    levels = np.repeat(mu * line.mean_pressure, 2).reshape(-1, 2)
    ax.plot(line.ends.T, levels.T, color="black", **ENVELOPE)
    ax.axvline(line.corner, color=GREY, lw=0.8, ls=":")
    ax.axhline(0, color="0.5", lw=0.5)
    strip = ax.get_xaxis_transform()
    ax.add_patch(Rectangle((0, 0), 1, STRIP, color="white", lw=0, zorder=2, transform=ax.transAxes))
    ax.plot([0, 1], [STRIP, STRIP], color="black", lw=0.5, zorder=2.5, transform=ax.transAxes)
    for status, mark in MARKS.items():
        here = line.radius[line.status == status]
        ax.plot(here, np.full(len(here), STRIP / 2), ls="", transform=strip, **mark)
    words = f"nodal $p$ from {line.pressure.min():.0f} to {line.pressure.max():.0f} MPa"
    ax.text(0.04, 0.95, words, transform=ax.transAxes, va="top")


def legend() -> list[Line2D]:
    """Handles in the order they are read, column by column."""
    nodal = {"ls": "", "ms": 4, "mew": 0.8, "mfc": "none"}
    return [
        Line2D([], [], color=BLUE, lw=2.2, label="pressure $p$, edge mean"),
        Line2D([], [], color=VERMILLION, lw=2.2, label=r"shear $\tau$, edge mean"),
        Line2D([], [], color=BLUE, marker="o", label="pressure $p$, nodal $r_n/A$", **nodal),
        Line2D([], [], color=VERMILLION, marker="+", label=r"shear $\tau$, nodal $r_t/A$", **nodal),
        Line2D([], [], color="black", label=r"envelope $\mu p$", **ENVELOPE),
        Line2D([], [], color=GREY, lw=0.8, ls=":", label="top corner"),
        *(Line2D([], [], ls="", **mark) for mark in MARKS.values()),
    ]


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    make(draw, "fig_traction", (__doc__ or "").splitlines()[0], argv)


if __name__ == "__main__":
    main()
