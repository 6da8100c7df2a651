r"""How little the force jumps where a side rolls onto the punch if the elements are where it lands.

    python -m studies.accuracy.rolling [--fast] [--resume | --overwrite] [--out DIR]

The seed's cylinder to 45 % at mu = 0.3 in ``q4p0``, with the elements of square meshes of 10 and 20 a side put
otherwise: fewer along the radius, graded towards the edge, and most of those along the side in the :data:`LANDING` that
comes to lie on the punch (:class:`~bipot.meshes.cells.Fine`). ``DIR/rolling.csv`` has a row a mesh: the largest jump as
in :mod:`studies.accuracy.scatter`, the force at 20 and 45 % over its limit (``limits.csv`` of
:mod:`studies.accuracy.mesh`, kept in ``docs/results``), and what the run costs.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np

from bipot.contact.closeness import carries
from bipot.fem.projection import VolumeChange
from bipot.forms import Dissipation, Newton, Tangent
from bipot.marching import Control, march, system_of
from bipot.meshes.cells import Fine
from bipot.meshes.elements import Element
from bipot.meshes.sections import cylinder
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.schedule import Schedule
from studies.accuracy.limits import Limit
from studies.accuracy.mesh import MARKS, REDUCTION, beside
from studies.accuracy.scatter import Largest
from studies.command import command, progressing, say
from studies.outputs import opened, parser_of
from studies.tables import read_rows
from studies.upsetting_march import FIRST

NAME = "rolling"
LIMITS = Path(__file__).parents[2] / "docs" / "results" / "limits.csv"
SIZE, LANDING = 5.0, 1.1
"""Radius and half height (mm); the part of the side that is on the punch at 45 % and mu = 0.3, and a little more."""

EDGE = 1 / 32
"""Radial size at the edge over that at the axis: next to it elements are no more than a few times as wide as high."""

COMPARED = (MARKS[1], MARKS[-1])
"""Reductions at which the force is set beside its limit."""

Key = tuple[float, int, int]


@dataclass(frozen=True)
class Mesh:
    """Elements along the radius and along the side, of these ``fine`` in the LANDING."""

    radial: int
    axial: int
    fine: int

    def scene(self, mu: float) -> Scene:
        """The cylinder."""
        grading = EDGE, Fine(LANDING, self.fine)
        scene = upsetting(mu=mu, reduction=REDUCTION, element=Element.Q4, volume=VolumeChange.P0)
        return replace(scene, mesh=cylinder(SIZE, SIZE, self.radial, self.axial, grading))


@dataclass(frozen=True)
class Plan:
    """Coefficients, meshes and equal increments after the start-up."""

    mus: tuple[float, ...] = (0.3,)
    meshes: tuple[Mesh, ...] = (Mesh(5, 20, 17), Mesh(10, 40, 34))
    increments: int = 90

    def runs(self) -> list[tuple[Mesh, float]]:
        """The short ones first."""
        return [(mesh, mu) for mesh in self.meshes for mu in self.mus]


FAST = Plan(meshes=(Mesh(3, 12, 9),), increments=18)


@dataclass(frozen=True)
class Row:
    """Row of rolling.csv; forces over their limits less one."""

    mu: float
    radial: int
    axial: int
    fine: int
    first_landing: float
    landings: int
    scatter: float
    reduction: float
    off_20: float
    off_45: float
    increments: int
    passes: int
    cuts: int
    fallbacks: int
    seconds: float


def key(row: Row) -> Key:
    """What tells one row from another."""
    return row.mu, row.radial, row.axial


def run(mesh: Mesh, mu: float, increments: int, limits: Sequence[float]) -> Row:
    """March to the end; ``limits`` of the force (N) at those COMPARED."""
    scene = mesh.scene(mu)
    schedule = Schedule(increments, FIRST / REDUCTION, landings=tuple(mark / REDUCTION for mark in MARKS[:-1]))
    side = beside(system_of(scene))
    steps = list(march(scene, schedule, Control(Newton(), (Tangent(), Dissipation()))))
    at = np.array([round(step.state.tau * REDUCTION, 9) for step in steps])
    force = np.array([-step.tool_force(0)[1] for step in steps])
    landed = np.array([float(carries(step.solved.r)[side].sum()) for step in steps])
    largest = Largest.of({"at": at, "force_N": force, "landed": landed})
    assert largest is not None, "friction folds the side onto the punch"
    off = [float(force[at == mark][0] / limit - 1) for mark, limit in zip(COMPARED, limits, strict=True)]
    return Row(
        mu,
        mesh.radial,
        mesh.axial,
        mesh.fine,
        *astuple(largest),
        *off,
        increments=len(steps),
        passes=sum(step.passes for step in steps),
        cuts=sum(step.cuts for step in steps),
        fallbacks=sum(step.form is not Newton.name for step in steps),
        seconds=sum(step.seconds for step in steps),
    )


def forces(mu: float) -> Iterator[float]:
    """The limits (N) at those COMPARED."""
    kept = {(one.mu, one.reduction): one.value for one in read_rows(LIMITS, Limit) if one.quantity == "force_N"}
    return (kept[mu, mark] for mark in COMPARED)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run mesh by mesh, rewriting the table after each row."""
    parser = parser_of(
        f"accuracy.{NAME}", "Jumps of the force on meshes fine where it lands.", fast="one small mesh, few increments"
    )
    asked = parser.parse_args(argv)
    plan = FAST if asked.fast else Plan()
    runs = plan.runs()
    fixed = {"increments": plan.increments, "landing": LANDING, "edge": EDGE}
    order = [(mu, mesh.radial, mesh.axial) for mesh, mu in runs]
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=order)
    with progressing(f"accuracy.{NAME}") as progress:
        for done, (mesh, mu) in enumerate(runs, 1):
            if (mu, mesh.radial, mesh.axial) not in table:
                table.add(run(mesh, mu, plan.increments, tuple(forces(mu))))
            progress.advance(done / len(runs), f"mu = {mu:g}, {mesh.radial} x {mesh.axial}")
    say(table.words())
    return 0


if __name__ == "__main__":
    sys.exit(main())
