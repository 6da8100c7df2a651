"""Which solver solves which discrete Coulomb problem, how well and how fast.

    python -m studies.coulomb_profiles --problems DIR [DIR ...] [--solvers auto proximal ...] [--limit 30]
                                       [--workers 2] [--fast] [--require N N N N] [--resume | --overwrite] [--out DIR]

Over every FCLIB file of the folders, each solver gets `limit` seconds a problem. Written to `out`:
`solved.csv` (one row a problem and solver, as they come), `table.csv` (problems solved at 1e-4 … 1e-10 by
`residual()`, the distance to the law against the load, whatever the solver said), `profile.csv` and
`profile.png` (Dolan-More: the share of problems solved within tau times the best solver's time).
`--require 55 54 54 52` fails unless `solve()` solved that many at 1e-4, 1e-6, 1e-8 and 1e-10.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from bipot import coulomb
from bipot.errors import InfeasibleProgram, ResultsError
from studies.command import command, progressing, say
from studies.options import count, positive, processes
from studies.outputs import Table, add_options, opened
from studies.performance import DERIVED, TOLERANCES, solved_table, write
from studies.pool import completed

PROFILE_AT = 1e-8
SMALL = 20_000
"""Bytes of a file that ``--fast`` takes."""
HERE = Path(__file__).resolve().parents[1]
DEFAULT_FOLDERS = (HERE.parent / "shared/fclib/problems", HERE / "tests/data/fclib")

Task = tuple[Path, str]
AUTO = "auto"
INFEASIBLE = "infeasible"
SOLVERS: dict[str, coulomb.Solver[Any] | None] = {
    AUTO: None,
    "proximal": coulomb.ProximalPoint(),
    "proximal-natural": coulomb.ProximalPoint(coulomb.NaturalMap()),
    "newton": coulomb.Newton(),
    "newton-natural": coulomb.Newton(coulomb.NaturalMap()),
    "newton-lm": coulomb.Newton(levenberg=1e-6),
    "tresca": coulomb.TrescaFixedPoint(),
    "tresca-plain": coulomb.TrescaFixedPoint(coulomb.Damped()),
    "de-saxce": coulomb.DeSaxceFixedPoint(),
    "de-saxce-plain": coulomb.DeSaxceFixedPoint(coulomb.Damped()),
    "gauss-seidel": coulomb.GaussSeidel(),
    "uzawa": coulomb.Uzawa(),
}


@dataclass(frozen=True)
class Row:
    """One problem and one solver, as measured on the returned force."""

    id: str
    dim: int
    contacts: int
    solver: str
    status: str
    residual: float
    residual_unit_free: float
    bipotential_gap: float
    iterations: int
    seconds: float


def measure(task: Task, limit: float, tol: float = 1e-10) -> Row:
    """Read, reduce and solve one problem; the time counted is the solver's, reading and reduction are not."""
    path, name = task
    problem = coulomb.reduced(coulomb.read_fclib(path))
    limits = coulomb.Limits(tol=tol, iterations=10_000_000, seconds=limit)
    solver = SOLVERS[name]
    try:
        answer = coulomb.solve(problem, limits) if solver is None else coulomb.run(solver, problem, limits)
    except InfeasibleProgram:
        return Row(path.stem, problem.dim, problem.contacts, name, INFEASIBLE, np.inf, np.inf, np.inf, 0, 0.0)
    return Row(
        id=path.stem,
        dim=problem.dim,
        contacts=problem.contacts,
        solver=name,
        status=answer.outcome.value,
        residual=answer.residual(),
        residual_unit_free=answer.unit_free_residual(),
        bipotential_gap=answer.bipotential_gap(),
        iterations=answer.iterations,
        seconds=answer.seconds,
    )


def key(row: Row) -> tuple[str, str]:
    """What tells one row from another."""
    return row.id, row.solver


def recorded(rows: Iterable[Row], total: int, table: Table[Row]) -> None:
    """Put each row into the table and show it as progress before the next one comes."""
    with progressing("coulomb_profiles") as progress:
        for done, row in enumerate(rows, 1):
            table.add(row)
            progress.advance(done / total, row.id)


def missed(rows: Iterable[Row], required: Sequence[int]) -> list[str]:
    """What ``required`` (problems at each of TOLERANCES) asks of `solve()` and was not reached, in words."""
    residuals = [row.residual for row in rows if row.solver == AUTO]
    counts = [sum(residual <= tol for residual in residuals) for tol in TOLERANCES]
    triples = zip(TOLERANCES, counts, required, strict=True)
    return [f"{got} solved at {tol:.0e}, {asked} required" for tol, got, asked in triples if got < asked]


def parser() -> argparse.ArgumentParser:
    """The command line."""
    about = (__doc__ or "").splitlines()[0]
    p = argparse.ArgumentParser(prog="studies.coulomb_profiles", description=about, allow_abbrev=False)
    folders = "folders of FCLIB files (default ../shared/fclib/problems, if it is there, and tests/data/fclib)"
    p.add_argument("--problems", type=Path, nargs="+", default=list(DEFAULT_FOLDERS), help=folders)
    p.add_argument("--solvers", nargs="+", choices=list(SOLVERS), default=[AUTO], help=f"default {AUTO}")
    p.add_argument("--limit", type=positive, default=30.0, help="seconds a problem and solver (default %(default)s)")
    p.add_argument("--tol", type=positive, default=1e-10, help="residual asked for (default %(default)s)")
    p.add_argument(
        "--workers", type=processes(0), default=2, help="processes; 0 runs in this one (default %(default)s)"
    )
    p.add_argument("--fast", action="store_true", help="small files only (under 20 kB), 5 s each")
    p.add_argument(
        "--require", type=count(0), nargs=len(TOLERANCES), metavar="N", help="counts that solve() must reach"
    )
    p.add_argument(
        "--out", type=Path, default=Path("results/coulomb_profiles"), help="folder of the results (default %(default)s)"
    )
    add_options(p)
    return p


def problems(folders: Iterable[Path], fast: bool) -> list[Path]:
    """The files of the folders, of names that differ, as the table has them; only default folders may be missing."""
    folders = list(folders)
    for folder in folders:
        if not (folder.is_dir() or folder in DEFAULT_FOLDERS):
            raise ResultsError(f"{folder}: no folder of FCLIB files")
    paths = [path for folder in folders for path in sorted(folder.glob("*.hdf5"))]
    kept = [path for path in dict.fromkeys(paths) if not fast or path.stat().st_size < SMALL]
    named = dict[str, Path]()
    for path in kept:
        if (other := named.setdefault(path.stem, path)) is not path:
            raise ResultsError(f"{path}: has the name of {other}; the table tells problems apart by their names")
    return kept


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run what is missing, write the tables, print the first."""
    options = parser().parse_args(argv)
    paths = problems(options.problems, options.fast)
    if not paths:
        say(f"no .hdf5 files in {', '.join(map(str, options.problems))}: nothing to study")
        return 0
    limit, began = min(options.limit, 5.0) if options.fast else options.limit, perf_counter()
    solvers = list(dict.fromkeys(options.solvers))
    tasks = {(path.stem, name): (path, name) for path in paths for name in solvers}
    table = opened(
        options.out,
        "solved",
        Row,
        key,
        options.policy,
        parameters={"limit": limit, "tol": options.tol},
        order=tasks,
        derived=DERIVED,
    )
    todo = [task for name, task in tasks.items() if name not in table]
    with closing(completed(partial(measure, limit=limit, tol=options.tol), todo, options.workers)) as found:
        recorded(found, len(todo), table)
    rows = [table[name] for name in tasks]
    write(rows, options.out, PROFILE_AT)
    for line in solved_table(rows):
        say("  ".join(line))
    say(f"{len(paths)} problems in {perf_counter() - began:.0f} s; written to {options.out}")
    short = missed(rows, options.require) if options.require else []
    for line in short:
        say(line)
    return 1 if short else 0


if __name__ == "__main__":
    sys.exit(main())
