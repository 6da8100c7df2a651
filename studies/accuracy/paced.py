r"""What increments by accuracy err and cost, beside the cheapest equal ones that err no more, in small scenes.

    python -m studies.accuracy.paced [--fast] [--resume | --overwrite] [--out DIR]

``DIR/paced.csv`` has a row a scene (:mod:`studies.accuracy.paced_scenes`) and accuracy. With F_k the force of the tool
at the end of increment k, and F*_k that of a march with each of these increments in :data:`FINER` parts,

    true_error = max_k |F_k - F*_k| / max |F*|,

increments left out in which a node touches for the first time in either, and those between. The columns ``uniform_...``
are of the march of fewest passes among those in :data:`FEWEST` equal increments and more whose true error is no larger
than that, nan where none is found. ``ratio`` is passes over ``uniform_passes``. How many passes equal increments take
goes up and down with their number: ``near_passes`` is the mean of those of up to :data:`NEAR` increments more or fewer.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise

import numpy as np

from bipot.contact.closeness import carries
from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, Schedule, march
from bipot.scene.scene import Scene
from bipot.typing import Floats
from studies.accuracy.paced_scenes import SCENES
from studies.command import command, progressing, say
from studies.outputs import opened, parser_of

NAME = "paced"
CONTROL = Control(Newton(), (Tangent(), Dissipation()))
FEWEST, FINER = 4, 8
"""Equal increments at least, of fewer hardly one is without a landing; parts of an increment in the finer march."""

NEAR = 2

Key = tuple[str, float]


@dataclass(frozen=True)
class Plan:
    """Scenes by name, accuracies, and how many equal increments are tried at ``most``."""

    scenes: tuple[str, ...] = tuple(SCENES)
    accuracies: tuple[float, ...] = (1e-3, 3e-4, 1e-4)
    most: int = 60

    def keys(self) -> Iterator[Key]:
        """Of all rows."""
        return ((scene, accuracy) for scene in self.scenes for accuracy in self.accuracies)


FAST = Plan(scenes=("block",), accuracies=(1e-3, 3e-4), most=8)


@dataclass(frozen=True)
class Row:
    """Row of paced.csv; errors are fractions of the force."""

    scene: str
    accuracy: float
    true_error: float
    increments: int
    passes: int
    uniform_error: float
    uniform_increments: float
    uniform_passes: float
    ratio: float
    near_passes: float


def key(row: Row) -> Key:
    """What tells one row from another."""
    return row.scene, row.accuracy


@dataclass(frozen=True)
class Course:
    """A march: pseudo-times (k,) at the ends of its increments, forces (k,) of the tool along 1, passes in all.

    ``touched`` (c,) are the pseudo-times at the end of the increment in which each candidate first bears a force.
    """

    scene: Scene
    taus: Floats
    forces: Floats
    passes: int
    touched: Floats

    @cached_property
    def error(self) -> float:
        """The true one (module docstring)."""
        ends = self.taus.tolist()
        spans = list(pairwise([0.0, *ends]))
        parts = [tau for a, b in spans for tau in np.linspace(a, b, FINER + 1)[1:].tolist()]
        fine = run(self.scene, Schedule(1, landings=tuple(parts[:-1])))
        # A node that lands in the one march earlier than in the other bears the force of the jump for so long.
        touched = np.sort([self.touched, fine.touched], axis=0)
        early, late = touched[:, touched[0] > fine.taus[0]]
        apart = [not ((early <= b) & (late > a)).any() for a, b in spans]
        force = dict(zip(fine.taus.tolist(), fine.forces.tolist(), strict=True))
        missed = np.abs(self.forces - [force[tau] for tau in ends])
        return float(missed[apart].max()) / float(np.abs(fine.forces).max())


def run(scene: Scene, schedule: Schedule) -> Course:
    """March to the end."""
    steps = list(march(scene, schedule, CONTROL))
    ends, forces = np.array([(step.state.tau, step.tool_forces[0, 1]) for step in steps]).T
    bears = np.array([carries(step.solved.r) for step in steps])
    touched = np.where(bears.any(axis=0), ends[bears.argmax(axis=0)], math.inf)
    return Course(scene, ends, forces, sum(step.passes for step in steps), touched)


def cheapest(uniform: Callable[[int], Course], error: float, most: int) -> Course | None:
    """The march of fewest passes among those in :data:`FEWEST` to ``most`` equal increments that err no more."""
    best: Course | None = None
    for increments in range(FEWEST, most + 1):
        # An increment takes a pass at least.
        if best and increments >= best.passes:
            break
        tried = uniform(increments)
        if (best is None or tried.passes < best.passes) and tried.error <= error:
            best = tried
    return best


def rows(name: str, accuracies: Sequence[float], most: int) -> Iterator[Row]:
    """Of a scene."""
    scene = SCENES[name]()

    @cache
    def uniform(increments: int) -> Course:
        return run(scene, Schedule(increments))

    for accuracy in accuracies:
        own = run(scene, Schedule(accuracy=accuracy))
        best = cheapest(uniform, own.error, most)
        error, passes, near, count = (math.nan,) * 4
        if best:
            error, passes, count = best.error, float(best.passes), len(best.taus)
            beside = range(max(count - NEAR, FEWEST), min(count + NEAR, most) + 1)
            near = float(np.mean([uniform(increments).passes for increments in beside]))
        ratio = own.passes / passes
        yield Row(name, accuracy, own.error, len(own.taus), own.passes, error, float(count), passes, ratio, near)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run scene by scene, rewriting the table after each row."""
    parser = parser_of(
        f"accuracy.{NAME}", "Increments by accuracy beside equal ones.", fast="one scene, few equal increments"
    )
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    fixed = {"finer": FINER, "fewest": FEWEST, "most": plan.most}
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=plan.keys())
    with progressing(f"accuracy.{NAME}") as progress:
        for done, name in enumerate(plan.scenes, 1):
            missing = [accuracy for accuracy in plan.accuracies if (name, accuracy) not in table]
            for row in rows(name, missing, plan.most):
                table.add(row)
            progress.advance(done / len(plan.scenes), name)
    say(table.words())
    return 0


if __name__ == "__main__":
    sys.exit(main())
