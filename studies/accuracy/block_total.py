r"""Error of the force curve over time of the block in space, and CalculiX in the same run.

    python -m studies.accuracy.block_total [--fast] [--resume | --overwrite] [--out DIR]

As :mod:`studies.accuracy.total` has the cylinder: the cube of :mod:`studies.block`, mu = 0.1, perfect plasticity,
friction and contact of CalculiX penalised, to 30 %. ``DIR/block_limits.csv`` says what the force tends to at the marks
5, 10, 20 and 30 %: with V and W the forces on 16 and 8 elements a side, both to an accuracy of 1e-4 of increments, V +
(V - W)/2 in a band of |V - W|/2, which holds errors of first order and of any higher one. ``DIR/block_total.csv`` has a
row a run, ``DIR/block_ratio.csv`` what both programs cost at the same error.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from bipot.tools.tool import Sampling
from studies.accuracy.block_alone import run as march
from studies.accuracy.block_deck import BlockDeck
from studies.accuracy.choice import OWN, Choice, Pace
from studies.accuracy.deck import FACES, NODES
from studies.accuracy.limits import Limit, bracketed
from studies.accuracy.total import SHOWN, key_of, runs, tasks_of
from studies.accuracy.total_plan import Foreign, Plan, Series
from studies.accuracy.total_row import Row, key, ratios
from studies.command import command, say
from studies.element_types import SolidType
from studies.outputs import Existing, opened, parser_of
from studies.tables import text, write_csv

NAME, RATIOS, LIMITS = "block_total", "block_ratio.csv", "block_limits.csv"
MARKS, FRICTION = (0.05, 0.10, 0.20, 0.30), 0.1
PACE, COARSE = Pace(accuracy=1e-3), Pace(accuracy=1e-2)
PACES = PACE, COARSE, Pace(increments=len(MARKS), plain=True)
ALONE = "studies.accuracy.block_alone"


@dataclass(frozen=True)
class BlockPlan(Plan):
    """A plan with the ``sides`` of the two meshes that tell the limits, and the accuracy of their increments."""

    sides: tuple[int, int] = (8, 16)
    accuracy: float = 1e-4


PLAN = BlockPlan(
    mus=(FRICTION,),
    own=(
        Series(SolidType.H8P0, sides=(1, 2, 3, 4, 5, 6), paces=PACES),
        Series(SolidType.H20, contact=Sampling.WEIGHTED, sides=(1, 2, 3, 4), paces=PACES),
        Series(SolidType.H20P1, contact=Sampling.WEIGHTED, sides=(1, 2, 3, 4, 5), paces=PACES),
    ),
    foreign=(
        Foreign("C3D8I", FACES, (1, 2), (0.02, 0.05, 0.1), deck=BlockDeck),
        Foreign("C3D8I", FACES, (4, 6, 8), (0.02, 0.05), deck=BlockDeck),
        Foreign("C3D8I", NODES, (1,), (0.1,), deck=BlockDeck),
        Foreign("C3D8I", NODES, (4,), (0.02,), deck=BlockDeck),
        Foreign("C3D20R", FACES, (1, 2), (0.02, 0.05, 0.1), deck=BlockDeck),
        Foreign("C3D20R", FACES, (3,), (0.02, 0.05), deck=BlockDeck),
        Foreign("C3D20R", FACES, (4,), (0.05,), deck=BlockDeck),
    ),
    repeats=3,
    marks=MARKS,
    alone=ALONE,
)
SHORT = BlockPlan(
    mus=(FRICTION,),
    own=(Series(SolidType.H8P0, sides=(1,), paces=(COARSE,)),),
    foreign=(Foreign("C3D8I", FACES, (2,), (0.05,), deck=BlockDeck),),
    repeats=1,
    marks=MARKS,
    alone=ALONE,
    sides=(2, 4),
    accuracy=1e-2,
)


def limits(mu: float, plan: BlockPlan) -> list[Limit]:
    """What the force tends to at the plan's marks."""
    names = "newton", SolidType.H8P0.value, SolidType.H8P0.quadrature.value, "tensor", "nodes"
    pace = str(Pace(accuracy=plan.accuracy))
    coarse, fine = (march(Choice(mu, OWN, *names, n, pace), plan.marks).forces for n in plan.sides)
    meshes = f"h8p0 {plan.sides[1]}, {plan.sides[0]}"
    found = [bracketed([f], [c], [f]) for c, f in zip(coarse, fine, strict=True)]
    return [Limit(mu, mark, "force_N", *one, meshes) for mark, one in zip(plan.marks, found, strict=True)]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    parser = parser_of(f"accuracy.{NAME}", "The block: error over time, and CalculiX.", fast="tiny meshes, once")
    asked = parser.parse_args(argv)
    plan, reached = SHORT if asked.fast else PLAN, asked.out / LIMITS
    fixed = {"repeats": plan.repeats, "row": plan.row, "sides": list(plan.sides), "accuracy": plan.accuracy}
    order = [key_of(job) for job in (*plan.jobs(), *plan.decks())]
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=order, derived=(RATIOS,))
    if asked.policy is not Existing.RESUME or not reached.exists():
        write_csv(reached, [one for mu in plan.mus for one in limits(mu, plan)])
    for row in runs([task for task in tasks_of(plan, reached) if key_of(task.job) not in table]):
        table.add(row)
    found = ratios(table.rows)
    write_csv(asked.out / RATIOS, found)
    say(text(found, SHOWN) if found else "no error is reached by two programs")
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
