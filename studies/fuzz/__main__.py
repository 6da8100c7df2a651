"""Random scenes and discrete Coulomb problems, each judged by an independent recomputation.

    python -m studies.fuzz [--scenes 600] [--shaped 300] [--solid 100] [--solid-shaped 100] [--regional 100]
                           [--solid-regional 50] [--parts 100] [--solid-parts 50] [--coulomb 2000] [--seed S]
                           [--jobs J]
                           [--resume | --overwrite] [--out DIR] [--fast]

Scenes have flat tools, shaped ones curved and turning tools beside (:mod:`studies.fuzz.shaped`), solid ones are of
bodies in space (:mod:`studies.fuzz.solid`), under curved and turning tools too (:mod:`studies.fuzz.solid_shaped`).
Regional ones are any of these, of several materials (:mod:`studies.fuzz.regional`). Those of parts are of two or three
that touch each other (:mod:`studies.fuzz.parts`), solid ones in space (:mod:`studies.fuzz.solid_parts`).
Scenes and problems have the seeds S, S + 1, ...: one seed again is
``--seed THAT --scenes 1 --shaped 0 --solid 0 --solid-shaped 0 --regional 0 --solid-regional 0 --parts 0
--solid-parts 0 --coulomb 0``.
Every scene is marched as drawn, in other
units, mirrored, renumbered and, about each of its planes of symmetry, unfolded; bodies in space turned or with axes
exchanged instead of mirrored, and unfolded about one plane.
``DIR/fuzz.csv`` (seed, kind, form, outcome, reason, increments, worst_residual, worst_law, worst_disagreement, seconds)
gets a row as each is done. Rows depend on their seeds alone, so that those it has are not run again, with ``--resume``
or without; ``--overwrite`` starts afresh. ``kind`` says which surfaces are not flat, whether contact is weighted or
friction capped, and what turns or is driven by force or by supports. The outcome is one of

* certified: to the end, and no independent measure above ten times the library's bound;
* refused: ended by the library in words (``reason``), and nothing wrong with what it accepted until then;
* wrong: accepted with a measure above that, with energies or forces of whole tools other than their sums, or with such
  or nodal forces that differ by more than 1e-5 of the largest between the variants where the answer was not reported as
  undetermined; ended with a claim of collapse that the inequalities of ``studies/independent/limit.py`` do not prove;
  or a discrete problem called solved that is not;
* raw exception, warning: what no user should see.

The last line counts them. Exit code 1 where one of the last three kinds is in the file, 130 after Ctrl-C.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from bipot.results import Existing
from studies.command import command, say
from studies.fuzz.row import Outcome, Table
from studies.fuzz.tasks import study
from studies.options import count, processes
from studies.outputs import parser_of
from studies.progress import terminal

OPTIONS = {
    "scene": "scenes",
    "shaped": "shaped",
    "solid": "solid",
    "solid shaped": "solid_shaped",
    "regional": "regional",
    "solid regional": "solid_regional",
    "parts": "parts",
    "solid parts": "solid_parts",
    "coulomb": "coulomb",
}
"""Which option says how many of a kind."""

FAST = {
    "scene": 10,
    "shaped": 10,
    "solid": 5,
    "solid shaped": 5,
    "regional": 5,
    "solid regional": 3,
    "parts": 5,
    "solid parts": 3,
    "coulomb": 50,
}
"""The most of each kind where a run is to be short."""


def counts(table: Table) -> str:
    """How often each outcome is in the file."""
    return ", ".join(f"{table.outcomes[outcome.value]} {outcome.value}" for outcome in Outcome)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = parser_of(
        "fuzz",
        (__doc__ or "").splitlines()[0],
        fast="at most 10 scenes of a kind, 5 solid ones, 50 problems",
        policy=Existing.RESUME,
    )
    p.add_argument("--scenes", type=count(0), default=600, help="random scenes (default %(default)s)")
    p.add_argument("--shaped", type=count(0), default=300, help="those with curved tools (default %(default)s)")
    p.add_argument("--solid", type=count(0), default=100, help="bodies in space (default %(default)s)")
    p.add_argument("--solid-shaped", type=count(0), default=100, help="with curved tools (default %(default)s)")
    p.add_argument("--regional", type=count(0), default=100, help="of several materials (default %(default)s)")
    p.add_argument("--solid-regional", type=count(0), default=50, help="such bodies in space (default %(default)s)")
    p.add_argument("--parts", type=count(0), default=100, help="of parts that touch (default %(default)s)")
    p.add_argument("--solid-parts", type=count(0), default=50, help="such parts in space (default %(default)s)")
    p.add_argument("--coulomb", type=count(0), default=2000, help="random discrete problems (default %(default)s)")
    p.add_argument("--seed", type=count(0), default=0, help="of the first scene and problem (default %(default)s)")
    p.add_argument("--jobs", type=processes(1), default=1, help="processes (default %(default)s)")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run what is not in the file yet."""
    given = parser().parse_args(argv)
    numbers: dict[str, int] = {kind: getattr(given, option) for kind, option in OPTIONS.items()}
    if given.fast:
        numbers = {kind: min(number, FAST[kind]) for kind, number in numbers.items()}
    table = Table(given.out / "fuzz.csv", afresh=given.policy is Existing.OVERWRITE)
    try:
        study(table, given.seed, numbers, given.jobs, terminal())
    finally:
        say(counts(table))
    return 1 if table.failed else 0


if __name__ == "__main__":
    sys.exit(main())
