"""The force on a punch by both programs, mesh by mesh: what the studies beside CalculiX on one deck each share.

Both programs have the same part of the body in equal elements, so that their meshes' errors are the same: if not said
otherwise the quarter of a meridian plane, Q8 with 2 x 2 points (CAX8R), with contact at nodes of the body. What differs
are increments, flow of order two or one, and exact or penalised contact; at deformable dies also how contact is posed.

``DIR/NAME.csv`` has a row a force: its relative ``difference`` is ours over CalculiX's, less one. The command ends with
exit code 1 where one exceeds :data:`MOST`. Seconds are processor time: ours from the making of the scene on, those of
CalculiX of its whole process.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from bipot import Accepted, Control, Dissipation, IncrementFailed, Newton, Scene, Schedule, Tangent, march
from studies.accuracy.calculix import ABSENT, calculated, executable
from studies.accuracy.deck import NODES, Deck
from studies.command import progressing, say
from studies.outputs import opened

ACCURACY, LONGEST, PENALTY = 1e-3, 0.005, (10.0, 0.1)
"""Of our increments; longest increment of CalculiX over half the height; its stiffnesses, as in the deck."""

MOST = 0.005
"""Largest difference, relative."""


@dataclass(frozen=True)
class Plan:
    """Coefficients, equal elements a side, and travels over half the height at which the force is read."""

    mus: tuple[float, ...]
    sides: tuple[int, ...]
    marks: tuple[float, ...]

    @property
    def runs(self) -> list[tuple[float, int]]:
        """Coefficient and elements a side, mesh by mesh."""
        return [(mu, side) for side in self.sides for mu in self.mus]

    @property
    def keys(self) -> list[tuple[float, int, float]]:
        """Of all rows."""
        return [(mu, side, mark) for mu, side in self.runs for mark in self.marks]


@dataclass(frozen=True)
class Row:
    """Row of a table; increments and seconds are those of the whole march."""

    mu: float
    elements: int
    travel: float
    own_force_N: float
    foreign_force_N: float
    difference: float
    own_increments: int
    foreign_increments: int
    own_s: float
    foreign_s: float


def key(row: Row) -> tuple[float, int, float]:
    """What tells one row from another."""
    return row.mu, row.elements, row.travel


@dataclass(frozen=True)
class Study:
    """One comparison: ``scene_of(mu, elements, travel)`` is ours, ``deck`` CalculiX's of the same.

    ``given`` is what its rows do not tell and yet depend on. ``element`` and ``contact`` are those of the deck.
    """

    name: str
    scene_of: Callable[[float, int, float], Scene]
    deck: type[Deck]
    whole: Plan
    fast: Plan
    given: Mapping[str, float | str]
    element: str = "CAX8R"
    contact: str = NODES

    def own(self, mu: float, elements: int, marks: Sequence[float]) -> tuple[list[float], int, float]:
        """Forces (N) at the marks, to the last before an element folds, how many increments they took, and seconds."""
        begun = time.process_time()
        landings = tuple(mark / marks[-1] for mark in marks[:-1])
        control, schedule = (
            Control(Newton(), (Tangent(), Dissipation())),
            Schedule(accuracy=ACCURACY, landings=landings),
        )
        steps = list[Accepted]()
        try:
            steps.extend(march(self.scene_of(mu, elements, marks[-1]), schedule, control))
        except IncrementFailed as failed:
            say(f"mu = {mu:g}, {elements} a side: {failed}", sys.stderr)
        forces = [-float(step.tool_force(0)[-1]) for step in steps if step.state.tau in (*landings, 1.0)]
        return forces, len(steps), time.process_time() - begun

    def rows(self, mu: float, elements: int, marks: Sequence[float], ccx: str) -> Iterator[Row]:
        """Of one mesh, to the last mark that both programs reach."""
        forces, count, seconds = self.own(mu, elements, marks)
        other = calculated(self.deck(mu, self.element, self.contact, elements, LONGEST, *PENALTY), marks, ccx)
        for mark, force, foreign in zip(marks, forces, other.forces, strict=False):
            spent = count, other.increments, seconds, other.seconds
            yield Row(mu, elements, mark, force, foreign, force / foreign - 1, *spent)

    def run(self, asked: argparse.Namespace) -> int:
        """Go mesh by mesh, rewriting the table after each; 1 where the programs differ."""
        plan, ccx = self.fast if asked.fast else self.whole, executable()
        if ccx is None:
            say(ABSENT, sys.stderr)
            return 0
        fixed = {"accuracy": ACCURACY, "longest": LONGEST, "penalty": list(PENALTY), **self.given}
        table = opened(asked.out, self.name, Row, key, asked.policy, parameters=fixed, order=plan.keys)
        with progressing(f"accuracy.{self.name}") as progress:
            for done, (mu, side) in enumerate(plan.runs, 1):
                if (mu, side, plan.marks[0]) not in table:
                    for row in self.rows(mu, side, plan.marks, ccx):
                        table.add(row)
                progress.advance(done / len(plan.runs), f"mu = {mu:g}, {side} a side")
        say(table.words())
        return int(max((abs(row.difference) for row in table.rows), default=math.inf) > MOST)
