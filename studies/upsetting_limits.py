"""The table that puts forces of runs beside what refined meshes tend to: a line a coefficient and reduction."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bipot.results import History
from studies.accuracy.limits import Limit
from studies.known_limits import FORCE, KEPT, limits_of
from studies.run_names import element_of, friction_of, side_of

DIGITS = 9
"""Of reductions: what is the same one."""

TITLE = "force_N at reductions, between increments with F (1 - reduction) linear; blank where none is known"
MEANING = (
    "limit, +-: what refined meshes tend to, without the jumps of nodes that land, and half the width of its band;"
    " off: of the run's force, which jumps, from it"
)


def against_limits(runs: Sequence[History], path: Path = KEPT) -> str:
    """Forces at the reductions of the limits and at the ends of the runs, and their distances from the limits.

    Nothing of runs of one element without limits: what they have to tell is in the table of runs.
    """
    names = list(dict.fromkeys(map(_name, runs)))
    lines = [["mu", "reduction", "limit", "+-", *(cell for name in names for cell in (name, "off"))]]
    for mu in dict.fromkeys(map(_mu, runs)):
        mine = [run for run in runs if _mu(run) == mu]
        limits = {round(one.reduction, DIGITS): one for run in mine for one in limits_of(run, path)}
        ends = {round(float(run["reduction"][-1]), DIGITS) for run in mine}
        marks = sorted({mark for mark in limits if mark <= max(ends)} | ends)
        lines += [_line(mu, mark, limits.get(mark), {_name(run): run for run in mine}, names) for mark in marks]
    if len(names) == 1 and not any(limits_of(run, path) for run in runs):
        return ""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    rows = ["  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in lines]
    return "\n".join([TITLE, *rows, MEANING])


def force_at(run: History, reduction: float) -> float | None:
    """The force at a reduction, N; None where the run does not come so far, or begins later.

    Linear in F (1 - reduction), which is nearly constant where the volume is.
    """
    known, force = run["reduction"], run[FORCE]
    if not known[0] <= reduction <= known[-1] + 10.0**-DIGITS:
        return None
    return float(np.interp(reduction, known, force * (1 - known)) / (1 - min(reduction, known[-1])))


def _line(mu: float, mark: float, limit: Limit | None, mine: dict[str, History], names: Sequence[str]) -> list[str]:
    known = ["", ""] if limit is None else [f"{limit.value:.0f}", f"{limit.band:.0f}"]
    return [
        friction_of(mu),
        f"{100 * mark:.6g} %",
        *known,
        *(c for n in names for c in _cells(mine.get(n), mark, limit)),
    ]


def _cells(run: History | None, mark: float, limit: Limit | None) -> tuple[str, str]:
    force = None if run is None else force_at(run, mark)
    if force is None:
        return "", ""
    return f"{force:.1f}", "" if limit is None else f"{100 * (force / limit.value - 1):+.2f} %"


def _name(run: History) -> str:
    return f"{element_of(run)} {side_of(run) or ''}".strip()


def _mu(run: History) -> float:
    return run.scene["tools"][0]["mu"]
