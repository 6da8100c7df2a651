r"""How the energy balance closes: trapezoidal over the increment, and with end-of-step work in small strain.

    python -m studies.energy [--fast] [--resume | --overwrite] [--out DIR]

``DIR/energy.csv`` has a row a run of the seed paper's cylinder: in ``midpoint`` from 5 to 20 %, all refinements from
one state, and in ``paper`` to 1 % from rest. ``trapezoidal`` and ``end`` are work - elastic - plastic - friction over
work by either rule (:mod:`bipot.energy`), ``order`` is log2 of the trapezoidal one's ratio to the run of half the
increments.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot.certificate import Bounds
from bipot.control.accepted import Accepted
from bipot.energy import Energies, Rule
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, Newton, Tangent
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from studies.command import command, say
from studies.outputs import Table, opened, parser_of
from studies.upsetting_march import FIRST

NAME = "energy"
BEGIN, END, SMALL = 0.05, 0.20, 0.01
Case = tuple[Configuration, Integration, float]
Key = tuple[str, str, float, int]
EQUILIBRIUM = 1e-9
"""Tighter than the march's default, so that the identity is not hidden by what equilibrium leaves."""


@dataclass(frozen=True)
class Plan:
    """Coefficients, elements a side, uniform increments over the whole of each path (powers of two)."""

    mus: tuple[float, ...] = (0.0, 0.1, 0.3)
    elements: int = 10
    increments: tuple[int, ...] = (16, 32, 64, 128)


FAST = Plan(mus=(0.1,), elements=3, increments=(8, 16))


@dataclass(frozen=True)
class Row:
    """One run: ``asked`` uniform increments over the whole path, ``increments`` accepted ones."""

    configuration: str
    integration: str
    mu: float
    asked: int
    increments: int
    trapezoidal: float
    order: float
    end: float


def balance(scene: Scene, accepted: list[Accepted], rule: Rule) -> float:
    """What is left of the work of a march by a rule, over the work."""
    total = Energies()
    for a in accepted:
        total = total.after(a.start, a.state, a.solved, rule)
    return total.imbalance / total.work


def key(row: Row) -> Key:
    """What tells one run from another."""
    return row.configuration, row.integration, row.mu, row.asked


def planned(case: Case, plan: Plan) -> list[Key]:
    """The refinements of one case."""
    configuration, integration, mu = case
    return [(configuration.value, integration.value, mu, increments) for increments in plan.increments]


def measures(case: Case, plan: Plan, table: Table[Row]) -> Iterator[Row]:
    """The refinements of one case that the table does not have."""
    missing = [run for run in planned(case, plan) if run not in table]
    if not missing:
        return
    configuration, integration, mu = case
    small = configuration is Configuration.PAPER
    reduction = SMALL if small else END
    scene = upsetting(mu=mu, reduction=reduction, elements=plan.elements, configuration=configuration)
    limits = Limits(Bounds(equilibrium=EQUILIBRIUM))
    control = Control(Newton(), (Tangent(), Dissipation()), limits, integration=integration)
    start = None
    if not small:
        begin = BEGIN / END
        schedule = Schedule(min(plan.increments), FIRST / END, landings=(begin,))
        start = next(a.state for a in march(scene, schedule, control) if a.state.tau == begin)
    for run in missing:
        asked = run[-1]
        accepted = list(march(scene, Schedule(asked, FIRST / SMALL / 2 if small else 0.0), control, start))
        left = balance(scene, accepted, Rule.TRAPEZOIDAL)
        yield Row(*run, len(accepted), left, float("nan"), balance(scene, accepted, Rule.END))


def with_orders(rows: list[Row]) -> list[Row]:
    """The rows of one case, each with its order against the run of half the increments, if there is one."""
    halves = {2 * row.asked: row.trapezoidal for row in rows}
    return [
        replace(row, order=float(np.log2(halves[row.asked] / row.trapezoidal)))
        if row.asked in halves and row.configuration != Configuration.PAPER.value
        else row
        for row in rows
    ]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    parser = parser_of(NAME, "How the energy balance closes.", fast="one coefficient, a small mesh, few increments")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    configurations = (Configuration.MIDPOINT, Configuration.PAPER)
    cases = [(c, integration, mu) for c in configurations for integration in Integration for mu in plan.mus]
    runs = [run for case in cases for run in planned(case, plan)]
    fixed = {"elements": plan.elements, "begun with": min(plan.increments)}
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=runs)
    for case in cases:
        for row in measures(case, plan, table):
            table.add(row)
            table.add(*with_orders([table[run] for run in planned(case, plan) if run in table]))
    say(table.words())
    return 0


if __name__ == "__main__":
    sys.exit(main())
