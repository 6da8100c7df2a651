"""What a run's file costs: the part of its processor time that goes into writing, and bytes per increment.

    python -m benchmarks.writing

Of the upsetting study at mu = 0.3, by the form that it takes by default (the increments posed in cvxpy) and by the
fastest, Newton's method. ``writing`` is what fields and file take, ``columns`` what the study's table takes beside
them; ``over numbers`` is the size of the file over that of the numbers of the states, 8 bytes each.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bipot.laws.flow import Flow
from bipot.marching import march, system_of
from bipot.response import State
from bipot.results import Recorder
from studies.command import command, say
from studies.upsetting_case import Case, cases, parser
from studies.upsetting_columns import UNITS, history_columns

FORMS, SIDES = ("tangent", "newton"), (10, 20)
INCREMENTS = 10


@dataclass(frozen=True)
class Cost:
    """Of a run: increments, processor seconds of all, of writing and of columns, bytes an increment, and of a state."""

    increments: int
    seconds: float
    writing: float
    columns: float
    bytes: float
    state: float

    @property
    def share(self) -> float:
        """Of writing in the run."""
        return self.writing / self.seconds


def cost(case: Case, folder: Path) -> Cost:
    """March and record, as the study does, the columns apart from the file."""
    scene, system = case.scene(), system_of(case.scene())
    columns, writing, asking, count, state = history_columns(case.reduction), 0.0, 0.0, 0, 0.0
    begun = time.process_time()
    with Recorder(folder, scene, (), case.parameters(), UNITS) as recorder:
        start = (folder / "run.vtkhdf").stat().st_size
        for accepted in march(scene, case.schedule(), case.control()):
            before = time.process_time()
            recorder.record(accepted)
            between = time.process_time()
            for column in columns:
                column.value(system, accepted)
            writing += between - before
            asking += time.process_time() - between
            count, state = accepted.number, _bytes(accepted.state)
    seconds = time.process_time() - begun
    size = (folder / "run.vtkhdf").stat().st_size - start
    return Cost(count, seconds, writing, asking, size / count, state)


def _bytes(state: State) -> float:
    """Those of the numbers of a state, its flow included."""
    flow = state.flow
    held = [getattr(state, one.name) for one in fields(State)] + [getattr(flow, one.name) for one in fields(Flow)]
    return float(sum(value.nbytes for value in held if isinstance(value, np.ndarray)))


def case(form: str, side: int, increments: int = INCREMENTS) -> Case:
    """The study's, shortened."""
    asked = ["--mu", "0.3", "--form", form, "--elements", str(side), "--increments", str(increments)]
    (found,) = cases(parser().parse_args([*asked, "--reduction", "0.1"]))
    return found


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the table."""
    say("form      elements   writing   columns  kB/increment  over numbers")
    for form in FORMS:
        for side in SIDES:
            with TemporaryDirectory() as folder:
                found = cost(case(form, side), Path(folder) / "run")
            shares = f"{100 * found.share:8.1f}%  {100 * found.columns / found.seconds:8.1f}%"
            told = f"{shares}  {found.bytes / 1e3:12.1f}  {found.bytes / found.state:12.2f}"
            say(f"{form:8s}  {side:3d}x{side:<4d}  {told}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
