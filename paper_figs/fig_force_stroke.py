"""Punch force against stroke, a line a run, with closed forms, the limits of refined meshes, and landings.

On the right the force over the section that the volume gives, F (1 - reduction) / A0, in which elements and landings
are told apart. The closed forms (:mod:`studies.closed_forms`) are of a perfectly plastic cylinder, the slab as long
as it slips everywhere; the limits (:mod:`studies.known_limits`) of the seed's cylinder at coefficients that are known.
Elsewhere they are left out. A landing is marked at the end of the increment in which a node of the side comes to carry.

python -m paper_figs.fig_force_stroke [--results results/upsetting] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bipot import plot
from bipot.typing import Floats
from paper_figs.common import GREY, LANDED, WIDTH, legend_below, lettered
from paper_figs.shown import Group, cylinder_of, has_closed_forms, landings, make, named, per_cent, stopped
from studies.closed_forms import Cylinder
from studies.known_limits import limits_of

MARKS = 9

SETTLED = 0.02
"""Reduction before which the right panel, of the plastic range, leaves the rise of the force below its frame."""

ASKED: dict[str, Any] = {"ls": "-", "lw": 1.1, "ms": 4, "mfc": "white", "mew": 0.9}
BESIDE: dict[str, Any] = {"ls": (0, (5, 1.5)), "lw": 1.7}
LIMIT: dict[str, Any] = {"ms": 4, "mec": "black", "mew": 0.7, "ecolor": "black", "capsize": 2.5, "zorder": 4}
LANDS = "a node of the side lands on the punch"


def draw(groups: list[Group]) -> Figure:
    """Force in kN over stroke in mm on the left, over the current section in MPa on the right, reduction on top."""
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    panels = Panel(left, over_section=False), Panel(right, over_section=True)
    for panel in panels:
        references(panel, groups)
    for group in groups:
        curves(panels, group)
        limits(panels, group)
    for panel in panels:
        panel.finish(groups)
    left.set_title("force")
    right.set_title("force over the section of constant volume")
    lettered((left, right))
    legend_below(figure, keys(left), 2)
    return figure


@dataclass(frozen=True)
class Panel:
    """Axes of one of the two scales: takes reductions and forces (N) of a run's cylinder."""

    ax: Axes
    over_section: bool

    def scaled(self, cylinder: Cylinder, reduction: Floats, force: Floats) -> tuple[Floats, Floats]:
        """Stroke, mm, and force, kN, or over the section, MPa."""
        section = np.pi * cylinder.radius**2 / (1 - reduction)
        return cylinder.height * reduction, force / (section if self.over_section else 1e3)

    def finish(self, groups: Sequence[Group]) -> None:
        """Labels, frame, and what the frame leaves out."""
        height, ax = cylinder_of(groups[0].run).height, self.ax
        # A little below 0, which leaves room between the zeros of both scales.
        ax.set(
            xlabel="stroke [mm]", xlim=(0, None), ylabel="punch force $F$ [kN]", ylim=(-0.03 * ax.get_ylim()[1], None)
        )
        factor = 100 / height
        top = ax.secondary_xaxis("top", functions=(lambda s: np.multiply(s, factor), lambda p: np.divide(p, factor)))
        top.set_xlabel("reduction in height [%]")
        if self.over_section:
            ax.set_ylabel(r"$F\,(1 - \mathrm{reduction})/A_0$ [MPa]")
            self.leave_out(height)

    def leave_out(self, height: float) -> None:
        """Frame what is plastic, and say so."""
        drawn = [np.asarray(line.get_xydata()) for line in self.ax.lines]
        plastic = [y for x, y in np.concatenate(drawn) if x >= SETTLED * height and np.isfinite(y)]
        if not plastic:
            return
        low, high = min(plastic), max(plastic)
        self.ax.set_ylim(low - 0.12 * (high - low), high + 0.06 * (high - low))
        style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 7, "color": GREY}
        self.ax.text(0.98, 0.02, "below the frame: the rise from 0", transform=self.ax.transAxes, **style)


# %% Runs
def curves(panels: Sequence[Panel], group: Group) -> None:
    """The runs of a coefficient, and their landings."""
    for run in group.runs:
        style: dict[str, Any] = {**BESIDE, "color": group.colour}
        if run is group.run:
            rows = marked(run["reduction"], group.number / 3 % 1)
            style = {**ASKED, "color": group.colour, "marker": group.marker, "markevery": rows}
        end = f", stopped at {per_cent(run['reduction'][-1])}"
        label, landed = f"{named(run)}, {group.words}{stopped(run, end)}", landings(run)
        for panel in panels:
            x, y = panel.scaled(cylinder_of(run), run["reduction"], run["force_N"])
            plot.force_stroke(x, y, panel.ax, label=label, **style)
            if landed.size:
                panel.ax.plot(x[landed], y[landed], label=LANDS, **LANDED)


def limits(panels: Sequence[Panel], group: Group) -> None:
    """What refined meshes tend to, with the band, as far as the runs of the coefficient come."""
    end = max(float(run["reduction"][-1]) for run in group.runs)
    known = [one for one in limits_of(group.run) if one.reduction <= end * (1 + 1e-9)]
    if not known:
        return
    at, value, band = (np.array([getattr(one, name) for one in known]) for name in ("reduction", "value", "band"))
    cylinder, label = cylinder_of(group.run), f"limit of refined meshes and its band, {group.words}"
    for panel in panels:
        x, y = panel.scaled(cylinder, at, value)
        half = panel.scaled(cylinder, at, band)[1]
        panel.ax.errorbar(x, y, half, label=label, fmt=group.marker, color=group.colour, **LIMIT)


def marked(reduction: Floats, shift: float) -> list[int]:
    """Rows nearest to even steps of the reduction, ``shift`` of a step early: increments are uneven."""
    wanted = (np.arange(1, MARKS + 1) - shift) * reduction[-1] / MARKS
    # The curve starts at the origin, one point before the first row.
    return sorted({int(np.abs(reduction - w).argmin()) + 1 for w in wanted})


# %% Closed forms
def references(panel: Panel, groups: Sequence[Group]) -> None:
    """Those of the runs' cylinder, if all are of one that has them."""
    runs = [run for group in groups for run in group.runs]
    cylinders = {cylinder_of(run) for run in runs}
    if len(cylinders) > 1 or not all(map(has_closed_forms, runs)):
        return
    (cylinder,) = cylinders
    first, end = cylinder.yield_stress / cylinder.young, max(float(run["reduction"][-1]) for run in runs)
    if end <= first:
        return
    plastic = np.linspace(first, end, 400)
    reduction = np.concatenate([[0.0, 0.5 * first], plastic])
    plain: dict[str, Any] = {"lw": 1.0, "color": "black"}
    exact = panel.scaled(cylinder, reduction, cylinder.exact_force(reduction))
    panel.ax.plot(*exact, ls=(0, (1.5, 1.5)), label=r"exact without friction, $\mu$ = 0", **plain)
    if panel.over_section:
        return
    for group in groups:
        slipping = plastic[cylinder.slips(plastic, group.mu)] if 0 < group.mu < np.inf else plastic[:0]
        if slipping.size:
            slab = panel.scaled(cylinder, slipping, cylinder.slab_force(slipping, group.mu))
            until = "" if slipping[-1] == end else f" (slips everywhere to {per_cent(slipping[-1])})"
            panel.ax.plot(*slab, ls=group.dots, color=group.colour, lw=1.5, label=f"slab, {group.words}{until}; in (a)")
    bound = panel.scaled(cylinder, plastic, cylinder.sticking_bound(plastic))
    panel.ax.plot(*bound, "-.", color=GREY, lw=1.1, label="upper bound, full sticking; in (a)")


def keys(ax: Axes) -> list[Any]:
    """Handles, each label once, what lands last."""
    found = dict[str, Any]()
    for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
        found.setdefault(label, handle)
    return [found[label] for label in sorted(found, key=LANDS.__eq__)]


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    make(draw, "fig_force_stroke", (__doc__ or "").splitlines()[0], argv)


if __name__ == "__main__":
    main()
