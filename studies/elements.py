r"""Element types against closed answers: mesh series of limit loads, and of an elastic membrane.

    python -m studies.elements [--fast] [--resume | --overwrite] [--out DIR]

The problems of :mod:`studies.element_scenes` on uniform meshes of n, 2 n and 4 n elements along a unit length (``n`` in
the table) by every element type, and on one refined mesh of at most 2000 elements (``n`` = 0). Limit loads are those of
a kinematic program (:mod:`studies.element_limits`), exact for the mesh to 1e-9: no march, no elasticity.

``DIR/elements.csv`` has a row a mesh, with ``error`` relative to the exact answer. ``DIR/orders.csv`` has a row a
series: with a, b, c on n, 2 n, 4 n the observed order p = log2((a - b)/(b - c)) and the value extrapolated with it,
c - (b - c)/(2^p - 1), nan where the differences do not shrink; ``side`` says on which side of the exact value all of
the series and the refined mesh were. A value is inf where no motion of the mesh keeps the volume, and nan where the
program found none to its accuracy.

A kinematic program is a strict bound only where the volume is kept, and the dissipation not underrated, between the
points of the rule as well: of the types here by ``t3`` alone, of constant strain. What others find from above they
happened to.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bipot.errors import ProgramError
from bipot.fem.elements import Quadrature
from bipot.system import system_of
from studies.command import command, progressing, say
from studies.convergence import observed_order
from studies.element_scenes import PROBLEMS, Choice, Problem
from studies.element_types import ElementType
from studies.outputs import opened, parser_of
from studies.tables import text, write_csv

NAME, ORDERS = "elements", "orders"
SERIES = 3
REFINED = 0
"""In the place of n."""

OTHER_RULES = {ElementType.Q8: (Quadrature.GAUSS2,), ElementType.Q8P1: (Quadrature.GAUSS2,)}
CHOICES = tuple(Choice(type, rule) for type in ElementType for rule in (type.quadrature, *OTHER_RULES.get(type, ())))
FIRST = {"block 1": 8, "block 2": 8, "notch": 8, "cook compressible": 8, "cook incompressible": 8}
"""n of a series where it is not 4."""

Key = tuple[str, str, str, int]


@dataclass(frozen=True)
class Row:
    """One mesh: p/k, sigma_net/2k or a deflection, its exact value, relative error, seconds."""

    problem: str
    element: str
    quadrature: str
    n: int
    elements: int
    unknowns: int
    value: float
    exact: float
    error: float
    seconds: float


@dataclass(frozen=True)
class Order:
    """One series: what three meshes tell of the limit."""

    problem: str
    element: str
    quadrature: str
    n: int
    order: float
    extrapolated: float
    exact: float
    error: float
    side: str


def measure(problem: Problem, choice: Choice, n: int) -> Row:
    """The problem on a uniform mesh, or the refined one."""
    started = time.perf_counter()
    scene = problem.refined(choice) if n == REFINED and problem.refined else problem.uniform(choice, n)
    try:
        value = problem.value(scene)
    except ProgramError:
        value = math.nan
    return Row(
        problem.name,
        choice.type.value,
        choice.quadrature.value,
        n,
        len(scene.mesh.elements),
        system_of(scene).body.space.size,
        value,
        problem.exact,
        value / problem.exact - 1,
        time.perf_counter() - started,
    )


def key(row: Row) -> Key:
    """What tells one mesh from another."""
    return row.problem, row.element, row.quadrature, row.n


def planned(fast: bool) -> dict[Key, tuple[Problem, Choice, int]]:
    """All meshes: of a fast study n = 2, 4 and 8 and none that is refined."""
    out = {}
    for problem in PROBLEMS:
        first = 2 if fast else FIRST.get(problem.name, 4)
        refined = [] if fast or problem.refined is None else [REFINED]
        for choice in CHOICES:
            for n in [*(first * 2**k for k in range(SERIES)), *refined]:
                out[problem.name, choice.type.value, choice.quadrature.value, n] = problem, choice, n
    return out


def extrapolated(values: Sequence[float]) -> tuple[float, float]:
    """Observed order and limit of three values at n, 2 n and 4 n, nan where they show none, inf where all lock.

    >>> [round(found, 6) for found in extrapolated([1.16, 1.04, 1.01])]
    [2.0, 1.0]
    >>> extrapolated([math.inf, math.nan, math.nan])
    (nan, nan)
    """
    order = observed_order(list(values)) if all(map(math.isfinite, values)) else None
    if order is None:
        return math.nan, math.inf if all(value == math.inf for value in values) else math.nan
    return order, values[-1] - (values[-2] - values[-1]) / (2**order - 1)


def orders(rows: Sequence[Row]) -> list[Order]:
    """Of every series that is whole."""
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.problem, row.element, row.quadrature), []).append(row)
    out = []
    for of, found in groups.items():
        series = sorted((row for row in found if row.n != REFINED), key=lambda row: row.n)
        if len(series) == SERIES:
            order, limit = extrapolated([row.value for row in series])
            exact = series[0].exact
            out.append(Order(*of, series[0].n, order, limit, exact, limit / exact - 1, side(found)))
    return out


def side(rows: Sequence[Row]) -> str:
    """Of the exact value on which these are: what locks is no answer."""
    sides = {"above" if row.error > 0 else "below" for row in rows if math.isfinite(row.error)}
    return " and ".join(sorted(sides)) or "none"


def measures(runs: Sequence[tuple[Problem, Choice, int]]) -> Iterator[Row]:
    """These meshes, with progress."""
    with progressing(NAME) as progress:
        for done, (problem, choice, n) in enumerate(runs):
            yield measure(problem, choice, n)
            progress.advance((done + 1) / len(runs), f"{problem.name}, {choice.type.value}, n = {n}")


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, rewriting the table after each mesh; then the orders."""
    parser = parser_of(NAME, "Element types against closed answers.", fast="coarse series, no refined meshes")
    asked = parser.parse_args(argv)
    plan = planned(asked.fast)
    derived = (f"{ORDERS}.csv",)
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters={}, order=plan, derived=derived)
    for row in measures([run for of, run in plan.items() if of not in table]):
        table.add(row)
    found = orders(table.rows)
    write_csv(asked.out / derived[0], found)
    say(text(found, ("problem", "element", "quadrature", "n", "order", "extrapolated", "exact", "error", "side")))
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
