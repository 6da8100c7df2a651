"""Benchmarks as ratios to the unit of cost kappa.

    python -m benchmarks.speed [--fast] [--sizes 10 40 80] [--forms newton tangent] [--out DIR]

Writes ``DIR/bench.csv`` (name, form, mu, elements, kappa_s, seconds, ratio) and ``DIR/bench_errors.csv`` (form, mu,
increments, passes, worst, rms): the histories' force against that of REFERENCE increments. Names: ``history``, the
whole march of the seed paper's cylinder; ``pass`` and ``increment``, their means once yield has spread; ``split
PART``, the parts of an increment over its passes.
kappa is the median of at least 20 assemblies, factorisations and solves interleaved with each measured run.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.kappa import Kappa, interleaved
from benchmarks.split import stopwatch
from bipot.forms import Dissipation, Form, FormName, Newton, Tangent
from bipot.increment import tool_forces
from bipot.march import Accepted, Control, Schedule, march, system_of
from bipot.scene import Scene, upsetting

Floats = NDArray[np.float64]

FORMS: dict[FormName, Form] = {FormName.NEWTON: Newton(), FormName.TANGENT: Tangent()}
REFERENCE, ONSET, SPREAD = 850, 0.02, 0.02
SMALL, MEASURED = 0.001, 10


@dataclass(frozen=True)
class Row:
    """One line of bench.csv."""

    name: str
    form: str
    mu: float
    elements: int
    kappa_s: float
    seconds: float
    ratio: float


@dataclass(frozen=True)
class Error:
    """One line of bench_errors.csv: a history's force against the reference's, relative."""

    form: str
    mu: float
    increments: int
    passes: int
    worst: float
    rms: float


@dataclass(frozen=True)
class History:
    """The seed's cylinder at one coefficient: how far, on which increments, and how many elements a side.

    mu = 0.3 stops at 44 %: beyond, landings of side nodes scatter the force between any two step sizes.
    """

    mu: float
    reduction: float
    schedule: Schedule
    elements: int = 10

    def scene(self) -> Scene:
        """The cylinder."""
        return upsetting(mu=self.mu, reduction=self.reduction, elements=self.elements)


def histories(fast: bool) -> list[History]:
    """The two of the seed paper; fast: one on a small mesh over a short path."""
    if fast:
        return [History(0.1, 0.06, Schedule(2, first=SMALL / 0.06, settling=4, growth=2), elements=3)]
    return [
        History(0.1, 0.45, Schedule(44, first=SMALL / 0.45, settling=4, growth=2)),
        History(0.3, 0.44, Schedule(160, first=SMALL / 0.44, settling=4, growth=2)),
    ]


def control(form: Form) -> Control:
    """The form with every conic fallback."""
    return Control(form=form, fallbacks=(Tangent(), Dissipation()))


def curve(scene: Scene, reduction: float, steps: Iterable[Accepted]) -> Floats:
    """Reduction and force (n, 2)."""
    system = system_of(scene)
    return np.array([(reduction * a.state.tau, -tool_forces(system, a.solved.r)[0, 1]) for a in steps])


def reference(history: History, folder: Path, increments: int) -> Floats:
    """The force curve of many increments, computed once and kept in ``folder``."""
    kept = folder / f"reference_mu{history.mu:g}_{history.elements}_{increments}.npy"
    if not kept.exists():
        schedule = Schedule(increments, first=SMALL / 2 / history.reduction)
        np.save(kept, curve(history.scene(), history.reduction, march(history.scene(), schedule, control(Newton()))))
    return np.load(kept)


def whole(history: History, form: Form, against: Floats) -> tuple[Row, Error]:
    """Time and error of a whole history."""
    kappa, scene = Kappa(), history.scene()
    count = len(history.schedule.times())
    steps = list(interleaved(system_of(scene), march(scene, history.schedule, control(form)), kappa, count))
    seconds = sum(a.seconds for a in steps)
    force = curve(scene, history.reduction, steps)
    force = force[force[:, 0] >= ONSET]
    error = np.abs(force[:, 1] / np.interp(force[:, 0], against[:, 0], against[:, 1]) - 1)
    name = form.name.value
    row = Row("history", name, history.mu, history.elements, kappa.median, seconds, seconds / kappa.median)
    passes = sum(a.passes for a in steps)
    return row, Error(name, history.mu, len(steps), passes, float(error.max()), float(np.sqrt(np.mean(error**2))))


def passes(form: Form, mu: float, elements: int, measured: int) -> tuple[list[Row], float]:
    """Mean pass once yield has spread, its split, and passes an increment; increments of 1 % of the height."""
    reduction = SPREAD + 0.01 * measured + 0.01
    scene, kappa, seen = upsetting(mu=mu, reduction=reduction, elements=elements), Kappa(), []
    schedule = Schedule(round(reduction / 0.01), first=SMALL / reduction, settling=4)
    with stopwatch(type(form)) as watch:
        running = watch.while_running(march(scene, schedule, control(form)))
        for step in interleaved(system_of(scene), running, kappa, measured):
            if reduction * step.start.tau < SPREAD:
                watch.reset()
                continue
            seen.append(step)
    count, name, unit = sum(a.passes for a in seen), form.name.value, kappa.median
    pace = {"pass": watch.passes / count, "increment": sum(a.seconds for a in seen) / len(seen)}
    rows = [Row(part, name, mu, elements, unit, s, s / unit) for part, s in pace.items()]
    rows += [
        Row(f"split {part.value}", name, mu, elements, unit, s / count, s / count / unit)
        for part, s in watch.seconds.items()
    ]
    return rows, count / len(seen)


def write(path: Path, kind: type, rows: Iterable[Any]) -> None:
    """A CSV of dataclasses."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f.name for f in fields(kind)])
        writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in astuple(row)] for row in rows)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(prog="benchmarks.speed", description=__doc__.splitlines()[0] if __doc__ else "")
    p.add_argument("--sizes", type=int, nargs="*", help="elements a side of the pass benchmark (default 10 40)")
    p.add_argument("--forms", nargs="+", choices=[f.value for f in FORMS], default=[f.value for f in FORMS])
    p.add_argument("--mu", type=float, default=0.1, help="Coulomb coefficient of the pass benchmark")
    p.add_argument("--out", type=Path, default=Path("results"))
    p.add_argument("--no-histories", action="store_true", help="leave out the whole histories")
    p.add_argument("--fast", action="store_true", help="a small mesh and a short path")
    return p


def main(argv: list[str] | None = None) -> int:
    """Run, print and write the benchmarks."""
    arguments = parser().parse_args(argv)
    arguments.out.mkdir(parents=True, exist_ok=True)
    sizes = arguments.sizes if arguments.sizes is not None else [3] if arguments.fast else [10, 40]
    rows: list[Row] = []
    errors: list[Error] = []

    def keep(new: list[Row]) -> None:
        rows.extend(new)
        write(arguments.out / "bench.csv", Row, rows)
        for row in new:
            print(f"{row.name:22} {row.form:8} mu {row.mu:<4g} {row.elements:>3} {1e3 * row.kappa_s:9.2f} ms", end=" ")
            print(f"{row.seconds:10.4f} s {row.ratio:9.2f} kappa", flush=True)

    for form in (FORMS[FormName(name)] for name in arguments.forms):
        for size in sizes:
            new, ratio = passes(form, arguments.mu, size, 2 if arguments.fast else MEASURED)
            keep(new)
            print(f"{'passes an increment':22} {form.name.value:8} {ratio:.2f}")
        for history in [] if arguments.no_histories else histories(arguments.fast):
            row, error = whole(history, form, reference(history, arguments.out, 20 if arguments.fast else REFERENCE))
            errors.append(error)
            keep([row])
            write(arguments.out / "bench_errors.csv", Error, errors)
            print(f"{'':22} {error.increments} increments, {error.passes} passes, ", end="")
            print(f"force off by {error.worst:.2%} at most, {error.rms:.2%} rms")
    return 0


if __name__ == "__main__":
    sys.exit(main())
