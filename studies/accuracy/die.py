r"""The force of a deformable die beside CalculiX's: the same meshes and elements.

    python -m studies.accuracy.die [--fast] [--resume | --overwrite] [--out DIR]

The seed's cylinder, with linear hardening, between two elastic dies, which the cylinder dents: contact of two bodies
whose nodes do not match, the die's top travels. What both programs share, the table and the exit code are those of
:mod:`studies.accuracy.foreign`. Contact of ours is posed in means between the sides, that of CalculiX at the nodes of
the cylinder.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot import (
    DeformableTool,
    Elastic,
    Elasticity,
    Element,
    Material,
    Mesh,
    Prescribed,
    Quadrature,
    Scene,
    Support,
    Symmetry,
    cylinder,
    together,
    upsetting,
)
from studies.accuracy.deck import PUNCH, Deck, edges_of, entries, numbered
from studies.accuracy.domed import MODULUS, SIZE, metal
from studies.accuracy.foreign import Plan, Study
from studies.command import command
from studies.outputs import parser_of

MARKS = (0.05, 0.1, 0.15, 0.2)
"""Travel of the die's top over half the cylinder's height: before nodes of the side land, at another travel in each
program."""

RADIUS, HEIGHT = 9.7, 5.0
"""Of the die (mm)."""

DIE = Elastic(Elasticity(30_000.0, 0.3))


@dataclass(frozen=True)
class DieDeck(Deck):
    """One calculation, as a :class:`~studies.accuracy.deck.Deck`."""

    def scene(self) -> Scene:
        """The study's, of which the cylinder's material is asked."""
        return replace(upsetting(mu=self.mu), material=metal())

    @property
    def tool(self) -> Material:
        """The die's."""
        return DIE

    def _punch(self, mesh: Mesh) -> Iterator[str]:
        yield from lines_of(die_of(self.elements), mesh, self.element, ("axis",))

    def _master(self, mesh: Mesh) -> Iterator[str]:
        die = die_of(self.elements)
        yield "*SURFACE, NAME=MASTER"
        yield from edges_of(die, die.boundaries["base"][:, [0, -1]], len(mesh.elements))


def lines_of(die: Mesh, body: Mesh, element: str, held: Sequence[str]) -> Iterator[str]:
    """Nodes and elements of a die, counted on from the body's; its top is the punch.

    The boundaries ``held`` are so along the first axis, the second, and so on.
    """
    first = len(body.nodes)
    yield "*NODE, NSET=DIE"
    yield from numbered(first + 1, die.nodes)
    yield f"*ELEMENT, TYPE={element}, ELSET=TOOL"
    for number, cell in enumerate(die.elements, len(body.elements) + 1):
        yield from entries(number, *(first + cell + 1))
    yield f"*NSET, NSET={PUNCH}"
    yield from (f"{first + node + 1}," for node in np.unique(die.boundaries["top"]))
    yield "*BOUNDARY"
    for axis, name in enumerate(held, 1):
        yield from (f"{first + node + 1}, {axis}, {axis}" for node in np.unique(die.boundaries[name]))


def die_of(elements: int) -> Mesh:
    """Of as many columns as leave no node but that on the axis before one of the cylinder."""
    count = 2 * elements - 1
    die = cylinder(RADIUS, HEIGHT, count, (count + 1) // 2, element=Element.Q8)
    return replace(die, nodes=die.nodes + np.array([0.0, SIZE]))


def scene_of(mu: float, elements: int, travel: float = MARKS[-1]) -> Scene:
    """The quarter of the cylinder, and the die whose top goes this part of its height."""
    mesh = together({"cylinder": cylinder(SIZE, SIZE, elements, elements, element=Element.Q8), "die": die_of(elements)})
    supports = (
        Support("cylinder/axis", 0),
        Symmetry("cylinder/base", 1),
        Support("die/axis", 0),
        Support("die/top", 0),
        Prescribed("die/top", 1, -travel * SIZE),
    )
    tools = (DeformableTool(("die/base",), ("cylinder/top", "cylinder/side"), mu),)
    scene = upsetting(mu=mu, elements=1, quadrature=Quadrature.GAUSS2)
    return replace(scene, mesh=mesh, material=metal(), regions={"die": DIE}, supports=supports, tools=tools)


STUDY = Study(
    name="die",
    scene_of=scene_of,
    deck=DieDeck,
    whole=Plan((0.0, 0.1, 0.3), (5, 10), MARKS),
    fast=Plan((0.3,), (3,), MARKS[:2]),
    given={"modulus": MODULUS, "radius": RADIUS, "height": HEIGHT, "die": repr(DIE)},
)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the study."""
    parser = parser_of(
        "accuracy.die", "A deformable die: the force beside CalculiX's.", fast="one coarse mesh, half way"
    )
    return STUDY.run(parser.parse_args(argv))


if __name__ == "__main__":
    sys.exit(main())
