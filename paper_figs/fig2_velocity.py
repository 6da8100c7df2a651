"""Fig. 2: nodal velocity at the end of the stroke on the deformed mesh, for both friction coefficients.

Velocities are those of the last increment over the punch speed, du/dtau / |travel|. The paper reads from its
Fig. 2 that the elements keep their form, so that no remeshing is needed; the measures printed in each panel
(:mod:`studies.quality`) say how far that is so: the Jacobian ratio (1 a parallelogram, <= 0 folded) and the
aspect ratio (1 a square), beside that of the frictionless cylinder, (1 - reduction)^(-3/2).

python -m paper_figs.fig2_velocity [--results results/upsetting] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from bipot import plot
from bipot.results import History
from paper_figs.common import PUNCH, WIDTH, friction, make, punch_travel
from studies.quality import quality

ARROW_MM = 0.42
"""Length of the arrow of a node as fast as the punch."""


def draw(found: list[History]) -> Figure:
    """One panel a friction coefficient, on one scale."""
    figure = Figure(figsize=(WIDTH, 2.45), layout="constrained")
    axes = figure.subplots(1, len(found), sharex=True, sharey=True)
    for ax, run, letter in zip(axes, found, "ab", strict=True):
        panel(ax, run, letter)
    right, top = np.max([run.state().nodes.max(axis=0) for run in found], axis=0)
    axes[0].set(xlim=(-0.15, right + 1.8 * ARROW_MM), ylim=(-0.5 * top, 1.14 * top), ylabel="$z$ [mm]")
    axes[0].set_yticks(np.arange(top + 0.2))
    return figure


def panel(ax: Axes, run: History, letter: str) -> None:
    """Mesh, punch, arrows, and what the mesh is worth."""
    state, mesh = run.state(), run.mesh
    height = state.nodes[:, 1].max()
    plot.mesh(state.nodes, mesh.elements, ax, color="0.68", lw=0.5)
    for edges in mesh.boundaries.values():
        plot.boundary(state.nodes, edges, ax, lw=0.8)
    speed = punch_travel(run)
    arrows = plot.vectors(state.nodes, state.velocity / speed, ax, ARROW_MM, color="#004B77")
    ax.add_patch(Rectangle((-1, height), 3 * state.nodes.max(), height, **PUNCH))
    reduction = run["reduction"][-1]
    worth = quality(state.nodes, mesh.elements)
    frictionless = (1 - reduction) ** -1.5
    words = (
        f"smallest Jacobian ratio {worth.jacobian.min():.2f} (1: undistorted, 0: folded)\n"
        f"worst aspect ratio {worth.aspect.max():.1f} (1: square; without friction {frictionless:.1f})"
    )
    ax.text(0.02, 0.27, words, transform=ax.transAxes, va="top", linespacing=1.25, fontsize=7.5)
    key: dict[str, Any] = {
        "labelpos": "E",
        "coordinates": "axes",
        "labelsep": 0.06,
        "fontproperties": {"size": 7.5},
    }
    ax.quiverkey(arrows, 0.078, 0.07, ARROW_MM, "punch speed", **key)
    ax.set_aspect("equal")
    ax.set_title(rf"({letter}) $\mu$ = {friction(run):g}, reduction {100 * reduction:g} %")
    ax.set_xlabel("$r$ [mm]")


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    make(draw, "fig2_velocity", (__doc__ or "").splitlines()[0], argv)


if __name__ == "__main__":
    main()
