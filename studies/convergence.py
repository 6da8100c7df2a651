r"""How the upsetting converges with increments and mesh, with observed orders where three values show one.

    python -m studies.convergence [--mu 0.1 0.3] [--fast] [--resume | --overwrite] [--out DIR]

Increments 15 to 120 on one mesh, then 5 to 20 elements a side at fixed increments. With values a, b, c at knobs that
double, the observed order is p = log2((a - b) / (b - c)); it is printed only if the differences keep their sign and
shrink. F at 45 % for mu = 0.3 follows a landing of side nodes on the punch and scatters: judge by F at 20 % and work.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from bipot.forms import Tangent
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from studies.command import command, progressing, say
from studies.options import coefficient
from studies.outputs import opened, parser_of
from studies.upsetting_columns import JOULE, force
from studies.upsetting_march import FIRST

REDUCTION, EARLY = 0.45, 0.20
INCREMENTS, ELEMENTS = "increments", "elements"
NAME = "convergence"
FILE = f"{NAME}.csv"

Key = tuple[float, str, int]


@dataclass(frozen=True)
class Plan:
    """Which values each knob takes, and where the other one stays."""

    increments: tuple[int, ...] = (15, 30, 60, 120)
    elements: tuple[int, ...] = (5, 10, 20)
    at_increments: int = 45
    at_elements: int = 10


FAST = Plan(increments=(4, 8, 16), elements=(2, 4), at_increments=6, at_elements=2)


@dataclass(frozen=True)
class Row:
    """One run: force at 20 % and 45 % (N), work (J), largest radius (mm), and the worst of its certificates."""

    mu: float
    knob: str
    value: int
    force_20_N: float
    force_45_N: float
    work_J: float
    max_radius_mm: float
    worst_relative_gap: float
    worst_equilibrium: float


def measure(mu: float, knob: str, value: int, plan: Plan) -> Row:
    """Run one upsetting to 45 %, landing on 20 % as well."""
    elements = value if knob == ELEMENTS else plan.at_elements
    increments = value if knob == INCREMENTS else plan.at_increments
    scene = upsetting(mu=mu, reduction=REDUCTION, elements=elements)
    system = system_of(scene)
    first = FIRST / REDUCTION if mu > 0 else 0.0
    schedule = Schedule(increments, first, landings=(EARLY / REDUCTION,))
    accepted = list(march(scene, schedule, Control(Tangent())))
    early = next(a for a in accepted if a.state.tau == schedule.landings[0])
    end, certificates = accepted[-1], [a.solved.certificate for a in accepted]
    return Row(
        mu,
        knob,
        value,
        force(system, early),
        force(system, end),
        end.energies.work * JOULE,
        float(end.state.nodes[:, 0].max()),
        max(c.relative_gap for c in certificates),
        max(c.equilibrium for c in certificates),
    )


def observed_order(values: list[float]) -> float | None:
    """Order from the last three values at knobs that double, or None where they show none.

    >>> round(observed_order([1.16, 1.04, 1.01]), 6)
    2.0
    >>> observed_order([1.0, 1.1, 1.0]) is None
    True
    """
    if len(values) < 3:
        return None
    first, second = values[-3] - values[-2], values[-2] - values[-1]
    if second == 0 or first / second <= 1:
        return None
    return float(np.log2(first / second))


def key(row: Row) -> Key:
    """What tells one run from another."""
    return row.mu, row.knob, row.value


def planned(mus: Iterable[float], plan: Plan) -> list[Key]:
    """All runs, each once."""
    knobs = [(INCREMENTS, n) for n in plan.increments] + [(ELEMENTS, n) for n in plan.elements]
    return list(dict.fromkeys((mu, *knob) for mu in mus for knob in knobs))


def measures(runs: Sequence[Key], plan: Plan) -> Iterator[Row]:
    """All rows, one run each, with progress."""
    with progressing(NAME) as progress:
        for done, (mu, knob, value) in enumerate(runs):
            yield measure(mu, knob, value, plan)
            progress.advance((done + 1) / len(runs), f"mu = {mu:g}, {value} {knob}")


def table(rows: list[Row]) -> str:
    """Values and, below each group, their observed orders."""
    names = [f.name for f in fields(Row)][3:7]
    lines = []
    for mu, knob in dict.fromkeys((row.mu, row.knob) for row in rows):
        group = [row for row in rows if (row.mu, row.knob) == (mu, knob)]
        lines += [f"mu = {mu:g}, {knob}", "  ".join(f"{n:>14}" for n in ["value", *names])]
        lines += ["  ".join([f"{row.value:>14}", *(f"{getattr(row, n):>14.6g}" for n in names)]) for row in group]
        orders = [observed_order([getattr(row, n) for row in group]) for n in names]
        shown = ["none" if p is None else f"{p:.2f}" for p in orders]
        lines += ["  ".join(f"{n:>14}" for n in ["order", *shown]), ""]
    return "\n".join(lines)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write ``convergence.csv`` row by row, print the tables."""
    parser = parser_of(NAME, "Increment and mesh convergence.", fast="small meshes and few increments")
    parser.add_argument("--mu", type=coefficient, nargs="+", default=[0.1, 0.3])
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    runs = planned(asked.mu, plan)
    fixed = {"at_increments": plan.at_increments, "at_elements": plan.at_elements}
    found = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=runs)
    for row in measures([run for run in runs if run not in found], plan):
        found.add(row)
    say(table(found.rows))
    say(f"results in {(asked.out / FILE).resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
