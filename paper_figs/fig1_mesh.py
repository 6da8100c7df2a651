"""Fig. 1: geometry and loading (left); mesh of the quarter model and boundary conditions (right).

python -m paper_figs.fig1_mesh [--results results/upsetting] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from bipot import plot
from bipot.meshes.elements import Element
from bipot.results import History
from paper_figs.common import BLUE, GREEN, PUNCH, VERMILLION, WIDTH, lettered
from paper_figs.shown import Group, cylinder_of, friction, make

ARROW = {"arrowstyle": "-|>", "color": "black", "lw": 1.2, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 10}
DIMENSION = {
    "arrowstyle": "<|-|>",
    "lw": 0.7,
    "shrinkA": 0,
    "shrinkB": 0,
    "mutation_scale": 7,
    "color": "black",
}


SHAPES = {
    Element.T3: "three-node triangles",
    Element.T6: "six-node triangles",
    Element.Q4: "four-node quadrilaterals",
    Element.Q8: "eight-node quadrilaterals",
    Element.Q9: "nine-node quadrilaterals",
}


def draw(groups: list[Group]) -> Figure:
    """Both panels, from the mesh at rest of the first run; where others have other meshes, it says whose it is."""
    figure = Figure(figsize=(WIDTH, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.05))
    first, *others = groups
    same = all(np.array_equal(first.run.mesh.nodes, other.run.mesh.nodes) for other in others)
    left.set_title("cylinder and punches")
    right.set_title("quarter model, at rest")
    lettered((left, right))
    geometry(left, first.run)
    model(right, first.run, "" if same else f" ({first.words})")
    for ax in (left, right):
        ax.set_aspect("equal")
        ax.set_axis_off()
    return figure


# %% The whole cylinder between the punches
def geometry(ax: Axes, run: History) -> None:
    """Side view with dimensions; the modelled quarter is shaded."""
    cylinder = cylinder_of(run)
    R, h = cylinder.radius, cylinder.height / 2
    t = 0.32 * R
    ax.add_patch(Rectangle((-R, -h), 2 * R, 2 * h, facecolor="white", edgecolor="black", lw=1.2))
    ax.add_patch(Rectangle((0, 0), R, h, facecolor=BLUE, alpha=0.18, lw=0))
    for side in (1, -1):
        ax.add_patch(Rectangle((-1.3 * R, side * h if side > 0 else -h - t), 2.6 * R, t, **PUNCH))
        start = (0.12 * R, side * (h + t + 0.34 * R))
        ax.annotate("", (0.12 * R, side * (h + t + 0.03 * R)), start, arrowprops=ARROW)
    ax.text(0.2 * R, h + t + 0.17 * R, "rigid punch", va="center")
    ax.text(0.2 * R, -h - t - 0.21 * R, "rigid punch", va="center")
    ax.plot([0, 0], [-h - 1.35 * t, h + 1.9 * t], color="black", lw=0.7, dashes=(8, 2, 1.5, 2))
    ax.plot([-1.08 * R, 1.08 * R], [0, 0], color="black", lw=0.7, dashes=(8, 2, 1.5, 2))
    ax.text(0.5 * R, 0.5 * h, "modelled\nquarter", ha="center", va="center")
    x, y = -1.5 * R, -h - 2.5 * t
    ax.annotate("", (x, h), (x, -h), arrowprops=DIMENSION)
    ax.text(x - 0.06 * R, 0, f"$L_0$ = {2 * h:g} mm", rotation=90, ha="right", va="center")
    ax.annotate("", (R, y), (-R, y), arrowprops=DIMENSION)
    ax.text(0, y - 0.06 * R, f"$D_0$ = {2 * R:g} mm", ha="center", va="top")
    for edge in (-h, h):
        ax.plot([x - 0.06 * R, -1.3 * R], [edge, edge], color="black", lw=0.4)
    for edge in (-R, R):
        ax.plot([edge, edge], [-h - t, y - 0.06 * R], color="black", lw=0.4)
    ax.set(xlim=(-1.85 * R, 1.4 * R), ylim=(-h - 3.4 * t, h + 2.2 * t))


# %% The quarter model
def model(ax: Axes, run: History, whose: str) -> None:
    """Mesh, rollers on the planes of symmetry, contact candidates, punch."""
    mesh, cylinder = run.mesh, cylinder_of(run)
    R, h = cylinder.radius, cylinder.height / 2
    plot.mesh(mesh.nodes, mesh.elements, ax, color="0.45")
    ax.plot(*mesh.nodes.T, ".", color="black", ms=1.8, zorder=3)
    for name in run.scene["tools"][0]["candidates"]:
        plot.boundary(mesh.nodes, mesh.boundary(name), ax, color=VERMILLION, lw=2.4)
    ax.add_patch(Rectangle((-0.04 * R, h + 0.02 * R), 1.3 * R, 0.15 * R, **PUNCH))
    ax.annotate("", (0.5 * R, h + 0.19 * R), (0.5 * R, h + 0.38 * R), arrowprops=ARROW)
    holds = "welded" if np.isinf(friction(run)) else r"Coulomb friction $\mu$"
    ax.text(0.54 * R, h + 0.28 * R, rf"$\bar u_z$, {holds}", va="center")
    rollers(ax, np.linspace(0.05, 0.95, 10)[:, None] * [0.0, h], (-1, 0))
    rollers(ax, np.linspace(0.05, 0.95, 10)[:, None] * [R, 0.0], (0, -1))
    ax.text(-0.16 * R, h / 2, "$u_r = 0$ (axis)", rotation=90, ha="right", va="center", color=GREEN)
    ax.text(R / 2, -0.13 * R, "$u_z = 0$ (symmetry plane)", ha="center", va="top", color=GREEN)
    ax.text(1.06 * R, h / 2, "contact candidates", rotation=90, ha="left", va="center", color=VERMILLION)
    ax.text(
        0.55 * R,
        -0.27 * R,
        f"{len(mesh.elements)} {SHAPES[mesh.element]}, {len(mesh.nodes)} nodes{whose}",
        ha="center",
        va="top",
    )
    frame(ax, R)
    ax.set(xlim=(-0.55 * R, 1.32 * R), ylim=(-0.42 * R, h + 0.42 * R))


def rollers(ax: Axes, points: np.ndarray, outwards: tuple[int, int]) -> None:
    """Small wheels outside the boundary at ``points`` (m, 2)."""
    radius = 0.018 * np.abs(points).max()
    centre = points + radius * 1.3 * np.array(outwards)
    ax.plot(*centre.T, "o", ms=3.6, mfc="white", mec=GREEN, mew=1.0, clip_on=False)
    wall = centre[[0, -1]] + 1.7 * radius * np.array(outwards)
    ax.plot(*wall.T, color=GREEN, lw=1.0)


def frame(ax: Axes, R: float) -> None:
    """The axes r and z."""
    origin = (-0.48 * R, -0.34 * R)
    for tip, name, offset in (((0.2, 0.0), "$r$", (0.02, 0.0)), ((0.0, 0.2), "$z$", (0.0, 0.04))):
        end = (origin[0] + tip[0] * R, origin[1] + tip[1] * R)
        ax.annotate("", end, origin, arrowprops={**ARROW, "lw": 0.9, "mutation_scale": 8})
        ax.text(
            end[0] + offset[0] * R,
            end[1] + offset[1] * R,
            name,
            ha="left" if tip[0] else "center",
            va="center",
        )


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    make(draw, "fig1_mesh", (__doc__ or "").splitlines()[0], argv)


if __name__ == "__main__":
    main()
