r"""How the energy balance closes: trapezoidal over the increment, and with end-of-step work in small strain.

    python -m studies.energy [--fast] [--out DIR]

``DIR/energy.csv`` has a row a run of the seed paper's cylinder: in ``midpoint`` from 5 to 20 %, all refinements from
one state, and in ``paper`` to 1 % from rest. ``trapezoidal`` and ``end`` are work - elastic - plastic - friction over
work by either rule (:mod:`bipot.energy`), ``order`` is log2 of the trapezoidal one's ratio to the run of half the
increments.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bipot.accepted import Accepted
from bipot.certificate import Bounds
from bipot.energy import Energies, Rule
from bipot.errors import BipotError
from bipot.fem.strain import Configuration
from bipot.forms import Dissipation, Newton, Tangent
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.marching import Control, Schedule, march
from bipot.scene import Scene, upsetting
from studies.tables import text, write_csv
from studies.upsetting_case import FIRST

NAME = "energy"
BEGIN, END, SMALL = 0.05, 0.20, 0.01
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
    """One run."""

    configuration: str
    integration: str
    mu: float
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


def measures(plan: Plan, configuration: Configuration, integration: Integration, mu: float) -> Iterator[Row]:
    """The refinements of one case."""
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
    last = float("nan")
    for increments in plan.increments:
        first = FIRST / SMALL / 2 if small else 0.0
        accepted = list(march(scene, Schedule(increments, first), control, start))
        left = balance(scene, accepted, Rule.TRAPEZOIDAL)
        order = float("nan") if small else float(np.log2(last / left))
        yield Row(
            configuration.value, integration.value, mu, len(accepted), left, order, balance(scene, accepted, Rule.END)
        )
        last = left


def main(argv: list[str] | None = None) -> int:
    """Run, write, print."""
    parser = argparse.ArgumentParser(
        prog="studies.energy", description="How the energy balance closes.", allow_abbrev=False
    )
    parser.add_argument("--out", type=Path, default=Path(f"results/{NAME}"))
    parser.add_argument("--fast", action="store_true", help="one coefficient, a small mesh, few increments")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    rows: list[Row] = []
    try:
        for configuration in (Configuration.MIDPOINT, Configuration.PAPER):
            for integration in Integration:
                for mu in plan.mus:
                    rows += measures(plan, configuration, integration, mu)
                    write_csv(asked.out / f"{NAME}.csv", rows)
    except BipotError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(text(rows, list(Row.__dataclass_fields__)))
    print(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
