r"""Which conic solver solves which program of increments, how well and how fast.

    python -m studies.conic_profiles [--set DIR] [--solvers clarabel qoco ...] [--resume | --overwrite] [--out DIR]

Every program of the folder (``python -m studies.conic_set`` makes one) by every solver that is installed: Clarabel and
QOCO on the data, others through cvxpy. Written to ``out``: ``solved.csv`` (one row a program and solver, as they come),
``table.csv`` (programs solved at 1e-4 ... 1e-10 by the largest residual, recomputed from P, q, A, b and the cones),
``profile.csv`` and ``profile.png`` (Dolan-More: the share of programs solved within tau times the best solver's time).
Seconds are those inside the solver.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter

import numpy as np

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import ConicProgram
from bipot.conic.qoco import Qoco
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.conic.stored import load
from bipot.conic.through_cvxpy import Cvxpy, cone_solvers
from bipot.errors import ProgramError, ResultsError, require
from studies.command import command, progressing, say
from studies.outputs import Table, opened, parser_of
from studies.performance import DERIVED, solved_table, write

NAME = "conic_profiles"
PROFILE_AT = 1e-6
"""What splitting methods reach, too."""
DEFAULT_SET = Path(__file__).resolve().parents[1] / "tests/data/conic"
ASKED: Mapping[str, Accuracy] = {"scs": Accuracy(1e-8, 20_000)}
USUAL = Accuracy(1e-9, 200)
"""Asked of those not in ASKED: more makes some interior points end without an answer."""


@dataclass(frozen=True)
class Row:
    """One program and one solver: the largest residual of the answer, how far its objective is from the stored one."""

    id: str
    solver: str
    variables: int
    cones: int
    status: str
    residual: float
    objective_off: float
    iterations: int
    seconds: float


def installed() -> dict[str, ConicSolver]:
    """The solvers of second-order cone programs that are there, by name."""
    direct: dict[str, ConicSolver] = {"clarabel": Clarabel()}
    if find_spec("qoco"):
        direct["qoco"] = Qoco()
    others = [name for name in cone_solvers() if name.lower() not in direct]
    return direct | {name.lower(): Cvxpy(name) for name in others}


def measure(id: str, program: ConicProgram, optimum: float, name: str, solver: ConicSolver) -> Row:
    """Solve one program once."""
    cones, began = sum(rows.count for rows in program.rows), perf_counter()
    try:
        answer, _ = solver.solve(program, ASKED.get(name, USUAL))
    except ProgramError as failure:
        spent = perf_counter() - began
        return Row(id, name, len(program.q), cones, type(failure).__name__, np.inf, np.inf, 0, spent)
    off = abs(program.cost(answer.x) - optimum) / (abs(optimum) or 1.0)
    said = answer.outcome.value, answer.error(), off
    return Row(id, name, len(program.q), cones, *said, answer.iterations, answer.timing.solve)


def files(folder: Path) -> list[Path]:
    """The programs of a folder; raises ResultsError where there are none."""
    found = sorted(folder.glob("*.npz"))
    if not found:
        raise ResultsError(f"{folder}: no programs; run: python -m studies.conic_set --out {folder}")
    return found


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = parser_of(NAME, (__doc__ or "").splitlines()[0])
    p.add_argument("--set", type=Path, default=DEFAULT_SET, help="folder of programs (default: those of the tests)")
    p.add_argument("--solvers", nargs="+", help="by name (default: all that are installed)")
    return p


def fill(table: Table[Row], paths: Sequence[Path], solvers: Mapping[str, ConicSolver]) -> None:
    """Solve what the table lacks.

    Raises:
        ResultsError: a file without an answer.
    """
    with progressing(NAME) as progress:
        for done, path in enumerate(paths):
            program, answer = load(path)
            if answer is None:
                raise ResultsError(f"{path}: holds no answer to compare with")
            for name, solver in solvers.items():
                if (path.stem, name) not in table:
                    progress.advance(done / len(paths), f"{path.stem}, {name}")
                    table.add(measure(path.stem, program, program.cost(answer.x), name, solver))


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run what is missing, write the tables, print the first."""
    asked = parser().parse_args(argv)
    there, paths = installed(), files(asked.set)
    for name in asked.solvers or ():
        require(name in there, "--solvers", name, f"one of {', '.join(there)}")
    solvers = {name: there[name] for name in asked.solvers or there}
    order = [(path.stem, name) for path in paths for name in solvers]
    fixed = {"usual": vars(USUAL), **{name: vars(accuracy) for name, accuracy in ASKED.items()}}
    table = opened(
        asked.out,
        "solved",
        Row,
        lambda row: (row.id, row.solver),
        asked.policy,
        parameters=fixed,
        order=order,
        derived=DERIVED,
    )
    fill(table, paths, solvers)
    write(table.rows, asked.out, PROFILE_AT)
    for line in solved_table(table.rows):
        say("  ".join(line))
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
