r"""The force on a domed punch beside CalculiX's: the same mesh, element and kind of contact.

    python -m studies.accuracy.domed [--fast] [--resume | --overwrite] [--out DIR]

The seed's cylinder, with linear hardening, between two punches whose faces are parts of a sphere of three times its
radius: normals turn along the contact, which grows from the pole until the whole top is in it, and slips outward. Both
programs have the quarter of the meridian plane in equal elements Q8 with 2 x 2 points (CAX8R) and contact at nodes, so
that their meshes' errors are the same. What differs are increments, flow of order two or one, exact or penalised
contact, and the sphere, which in CalculiX is a polygon.

``DIR/domed.csv`` has a row a force: its relative ``difference`` is ours over CalculiX's, less one. The command ends
with exit code 1 where one exceeds :data:`MOST`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot import (
    Circle,
    Control,
    Dissipation,
    Linear,
    Mesh,
    Newton,
    Quadrature,
    Scene,
    Schedule,
    ShapedTool,
    Tangent,
    VonMises,
    march,
    upsetting,
)
from studies.accuracy.calculix import ABSENT, calculated, executable
from studies.accuracy.deck import HOLE, NODES, OUTSIDE, PUNCH, Deck, entries, numbered
from studies.command import command, progressing, say
from studies.outputs import opened, parser_of

NAME = "domed"
MARKS = (0.1, 0.2, 0.3, 0.4)
"""Travel of the pole over half the height."""

SIZE, RADIUS, MODULUS = 5.0, 15.0, 300.0
"""Radius and half height of the cylinder, radius of the sphere (mm), hardening (MPa)."""

ACCURACY, LONGEST, PENALTY = 1e-3, 0.005, (10.0, 0.1)
"""Of our increments; longest increment of CalculiX over half the height; its stiffnesses, as in the deck."""

MOST = 0.005
"""Largest difference, relative."""


@dataclass(frozen=True)
class DomedDeck(Deck):
    """One calculation, as a :class:`~studies.accuracy.deck.Deck`."""

    @property
    def facets(self) -> int:
        """Chords of a fortieth of the sphere's radius: they miss it by a thousandth of the least travel."""
        return 60

    def scene(self) -> Scene:
        """The study's."""
        return scene_of(self.mu, 1)

    def _punch(self, mesh: Mesh) -> Iterator[str]:
        first, count = len(mesh.nodes) + 1, self.facets + 1
        inner, outer = np.arcsin(SIZE / RADIUS * np.array([HOLE, 0.9 * OUTSIDE]))
        angle = np.linspace(inner, outer, count)
        face = np.column_stack([RADIUS * np.sin(angle), SIZE + RADIUS * (1 - np.cos(angle))])
        yield f"*NODE, NSET={PUNCH}"
        yield from numbered(first, np.vstack([face, face + np.array([0.0, 0.2 * SIZE])]))
        yield "*ELEMENT, TYPE=CAX4, ELSET=TOOL"
        for k in range(self.facets):
            corners = first + k, first + k + 1, first + count + k + 1, first + count + k
            yield from entries(len(mesh.elements) + 1 + k, *corners)


@dataclass(frozen=True)
class Plan:
    """Coefficients, equal elements a side, and travels at which the force is read."""

    mus: tuple[float, ...] = (0.0, 0.1, 0.3)
    sides: tuple[int, ...] = (5, 10)
    marks: tuple[float, ...] = MARKS


FAST = Plan(mus=(0.3,), sides=(3,), marks=MARKS[:2])


@dataclass(frozen=True)
class Row:
    """Row of domed.csv; increments are those of the whole march."""

    mu: float
    elements: int
    travel: float
    own_force_N: float
    foreign_force_N: float
    difference: float
    own_increments: int
    foreign_increments: int


def scene_of(mu: float, elements: int, travel: float = MARKS[-1]) -> Scene:
    """The quarter of the cylinder, and the punch that goes this part of its height."""
    scene = upsetting(mu=mu, elements=elements, quadrature=Quadrature.GAUSS2)
    material = VonMises(scene.material.elasticity, Linear(float(scene.material.yield_stress(0.0)), MODULUS))
    punch = ShapedTool(Circle((0.0, SIZE + RADIUS), RADIUS), (0.0, -travel * SIZE), ("top", "side"), mu)
    return replace(scene, material=material, tools=(punch,))


def own(mu: float, elements: int, marks: Sequence[float]) -> tuple[list[float], int]:
    """Forces (N) at the marks, and how many increments they took."""
    landings = tuple(mark / marks[-1] for mark in marks[:-1])
    control = Control(Newton(), (Tangent(), Dissipation()))
    steps = list(march(scene_of(mu, elements, marks[-1]), Schedule(accuracy=ACCURACY, landings=landings), control))
    forces = [-step.tool_force(0)[1] for step in steps if step.state.tau in (*landings, 1.0)]
    return forces, len(steps)


def rows(mu: float, elements: int, marks: Sequence[float], ccx: str) -> Iterator[Row]:
    """Of one mesh; where CalculiX stops, to the mark before."""
    forces, count = own(mu, elements, marks)
    other = calculated(DomedDeck(mu, "CAX8R", NODES, elements, LONGEST, *PENALTY), marks, ccx)
    for mark, force, foreign in zip(marks, forces, other.forces, strict=False):
        yield Row(mu, elements, mark, force, foreign, force / foreign - 1, count, other.increments)


def key(row: Row) -> tuple[float, int, float]:
    """What tells one row from another."""
    return row.mu, row.elements, row.travel


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run mesh by mesh, rewriting the table after each; 1 where the programs differ."""
    parser = parser_of(
        f"accuracy.{NAME}", "A domed punch: the force beside CalculiX's.", fast="one coarse mesh, half way"
    )
    asked = parser.parse_args(argv)
    plan, ccx = FAST if asked.fast else Plan(), executable()
    if ccx is None:
        say(ABSENT, sys.stderr)
        return 0
    runs = [(mu, side) for side in plan.sides for mu in plan.mus]
    fixed = {"accuracy": ACCURACY, "longest": LONGEST, "penalty": list(PENALTY), "modulus": MODULUS, "radius": RADIUS}
    order = [(mu, side, mark) for mu, side in runs for mark in plan.marks]
    table = opened(asked.out, NAME, Row, key, asked.policy, parameters=fixed, order=order)
    with progressing(f"accuracy.{NAME}") as progress:
        for done, (mu, side) in enumerate(runs, 1):
            if (mu, side, plan.marks[0]) not in table:
                for row in rows(mu, side, plan.marks, ccx):
                    table.add(row)
            progress.advance(done / len(runs), f"mu = {mu:g}, {side} a side")
    say(table.words())
    return int(max(abs(row.difference) for row in table.rows) > MOST)


if __name__ == "__main__":
    sys.exit(main())
