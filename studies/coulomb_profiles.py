"""Which solver solves which discrete Coulomb problem, how well and how fast.

    python -m studies.coulomb_profiles --problems DIR [DIR ...] [--solvers auto,proximal ...] [--limit 30]
                                       [--workers 2] [--fast] [--require N N N N] [--resume | --overwrite] [--out DIR]

Over every FCLIB file of the folders, each solver gets `limit` seconds a problem. Written to `out`:
`solved.csv` (one row a problem and solver, as they come), `table.csv` (problems solved at 1e-4 … 1e-10 by
`residual()`, the distance to the law against the load, whatever the solver said), `profile.csv` and
`profile.png` (Dolan-More: the share of problems solved within tau times the best solver's time).
`--require 55 54 54 52` fails unless `solve()` solved that many at 1e-4, 1e-6, 1e-8 and 1e-10.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bipot import coulomb
from bipot.errors import InfeasibleProgram, ResultsError
from bipot.progress import terminal
from studies.command import command, say
from studies.files import replacing
from studies.options import count, positive, processes
from studies.outputs import Table, add_options, opened
from studies.pool import completed

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
PROFILE_AT = 1e-8
SMALL = 20_000
"""Bytes of a file that ``--fast`` takes."""
DERIVED = ("table.csv", "profile.csv", "profile.png")
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
    progress = terminal()
    progress.start("coulomb_profiles")
    try:
        for done, row in enumerate(rows, 1):
            table.add(row)
            progress.advance(done / total, row.id)
    finally:
        progress.close()


def solved_table(rows: Iterable[Row]) -> list[list[str]]:
    """Problems solved at each tolerance and the total time, a line a solver, most solved first."""
    rows = list(rows)
    lines = []
    for name in dict.fromkeys(row.solver for row in rows):
        own = [row for row in rows if row.solver == name]
        counts = [sum(row.residual <= tol for row in own) for tol in TOLERANCES]
        seconds = np.array([row.seconds for row in own])
        median, total = f"{np.median(seconds):.3f}", f"{seconds.sum():.1f}"
        lines.append([name, *map(str, counts), str(len(own)), median, total])
    return sorted(lines, key=lambda line: [-int(n) for n in line[1:5]])


def performance_profile(rows: Iterable[Row], tol: float) -> dict[str, NDArray[np.float64]]:
    """Dolan and More's ratios time / best time over the problems, sorted, inf where not solved at ``tol``."""
    rows = list(rows)
    names, ids = (list(dict.fromkeys(getattr(row, key) for row in rows)) for key in ("solver", "id"))
    seconds = np.full((len(ids), len(names)), np.inf)
    for row in rows:
        if row.residual <= tol:
            seconds[ids.index(row.id), names.index(row.solver)] = max(row.seconds, 1e-3)
    best = seconds.min(axis=1, keepdims=True)
    ratios = np.where(np.isfinite(seconds), seconds / np.where(np.isfinite(best), best, 1.0), np.inf)
    return {name: np.sort(ratios[:, k]) for k, name in enumerate(names)}


def missed(rows: Iterable[Row], required: Sequence[int]) -> list[str]:
    """What ``required`` (problems at each of TOLERANCES) asks of `solve()` and was not reached, in words."""
    residuals = [row.residual for row in rows if row.solver == AUTO]
    counts = [sum(residual <= tol for residual in residuals) for tol in TOLERANCES]
    triples = zip(TOLERANCES, counts, required, strict=True)
    return [f"{got} solved at {tol:.0e}, {asked} required" for tol, got, asked in triples if got < asked]


def write(rows: list[Row], out: Path) -> None:
    """The tables, and the figure where matplotlib is installed."""
    header = ["solver", *(f"{tol:.0e}" for tol in TOLERANCES), "problems", "median_seconds", "total_seconds"]
    _write_csv(out / DERIVED[0], header, solved_table(rows))
    profile = performance_profile(rows, PROFILE_AT)
    _write_csv(out / DERIVED[1], list(profile), zip(*profile.values(), strict=True))
    _draw(profile, out / DERIVED[2])


def _write_csv(path: Path, header: Sequence[str], lines: Iterable[Iterable[Any]]) -> None:
    with replacing(path) as part, part.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(lines)


def _draw(profile: dict[str, NDArray[np.float64]], path: Path) -> None:
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    axes = (figure := Figure(figsize=(6, 4), layout="constrained")).subplots()
    for name, ratios in profile.items():
        axes.step(ratios, np.arange(1, ratios.size + 1) / ratios.size, where="post", label=name)
    axes.set(xscale="log", xlim=(1, 1e4), ylim=(0, 1.02))
    axes.set(xlabel="time / best time", ylabel=f"share of problems solved at {PROFILE_AT:.0e}")
    axes.legend(fontsize="x-small")
    with replacing(path) as part:
        figure.savefig(part, dpi=150, format="png")


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0], allow_abbrev=False)
    p.add_argument("--problems", type=Path, nargs="+", default=list(DEFAULT_FOLDERS))
    p.add_argument("--solvers", nargs="+", choices=list(SOLVERS), default=[AUTO])
    p.add_argument("--limit", type=positive, default=30.0, help="seconds a problem and solver")
    p.add_argument("--tol", type=positive, default=1e-10)
    p.add_argument("--workers", type=processes(0), default=2, help="processes; 0 runs in this one")
    p.add_argument("--fast", action="store_true", help="small files only (under 20 kB), 5 s each")
    p.add_argument(
        "--require", type=count(0), nargs=len(TOLERANCES), metavar="N", help="counts that solve() must reach"
    )
    p.add_argument("--out", type=Path, default=Path("results/coulomb_profiles"))
    add_options(p)
    return p


def problems(folders: Iterable[Path], fast: bool) -> list[Path]:
    """The files of the folders; the table calls them by their names, which must differ."""
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
    write(rows, options.out)
    for line in solved_table(rows):
        say("  ".join(line))
    say(f"{len(paths)} problems in {perf_counter() - began:.0f} s; written to {options.out}")
    short = missed(rows, options.require) if options.require else []
    for line in short:
        say(line)
    return 1 if short else 0


if __name__ == "__main__":
    sys.exit(main())
