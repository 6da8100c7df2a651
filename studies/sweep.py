r"""The main study over many coefficients and meshes: one table, one picture, in as many processes as one likes.

    python -m studies.sweep --mu 0:0.6:13 --elements 10 20 [--at 0.2 0.45] [--jobs 2 | --executor dask:ADDRESS]
                            [--resume | --overwrite] [--out DIR] [any option of studies.upsetting]

``sweep.csv`` has a row a point (mu, elements), as they come: forces on the punch at the reductions of ``--at`` (N), how
far the march went, what it cost, the worst measure of its certificates over its bound, and how it ended. ``stopped`` is
a march that refused to go on, for the ``reason``; ``lost`` one of which nothing came, as where its process was killed.
A point that fails is a row, and the others are computed; ``--resume`` computes what is missing or was lost.
``sweep.png`` shows the forces over mu. Exit code 1 where a point is not ``solved``.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from bipot.errors import require
from studies import upsetting_case
from studies.command import command, progressing, say
from studies.executors import Executors, chosen
from studies.options import coefficients, count, positive, processes
from studies.outputs import Table, add_options
from studies.pictures import drawn
from studies.sweep_picture import draw
from studies.sweep_point import Outcome, Point, Status, solve
from studies.sweep_table import missing, row_of, table_of
from studies.sweeping import Lost, lasting
from studies.tables import text

NAME = "sweep"
PICTURE = f"{NAME}.png"
EARLY = 0.2


def parser() -> argparse.ArgumentParser:
    """The options of a sweep; what it does not know is for the main study's."""
    p = argparse.ArgumentParser(
        prog=f"studies.{NAME}",
        description=(__doc__ or "").splitlines()[0],
        epilog="Any other option of studies.upsetting, as --form or --hardening, is taken for all points.",
        allow_abbrev=False,
    )
    p.add_argument(
        "--mu", type=coefficients, nargs="+", required=True, help="coefficients, or FROM:TO:NUMBER of them evenly"
    )
    p.add_argument("--elements", type=count(1), nargs="+", help="elements a side (default as in studies.upsetting)")
    p.add_argument("--at", type=positive, nargs="+", help=f"reductions (default: {EARLY:g}, if it comes, and the end)")
    p.add_argument("--jobs", type=processes(1), help="processes (default 1)")
    p.add_argument("--executor", help="where points are computed instead: dask:ADDRESS of a scheduler")
    p.add_argument(
        "--out", type=Path, default=Path(f"results/{NAME}"), help="folder of the results (default %(default)s)"
    )
    add_options(p)
    return p


def points(asked: argparse.Namespace, others: Sequence[str]) -> list[Point]:
    """Each once, the costly ones first, so that no process ends long after the others.

    Raises:
        SceneError: an option without effect on a sweep, or a point that is none.
    """
    inner = upsetting_case.parser()
    inner.prog = f"studies.{NAME}"
    mus = [repr(mu) for mu in dict.fromkeys(mu for several in asked.mu for mu in several)]
    sides = sorted(set(asked.elements or ()), reverse=True)
    found = []
    for side in sides or [None]:
        meshed = [] if side is None else ["--elements", str(side)]
        given = inner.parse_args([*others, *meshed, "--mu", *mus])
        for option, used in (("--beside", given.beside), ("--fclib", given.fclib)):
            require(not used, option, "given", "left out of a sweep")
        cases = upsetting_case.cases(given)
        at = asked.at or sorted({min(EARLY, cases[0].reduction), cases[0].reduction})
        found += [Point(case, tuple(sorted(set(at)))) for case in cases]
    return found


def computed(missing: Sequence[Point], table: Table[Any], executors: Executors, ahead: int | None) -> None:
    """Put each point into the table as it comes, and show it as progress."""
    with progressing(NAME) as progress, closing(lasting(missing, executors, solve, ahead)) as found:
        for done, (point, outcome) in enumerate(found, 1):
            lost = Outcome.none(point, Status.LOST, outcome.reason) if isinstance(outcome, Lost) else outcome
            table.add(row_of(point, lost))
            progress.advance(done / len(missing), "mu = {:g}, {} elements a side".format(*point.key))


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Compute what is missing, draw, print."""
    asked, others = parser().parse_known_args(argv)
    executors, ahead = chosen(asked.jobs, asked.executor)
    every = points(asked, others)
    table = table_of(asked.out, NAME, every, asked.policy, derived=(PICTURE,))
    computed(missing(every, table), table, executors, ahead)
    rows = [table[point.key] for point in every]
    rows.sort(key=table.rows.index)
    drawn(asked.out / PICTURE, lambda figure: draw(figure, rows, every[0].at))
    say(text(rows, [name for name in vars(rows[0]) if name != "reason"]))
    ended = Counter(row.status for row in rows)
    for row in rows:
        if row.status != Status.SOLVED.value:
            say(f"{row.status}: mu = {row.mu:g}, {row.elements} elements a side: {row.reason}")
    say(f"{', '.join(f'{number} {status}' for status, number in ended.items())}; results in {asked.out.resolve()}")
    return int(ended[Status.SOLVED.value] < len(rows))


if __name__ == "__main__":
    sys.exit(main())
