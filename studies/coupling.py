r"""Does friction's fixed point converge, how fast, and what does the safeguard add?

    python -m studies.coupling [--fast] [--resume | --overwrite] [--out DIR]

Upsetting by the tangent form *without* exact friction in its polish, so that the fixed point alone couples friction to
the normal forces, and the small problems of hard case 14: each by either sequence of programs (frozen threshold, De
Saxce's shift), plain and safeguarded. ``coupling.csv``: how the run ended, increments, cuts, passes, the median and the
largest contraction seen in an increment, and how many increments ended by which route.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial

import numpy as np

from bipot.control.accepted import Accepted
from bipot.errors import IncrementFailed
from bipot.forms import Tangent
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.programs.fixed_point import Coupled, Frozen, Safeguard
from studies.command import command, say
from studies.hard_programs import DISCRETE, SETTLED, passes_of
from studies.outputs import opened, parser_of
from studies.upsetting_march import FIRST

NAME = "coupling"
FORM = Tangent(coupled=False)
Key = tuple[str, str, str]


class Outcome(Enum):
    """How a run ended."""

    CERTIFIED = "certified"
    FAILED = "failed"
    GIVEN_UP = "given up"


@dataclass(frozen=True)
class Row:
    """One run."""

    case: str
    sequence: str
    steps: str
    outcome: str
    increments: int
    cuts: int
    passes: int
    contraction: float
    worst_contraction: float
    routes: str


@dataclass(frozen=True)
class Settings:
    """Coefficients, elements a side, reduction, uniform increments; passes after which a run, a small problem ends."""

    mu: tuple[float, ...] = (0.1, 0.3, 1.0, 10.0)
    elements: int = 5
    reduction: float = 0.45
    increments: int = 20
    most: int = 1500
    small: int = 200


FAST = Settings((0.1, 10.0), 2, 0.3, 8, 130, 80)


def rules() -> list[tuple[Frozen, str, Safeguard]]:
    """Either sequence, plain and safeguarded."""
    return [
        (frozen, steps, Safeguard(first=frozen, falls=falls))
        for frozen in Frozen
        for steps, falls in (("plain", math.inf), ("safeguarded", Safeguard().falls))
    ]


def upset(mu: float, settings: Settings, frozen: Frozen, steps: str, rule: Safeguard) -> Row:
    """March until the end, a failure, or too many passes."""
    reduction = settings.reduction
    scene = upsetting(mu=mu, reduction=reduction, elements=settings.elements)
    control = Control(replace(FORM, safeguard=rule), ())
    done, outcome = list[Accepted](), Outcome.CERTIFIED
    try:
        for accepted in march(scene, Schedule(settings.increments, FIRST / reduction), control):
            done.append(accepted)
            if sum(a.passes for a in done) > settings.most:
                outcome = Outcome.GIVEN_UP
                break
    except IncrementFailed:
        outcome = Outcome.FAILED
    spent = (len(done), sum(a.cuts for a in done), sum(a.passes for a in done))
    return _row(f"upsetting mu {mu:g}", frozen, steps, outcome, spent, [a.solved.coupled for a in done])


def solve(index: int, most: int, frozen: Frozen, steps: str, rule: Safeguard) -> Row:
    """A small problem until Coulomb's law holds, or ``most`` passes."""
    name, W, q, mu = DISCRETE[index]
    numbered = enumerate(passes_of(W, q, mu, rule), start=1)
    number, small = next((n, small) for n, small in numbered if small.distance <= SETTLED or n == most)
    outcome = Outcome.CERTIFIED if small.distance <= SETTLED else Outcome.GIVEN_UP
    return _row(name, frozen, steps, outcome, (1, 0, number), [small.coupled])


def _row(
    case: str, frozen: Frozen, steps: str, outcome: Outcome, spent: tuple[int, int, int], seen: list[Coupled]
) -> Row:
    factors = [c.contraction for c in seen if not math.isnan(c.contraction)] or [math.nan]
    routes = Counter(c.route.value for c in seen)
    listed = " ".join(f"{route}:{count}" for route, count in routes.most_common())
    return Row(
        case, frozen.value, steps, outcome.value, *spent, float(np.median(factors)), float(np.max(factors)), listed
    )


def planned(settings: Settings) -> dict[Key, Callable[[], Row]]:
    """All runs, by what tells one from another in the table."""
    runs: dict[Key, Callable[[], Row]] = {}
    for rule in rules():
        frozen, steps, _ = rule
        for mu in settings.mu:
            runs[f"upsetting mu {mu:g}", frozen.value, steps] = partial(upset, mu, settings, *rule)
        for index, (name, *_) in enumerate(DISCRETE):
            runs[name, frozen.value, steps] = partial(solve, index, settings.small, *rule)
    return runs


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run all, rewriting the table after each."""
    parser = parser_of(NAME, "The fixed point of friction.", fast="two coefficients on a small mesh")
    asked = parser.parse_args(argv)
    settings = FAST if asked.fast else Settings()
    fixed = {name: value for name, value in vars(settings).items() if name != "mu"}
    runs = planned(settings)
    table = opened(
        asked.out,
        NAME,
        Row,
        lambda row: (row.case, row.sequence, row.steps),
        asked.policy,
        parameters=fixed,
        order=runs,
    )
    for key, run in runs.items():
        if key not in table:
            table.add(run())
    say(table.words())
    return 0


if __name__ == "__main__":
    sys.exit(main())
