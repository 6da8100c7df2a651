r"""Total error of the force curve over time, by element, form and program: a column a coefficient.

Above: the run alone; below: the whole process, with the start of Python. Under the grey edge errors are within the band
of the limit, where no run is known to be better than another.

python -m paper_figs.fig_total_error [--results results/accuracy_total] [--out DIR]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bipot.meshes.layout import Layout
from bipot.tools.tool import Sampling
from paper_figs.common import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, WIDTH, from_results, lettered, rows_of
from studies.accuracy.choice import FOREIGN, OWN
from studies.accuracy.deck import FACES, NODES
from studies.accuracy.total import NAME
from studies.accuracy.total_row import Row, front
from studies.element_types import ElementType
from studies.methods import Method

COMMAND = f"python -m studies.accuracy.{NAME} --out {{out}}"
MEASURES = {"seconds": "processor time of the run [s]", "process_seconds": "processor time of the process [s]"}

ELEMENTS: dict[ElementType, dict[str, Any]] = {
    ElementType.Q8: {"color": VERMILLION, "marker": "s"},
    ElementType.Q4P0: {"color": BLUE, "marker": "o"},
    ElementType.Q8P1: {"color": GREEN, "marker": "^"},
    ElementType.Q9P1: {"color": PURPLE, "marker": "D"},
    ElementType.T6: {"color": ORANGE, "marker": "v"},
    ElementType.Q4: {"color": GREY, "marker": "o"},
    ElementType.Q9: {"color": GREY, "marker": "D"},
    ElementType.T3: {"color": GREY, "marker": "v"},
}
FORMS = {Method.TANGENT: "1", Method.DISSIPATION: "2", Method.UZAWA: "3", Method.PENALTY: "4"}
PEERS: dict[tuple[str, str], dict[str, Any]] = {
    ("CAX8R", NODES): {"marker": "X", "mfc": "black"},
    ("CAX8R", FACES): {"marker": "P", "mfc": "black"},
    ("CAX8", FACES): {"marker": "P", "mfc": "white"},
    ("CAX4R", NODES): {"marker": "*", "mfc": "white"},
    ("CAX4R", FACES): {"marker": "*", "mfc": "black"},
    ("CAX4", FACES): {"marker": "p", "mfc": "white"},
}


class Look(NamedTuple):
    """What a series is called and how its points look."""

    label: str
    style: dict[str, Any]


def look(row: Row) -> Look:
    """By program, form, element, layout, rule and contact."""
    if row.program == FOREIGN:
        style = next(style for (e, c), style in PEERS.items() if (e, c.lower()) == (row.element, row.contact))
        return Look(f"CalculiX {row.element}, {row.contact.removesuffix(' to surface')}s", {"color": "black"} | style)
    kind, method = ElementType(row.element), Method(row.form)
    style = dict(ELEMENTS[kind])
    if method is not Method.NEWTON:
        return Look(f"{row.element}, {row.form}", style | {"marker": FORMS[method], "ms": 8, "mew": 1.4})
    words = [row.element]
    style |= {"mfc": "none"}
    if row.layout == Layout.FANNED.value:
        words.append(row.layout)
        style["mfc"] = style["color"]
    if row.contact == Sampling.WEIGHTED.value:
        words.append("weighted contact")
        style |= {"marker": "h", "color": SKY}
    if row.quadrature != kind.quadrature.value:
        words.append("2 x 2 points")
        style |= {"marker": "s", "color": SKY}
    return Look(", ".join(words), style)


def draw(rows: Sequence[Row]) -> Figure:
    """Measures of time by coefficients."""
    mus = sorted({row.mu for row in rows})
    figure = Figure(figsize=(WIDTH, 7.4), layout="constrained")
    axes = figure.subplots(len(MEASURES), len(mus), sharex=True, sharey=True, squeeze=False)
    for line, (measure, words) in zip(axes, MEASURES.items(), strict=True):
        for ax, mu in zip(line, mus, strict=True):
            panel(ax, [row for row in rows if row.mu == mu], measure)
            ax.set_xlabel(words)
            ax.tick_params(labelbottom=True)
        line[0].set_ylabel("largest relative error of the force")
    for ax, mu in zip(axes[0], mus, strict=True):
        ax.set_title(f"$\\mu$ = {mu:g}")
    lettered(axes.flat)
    errors = [row.force_error for row in rows if not math.isnan(row.force_error)]
    # The panels share it.
    axes[0, 0].set_ylim(min([row.band for row in rows] + errors) / 2, max(errors, default=1.0) * 2)
    found = [ax.get_legend_handles_labels() for ax in axes.flat]
    once = {label: handle for handles, labels in found for handle, label in zip(handles, labels, strict=True)}
    figure.legend(list(once.values()), list(once), loc="outside lower center", ncols=3)
    return figure


def panel(ax: Axes, rows: Sequence[Row], measure: str) -> None:
    """Points of runs that came to the end, fronts of both programs, the band."""
    ended = [row for row in rows if not math.isnan(row.known)]
    looks = {row: look(row) for row in ended}
    for label, style in {found.label: found.style for found in looks.values()}.items():
        chosen = [row for row, found in looks.items() if found.label == label]
        points = [getattr(row, measure) for row in chosen], [row.force_error for row in chosen]
        ax.loglog(*points, ls="none", label=label, **{"ms": 5, "mew": 0.9} | style)
    for program, colour, line in ((OWN, BLUE, "-"), (FOREIGN, "black", "--")):
        best = front((row for row in ended if row.program == program), measure)
        if best:
            corners = [getattr(row, measure) for row in best], [row.known for row in best]
            ax.step(*corners, where="post", color=colour, ls=line, lw=1.0, label=f"best of {program}")
    band = max(row.band for row in rows)
    ax.axhspan(1e-9, band, color="0.85", zorder=0, label="within the band of the limit")


def figures(results: Path) -> dict[str, Figure]:
    """The one, by its name."""
    return {"fig_total_error": draw(rows_of(results / f"{NAME}.csv", Row, COMMAND))}


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    from_results(argv, __doc__, f"results/accuracy_{NAME}", figures)


if __name__ == "__main__":
    main()
