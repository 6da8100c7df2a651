"""Benchmarks as ratios to the unit of cost kappa.

    python -m benchmarks.speed [--fast] [--sizes 10 40 80] [--forms newton tangent] [--out DIR]

Writes ``DIR/bench.csv`` (name, form, mu, elements, kappa_s, seconds, ratio) and ``DIR/bench_errors.csv`` (form, mu,
increments, passes, left_out, worst, rms): the histories' force against that of REFERENCE increments, but for the
``left_out`` increments in which the reference has a landing. Names: ``history``, the
whole march of the seed paper's cylinder; ``pass`` and ``increment``, their means once yield has spread; ``split
PART``, the parts of an increment over its passes; ``passes an increment``, ``growth over factorisation`` (a pass
against one ``splu``, each over its own at the least size), ``fine`` (a whole march on a fine mesh, where side nodes
land) and memory in GB (:mod:`benchmarks.memory`), in the column ``ratio``;
the stages of the dissipation form (:mod:`benchmarks.dissipation`). Ends with what
:mod:`benchmarks.targets` allows, and with exit code 1 where that is exceeded.
kappa is the median of at least 20 assemblies, factorisations and solves interleaved with each measured run. All times
are processor seconds of one thread, which other work on the machine disturbs least.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.dissipation import measured as dissipation
from benchmarks.kappa import Kappa, interleaved
from benchmarks.memory import measured as memory_of
from benchmarks.rows import Error, Row, write
from benchmarks.split import Split
from benchmarks.targets import verdicts
from bipot.contact.closeness import carries
from bipot.control.accepted import Accepted
from bipot.fem.projection import VolumeChange
from bipot.forms import Dissipation, Form, FormName, Newton, Tangent
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.typing import Floats
from studies.command import command, say
from studies.files import replacing, require_writable
from studies.options import coefficient, count

FORMS: dict[FormName, Form] = {FormName.NEWTON: Newton(), FormName.TANGENT: Tangent()}
REFERENCE, ONSET, SPREAD = 850, 0.02, 0.02
SMALL, MEASURED = 0.001, 10
BEGIN = {0.1: 0.025, 0.3: 0.014}
"""First increments of the histories, of the height.

A first one that leaves yield behind errs least (bipot.control.pacing). Of schedules like these, tried in steps of a
thousandth or more, they have the fewest passes among those that err by what the targets allow.
"""

LARGE, MEMORY_INCREMENTS, HIGH_FRICTION = 80, 6, 0.3
FINE, FINE_INCREMENTS, WHOLE = 40, 90, 0.45


@dataclass(frozen=True)
class History:
    """The seed's cylinder at one coefficient: how far, on which increments, and how many elements a side.

    mu = 0.3 stops at 44 %: beyond, landings of side nodes scatter the force between any two step sizes. Increments
    with a landing inside are not compared: the force jumps there, within a thousandth of the height.
    """

    mu: float
    reduction: float
    schedule: Schedule
    elements: int = 10

    def scene(self) -> Scene:
        """The cylinder."""
        return upsetting(mu=self.mu, reduction=self.reduction, elements=self.elements)


def shrinking(first: float, more: int, ratio: float) -> Schedule:
    """An increment to ``first`` and ``more`` from there, each the last one times the ``ratio``: error grows with force.

    >>> [round(tau, 3) for tau in shrinking(0.25, 2, 0.5).times()]
    [0.25, 0.75, 1.0]
    """
    rest = np.cumsum(ratio ** np.arange(more))
    ends = first + (1 - first) * np.append(0.0, rest[:-1]) / rest[-1]
    return Schedule(1, landings=tuple(ends.tolist()))


def histories(fast: bool) -> list[History]:
    """The two of the seed paper; fast: one on a small mesh over a short path."""
    if fast:
        return [History(0.1, 0.06, Schedule(2, first=SMALL / 0.06, settling=4, growth=2), elements=3)]
    return [
        History(0.1, 0.45, shrinking(BEGIN[0.1] / 0.45, 9, 0.985)),
        History(0.3, 0.44, Schedule(20, first=BEGIN[0.3] / 0.44, settling=1, growth=1.5)),
    ]


def control(form: Form) -> Control:
    """The form with every conic fallback."""
    return Control(form=form, fallbacks=(Tangent(), Dissipation()))


def curve(reduction: float, steps: Iterable[Accepted]) -> Floats:
    """Reduction, force and whether a candidate touched for the first time, (n, 3)."""
    known, rows = None, []
    for a in steps:
        closed = carries(a.solved.r)
        landed = known is not None and bool(np.any(closed & ~known))
        known = closed if known is None else known | closed
        rows.append((reduction * a.state.tau, -a.tool_forces[0, 1], landed))
    return np.array(rows)


def reference(history: History, folder: Path, increments: int) -> Floats:
    """The curve of many increments, computed once and kept in ``folder``."""
    reached = f"{history.mu:g}_{history.reduction:g}_{history.elements}_{increments}"
    kept = folder / f"reference_{Control().integration.name.lower()}_{reached}.npy"
    if not kept.exists():
        schedule = Schedule(increments, first=SMALL / 2 / history.reduction)
        found = curve(history.reduction, march(history.scene(), schedule, control(Newton())))
        with replacing(kept) as part, part.open("wb") as file:
            np.save(file, found)
    return np.load(kept)


def errors(force: Floats, against: Floats) -> tuple[Floats, int]:
    """Relative force errors from ONSET on, and how many increments are left out for a landing inside."""
    landings = against[against[:, 2] > 0, 0]
    begin, end = np.append(0.0, force[:-1, 0]), force[:, 0]
    inside = np.array([np.any((landings > b) & (landings <= e)) for b, e in zip(begin, end, strict=True)])
    late = end >= ONSET
    error = np.abs(force[:, 1] / np.interp(end, against[:, 0], against[:, 1]) - 1)
    return error[late & ~inside], int(np.sum(late & inside))


def whole(history: History, form: Form, against: Floats) -> tuple[Row, Error]:
    """Time and error of a whole history."""
    kappa, scene = Kappa(), history.scene()
    count = len(history.schedule.times())
    split = Split()
    running = split.while_running(march(scene, history.schedule, control(form)))
    steps = list(interleaved(system_of(scene), running, kappa, count))
    seconds = split.seconds
    force = curve(history.reduction, steps)
    error, left_out = errors(force, against)
    name = form.name.value
    row = Row("history", name, history.mu, history.elements, kappa.median, seconds, seconds / kappa.median)
    passes = sum(a.passes for a in steps)
    return row, Error(
        name,
        history.mu,
        history.elements,
        len(steps),
        passes,
        left_out,
        float(error.max()),
        float(np.sqrt(np.mean(error**2))),
    )


def passes(form: Form, mu: float, elements: int, measured: int) -> tuple[list[Row], float]:
    """Mean pass once yield has spread, its split, and passes an increment, for increments of 1 % of the height; and
    the time of a pass over that of a factorisation.
    """
    reduction = SPREAD + 0.01 * measured + 0.01
    scene, kappa, seen = upsetting(mu=mu, reduction=reduction, elements=elements), Kappa(), []
    schedule = Schedule(round(reduction / 0.01), first=SMALL / reduction, settling=4)
    split = Split()
    running = split.while_running(march(scene, schedule, control(form), observe=split.see))
    for step in interleaved(system_of(scene), running, kappa, measured):
        if reduction * step.start.tau < SPREAD:
            split.reset()
            continue
        seen.append(step)
    count, name, unit = sum(a.passes for a in seen), form.name.value, kappa.median
    pace = {"pass": split.passes / count, "increment": split.seconds / len(seen)}
    parts = {f"split {part}": seconds / count for part, seconds in split.parts().items()}
    rows = [Row(part, name, mu, elements, unit, s, s / unit) for part, s in (pace | parts).items()]
    rows.append(Row("passes an increment", name, mu, elements, unit, 0.0, count / len(seen)))
    return rows, pace["pass"] / kappa.factorisation


def fine(elements: int, increments: int) -> list[Row]:
    """Passes an increment and conic fallbacks of the whole upsetting at HIGH_FRICTION, where side nodes land.

    Of the element that made meshes have: the paper's locks, and takes more passes.
    """
    scene = upsetting(mu=HIGH_FRICTION, elements=elements, element=Element.Q4, volume=VolumeChange.P0)
    steps = list(march(scene, Schedule(increments, first=SMALL / WHOLE), control(Newton())))
    fallbacks = sum(step.form is not FormName.NEWTON for step in steps)
    measures = {"fine passes an increment": sum(a.passes for a in steps) / len(steps), "fine fallbacks": fallbacks}
    return [Row(name, FormName.NEWTON.value, HIGH_FRICTION, elements, 0.0, 0.0, v) for name, v in measures.items()]


def memory(elements: int) -> list[Row]:
    """Peak and growth of the memory of a Newton run, in a process of its own."""
    whole_run, grown = memory_of(elements, MEMORY_INCREMENTS)
    measures = {"peak memory in GB": whole_run, "memory growth in GB": grown}
    return [Row(name, FormName.NEWTON.value, 0.1, elements, 0.0, 0.0, value) for name, value in measures.items()]


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="benchmarks.speed", description=__doc__.splitlines()[0] if __doc__ else "", allow_abbrev=False
    )
    p.add_argument("--sizes", type=count(1), nargs="*", help="elements a side of the pass benchmark (default 10 40 80)")
    p.add_argument("--forms", nargs="+", choices=[f.value for f in FORMS], default=[f.value for f in FORMS])
    p.add_argument("--mu", type=coefficient, default=0.1, help="Coulomb coefficient of the pass benchmark")
    p.add_argument("--out", type=Path, default=Path("results"))
    p.add_argument("--no-histories", action="store_true", help="leave out the whole histories")
    p.add_argument("--fast", action="store_true", help="a small mesh and a short path")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, print and write the benchmarks."""
    arguments = parser().parse_args(argv)
    require_writable(arguments.out)
    sizes = arguments.sizes if arguments.sizes is not None else [3] if arguments.fast else [10, 40, LARGE]
    rows: list[Row] = []
    errors: list[Error] = []

    def keep(new: list[Row]) -> None:
        rows.extend(new)
        write(arguments.out / "bench.csv", Row, rows)
        for row in new:
            unit = f"kappa = {1e3 * row.kappa_s:.2f} ms" if row.seconds > 0 else ""
            say(f"{row.name:26} {row.form:8} mu {row.mu:<4g} {row.elements:>3} {row.ratio:10.4f} {unit}")

    forms = [FORMS[FormName(name)] for name in arguments.forms]
    least: dict[FormName, float] = {}

    def measure(size: int) -> None:
        for form in forms:
            new, cost = passes(form, arguments.mu, size, 2 if arguments.fast else MEASURED)
            grown = cost / least.setdefault(form.name, cost)
            keep([*new, Row("growth over factorisation", form.name.value, arguments.mu, size, 0.0, 0.0, grown)])

    # The small ones first: what large runs leave of the heap changes the times of small ones by a tenth.
    for size in sizes[:1]:
        measure(size)
    for form in [] if arguments.no_histories else forms:
        for history in histories(arguments.fast):
            row, error = whole(history, form, reference(history, arguments.out, 20 if arguments.fast else REFERENCE))
            errors.append(error)
            keep([row, *error.rows()])
            write(arguments.out / "bench_errors.csv", Error, errors)
            say(f"{'':22} {error.increments} increments ({error.left_out} left out), {error.passes} passes")
    keep(dissipation(HIGH_FRICTION, 3 if arguments.fast else 10))
    for size in sizes[1:]:
        measure(size)
    if FINE in sizes:
        keep(fine(FINE, FINE_INCREMENTS))
    if LARGE in sizes:
        keep(memory(LARGE))
    return report(rows, whole=not arguments.fast)


def report(rows: list[Row], whole: bool) -> int:
    """Print what became of each limit; 1 where one is exceeded, or, of a ``whole`` run, was not measured."""
    failed = False
    for limit, ratio in verdicts(rows):
        met = ratio is not None and ratio <= limit.most
        failed |= not met and (whole or ratio is not None)
        said = "not measured" if ratio is None else f"{ratio:.3g}"
        what = f"{limit.name}, {limit.form}, mu = {limit.mu:g}, {limit.elements}"
        say(f"{'met ' if met else 'MISS'} {what}: {said}, at most {limit.most:g}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
