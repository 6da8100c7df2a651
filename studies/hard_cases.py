"""Hard cases: what each form makes of scenes that defeat others.

    python -m studies.hard_cases [--fast] [--forms newton tangent ...] [--only TEXT] [--out DIR]

Writes ``DIR/hard_cases.csv`` (case, form, outcome, as_expected, increments, cuts, fallbacks, passes,
worst_relative_gap, seconds), one row a case and form, and prints the same table. ``newton`` may fall back on
``tangent`` and ``dissipation``, ``tangent`` on ``dissipation``; the others stand alone.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from bipot.accepted import Accepted
from bipot.errors import BipotError, IncrementFailed, SceneError
from bipot.forms import FormName
from bipot.marching import Control, march
from studies.hard_forms import FORMS
from studies.hard_loads import load_cases
from studies.hard_programs import program_cases
from studies.hard_scenes import Case, Outcome, Run, Settings, cases

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


class Table:
    """Rows kept on disk as they come."""

    def __init__(self, path: Path) -> None:
        self.path, self.rows = path, list[Row]()
        path.parent.mkdir(parents=True, exist_ok=True)

    def add(self, line: Row) -> None:
        """Append, rewrite the file, and show the line."""
        self.rows.append(line)
        with self.path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([f.name for f in fields(Row)])
            writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in astuple(r)] for r in self.rows)
        print(
            f"{line.case:34} {line.form:12} {line.outcome:10} {'ok' if line.as_expected else 'NOT EXPECTED':13}"
            f"{line.increments:4} increments {line.cuts:3} cuts {line.fallbacks:3} fallbacks {line.passes:5} passes "
            f"gap {line.worst_relative_gap:.1e} {line.seconds:7.1f} s",
            flush=True,
        )


def _positive(text: str) -> int:
    """A whole number from one on."""
    if (number := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"{number}: must be >= 1")
    return number


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(prog="studies.hard_cases", description="Scenes that defeat others.", allow_abbrev=False)
    p.add_argument("--forms", nargs="+", choices=[f.value for f in FORMS], default=[f.value for f in FORMS])
    p.add_argument("--only", default="", help="cases whose name contains this")
    p.add_argument("--elements", type=_positive, help=f"elements a side (default {FULL.elements})")
    p.add_argument("--increments", type=_positive, help=f"uniform increments (default {FULL.increments})")
    p.add_argument("--out", type=Path, default=Path("results/hard_cases"))
    p.add_argument("--fast", action="store_true", help="small meshes, and the cases that are then quick")
    return p


def main(argv: list[str] | None = None) -> int:
    """Run the table; exit code 1 when newton or dissipation end otherwise than they must."""
    command = parser()
    arguments = command.parse_args(argv)
    base = FAST if arguments.fast else FULL
    settings = Settings(arguments.elements or base.elements, arguments.increments or base.increments)
    table = Table(arguments.out / "hard_cases.csv")

    def chosen(name: str) -> bool:
        return arguments.only in name and (not arguments.fast or name.startswith(FAST_CASES))

    loads, programs = load_cases(map(FormName, arguments.forms)), program_cases()
    if not any(chosen(case.name) for case in (*cases(), *loads, *programs)):
        command.error(
            f"--only {arguments.only!r}: no case{' of --fast' if arguments.fast else ''} has that in its name"
        )
    forces: dict[tuple[str, FormName], float] = {}
    for case in filter(lambda case: chosen(case.name), cases()):
        for name in map(FormName, arguments.forms):
            began = time.perf_counter()
            done = run(case, name, settings)
            force = done.force / case.unit
            first = forces.setdefault((case.group, name), force) if case.group else force
            same = abs(force - first) <= SAME * abs(first)
            table.add(row(case, name, done, case.expected(done) and same, time.perf_counter() - began))
            if not table.rows[-1].as_expected and done.error is not None:
                print(f"    {type(done.error).__name__}: {done.error}", file=sys.stderr)
    for small in filter(lambda small: chosen(small.name), loads + programs):
        began = time.perf_counter()
        done = small.run()
        seconds = time.perf_counter() - began
        expected = done.outcome is small.expected
        shown = (small.name, small.form.value, done.outcome.value, expected)
        table.add(Row(*shown, 1, 0, done.fallbacks, done.passes, done.gap, seconds))
        if done.said:
            print(f"    {done.said}", file=sys.stderr)
    promised = {FormName.NEWTON.value, FormName.DISSIPATION.value}
    return int(any(not r.as_expected and r.form in promised for r in table.rows))


if __name__ == "__main__":
    sys.exit(main())
