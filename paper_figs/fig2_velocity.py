"""Fig. 2: nodal velocity at the end of the stroke on the deformed mesh, a panel a run, the trustworthy one beside.

Velocities are those of the last increment over the punch speed, du/dtau / |travel|. The paper reads from its
Fig. 2 that the elements keep their form, so that no remeshing is needed; the measures printed below each panel
(:mod:`studies.quality`) say how far that is so, beside what they were at rest: the Jacobian ratio (<= 0 folded; 0 where
an angle between straight edges has become straight, on the punch) and the stretch ratio, beside that of the
frictionless cylinder, (1 - reduction)^(-3/2).

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
from bipot.fem.orientation import STRAIGHT
from bipot.results import History
from paper_figs.common import LANDED, PUNCH, letters
from paper_figs.shown import Group, carrying, make, paired, side_nodes, titled, width_of
from studies.quality import quality, stretch_ratios

ARROW = 0.085
"""Length of the arrow of a node as fast as the punch, over the largest radius at rest."""

BELOW, ABOVE = 0.24, 0.14
"""Room under the plane of symmetry for the scale of arrows, and that of the punch, over the largest radius at rest."""

WORDS, MARGIN = 1.12, 0.5
"""Height of what is written above and below a panel, width of what is beside it, inches."""


def draw(groups: list[Group]) -> Figure:
    """One panel a run on one scale: those of a coefficient side by side."""
    runs = [run for group in groups for run in group.runs]
    lines = paired(groups, [[run] for run in runs])
    size = max(float(run.mesh.nodes[:, 0].max()) for run in runs)
    right, top = np.max([run.state().nodes.max(axis=0) for run in runs], axis=0)
    xlim, ylim = (-0.03 * size, right + 1.8 * ARROW * size), (-BELOW * size, top + ABOVE * size)
    width = width_of(len(lines[0]))
    height = (width / len(lines[0]) - MARGIN) * (ylim[1] - ylim[0]) / (xlim[1] - xlim[0])
    figure = Figure(figsize=(width, len(lines) * (height + WORDS)), layout="compressed")
    axes = figure.subplots(len(lines), len(lines[0]), squeeze=False)
    cells = [(ax, run) for line, row in zip(axes, lines, strict=True) for ax, run in zip(line, row, strict=True)]
    named_by = letters()
    for ax, run in cells:
        if run is None:
            ax.set_axis_off()
            continue
        panel(ax, run, next(named_by), size)
        ax.set(xlim=xlim, ylim=ylim)
        ax.set_yticks([tick for tick in ax.get_yticks() if 0 <= tick <= ylim[1]])
    for ax in axes[:, 0]:
        ax.set_ylabel("$z$ [mm]")
    return figure


def panel(ax: Axes, run: History, letter: str, size: float) -> None:
    """Mesh, punch, arrows, and what the mesh is worth."""
    state, mesh = run.state(), run.mesh
    height = float(mesh.nodes[:, 1].max() * (1 - run["reduction"][-1]))
    plot.mesh(state.nodes, mesh.elements, ax, color="0.68", lw=0.5)
    for edges in mesh.boundaries.values():
        plot.boundary(state.nodes, edges, ax, lw=0.8)
    speed = abs(float(run.scene["tools"][0]["travel"][1]))
    arrows = plot.vectors(state.nodes, state.velocity / speed, ax, ARROW * size, color="#004B77")
    ax.add_patch(Rectangle((-size, height), 3 * float(state.nodes.max()) + size, size, **PUNCH))
    side = side_nodes(run)
    landed = side[carrying(run, len(run) - 1, side)]
    ax.plot(*state.nodes[landed].T, **LANDED)
    key: dict[str, Any] = {"labelpos": "E", "coordinates": "data", "labelsep": 0.06, "fontproperties": {"size": 7.5}}
    ax.quiverkey(arrows, 0.12 * size, -0.6 * BELOW * size, ARROW * size, "punch speed", **key)
    ax.set_aspect("equal")
    ax.set_title(titled(letter, run, len(run) - 1))
    ax.set_xlabel(f"$r$ [mm]\n{worth(run, len(landed))}", linespacing=1.35, fontsize=7.2)


def worth(run: History, landed: int) -> str:
    """The worst elements in words, and how many nodes of the side have ``landed``."""
    mesh, nodes = run.mesh, run.state().nodes
    now, rest = (float(quality(x, mesh.elements).jacobian.min()) for x in (nodes, mesh.nodes))
    stretch = float(stretch_ratios(nodes, mesh.elements, mesh.nodes).max())
    uniform = (1 - run["reduction"][-1]) ** -1.5
    straight = abs(now) < STRAIGHT
    value, means = ("0", "straight angle on punch") if straight else (f"{now:.2g}", "folded below 0")
    return (
        f"smallest Jacobian ratio {value} (at rest {rest:.2g}; {means})\n"
        f"largest stretch ratio {stretch:.1f} (at rest 1; without friction {uniform:.1f})\n"
        f"nodes of the side that landed on the punch: {landed or 'none'}{' (triangles)' if landed else ''}"
    )


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    make(draw, "fig2_velocity", (__doc__ or "").splitlines()[0], argv)


if __name__ == "__main__":
    main()
