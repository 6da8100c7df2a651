"""What a run's files cost: the part of its processor time that goes into writing, and bytes per increment.

    python -m benchmarks.writing

Of the upsetting study at mu = 0.3, by the form that it takes by default (the increments posed in cvxpy) and by the
fastest, Newton's method, each in a process of its own. ``writing`` is what fields and files take from first to last,
over all that the process does; ``of the march`` the same over what it does once all is imported; ``columns`` what the
study's table takes beside them; ``over numbers`` is the size of the file over that of the numbers of the states, 8
bytes each. The exit code is 1 where writing takes more than :data:`MOST` of a process.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, fields
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bipot.laws.flow import Flow
from bipot.marching import march, system_of
from bipot.results import Recorder
from bipot.state import State
from studies.command import command, say
from studies.upsetting_case import Case, cases, parser
from studies.upsetting_columns import UNITS, history_columns

FORMS, SIDES = ("tangent", "newton"), (10, 20)
INCREMENTS = 45
MOST = 0.10


@dataclass(frozen=True)
class Cost:
    """Processor seconds of a process, its march, of writing and of columns; bytes of an increment and of a state."""

    process: float
    march: float
    writing: float
    columns: float
    bytes: float
    state: float


def cost(form: str, side: int, increments: int = INCREMENTS) -> Cost:
    """March and record, as the study does, the columns apart from the file; in a process that does nothing else."""
    # What takes long to import is not the file's.
    import h5py  # noqa: F401

    one = case(form, side, increments)
    scene, system = one.scene(), system_of(one.scene())
    columns, writing, asking, count, state = history_columns(one.reduction), 0.0, 0.0, 0, 0.0
    begun = time.process_time()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "run.vtkhdf"
        with ExitStack() as opened:
            recorder = opened.enter_context(Recorder(folder, scene, (), one.parameters(), UNITS))
            writing, start = time.process_time() - begun, file.stat().st_size
            for accepted in march(scene, one.schedule(), one.control()):
                before = time.process_time()
                recorder.record(accepted)
                between = time.process_time()
                for column in columns:
                    column.value(system, accepted)
                writing += between - before
                asking += time.process_time() - between
                count, state = accepted.number, _bytes(accepted.state)
            before = time.process_time()
        end = time.process_time()
        size = file.stat().st_size - start
    return Cost(end, end - begun, writing + end - before, asking, size / count, state)


def _bytes(state: State) -> float:
    """Those of the numbers of a state, its flow included."""
    flow = state.flow
    held = [getattr(state, one.name) for one in fields(State)] + [getattr(flow, one.name) for one in fields(Flow)]
    return float(sum(value.nbytes for value in held if isinstance(value, np.ndarray)))


def case(form: str, side: int, increments: int) -> Case:
    """The study's."""
    asked = ["--mu", "0.3", "--form", form, "--elements", str(side), "--increments", str(increments)]
    (found,) = cases(parser().parse_args(asked))
    return found


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the table."""
    argparse.ArgumentParser(
        prog="benchmarks.writing", description="What a run's files cost.", allow_abbrev=False
    ).parse_args(argv)
    say("form      elements   writing  of the march   columns  kB/increment  over numbers")
    most = 0.0
    for form in FORMS:
        for side in SIDES:
            # A process of its own, so that its time is that of the run.
            with ProcessPoolExecutor(1, get_context("spawn")) as alone:
                found = alone.submit(cost, form, side).result()
            most = max(most, found.writing / found.process)
            shares = f"{found.writing / found.process:8.1%}  {found.writing / found.march:12.1%}"
            told = f"{found.columns / found.process:8.1%}  {found.bytes / 1e3:12.1f}  {found.bytes / found.state:12.2f}"
            say(f"{form:8s}  {side:3d}x{side:<4d}  {shares}  {told}")
    say(f"writing: at most {most:.1%} of a process, {MOST:.0%} allowed")
    return int(most > MOST)


if __name__ == "__main__":
    sys.exit(main())
