"""Costs in space: the block of :mod:`studies.block` between platens by Newton's method, on finer and finer bricks.

    python -m benchmarks.space [--mu 0.1 0.3] [--sizes 8 12 16] [--reduction 0.3] [--fast] [--out DIR]

Writes ``DIR/space.csv``, a row for each coefficient and number of elements a side, marched after the start-up in
increments of 1 %, where sides land of 0.5 %, in a process of its own, to 30 % unless asked. There (mu = 0.3) meshes are
fanned out, which have more elements: between planes one of 12 a side folds at 25 % (:mod:`studies.block`).
``passes_an_increment`` and ``pass_s`` are means once yield has spread (from 2 % of the height on), ``pass_over_kappa``
the latter over the unit of cost: assembly, factorisation in the same order of elimination, found before, and solve, the
median of at least 20. ``fill`` are the entries of its factors, ``seconds`` the whole march, ``peak_MB`` the largest
size of the process, units included; ``time_growth`` and ``factorisation_growth`` are exponents over the unknowns, of
``pass_s`` and ``factorisation_s`` against the size before. All times are processor seconds of one thread. Ends with
what :data:`LIMITS` allow, and with exit code 1 where one is exceeded.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from benchmarks.kappa import Kappa, interleaved
from benchmarks.memory import peak
from benchmarks.rows import write
from benchmarks.split import Split
from bipot.forms import FormName
from bipot.forms.memory import ordered
from bipot.marching import march, system_of
from bipot.meshes.layout import Layout
from studies import block
from studies.command import command, say
from studies.files import require_writable
from studies.options import coefficient, count
from studies.pool import processes

STEP, LANDING, SPREAD = 0.01, 0.005, 0.02
"""Of the height: increments, those in which sides land, and where yield has spread."""

REDUCTION, SHORT = 0.3, 0.06
LAYOUTS = {0.1: Layout.TENSOR, 0.3: Layout.FANNED}
"""Where sides land, fanned."""
SIZES = (8, 12, 16)

MB = 1e3
"""Of what :func:`benchmarks.memory.peak` gives."""


@dataclass(frozen=True)
class Row:
    """One line of space.csv."""

    mu: float
    reduction: float
    layout: str
    elements: int
    unknowns: int
    contacts: int
    fill: int
    increments: int
    passes_an_increment: float
    fallbacks: int
    kappa_s: float
    factorisation_s: float
    pass_s: float
    pass_over_kappa: float
    seconds: float
    peak_MB: float
    time_growth: float = math.nan
    factorisation_growth: float = math.nan


class Limit(NamedTuple):
    """Largest value of a column at some sizes."""

    column: str
    sizes: tuple[int, ...]
    most: float


LIMITS = (
    Limit("pass_over_kappa", SIZES, 1.3),
    Limit("passes_an_increment", SIZES, 5.0),
    Limit("peak_MB", (16,), 2000.0),
)


def count_of(mu: float, reduction: float) -> int:
    """Increments after the start-up."""
    return round(reduction / (LANDING if layout_of(mu) is Layout.FANNED else STEP))


def layout_of(mu: float) -> Layout:
    """Of the meshes at this coefficient."""
    return LAYOUTS.get(mu, Layout.FANNED)


def case(mu: float, elements: int, reduction: float, increments: int) -> block.Block:
    """The study's, by Newton's method."""
    asked = ["--mu", f"{mu:g}", "--elements", str(elements), "--form", FormName.NEWTON.value]
    asked += ["--reduction", f"{reduction:g}", "--increments", str(increments)]
    asked += ["--layout", layout_of(mu).value]
    (found,) = block.cases(block.parser().parse_args(asked))
    return found


def measured(mu: float, elements: int, reduction: float, increments: int) -> Row:
    """A march and its units, in this process."""
    one = case(mu, elements, reduction, increments)
    scene, schedule = one.scene(), one.schedule()
    system, whole, late = system_of(scene), Split(), Split()
    kappa, increments, passes, fallbacks = Kappa(ordered(system.body.space)), 0, list[int](), 0
    running = whole.while_running(march(scene, schedule, one.control(), observe=late.see))
    for step in interleaved(system, running, kappa, len(schedule.times())):
        # Nothing else is kept of an increment: all its arrays hang on it.
        increments, fallbacks = increments + 1, fallbacks + (step.form is not FormName.NEWTON)
        if reduction * step.start.tau < SPREAD:
            late.reset()
        else:
            passes.append(step.passes)
    cost = late.passes / sum(passes)
    return Row(
        mu=mu,
        reduction=reduction,
        layout=one.layout.value,
        elements=elements,
        unknowns=system.body.space.size,
        contacts=len(system.candidates.node),
        fill=kappa.fill,
        increments=increments,
        passes_an_increment=sum(passes) / len(passes),
        fallbacks=fallbacks,
        kappa_s=kappa.median,
        factorisation_s=kappa.factorisation,
        pass_s=cost,
        pass_over_kappa=cost / kappa.median,
        seconds=whole.seconds,
        peak_MB=MB * peak(),
    )


def grown(row: Row, before: Row) -> Row:
    """The row with its exponents of growth from the size ``before``."""
    apart = math.log(row.unknowns / before.unknowns)
    time, factor = row.pass_s / before.pass_s, row.factorisation_s / before.factorisation_s
    return replace(row, time_growth=math.log(time) / apart, factorisation_growth=math.log(factor) / apart)


def verdicts(rows: Sequence[Row]) -> list[tuple[Row, Limit, float]]:
    """Every limit on each row that it is for, with what was measured."""
    return [(row, one, getattr(row, one.column)) for row in rows for one in LIMITS if row.elements in one.sizes]


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(prog="benchmarks.space", description="Costs in space.", allow_abbrev=False)
    p.add_argument("--mu", type=coefficient, nargs="+", help="Coulomb coefficients (default 0.1 0.3, --fast 0.3)")
    p.add_argument("--sizes", type=count(1), nargs="+", help="elements a side (default 8 12 16, --fast 3 4)")
    p.add_argument("--reduction", type=float, help=f"of the height (default {REDUCTION:g})")
    p.add_argument("--out", type=Path, default=Path("results"))
    p.add_argument("--fast", action="store_true", help="small bricks and a short path, without limits")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    asked = parser().parse_args(argv)
    require_writable(asked.out)
    mus, sizes = asked.mu or ([0.3] if asked.fast else [0.1, 0.3]), asked.sizes or ([3, 4] if asked.fast else SIZES)
    rows = list[Row]()
    for mu in mus:
        reduction = asked.reduction or (SHORT if asked.fast else REDUCTION)
        before: Row | None = None
        for size in sorted(sizes):
            with processes(1) as alone:
                row = alone.submit(measured, mu, size, reduction, count_of(mu, reduction)).result()
            row = row if before is None else grown(row, before)
            before = row
            rows.append(row)
            write(asked.out / "space.csv", Row, rows)
            say(told(row))
    missed = [value > limit.most for _, limit, value in verdicts(rows)]
    for (row, limit, value), miss in zip(verdicts(rows), missed, strict=True):
        what = f"{limit.column}, mu = {row.mu:g}, {row.elements}"
        say(f"{'MISS' if miss else 'met '} {what}: {value:.3g}, at most {limit.most:g}")
    return int(any(missed))


def told(row: Row) -> str:
    """A row in words."""
    unit = f"kappa {1e3 * row.kappa_s:.0f} ms, a pass {row.pass_over_kappa:.2f} of it"
    cost = f"{row.passes_an_increment:.2f} passes an increment, {row.seconds:.0f} s, {row.peak_MB:.0f} MB"
    growth = f"; growth {row.time_growth:.2f}, of a factorisation {row.factorisation_growth:.2f}"
    what = f"mu {row.mu:g}, {row.elements:>2} a side, {row.layout}"
    return f"{what}: {unit}, {cost}{'' if math.isnan(row.time_growth) else growth}"


if __name__ == "__main__":
    sys.exit(main())
