r"""Four ways to minimise the penalised program, side by side on every pass of one run.

    python -m studies.optimisers [--fast] [--resume | --overwrite] [--out DIR]

A cylinder is upset by 10 % at mu = 0.3 with K = 30 E/h. Every pass's program goes to every optimiser from the same
start; ``optimisers.csv`` has for each the largest difference in displacement from Newton (over the max-norm), the mean
and largest number of iterations, mean processor time of a pass, and on how many passes less than asked was claimed.
The command fails when an optimiser differs by more than ``ALLOWED`` on any pass. All are measured in one march, so that
``--resume`` keeps a whole table or makes one.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bipot.conic.problem import Claim
from bipot.forms import Optimiser, Penalty, contact_penalty
from bipot.increment import Trial
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from studies.command import command, say
from studies.outputs import opened, parser_of
from studies.upsetting_march import FIRST

NAME = "optimisers"
MU, REDUCTION, FACTOR = 0.3, 0.1, 30.0

ALLOWED = {Optimiser.TRUST_REGION: 1e-6, Optimiser.CVXPY: 1e-6, Optimiser.GRADIENT_ONLY: 1e-5}
"""Largest difference in displacement from Newton, over the max-norm, on any pass."""


@dataclass
class Compared:
    """Gives the program of every pass of a penalty form to every optimiser and keeps what they did."""

    spent: dict[Optimiser, list[tuple[float, int, float, bool]]] = field(default_factory=dict)

    def see(self, trial: Trial) -> None:
        """One pass."""
        assert isinstance(trial.form, Penalty)
        psi = trial.form.program(trial.iterate, trial.r, trial.state).scaled(trial.state.units)
        start = trial.iterate.x / trial.state.units.length
        exact = Optimiser.NEWTON.minimise(psi, start).x
        for optimiser in Optimiser:
            began = time.process_time()
            found = optimiser.minimise(psi, start)
            seconds = time.process_time() - began
            difference = float(np.abs(found.x - exact).max() / np.abs(exact).max())
            self.spent.setdefault(optimiser, []).append(
                (difference, found.iterations, seconds, found.outcome is Claim.ALMOST)
            )


@dataclass(frozen=True)
class Row:
    """One optimiser over all passes."""

    optimiser: str
    passes: int
    largest_difference: float
    mean_iterations: float
    most_iterations: int
    seconds_per_pass: float
    almost: int


def compare(elements: int, increments: int) -> Compared:
    """March and keep everything."""
    scene = upsetting(mu=MU, reduction=REDUCTION, elements=elements)
    K = contact_penalty(system_of(scene).candidates, FACTOR)
    compared = Compared()
    control = Control(Penalty(K, K), ())
    for _ in march(scene, Schedule(increments, FIRST / REDUCTION), control, observe=compared.see):
        pass
    return compared


def rows(compared: Compared) -> list[Row]:
    """A row an optimiser."""
    found = []
    for optimiser, spent in compared.spent.items():
        difference, iterations, seconds, almost = np.array(spent).T
        found.append(
            Row(
                optimiser.value,
                len(spent),
                float(difference.max()),
                float(iterations.mean()),
                int(iterations.max()),
                float(seconds.mean()),
                int(almost.sum()),
            )
        )
    return found


def disagreements(found: list[Row]) -> list[str]:
    """What is above ``ALLOWED`` or was not compared at all, in words."""
    largest = {row.optimiser: row.largest_difference for row in found}
    measured = [(o.value, largest.get(o.value, float("nan")), allowed) for o, allowed in ALLOWED.items()]
    return [
        f"{name} differs from newton by {difference:.1e}, allowed {allowed:g}"
        for name, difference, allowed in measured
        if not difference <= allowed
    ]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    parser = parser_of(NAME, "Ways to minimise the penalised program.", fast="a small mesh and few increments")
    asked = parser.parse_args(argv)
    elements, increments = (2, 1) if asked.fast else (10, 4)
    fixed = {"elements": elements, "increments": increments}
    table = opened(asked.out, NAME, Row, lambda row: row.optimiser, asked.policy, parameters=fixed)
    if not all(optimiser.value in table for optimiser in Optimiser):
        table.add(*rows(compare(elements, increments)))
    say(table.words())
    for disagreement in disagreements(table.rows):
        say(f"error: {disagreement}", sys.stderr)
    return 1 if disagreements(table.rows) else 0


if __name__ == "__main__":
    sys.exit(main())
