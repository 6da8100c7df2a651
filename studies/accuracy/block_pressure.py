r"""Pressure on the upper face of the upset cube, mesh by mesh and in both layouts of :mod:`studies.block`.

    python -m studies.accuracy.block_pressure [--fast] [--resume | --overwrite] [--out DIR]

The study's eighth of a cube in H8/P0, by ``newton`` alone, in increments of 1 % after the start-up, towards 30 %.
``DIR/block_pressure.csv`` has a row a run: the reduction it ``reached``; ``line``, ``edge``, ``inner`` and ``written``
(:mod:`studies.block_line`) where it ended; the largest of each from :data:`ONSET` on, with the reduction ``at`` which
``line`` was largest; the least Jacobian over its mean, passes an increment and seconds. A run ends early where an
element folds.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot.errors import IncrementFailed
from bipot.marching import march, system_of
from bipot.meshes.layout import Layout
from bipot.results.columns import MIN_JACOBIAN
from bipot.typing import Floats
from studies.accuracy.alone import CUTS
from studies.block import Block, cases, parser
from studies.block_line import edge, inner, line, written
from studies.command import command, progressing, say
from studies.outputs import opened, parser_of

NAME = "block_pressure"
REDUCTION, ONSET = 0.3, 0.02
MEASURES = (line, edge, inner, written)

Key = tuple[float, str, int]


@dataclass(frozen=True)
class Plan:
    """Coefficients, elements a side, and the finest mesh of mu = 0.3, which is fanned."""

    mus: tuple[float, ...] = (0.1, 0.3)
    sides: tuple[int, ...] = (4, 8, 12)
    finest: int | None = 16

    def keys(self) -> list[Key]:
        """The runs in the table's order."""
        found = [(mu, layout.value, n) for mu in self.mus for layout in Layout for n in self.sides]
        return [*found, (self.mus[-1], Layout.FANNED.value, self.finest)] if self.finest else found


FAST = Plan(mus=(0.3,), sides=(3,), finest=None)


@dataclass(frozen=True)
class Row:
    """Row of block_pressure.csv; pressures over their mean, NaN where too few nodes carry."""

    mu: float
    layout: str
    elements: int
    reached: float
    line: float
    edge: float
    inner: float
    written: float
    largest_line: float
    at: float
    largest_edge: float
    largest_inner: float
    largest_written: float
    min_jacobian: float
    passes_an_increment: float
    cuts: int
    seconds: float


def key(row: Row) -> Key:
    """What tells one row from another."""
    return row.mu, row.layout, row.elements


def block_of(mu: float, layout: str, elements: int) -> Block:
    """The run of :mod:`studies.block`."""
    asked = ["--mu", f"{mu}", "--elements", f"{elements}", "--layout", layout, "--reduction", f"{REDUCTION}"]
    (block,) = cases(parser().parse_args(asked))
    return block


def run(mu: float, layout: str, elements: int) -> Row:
    """March until the end or a fold."""
    block = block_of(mu, layout, elements)
    scene = block.scene()
    system, found, jacobian, passes, cuts, seconds = system_of(scene), list[list[float]](), 1.0, 0, 0, 0.0
    try:
        for accepted in march(scene, block.schedule(), replace(block.control(), fallbacks=(), cuts=CUTS)):
            found.append([REDUCTION * accepted.state.tau, *(measure(system, accepted) for measure in MEASURES)])
            jacobian = float(MIN_JACOBIAN.value(system, accepted))
            passes, cuts, seconds = passes + accepted.passes, cuts + accepted.cuts, seconds + accepted.seconds
    except IncrementFailed:
        if not found:
            raise
    at, *measures = np.array(found).T
    late = at >= ONSET
    line_, edge_, inner_, written_ = (_largest(one[late]) for one in measures)
    return Row(
        mu=mu,
        layout=layout,
        elements=elements,
        reached=float(at[-1]),
        line=float(measures[0][-1]),
        edge=float(measures[1][-1]),
        inner=float(measures[2][-1]),
        written=float(measures[3][-1]),
        largest_line=line_,
        at=float(at[late][measures[0][late] == line_].min(initial=np.inf)),
        largest_edge=edge_,
        largest_inner=inner_,
        largest_written=written_,
        min_jacobian=jacobian,
        passes_an_increment=passes / len(found),
        cuts=cuts,
        seconds=seconds,
    )


def _largest(values: Floats) -> float:
    """Of those that are numbers; NaN where none is."""
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else np.nan


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run mesh by mesh, rewriting the table after each row."""
    options = parser_of(f"accuracy.{NAME}", "Pressure on an upset cube.", fast="one small mesh in both layouts")
    asked = options.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    fixed = {"reduction": REDUCTION, "onset": ONSET, "cuts": CUTS}
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=plan.keys())
    with progressing(f"accuracy.{NAME}") as progress:
        for done, (mu, layout, elements) in enumerate(plan.keys(), 1):
            if (mu, layout, elements) not in table:
                table.add(run(mu, layout, elements))
            progress.advance(done / len(plan.keys()), f"mu = {mu:g}, {layout}, {elements} a side")
    say(table.words())
    return 0


if __name__ == "__main__":
    sys.exit(main())
