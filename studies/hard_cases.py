"""Hard cases: what each form makes of scenes that defeat others.

    python -m studies.hard_cases [--fast] [--forms newton tangent ...] [--only TEXT] [--resume | --overwrite]
                                 [--out DIR]

Writes ``DIR/hard_cases.csv`` (case, form, outcome, as_expected, increments, cuts, fallbacks, passes,
worst_relative_gap, seconds), one row a case and form, and prints the same table. ``newton`` may fall back on
``tangent`` and ``dissipation``, ``tangent`` on ``dissipation``; the others stand alone.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

from bipot.control.accepted import Accepted
from bipot.errors import BipotError, IncrementFailed, SceneError
from bipot.forms import FormName
from bipot.marching import Control, march
from studies.command import command, say
from studies.hard_forms import FORMS
from studies.hard_loads import load_cases
from studies.hard_programs import ProgramCase, program_cases
from studies.hard_scenes import Case, Outcome, Run, Settings, cases
from studies.options import count
from studies.outputs import Table, opened, parser_of

NAME = "hard_cases"
Key = tuple[str, str]
PROMISED = (FormName.NEWTON.value, FormName.DISSIPATION.value)
SAME = 1e-6
"""Relative agreement of the forces of one group."""

FULL, FAST = Settings(8, 24), Settings(3, 4)
FAST_CASES = ("1 mu 10", "6 ", "7 gap", "9 ", "10 m", "12 ", "13 softening", "8 ", "14 ")


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    case: str
    form: str
    outcome: str
    as_expected: bool
    increments: int
    cuts: int
    fallbacks: int
    passes: int
    worst_relative_gap: float
    seconds: float


def run(case: Case, name: FormName, settings: Settings) -> Run:
    """March a case to its end, whatever that is."""
    steps: list[Accepted] = []
    try:
        scene = case.scene(settings)
        form, fallbacks = FORMS[name](scene)
        control = Control(form, fallbacks, cuts=case.cuts)
        steps.extend(march(scene, case.schedule(settings), control))
    except SceneError as error:
        return Run(Outcome.REFUSED, steps, error)
    except IncrementFailed as error:
        return Run(Outcome.STOPPED, steps, error)
    except BipotError as error:
        return Run(Outcome.FAILED, steps, error)
    except Exception as error:
        return Run(Outcome.CRASHED, steps, error)
    return Run(Outcome.CERTIFIED, steps)


def row(case: Case, name: FormName, done: Run, expected: bool, seconds: float) -> Row:
    """The line of a run. Increments of a failed attempt are those accepted before it."""
    return Row(
        case.name,
        name.value,
        done.outcome.value,
        expected,
        len(done.steps),
        sum(a.cuts for a in done.steps),
        sum(a.form is not name for a in done.steps),
        sum(a.passes for a in done.steps),
        max((a.solved.certificate.relative_gap for a in done.steps), default=0.0),
        seconds,
    )


def key(line: Row) -> Key:
    """What tells one line from another."""
    return line.case, line.form


def told(line: Row) -> str:
    """A line in words."""
    return (
        f"{line.case:34} {line.form:12} {line.outcome:10} {'ok' if line.as_expected else 'NOT EXPECTED':13}"
        f"{line.increments:4} increments {line.cuts:3} cuts {line.fallbacks:3} fallbacks {line.passes:5} passes "
        f"gap {line.worst_relative_gap:.1e} {line.seconds:7.1f} s"
    )


def of_marches(
    chosen: Sequence[Case], forms: Sequence[FormName], settings: Settings, table: Table[Row]
) -> Iterator[Row]:
    """The lines that the table lacks. Of a group, whose forces are compared, all are run or none."""
    reached = [(case, name) for case in chosen for name in forms]
    lacking = {(case.group or case.name, name) for case, name in reached if (case.name, name.value) not in table}
    forces: dict[tuple[str, FormName], float] = {}
    for case, name in reached:
        if (case.group or case.name, name) not in lacking:
            continue
        began = time.perf_counter()
        done = run(case, name, settings)
        force = done.force / case.unit
        first = forces.setdefault((case.group, name), force) if case.group else force
        same = abs(force - first) <= SAME * abs(first)
        yield row(case, name, done, expected := case.expected(done) and same, time.perf_counter() - began)
        if not expected and done.error is not None:
            say(f"    {type(done.error).__name__}: {done.error}", sys.stderr)


def of_programs(chosen: Sequence[ProgramCase], table: Table[Row]) -> Iterator[Row]:
    """The lines that the table lacks."""
    for small in chosen:
        if (small.name, small.form.value) in table:
            continue
        began = time.perf_counter()
        done = small.run()
        seconds = time.perf_counter() - began
        shown = (small.name, small.form.value, done.outcome.value, done.outcome is small.expected)
        yield Row(*shown, 1, 0, done.fallbacks, done.passes, done.gap, seconds)
        if done.said:
            say(f"    {done.said}", sys.stderr)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = parser_of(NAME, "Scenes that defeat others.", fast="small meshes, and the cases that are then quick")
    p.add_argument("--forms", nargs="+", choices=[f.value for f in FORMS], default=[f.value for f in FORMS])
    p.add_argument("--only", default="", help="cases whose name contains this")
    p.add_argument("--elements", type=count(1), help=f"elements a side (default {FULL.elements})")
    p.add_argument("--increments", type=count(1), help=f"uniform increments (default {FULL.increments})")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the table; exit code 1 when newton or dissipation end otherwise than they must."""
    asking = parser()
    asked = asking.parse_args(argv)
    base = FAST if asked.fast else FULL
    settings = Settings(asked.elements or base.elements, asked.increments or base.increments)
    forms = [FormName(name) for name in dict.fromkeys(asked.forms)]

    def chosen(name: str) -> bool:
        return asked.only in name and (not asked.fast or name.startswith(FAST_CASES))

    marches = [case for case in cases() if chosen(case.name)]
    programs = [case for case in load_cases(forms) + program_cases() if chosen(case.name)]
    if not marches and not programs:
        asking.error(f"--only {asked.only!r}: no case{' of --fast' if asked.fast else ''} has that in its name")
    order = [(case.name, name.value) for case in marches for name in forms]
    order += [(case.name, case.form.value) for case in programs]
    fixed = vars(settings)
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=order)
    for line in chain(of_marches(marches, forms, settings, table), of_programs(programs, table)):
        table.add(line)
        say(told(line))
    return int(any(not line.as_expected and line.form in PROMISED for line in table.rows))


if __name__ == "__main__":
    sys.exit(main())
