r"""Round-off or tolerance? The control of ``penalty_vs_conic``, whose tolerance has to grow with K.

    python -m studies.penalty_round_off [--fast] [--resume | --overwrite] [--out DIR]

At mu = 0.1 to 20 % every K is asked for equilibrium to 1e-6 .. 1e-10 of the largest nodal force, without cutting an
increment. ``penalty_round_off.csv``: the force, its relative difference from the smallest K at the tightest tolerance,
and where a run stopped. A force that does not follow the tolerance owes its error to something else.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

from bipot.certificate import Bounds
from bipot.forms import Penalty, contact_penalty
from bipot.increment import Limits
from bipot.marching import Control, Schedule, system_of
from bipot.paper import upsetting
from studies.command import command, say
from studies.outputs import opened, parser_of
from studies.runs import record
from studies.upsetting_march import FIRST

NAME = "penalty_round_off"
MU, REDUCTION, INCREMENTS = 0.1, 0.2, 7
FACTORS = (1e4, 1e6, 1e7, 1e8)
TOLERANCES = (1e-10, 1e-9, 1e-8, 1e-7, 1e-6)


@dataclass(frozen=True)
class Row:
    """One run; force and difference are nan when it stopped, and ``reached`` is the pseudo-time it got to."""

    K_over_E_h: float
    tolerance: float
    force_N: float
    difference: float
    reached: float
    outcome: str


def measure(factor: float, tolerance: float, elements: int, reference: float | None) -> Row:
    """One run, compared with ``reference`` (None: this is it)."""
    scene = upsetting(mu=MU, reduction=REDUCTION, elements=elements)
    K = contact_penalty(system_of(scene).candidates, factor)
    cone = min(Bounds().cone_violation, tolerance)
    limits = Limits(replace(Bounds(), equilibrium=tolerance, cone_violation=cone), passes=60)
    run = record(scene, Schedule(INCREMENTS, FIRST / REDUCTION), Control(Penalty(K, K), (), limits, cuts=0))
    reached = run.snapshots[-1].tau if run.snapshots else 0.0
    force = float("nan") if run.failure else run.snapshots[-1].force
    outcome = f"failed: {run.failure}" if run.failure else "solved"
    return Row(factor, tolerance, force, force / (reference or force) - 1, reached, outcome)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, rewriting the table after each."""
    parser = parser_of(NAME, "Round-off or tolerance?", fast="a small mesh, one penalty, two tolerances")
    asked = parser.parse_args(argv)
    factors, tolerances, elements = (FACTORS[:1], TOLERANCES[::4], 2) if asked.fast else (FACTORS, TOLERANCES, 10)
    runs = [(factor, tolerance) for factor in factors for tolerance in tolerances]
    table = opened(
        asked.out,
        NAME,
        Row,
        lambda row: (row.K_over_E_h, row.tolerance),
        asked.policy,
        parameters={"elements": elements},
        order=runs,
    )
    for run in runs:
        if run not in table:
            table.add(measure(*run, elements, table[runs[0]].force_N if runs[0] in table else None))
    say(table.words())
    return 0


if __name__ == "__main__":
    sys.exit(main())
