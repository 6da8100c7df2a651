"""Solvers over a set of problems: how many each solves, and Dolan and More's performance profiles, as files.

A problem counts as solved by the residual that was measured on the answer, whatever the solver said.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bipot.typing import Floats
from studies.files import replacing
from studies.pictures import drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
DERIVED = ("table.csv", "profile.csv", "profile.png")
"""What :func:`write` writes."""
QUICK = 1e-3
"""Seconds below which times are not told apart."""
LINES = ("-", "--", "-.", ":")


class Measured(Protocol):
    """One problem and one solver."""

    @property
    def id(self) -> str: ...  # noqa: D102
    @property
    def solver(self) -> str: ...  # noqa: D102
    @property
    def residual(self) -> float: ...  # noqa: D102
    @property
    def seconds(self) -> float: ...  # noqa: D102


def solved_table(rows: Iterable[Measured]) -> list[list[str]]:
    """Problems solved at each tolerance and the total time, a line a solver, most solved first."""
    rows = list(rows)
    lines = []
    for name in dict.fromkeys(row.solver for row in rows):
        own = [row for row in rows if row.solver == name]
        counts = [sum(row.residual <= tol for row in own) for tol in TOLERANCES]
        seconds = np.array([row.seconds for row in own])
        median, total = f"{np.median(seconds):.3f}", f"{seconds.sum():.1f}"
        lines.append([name, *map(str, counts), str(len(own)), median, total])
    return sorted(lines, key=lambda line: [-int(n) for n in line[1:5]])


def performance_profile(rows: Iterable[Measured], tol: float) -> dict[str, Floats]:
    """Dolan and More's ratios time / best time over the problems, sorted, inf where not solved at ``tol``."""
    rows = list(rows)
    names, ids = (list(dict.fromkeys(getattr(row, key) for row in rows)) for key in ("solver", "id"))
    seconds = np.full((len(ids), len(names)), np.inf)
    for row in rows:
        if row.residual <= tol:
            seconds[ids.index(row.id), names.index(row.solver)] = max(row.seconds, QUICK)
    best = seconds.min(axis=1, keepdims=True)
    ratios = np.where(np.isfinite(seconds), seconds / np.where(np.isfinite(best), best, 1.0), np.inf)
    return {name: np.sort(ratios[:, k]) for k, name in enumerate(names)}


def write(rows: Sequence[Measured], out: Path, tol: float) -> None:
    """The table and the profile at ``tol``, and its figure where matplotlib is installed."""
    header = ["solver", *(f"{at:.0e}" for at in TOLERANCES), "problems", "median_seconds", "total_seconds"]
    _write_csv(out / DERIVED[0], header, solved_table(rows))
    profile = performance_profile(rows, tol)
    _write_csv(out / DERIVED[1], list(profile), zip(*profile.values(), strict=True))
    drawn(out / DERIVED[2], partial(draw, profile, tol))


def draw(profile: Mapping[str, Floats], tol: float, figure: Figure) -> None:
    """Fill the figure with a step line for each solver, to the ratio where nothing changes any more."""
    axes = figure.subplots()
    finite = [ratio for ratios in profile.values() for ratio in ratios[np.isfinite(ratios)]]
    end = 2 * max(finite, default=1.0)
    for number, (name, ratios) in enumerate(profile.items()):
        solved, total = int(np.isfinite(ratios).sum()), len(ratios)
        # Level from its last problem to the frame, where the line of a solver ends that solves nothing more.
        x, y = [*ratios[:solved], end], [*np.arange(1, solved + 1), solved]
        axes.step(
            x, np.array(y) / total, where="post", ls=LINES[number % len(LINES)], label=f"{name}: {solved}/{total}"
        )
    axes.set(xscale="log", xlim=(1, end), ylim=(0, 1.02))
    axes.set(xlabel="time / best time", ylabel=f"share of problems solved at {tol:.0e}")
    axes.legend(fontsize="small", loc="lower right")


def _write_csv(path: Path, header: Sequence[str], lines: Iterable[Iterable[Any]]) -> None:
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(lines)
