r"""Tractions along the punch and the force with the paper's element and with the best one, against the finest mesh.

Above recovered pressure and shear at 45 %, with as many unknowns as in the paper and on the finest mesh; then the force
over that without friction, with the band of its limit (:mod:`studies.accuracy.limits`) at every reduction; below the
distance of the force at 45 % on the smooth curve through each run (:mod:`studies.accuracy.smooth`) from its limit, with
the half width of that limit's band, over the unknowns.

python -m paper_figs.fig_mesh [--results results/accuracy] [--out DIR]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bipot.meshes.layout import Layout
from bipot.paper import upsetting
from bipot.typing import Floats
from paper_figs.common import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, WIDTH, from_results, lettered, rows_of
from studies.accuracy.limits import Limit, courses_of, limit
from studies.accuracy.mesh import NAME, REDUCTION
from studies.accuracy.mesh import name as named
from studies.accuracy.row import Discretisation, Row
from studies.accuracy.smooth import AT, smoothed
from studies.closed_forms import Cylinder
from studies.element_types import ElementType
from studies.outputs import read_curves
from studies.tables import read_rows

Curves = Mapping[Row, Mapping[str, Any]]

COMMAND = "python -m studies.accuracy.mesh --out {out}"
FORCE = "force_N"
PAPERS = Discretisation(ElementType.Q8)
BEST = Discretisation(ElementType.Q4P0)
FINEST = Discretisation(ElementType.Q4P0, Layout.FANNED)
Q8P1, Q9P1 = Discretisation(ElementType.Q8P1, Layout.FANNED), Discretisation(ElementType.Q9P1, Layout.FANNED)
LOOKS: dict[Discretisation, dict[str, Any]] = {
    PAPERS: {"color": VERMILLION, "marker": "o", "label": "Q8 (the paper's)"},
    BEST: {"color": BLUE, "marker": "s", "label": "Q4/P0"},
    FINEST: {"color": ORANGE, "marker": "v", "ls": "--", "label": "Q4/P0, fanned"},
    Q8P1: {"color": GREEN, "marker": "^", "ls": "--", "label": "Q8/P1, fanned"},
    Q9P1: {"color": PURPLE, "marker": "D", "ls": "--", "label": "Q9/P1, fanned"},
}
TEETH = "jumps: nodes of the side land"
GRID = np.linspace(0.02, REDUCTION, 87)
"""Reductions of the band."""


def draw(rows: Sequence[Row], limits: Sequence[Limit], curves: Curves) -> Figure:
    """A column a coefficient with friction."""
    mus = sorted({row.mu for row in rows if row.mu > 0})
    figure = Figure(figsize=(WIDTH, 8.9), layout="constrained")
    axes = figure.subplots(4, len(mus), squeeze=False, height_ratios=(1, 1, 1.35, 1.25))
    for (pressure, shear, force, error), mu in zip(axes.T, mus, strict=True):
        mine = [row for row in rows if row.mu == mu]
        pressure.set_title(rf"$\mu$ = {mu:g}")
        tractions(pressure, shear, mine, curves)
        forces(force, mine, curves)
        errors(error, mine, curves, [one for one in limits if one.mu == mu and one.quantity == FORCE])
    lettered(axes.flat)
    axes[0, 0].set_ylabel("recovered pressure\nat 45 % [MPa]")
    axes[1, 0].set_ylabel("recovered shear, size,\nat 45 % [MPa]")
    axes[2, 0].set_ylabel("force over that\nwithout friction")
    axes[3, 0].set_ylabel("smooth force at 45 %\nfrom its limit, relative")
    axes[1, 0].legend(loc="upper left")
    axes[2, 0].legend(loc="upper left")
    figure.legend(*_keys(axes[3]), loc="outside lower center", ncols=3)
    return figure


def chosen(rows: Sequence[Row]) -> list[tuple[Row, dict[str, Any]]]:
    """The paper's mesh, one of about as many unknowns of the best element, and the finest, with their looks."""
    papers = next((row for row in _of(rows, PAPERS) if row.elements == 10), None) or _of(rows, PAPERS)[-1]
    near = min(_of(rows, BEST), key=lambda row: abs(row.unknowns - papers.unknowns))
    return [
        (papers, LOOKS[PAPERS] | _said(papers, "Q8")),
        (near, LOOKS[BEST] | _said(near, "Q4/P0")),
        (_of(rows, FINEST)[-1], {"color": "black", "ls": "--", **_said(_of(rows, FINEST)[-1], "Q4/P0, fanned")}),
    ]


def tractions(pressure: Axes, shear: Axes, rows: Sequence[Row], curves: Curves) -> None:
    """Along the punch, from the axis to the last node that carries."""
    for row, look in chosen(rows):
        along = curves[row]
        style: dict[str, Any] = {"lw": 0.9, "ms": 3, **look}
        pressure.plot(along["radius"], along["pressure"], **style)
        shear.plot(along["radius"], np.abs(along["shear"]), **style)
    (papers, _), *others = chosen(rows)
    largest = max(float(curves[row]["pressure"].max()) for row, _ in others)
    pressure.set(ylim=(0, 1.05 * largest), xlim=(0, None))
    _say_outside(pressure, curves[papers]["pressure"])
    pressure.tick_params(labelbottom=False)
    shear.set(xlabel="radius [mm]", xlim=pressure.get_xlim(), ylim=(0, None))


def _say_outside(ax: Axes, values: Floats) -> None:
    """How many values are above the frame, and up to where."""
    above = values[values > ax.get_ylim()[1]]
    if above.size:
        said = f"{above.size} of Q8 above the frame,\nup to {above.max():.0f} MPa"
        ax.text(0.03, 0.95, said, transform=ax.transAxes, va="top", fontsize=7, color=GREY)


def forces(ax: Axes, rows: Sequence[Row], curves: Curves) -> None:
    """The courses over the closed form without friction, and the band of the limit of the smooth ones."""
    (courses,) = courses_of(rows, curves).values()
    told = np.array([limit(courses, FORCE, reduction)[:2] for reduction in GRID.tolist()])
    free = cylinder().exact_force(GRID)
    value, band = told.T
    edges = (value - band) / free, (value + band) / free
    ax.fill_between(100 * GRID, *edges, color="0.75", lw=0, label="band of the force's limit", zorder=0)
    for row, look in chosen(rows):
        kept = curves[row][AT] >= GRID[0]
        x, F = curves[row][AT][kept], curves[row][FORCE][kept]
        style: dict[str, Any] = look | {"marker": "", "lw": 0.9}
        ax.plot(100 * x, F / cylinder().exact_force(x), **style)
    ax.set(xlabel="reduction [%]", xlim=(0, 100 * REDUCTION))
    ax.set_title(TEETH, fontsize=8)


def cylinder() -> Cylinder:
    """The whole cylinder of which the study models a quarter."""
    scene = upsetting(mu=0.0, elements=1)
    radius, half_height = scene.mesh.nodes.max(axis=0).tolist()
    elastic = scene.material.elasticity
    return Cylinder(2 * half_height, radius, elastic.young, elastic.poisson, float(scene.material.yield_stress(0.0)))


def errors(ax: Axes, rows: Sequence[Row], curves: Curves, limits: Sequence[Limit]) -> None:
    """Of the smooth curve's force, over the unknowns, with the limit's band."""
    for found in (one for one in limits if one.reduction == REDUCTION):
        ax.axhline(
            found.band / found.value, color=GREY, lw=0.8, ls=":", zorder=0, label="half width of the limit's band"
        )
        for kind, look in LOOKS.items():
            if mine := _of(rows, kind):
                off = [abs(smoothed(curves[row], FORCE, REDUCTION) / found.value - 1) for row in mine]
                ax.loglog([row.unknowns for row in mine], off, **{"ms": 4, "lw": 0.9, **look})
    ax.set(xlabel="unknowns")
    if stopped := [f"{look['label']}, {side} a side" for kind, look in LOOKS.items() for side in _stopped(rows, kind)]:
        said = "stopped before the end:\n" + "\n".join(stopped)
        ax.text(0.03, 0.03, said, transform=ax.transAxes, va="bottom", fontsize=7, color=GREY)


def _said(row: Row, word: str) -> dict[str, str]:
    return {"label": f"{word}, {row.elements} a side"}


def _keys(axes: Sequence[Axes]) -> tuple[list[Any], list[str]]:
    """Of all axes, each once."""
    found = dict[str, Any]()
    for ax in axes:
        found |= {label: handle for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    return list(found.values()), list(found)


def _stopped(rows: Sequence[Row], kind: Discretisation) -> list[int]:
    """Elements a side of runs that did not come to the end."""
    return sorted({row.elements for row in rows if row.of == kind} - {row.elements for row in _of(rows, kind)})


def _of(rows: Sequence[Row], kind: Discretisation) -> list[Row]:
    """Those of a discretisation at the end, from coarse to fine."""
    mine = [row for row in rows if (row.of, row.reduction) == (kind, REDUCTION)]
    return sorted(mine, key=lambda row: row.elements)


def figures(results: Path) -> dict[str, Figure]:
    """The one, by its name."""
    rows = rows_of(results / f"{NAME}.csv", Row, COMMAND)
    limits, found = read_rows(results / "limits.csv", Limit), read_curves(results / f"{NAME}.h5")
    return {f"fig_{NAME}": draw(rows, limits, {row: found[named(row)] for row in rows})}


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    from_results(argv, __doc__, "results/accuracy", figures)


if __name__ == "__main__":
    main()
