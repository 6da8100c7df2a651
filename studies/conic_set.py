r"""Forty conic programs of increments, with their optima: a test set for solvers of second-order cone programs.

    python -m studies.conic_set [--fast] [--resume | --overwrite] [--out DIR]

Upsetting, ring, wedge and extrusion, by the forms ``tangent`` and ``dissipation``, from 50 to 10 000 cones
(:mod:`studies.conic_scenes`). Each program is a npz file with the best answer that Clarabel finds, as its residuals
tell, over TOLERANCES; ``conic_set.csv`` has a row a program, and ``README.md`` tells the format. ``--fast`` makes those
of the coarse meshes, which are the tests' data.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Cone, ConicProgram, ConicSolution
from bipot.conic.solver import Accuracy
from bipot.control.accepted import Accepted
from bipot.errors import ProgramError
from studies.command import command, progressing, say
from studies.conic_scenes import COURSES, Course, Pick
from studies.files import replacing
from studies.outputs import Table, opened, parser_of
from studies.tables import text

NAME = "conic_set"
README = Path(__file__).with_name(f"{NAME}.md")
TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12)
ITERATIONS = 200


@dataclass(frozen=True)
class Row:
    """One program: where it is from, its sizes, its optimum and the residuals of its stored answer.

    ``conditions`` are single rows that must not be negative, ``equalities`` rows that must vanish; ``entries`` those of
    P and A together. The residuals are those of :meth:`bipot.ConicSolution.residuals`, in its order.
    """

    name: str
    scene: str
    elements: int
    form: str
    moment: str
    increment: int
    tau: float
    variables: int
    second_order_cones: int
    conditions: int
    equalities: int
    entries: int
    optimum: float
    dual_residual: float
    primal_residual: float
    duality_gap: float
    dual_violation: float


def row_of(course: Course, pick: Pick, accepted: Accepted, answer: ConicSolution) -> Row:
    """A program with its best answer."""
    program = answer.program
    counts = {cone: sum(rows.count for rows in program.rows if rows.cone is cone) for cone in Cone}
    return Row(
        course.name(pick),
        course.scene,
        course.elements,
        pick.form.value,
        pick.moment.value,
        accepted.number,
        accepted.state.tau,
        len(program.q),
        counts[Cone.SECOND_ORDER],
        counts[Cone.NONNEGATIVE],
        counts[Cone.ZERO],
        program.P.nnz + sum(rows.A.nnz for rows in program.rows),
        program.cost(answer.x),
        *answer.residuals().tolist(),
    )


def best(program: ConicProgram) -> ConicSolution:
    """Of the answers to rising demands that of the smallest error: asked for too much, interior points end in noise.

    Raises:
        ProgramError: there is none.
    """
    found: list[ConicSolution] = []
    for tolerance in TOLERANCES:
        try:
            found.append(Clarabel().solve(program, Accuracy(tolerance, ITERATIONS))[0])
        except ProgramError:
            continue
    if not found:
        raise ProgramError("Clarabel answers to none of the tolerances")
    return min(found, key=ConicSolution.error)


def made(courses: Iterable[Course], table: Table[Row]) -> None:
    """March, solve and write, program by program."""
    missing = [course for course in courses if any(course.name(pick) not in table for pick in course.picks)]
    with progressing(NAME) as progress:
        for done, course in enumerate(missing):
            progress.advance(done / len(missing), f"{course.scene}, {course.elements}")
            for pick, accepted, program in course.programs():
                answer = best(program)
                program.save(table.folder / f"{course.name(pick)}.npz", answer)
                table.add(row_of(course, pick, accepted, answer))


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Make what is missing, print the table."""
    parser = parser_of(NAME, "A conic test set.", fast="programs of the coarse meshes alone")
    asked = parser.parse_args(argv)
    courses = [course for course in COURSES if course.small or not asked.fast]
    names = [course.name(pick) for course in courses for pick in course.picks]
    fixed = {"tolerances": TOLERANCES, "iterations": ITERATIONS}
    table = opened(asked.out, NAME, Row, lambda row: row.name, asked.policy, parameters=fixed, order=names)
    made(courses, table)
    with replacing(asked.out / "README.md") as part:
        shutil.copyfile(README, part)
    say(text(table.rows, [field.name for field in fields(Row) if field.name not in ("name", "scene")] + ["name"]))
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
