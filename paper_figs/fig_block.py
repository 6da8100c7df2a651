r"""The upset block: its eighth as it is at the end, and pressure and slip on the face under the platen, a line a run.

Pressures are nodal, :func:`bipot.traction.nodal_tractions`; slips are those of the last increment over the platen's
travel in it.

python -m paper_figs.fig_block [--results results/block] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.tri import Triangulation

from bipot.errors import ResultsError
from bipot.fem.reduction import Geometry
from bipot.laws.coulomb import Status
from bipot.results import History
from bipot.results import open as open_results
from bipot.typing import Bools, Ints
from paper_figs.common import LANDED, WIDTH, from_results, legend_below, lettered, require_run

COMMAND = "python -m studies.block --out {results}"
COLUMNS = "reduction", "force_N"
FACES = ("right", "back", "top")
"""What the drawing of the eighth shows, seen from the first octant."""

SEEN = np.array([[-np.sqrt(0.5), np.sqrt(0.5), 0.0], [-0.35, -0.35, np.sqrt(1 - 2 * 0.35**2)]])
"""Axes (2, 3) of the drawing."""

ARROW = 0.12
"""Length of the arrow of a node that slips as far as the platen goes, over the half width."""

STUCK: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.2, "mfc": "white", "mec": "black", "mew": 0.6, "zorder": 4}


def draw(runs: Sequence[History]) -> Figure:
    """A line a run: the eighth, and its face from above."""
    figure = Figure(figsize=(WIDTH, 3.2 * len(runs)), layout="constrained")
    axes = figure.subplots(len(runs), 2, squeeze=False)
    largest = max(float(np.nanmax(run.at().nodal("contact_pressure"))) for run in runs)
    colours = ScalarMappable(Normalize(0.0, largest), "viridis")
    for (left, right), run in zip(axes, runs, strict=True):
        said = rf"$\mu$ = {run.scene['tools'][0]['mu']:g}: {run['force_N'][-1]:.0f} N at {run['reduction'][-1]:.0%}"
        eighth(left, run, colours)
        face(right, run, colours)
        left.set(title=said, aspect="equal")
        right.set(title="face under the platen, from above", aspect="equal", xlabel="$x$ [mm]", ylabel="$y$ [mm]")
    lettered(axes.flat)
    figure.colorbar(colours, ax=axes, label="contact pressure [MPa]", shrink=0.7)
    handles = [
        Line2D([], [], label="sticks", **STUCK),
        Line2D([], [], label="node of a side on the platen", **LANDED),
    ]
    legend_below(figure, handles, 2)
    return figure


def eighth(ax: Axes, run: History, colours: ScalarMappable) -> None:
    """The three sides that are no planes of symmetry; those under the platen in the colour of their pressure."""
    nodes, pressure = run.at().nodes, run.at().nodal("contact_pressure")
    for name in FACES:
        faces = run.mesh.boundary(name)
        found = pressure[faces].mean(axis=1)
        colour = np.where(np.isfinite(found)[:, None], colours.to_rgba(np.nan_to_num(found)), (0.93, 0.93, 0.93, 1.0))
        drawn = nodes[faces] @ SEEN.T
        ax.add_collection(PolyCollection(list(drawn), facecolors=colour, edgecolors="0.25", linewidths=0.4))
    ax.autoscale_view()
    ax.set_axis_off()
    corner = np.array([nodes[:, 0].max(), 0.0, 0.0]), np.array([0.0, nodes[:, 1].max(), 0.0])
    for name, way in zip("xy", corner, strict=True):
        at = (1.07 * way + [0, 0, nodes[:, 2].max()]) @ SEEN.T
        ax.annotate(f"${name}$", (at[0], at[1]), ha="center", va="center")


def face(ax: Axes, run: History, colours: ScalarMappable) -> None:
    """Pressure by colour, slips as arrows, nodes that stick, and those of the sides that came onto the platen."""
    step, size = run.at(), float(run.mesh.nodes[:, 0].max())
    pressure, status = step.nodal("contact_pressure"), step.nodal("status")
    carried = step.nodal("contact_force")[:, 2] < 0
    x = step.nodes[:, :2]
    covered = Triangulation(x[:, 0], x[:, 1], _triangles(run, np.isfinite(pressure)))
    low, high = colours.get_clim()
    ax.tripcolor(covered, np.nan_to_num(pressure), shading="gouraud", cmap=colours.cmap, vmin=low, vmax=high)
    slips = np.flatnonzero(carried & (status == Status.SLIP))
    travel = abs(float(run.scene["tools"][0]["travel"][2]))
    by = step.state.velocity[slips, :2] / travel
    arrows = ax.quiver(
        *x[slips].T, *(ARROW * size * by).T, angles="xy", scale_units="xy", scale=1.0, color="white", width=0.007,
        edgecolor="black", linewidth=0.4,
    )  # fmt: skip
    ax.quiverkey(arrows, 0.12, 0.94, ARROW * size, "slip as far as the platen goes", labelpos="E", coordinates="axes")
    ax.plot(*x[carried & (status == Status.STICK)].T, **STUCK)
    side = np.setdiff1d(run.mesh.boundary_nodes("right", "back"), run.mesh.boundary_nodes("top"))
    ax.plot(*x[side[carried[side]]].T, **LANDED)
    reach = float(x.max()) + ARROW * size
    # Above it there is room for what the arrows mean.
    ax.set(xlim=(-0.04 * size, reach), ylim=(-0.04 * size, reach + 0.15 * size))


def _triangles(run: History, known: Bools) -> Ints:
    """Halves (f, 3) of the faces of the sides all of whose nodes have a pressure."""
    faces = np.concatenate([run.mesh.boundary(name) for name in FACES])
    whole = faces[known[faces].all(axis=1)]
    return np.concatenate([whole[:, [0, 1, 2]], whole[:, [0, 2, 3]]])


def figures(results: Path) -> dict[str, Figure]:
    """The one, by its name."""
    folders = sorted(path for path in results.glob("mu*") if (path / "history.csv").is_file())
    if not folders:
        raise ResultsError(f"{results}: no results; run: {COMMAND.format(results=results)}")
    return {"fig_block": draw([_read(folder) for folder in folders])}


def _read(folder: Path) -> History:
    """The run of a folder, which must be one of the study that has come to an increment."""
    run = open_results(folder)
    require_run(run, "studies.block", Geometry.SOLID, COLUMNS, FACES)
    if not len(run):
        raise ResultsError(f"{run.file}: no increment is recorded: there is nothing to draw")
    return run


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    from_results(argv, __doc__, "results/block", figures)


if __name__ == "__main__":
    main()
