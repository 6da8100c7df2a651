r"""Pressure and shear on the contact line, at 20 % and at the end of the stroke, with stick and slip marked.

Where contact is posed at nodes, tractions are recovered from nodal contact forces (:mod:`bipot.traction`): the mean
over each edge is drawn as a step, the nodal values r/A as marks. Both obey sign and cone as the forces do. Nodal values
alternate between corner and mid-side nodes where the element locks; their range, and how many marks the frame leaves
out, are written. Where contact is posed in weighted means, tractions are those of the law at the ends of edges, and
linear in between. The envelope is mu p of what is drawn along the edges.

python -m paper_figs.fig_traction [--results results/upsetting] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from bipot.laws.coulomb import Status
from bipot.results import History
from bipot.typing import Floats
from paper_figs.common import BLUE, GREY, VERMILLION, legend_below, letters
from paper_figs.contact_line import Line, contact_line
from paper_figs.shown import Group, friction, make, paired, titled, width_of

EARLY = 0.2
STRIP, FOOT = 0.1, 0.14
"""Height of the strip of statuses and that at which the axis of tractions ends, as fractions of a panel."""

BELOW, ABOVE = -0.35, 1.25
"""The frame, over the largest pressure drawn along an edge."""

ENVELOPE: dict[str, Any] = {"lw": 1.0, "ls": (0, (2, 1.5)), "color": "black"}
ALONG = {False: "edge mean", True: "linear on edges"}
AT = {False: ("nodal $r_n/A$", "nodal $r_t/A$"), True: ("at points", "at points")}
"""Of lines that are not weighted, and of those that are."""

EDGED: dict[str, Any] = {"mec": "black", "ms": 3.8, "mew": 0.8, "zorder": 3}
MARKS: dict[Status, dict[str, Any]] = {
    Status.STICK: {**EDGED, "marker": "s", "mfc": "black", "label": "stick"},
    Status.SLIP: {**EDGED, "marker": "o", "mfc": "white", "label": "slip"},
    Status.OPEN: {**EDGED, "marker": "|", "label": "open"},
    Status.UNDECIDED: {**EDGED, "marker": "x", "label": "undecided"},
}


def draw(groups: list[Group]) -> Figure:
    """Panels early and at the end of the stroke: those of a coefficient one below the other, its runs side by side."""
    cells = paired(groups, [stages(run) for group in groups for run in group.runs])
    columns = len(cells[0])
    figure = Figure(figsize=(width_of(columns), 2.15 * len(cells) + 0.9), layout="constrained")
    axes = figure.subplots(len(cells), columns, sharex=True, sharey=True, squeeze=False)
    drawn, letter = list[tuple[Axes, History, Line]](), letters()
    for ax, cell in zip(axes.flat, [cell for line in cells for cell in line], strict=True):
        if cell is None:
            ax.set_axis_off()
            continue
        run, row = cell
        drawn.append((ax, run, contact_line(run, row)))
        ax.set_title(titled(next(letter), run, row))
    highest = max((float(line.edge_pressure.max(initial=0.0)) for _, _, line in drawn), default=0.0) or 1.0
    axes[0, 0].set(ylim=(BELOW * highest, ABOVE * highest))
    # No ticks in the strip of statuses.
    axes[0, 0].set_yticks([tick for tick in axes[0, 0].get_yticks() if -0.1 * highest <= tick <= ABOVE * highest])
    for ax, run, line in drawn:
        panel(ax, friction(run), line)
        ax.set_title(f"{ax.get_title()}\n{words(line, ax.get_ylim())}", fontsize=8)
        ax.tick_params(labelbottom=True)
    for column in axes.T:
        lowest = [ax for ax in column if ax.axison][-1]
        lowest.set_xlabel("current radius $r$ [mm]")
    axes[0, 0].set_xlim(-0.15, None)
    figure.supylabel("contact traction [MPa]", fontsize=9)
    legend_below(figure, legend(drawn), 2 * columns)
    return figure


def stages(run: History) -> list[tuple[History, int] | None]:
    """The increment that ends nearest to :data:`EARLY`, None of a run that ends there or before, and the last one."""
    last = len(run) - 1
    early = int(np.abs(run["reduction"] - EARLY).argmin())
    return [(run, early) if early < last else None, (run, last)]


def profile(
    ax: Axes, ends: Floats, means: Floats, radius: Floats, values: Floats, marker: str, color: str
) -> tuple[LineCollection, Line2D]:
    """Traction on a contact line between the edges' ends (f, 2), nodal values marked.

    ``means`` (f,) are drawn as steps, values (f, 2) at the ends as straight lines.
    """
    levels = np.stack([ends, np.broadcast_to(means.reshape(len(ends), -1), ends.shape)], axis=-1)
    steps = LineCollection(list(levels), lw=2.2, color=color)
    ax.add_collection(steps)
    (marks,) = ax.plot(radius, values, marker, ms=4, mew=0.8, mfc="none", color=steps.get_color()[0], zorder=1)
    ax.autoscale_view()
    return steps, marks


def panel(ax: Axes, mu: float, line: Line) -> None:
    """Tractions along edges and at points, envelope, and a strip of statuses below."""
    profile(ax, line.ends, line.edge_pressure, line.radius, line.pressure, "o", BLUE)
    profile(ax, line.ends, line.edge_shear, line.radius, line.shear, "+", VERMILLION)
    if bounded(mu):
        ax.plot(line.ends.T, mu * line.edge_pressure.T, **ENVELOPE)
    ax.axvline(line.corner, color=GREY, lw=0.8, ls=":")
    ax.axhline(0, color="0.5", lw=0.5)
    _apart(ax)
    strip = ax.get_xaxis_transform()
    for status, mark in MARKS.items():
        here = line.radius[line.status == status]
        ax.plot(here, np.full(len(here), STRIP / 2), ls="", transform=strip, **mark)


def _apart(ax: Axes) -> None:
    """Leave the strip below to the statuses: the axis of tractions ends above it."""
    foot, top = _foot(ax.get_ylim()), ax.get_ylim()[1]
    ax.add_patch(Rectangle((0, 0), 1, FOOT, color="white", lw=0, zorder=2, transform=ax.transAxes))
    for side in ("left", "right"):
        ax.spines[side].set_bounds(foot, top)
    ax.axhline(foot, color="black", lw=0.7, zorder=2.5)
    ax.spines["bottom"].set_visible(False)
    box = Rectangle((0, 0), 1, STRIP, fill=False, lw=0.7, zorder=2.5, transform=ax.transAxes, clip_on=False)
    ax.add_patch(box)
    spec = ax.get_subplotspec()
    if spec is not None and spec.is_first_col():
        ax.text(-0.02, STRIP / 2, "status", transform=ax.transAxes, ha="right", va="center", fontsize=7)


def _foot(frame: tuple[float, float]) -> float:
    """The traction at which the axis ends."""
    return frame[0] + FOOT * (frame[1] - frame[0])


def words(line: Line, frame: tuple[float, float]) -> str:
    """The range of the points' pressure, and how many marks the frame, with its strip, leaves out."""
    if not line.radius.size:
        return "no contact"
    lowest = _foot(frame)
    marks = np.concatenate([line.pressure, line.shear])
    out = int(((marks < lowest) | (marks > frame[1])).sum())
    left = f"; {out} mark{'s' if out > 1 else ''} outside the frame" if out else ""
    where = "at points" if line.weighted else "nodal"
    return f"{where} $p$ {line.pressure.min():.0f} to {line.pressure.max():.0f} MPa{left}"


def bounded(mu: float) -> bool:
    """Whether there is an envelope to draw: none without friction, nor of a weld."""
    return 0 < mu < np.inf


def legend(drawn: Sequence[tuple[Axes, History, Line]]) -> list[Line2D]:
    """Handles of what is drawn, in the order they are read, column by column."""
    lines, mus = [line for _, _, line in drawn], [friction(run) for _, run, _ in drawn]
    kinds = {line.weighted for line in lines}
    along = " / ".join(ALONG[weighted] for weighted in sorted(kinds))
    at = [" / ".join(AT[weighted][k] for weighted in sorted(kinds)) for k in (0, 1)]
    nodal: dict[str, Any] = {"ls": "", "ms": 4, "mew": 0.8, "mfc": "none"}
    statuses = {int(status) for line in lines for status in line.status}
    return [
        Line2D([], [], color=BLUE, lw=2.2, label=f"pressure $p$, {along}"),
        Line2D([], [], color=VERMILLION, lw=2.2, label=rf"shear $\tau$, {along}"),
        Line2D([], [], color=BLUE, marker="o", label=f"pressure $p$, {at[0]}", **nodal),
        Line2D([], [], color=VERMILLION, marker="+", label=rf"shear $\tau$, {at[1]}", **nodal),
        *([Line2D([], [], label=r"envelope $\mu p$", **ENVELOPE)] if any(map(bounded, mus)) else []),
        Line2D([], [], color=GREY, lw=0.8, ls=":", label="top corner; beyond: landed"),
        *(Line2D([], [], ls="", **mark) for status, mark in MARKS.items() if status in statuses),
    ]


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    make(draw, "fig_traction", (__doc__ or "").splitlines()[0], argv)


if __name__ == "__main__":
    main()
