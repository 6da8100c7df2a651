"""The command line of the suite (:mod:`studies.verification`)."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from studies.command import command, progressing, say
from studies.files import replacing
from studies.outputs import opened, parser_of
from studies.tables import text
from studies.verification.case import NO, Case, Row
from studies.verification.cases import all_cases
from studies.verification.forms import asked_on, judged_on, measured
from studies.verification.page import NAME, page

SHOWN = ("case", "quantity", "mesh", "reference", "value", "error", "tolerance", "ok", "seconds")


def measures(runs: Sequence[tuple[Case, int]], *, others: bool) -> Iterator[list[Row]]:
    """These runs, with progress; ``others``, with what other forms find."""
    with progressing(NAME) as progress:
        for done, (case, mesh) in enumerate(runs, 1):
            yield list(measured(case, mesh, others=others))
            progress.advance(done / len(runs), f"{case.name}, {mesh}")


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, rewriting the table after each mesh."""
    cases = {case.name: case for case in all_cases()}
    parser = parser_of(NAME, "Cases with known answers.", fast="the coarsest mesh of each case")
    parser.add_argument("--only", nargs="+", choices=cases, default=list(cases), metavar="NAME", help=", ".join(cases))
    parser.add_argument("--page", type=Path, help="page to write from the table")
    asked = parser.parse_args(argv)
    keys = [
        (case.name, mesh, one.quantity)
        for case in cases.values()
        for mesh in case.meshes
        for one in asked_on(case, mesh, others=True)
    ]
    table = opened(
        asked.out,
        NAME,
        Row,
        lambda row: (row.case, row.mesh, row.quantity),
        asked.policy,
        parameters={},
        order=keys,
    )
    chosen = [cases[name] for name in cases if name in asked.only]
    runs = [(case, mesh) for case in chosen for mesh in (case.meshes[:1] if asked.fast else case.meshes)]
    left = [
        (case, mesh)
        for case, mesh in runs
        if any((case.name, mesh, one.quantity) not in table for one in asked_on(case, mesh, others=not asked.fast))
    ]
    for rows in measures(left, others=not asked.fast):
        table.add(*(row for row in rows if (row.case, row.mesh, row.quantity) not in table))
    say(text([row for row in table.rows if row.case in asked.only], SHOWN))
    if asked.page is not None:
        with replacing(asked.page) as part:
            part.write_text(page(list(cases.values()), table.rows), encoding="utf-8")
    judged = [
        row for row in table.rows if row.case in asked.only and row.mesh == judged_on(cases[row.case], row.quantity)
    ]
    missed = sorted({row.case for row in judged if row.ok == NO})
    whole = {row.case for row in judged if row.mesh == cases[row.case].finest}
    judgement = f"{len(whole)} of {len(chosen)} cases judged on their finest mesh"
    say(f"{judgement}; missed: {', '.join(missed) or 'none'}")
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main())
