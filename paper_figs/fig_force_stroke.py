"""Punch force against stroke, with the exact frictionless force, the slab method, and the sticking bound.

The references are closed forms (:mod:`paper_figs.closed_forms`) and hold for perfect plasticity only; with
hardening they are left out.

python -m paper_figs.fig_force_stroke [--results results/upsetting] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bipot import plot
from bipot.results import History
from paper_figs.closed_forms import Cylinder
from paper_figs.common import COLOUR, DASHES, GREY, MARKER, cylinder_of, friction, make

MARKS = 12


def draw(found: list[History]) -> Figure:
    """All curves in one panel: force in kN over stroke in mm, reduction in per cent on top."""
    figure = Figure(figsize=(4.6, 3.7), layout="constrained")
    ax = figure.subplots()
    cylinder = cylinder_of(found[0])
    if found[0].scene["perfectly_plastic"]:
        references(ax, cylinder, max(run["reduction"][-1] for run in found), [friction(run) for run in found])
    for k, run in enumerate(found):
        mu = friction(run)
        plot.force_stroke(
            run["reduction"] * cylinder.height,
            run["force_N"] / 1e3,
            ax,
            color=COLOUR[mu],
            marker=MARKER[mu],
            ms=4,
            mfc="white" if k % 2 else None,
            markevery=marked(run["reduction"], k / len(found)),
            label=rf"finite elements, $\mu$ = {mu:g}",
        )
    # Most of the elastic rise is left below the frame: the plastic range needs the room.
    first = cylinder.yield_stress * np.pi * cylinder.radius**2 / 1e3
    ax.set(xlabel="stroke [mm]", ylabel="punch force [kN]", xlim=(0, None), ylim=(0.85 * first, None))
    per_cent = 100 / cylinder.height
    top = ax.secondary_xaxis("top", functions=(lambda s: np.multiply(s, per_cent), lambda p: np.divide(p, per_cent)))
    top.set_xlabel("reduction in height [%]")
    ax.legend(loc="upper left")
    return figure


def references(ax: Axes, cylinder: Cylinder, end: float, mus: list[float]) -> None:
    """The closed forms, from below to above."""
    first = cylinder.yield_stress / cylinder.young
    reduction = np.concatenate([[0.0, 0.5 * first], np.linspace(first, end, 200)])
    stroke = reduction * cylinder.height
    ax.plot(stroke, cylinder.exact_force(reduction) / 1e3, "k--", lw=1.1, label=r"exact, $\mu$ = 0")
    plastic, travel = reduction[2:], stroke[2:]
    for mu in mus:
        slab = cylinder.slab_force(plastic, mu) / 1e3
        ax.plot(travel, slab, ls=DASHES[mu], color=COLOUR[mu], lw=1.6, label=rf"slab, $\mu$ = {mu:g}")
    bound = cylinder.sticking_bound(plastic) / 1e3
    ax.plot(travel, bound, "-.", color=GREY, lw=1.1, label="upper bound, full sticking")


def marked(reduction: np.ndarray, shift: float) -> list[int]:
    """Rows nearest to even steps of the reduction, ``shift`` of a step early: increments are uneven."""
    wanted = (np.arange(1, MARKS + 1) - shift) * reduction[-1] / MARKS
    # The curve starts at the origin, one point before the first row.
    return sorted({int(np.abs(reduction - w).argmin()) + 1 for w in wanted})


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    make(draw, "fig_force_stroke", (__doc__ or "").splitlines()[0], argv)


if __name__ == "__main__":
    main()
