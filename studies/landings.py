r"""What locating the landings of side nodes on the punch does to the force, and to its scatter at 45 %.

    python -m studies.landings [--fast] [--elements 10] [--resume | --overwrite] [--out DIR]

The seed paper's cylinder at mu = 0.3 to 46 %, over the number of increments, both integrations of plastic flow,
landings inside increments or located (:mod:`bipot.control.landing`). ``DIR/landings.csv`` has a row a run,
``DIR/landings.h5`` the same and every force-stroke curve. The curve's error is the relative L2 norm over the stroke
against the run of most increments, BDF2, located, and nan until that is there. A landing is an open candidate that
closes from more than a thousandth of the travel.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot.contact.closeness import newly_closed
from bipot.control.accepted import Accepted
from bipot.control.landing import Locate
from bipot.forms import Dissipation, Newton, Tangent
from bipot.laws.flow import Integration
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.system import System
from bipot.typing import Floats
from studies.command import command, progressing, say
from studies.options import count
from studies.outputs import opened, parser_of
from studies.tables import text
from studies.upsetting_march import FIRST

NAME = "landings"
COMMAND = "python -m studies.landings --out {out}"
SAME, MARGIN = 1 + 1e-12, 1e-3
MU, STROKE, STOPS = 0.3, 0.46, (0.20, 0.44, 0.45)
"""The stroke goes on past 45 %, to see the landing that is due there."""
FORCES = ("force_20_N", "force_44_N", "force_45_N")
Key = tuple[str, int, int]
SHOWN = ("integration", "located", "increments", *FORCES, "curve_error", "curve_error_44", "landings", "second_landing")


@dataclass(frozen=True)
class Plan:
    """Numbers of uniform increments, that of the reference, and elements a side."""

    increments: tuple[int, ...] = (22, 32, 45, 64, 90, 128, 180, 256, 360, 512, 720)
    reference: int = 1440
    elements: int = 10


FAST = Plan(increments=(12,), reference=16, elements=8)


@dataclass(frozen=True)
class Row:
    """One run: forces (N), error of its curve to 45 and to 44 %, landings before 45 %, reductions of the first two."""

    integration: str
    located: int
    increments: int
    accepted: int
    passes: int
    force_20_N: float
    force_44_N: float
    force_45_N: float
    curve_error: float
    curve_error_44: float
    landings: int
    first_landing: float
    second_landing: float
    fallbacks: int


@dataclass(frozen=True)
class Course:
    """A run: reduction and force (n,), the reductions of its landings, increments and passes it took, fallbacks."""

    integration: Integration
    located: bool
    increments: int
    reduction: Floats
    force: Floats
    landings: tuple[float, ...]
    passes: int
    fallbacks: int

    def at(self, reduction: float) -> float:
        """Force where an increment ends."""
        return float(self.force[np.argmin(np.abs(self.reduction - reduction))])

    def error(self, reference: Course, upto: float) -> float:
        """Relative L2 distance up to a reduction, at the ends of its own increments."""
        kept = self.reduction <= upto * SAME
        where, force = self.reduction[kept], self.force[kept]
        exact = np.interp(where, reference.reduction, reference.force)
        return float(np.sqrt(np.trapezoid((force - exact) ** 2, where) / np.trapezoid(exact**2, where)))

    @staticmethod
    def kept(row: Row, curve: dict[str, Floats]) -> Course:
        """A run again, from its line of the table and its curve."""
        landings = tuple(curve["landings"].tolist())
        what = Integration(row.integration), bool(row.located), row.increments
        return Course(*what, curve["reduction"], curve["force_N"], landings, row.passes, row.fallbacks)

    def curve(self) -> dict[str, dict[str, Floats]]:
        """What is kept of it beside its line."""
        arrays = {"reduction": self.reduction, "force_N": self.force, "landings": np.array(self.landings)}
        return {curve_name(self.row(None)): arrays}

    def row(self, reference: Course | None) -> Row:
        """Its line of the table; without a reference errors are nan."""
        first, second = (*self.landings, float("nan"), float("nan"))[:2]
        early, late, end = STOPS
        return Row(
            self.integration.value,
            int(self.located),
            self.increments,
            len(self.force),
            self.passes,
            self.at(early),
            self.at(late),
            self.at(end),
            float("nan") if reference is None else self.error(reference, end),
            float("nan") if reference is None else self.error(reference, late),
            sum(landing <= end * SAME for landing in self.landings),
            first,
            second,
            self.fallbacks,
        )


def key(row: Row) -> Key:
    """What tells one run from another."""
    return row.integration, row.located, row.increments


def curve_name(row: Row) -> str:
    """Of a run's curve in the results."""
    return f"{row.integration} {'located' if row.located else 'inside'} {row.increments}"


def course(integration: Integration, located: bool, increments: int, elements: int) -> Course:
    """March, with increments that end at 20, 44 and 45 %."""
    scene = upsetting(mu=MU, reduction=STROKE, elements=elements)
    schedule = Schedule(increments, FIRST / STROKE, landings=tuple(stop / STROKE for stop in STOPS))
    how = Locate(margin=MARGIN)
    control = Control(Newton(), (Tangent(), Dissipation()), integration=integration, locate=how if located else None)
    system, accepted = system_of(scene), list(march(scene, schedule, control))
    none = how.tolerance * abs(scene.tools[0].travel[1]) / increments
    return Course(
        integration,
        located,
        increments,
        np.array([STROKE * a.state.tau for a in accepted]),
        np.array([-a.tool_forces[0, 1] for a in accepted]),
        tuple(STROKE * a.state.tau for a in accepted for _ in range(_landings(system, a, none))),
        sum(a.passes for a in accepted),
        sum(a.form is not Newton.name for a in accepted),
    )


def _landings(system: System, a: Accepted, none: float) -> int:
    """How many candidates land in an increment, or at its end if it is cut there."""
    gap = a.start.gap
    return len(newly_closed(gap, a.solved.r, none)) + (a.landed is not None)


def planned(plan: Plan) -> list[Key]:
    """All runs, the reference last."""
    runs = [(i.value, located, n) for i in Integration for located in (0, 1) for n in plan.increments]
    return [*runs, (Integration.BDF2.value, 1, plan.reference)]


def courses(runs: Sequence[Key], elements: int) -> Iterator[Course]:
    """These runs, with progress."""
    with progressing(NAME) as progress:
        for done, (integration, located, increments) in enumerate(runs):
            yield course(Integration(integration), bool(located), increments, elements)
            progress.advance((done + 1) / len(runs), f"{integration}, {increments} increments")


def scatter(rows: list[Row], least: int) -> str:
    """Range of the force at each reduction over runs of at least ``least`` increments, relative to its mean."""
    lines = [f"range of the force over runs of {least} increments or more, relative to its mean"]
    for key in dict.fromkeys((row.integration, row.located) for row in rows):
        group = [row for row in rows if (row.integration, row.located) == key and row.increments >= least]
        spread = []
        for name in FORCES:
            force = np.array([getattr(row, name) for row in group])
            spread.append(f"{name} {np.ptp(force) / force.mean():.2e}")
        lines.append(f"{key[0]:>14} {'located' if key[1] else 'inside':>8}  " + "  ".join(spread))
    return "\n".join(lines)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print."""
    parser = parser_of(NAME, "Landings inside increments or located.", fast="a small mesh and few increments")
    parser.add_argument("--elements", type=count(1), help="elements a side")
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    plan = plan if asked.elements is None else replace(plan, elements=asked.elements)
    runs, fixed = planned(plan), {"elements": plan.elements, "reference": plan.reference}
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=runs, curve=curve_name)
    for found in courses([run for run in runs if run not in table], plan.elements):
        table.add(found.row(None), curves=found.curve())
    every = [Course.kept(row, table.curves[curve_name(row)]) for row in table.rows]
    reference = next(c for c in every if key(c.row(None)) == runs[-1])
    table.add(*(c.row(reference) for c in every))
    say(text(table.rows, SHOWN))
    say(scatter([row for row in table.rows if key(row) != runs[-1]], plan.increments[len(plan.increments) // 3]))
    say(f"results in {asked.out.resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
