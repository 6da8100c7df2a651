r"""The programs of one upsetting by every conic solver: objective, residuals and seconds.

    python -m studies.solvers [--fast] [--resume | --overwrite] [--out DIR]

The seed paper's cylinder, mu = 0.3, is marched to 10 % with each conic form, and ten of its programs, spread over the
march, are given to each solver through the one interface. ``solvers.csv``: a row for each form and solver, with the
largest relative difference of the objective from Clarabel's at its tightest, the largest error of the solution as it
measures itself, and the median seconds of a program (statement or transfer, and solution).
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import ConicProgram
from bipot.conic.qoco import Qoco
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.conic.through_cvxpy import Cvxpy
from bipot.exchange import conic_program
from bipot.forms import Dissipation, FormName, Tangent
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from studies.command import command, say
from studies.outputs import opened, parser_of
from studies.tables import text
from studies.upsetting_march import FIRST

NAME = "solvers"
MU, REDUCTION, INCREMENTS, PROGRAMS = 0.3, 0.1, 10, 10
REFERENCE = Accuracy(1e-12)
SOLVERS: Mapping[str, tuple[ConicSolver, Accuracy]] = {
    "clarabel": (Clarabel(), Accuracy(1e-10)),
    "qoco": (Qoco(), Accuracy(1e-9)),
    "cvxpy:clarabel": (Cvxpy("CLARABEL"), Accuracy(1e-10)),
    "cvxpy:scs": (Cvxpy("SCS"), Accuracy(1e-7, 100_000)),
}
"""Each with what it is asked."""


@dataclass(frozen=True)
class Row:
    """One solver on the programs of one form; ``variables`` and ``cones`` are the largest there were."""

    form: str
    solver: str
    programs: int
    variables: int
    cones: int
    objective: float
    error: float
    iterations: float
    seconds: float


def recorded(name: FormName, elements: int, increments: int = INCREMENTS) -> list[ConicProgram]:
    """Ten programs of an upsetting, spread over it: each that of the last pass of an increment."""
    form = Tangent() if name is FormName.TANGENT else Dissipation()
    scene = upsetting(mu=MU, reduction=REDUCTION, elements=elements)
    schedule = Schedule(increments, FIRST / REDUCTION)
    programs = [conic_program(accepted, form).conic() for accepted in march(scene, schedule, Control(form))]
    chosen = np.linspace(0, len(programs) - 1, PROGRAMS).round().astype(int)
    return [programs[i] for i in chosen]


def compared(programs: list[ConicProgram], form: str, solvers: Iterable[str] = SOLVERS) -> Iterator[Row]:
    """The solvers on the same programs, one after another, each keeping what it can."""
    exact = [program.cost(Clarabel().solve(program, REFERENCE)[0].x) for program in programs]
    variables = max(len(program.q) for program in programs)
    cones = max(sum(rows.count for rows in program.rows if rows.width > 1) for program in programs)
    for name in solvers:
        answers, last = [], None
        solver, accuracy = SOLVERS[name]
        for program in programs:
            answer, last = solver.solve(program, accuracy, last)
            answers.append(answer)
        costs = [answer.program.cost(answer.x) for answer in answers]
        yield Row(
            form,
            name,
            len(programs),
            variables,
            cones,
            max(abs(cost / best - 1) for cost, best in zip(costs, exact, strict=True)),
            max(answer.error() for answer in answers),
            float(np.median([answer.iterations for answer in answers])),
            float(np.median([answer.timing.build + answer.timing.solve for answer in answers])),
        )


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, rewriting the table after each solver."""
    parser = parser_of(NAME, "Conic solvers compared.", fast="a small mesh and few increments", out=Path("results"))
    asked = parser.parse_args(argv)
    elements, increments = (2, 3) if asked.fast else (10, INCREMENTS)
    forms = (FormName.TANGENT, FormName.DISSIPATION)
    table = opened(
        asked.out,
        NAME,
        Row,
        lambda row: (row.form, row.solver),
        asked.policy,
        parameters={"elements": elements, "increments": increments},
        order=((form.value, solver) for form in forms for solver in SOLVERS),
    )
    for form in forms:
        missing = [solver for solver in SOLVERS if (form.value, solver) not in table]
        if missing:
            for row in compared(recorded(form, elements, increments), form.value, missing):
                table.add(row)
    say(text(table.rows, ("form", "solver", "objective", "error", "iterations", "seconds")))
    return 0


if __name__ == "__main__":
    sys.exit(main())
