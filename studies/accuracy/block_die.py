r"""The force of a deformable die in space beside CalculiX's: the same meshes and elements.

    python -m studies.accuracy.block_die [--fast] [--resume | --overwrite] [--out DIR]

A cube, of the metal of :mod:`studies.accuracy.domed`, between two elastic dies, which it dents: an eighth, H20 with
2 x 2 x 2 points (C3D20R), whose faces do not match. The directions of slip differ over the face. What both programs
share, the table and the exit code are those of :mod:`studies.accuracy.foreign`. Contact of ours is posed in means
between the sides, that of CalculiX at points within the cube's faces: with that at nodes it stops.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot import (
    DeformableTool,
    Element,
    Geometry,
    Material,
    Mesh,
    Prescribed,
    Scene,
    Support,
    Symmetry,
    VolumeChange,
    brick,
    together,
)
from studies.accuracy.block_deck import BlockDeck, faces_of
from studies.accuracy.deck import FACES
from studies.accuracy.die import DIE, MARKS, lines_of
from studies.accuracy.domed import MODULUS, SIZE, metal
from studies.accuracy.foreign import Plan, Study
from studies.block import CANDIDATES
from studies.command import command
from studies.outputs import parser_of

WIDTH, HEIGHT = 8.0, 4.0
"""Of the die: half its width, and its height (mm)."""


@dataclass(frozen=True)
class BlockDieDeck(BlockDeck):
    """One calculation, as a :class:`~studies.accuracy.deck.Deck`."""

    def scene(self) -> Scene:
        """The cube, of which mesh and material are asked."""
        return replace(super().scene(), material=metal())

    @property
    def tool(self) -> Material:
        """The die's."""
        return DIE

    def _punch(self, mesh: Mesh) -> Iterator[str]:
        yield from lines_of(die_of(self.elements), mesh, self.element, ("left", "front"))

    def _master(self, mesh: Mesh) -> Iterator[str]:
        die = die_of(self.elements)
        yield "*SURFACE, NAME=MASTER"
        yield from faces_of(die, die.boundaries["base"], len(mesh.elements))


def die_of(elements: int) -> Mesh:
    """Of so many columns that none of its nodes off the planes of symmetry is before one of the cube."""
    count = 2 * elements - 1
    die = brick(WIDTH, WIDTH, HEIGHT, count, count, elements, element=Element.H20)
    return replace(die, nodes=die.nodes + np.array([0.0, 0.0, SIZE]))


def scene_of(mu: float, elements: int, travel: float = MARKS[-1]) -> Scene:
    """The eighth of the cube, and the die whose top goes this part of its height."""
    cube = brick(SIZE, SIZE, SIZE, elements, elements, elements, element=Element.H20)
    supports = (
        *(Symmetry(f"cube/{name}", axis) for axis, name in enumerate(("left", "front", "base"))),
        *(Symmetry(f"die/{name}", axis) for axis, name in enumerate(("left", "front"))),
        *(Support("die/top", axis) for axis in range(2)),
        Prescribed("die/top", 2, -travel * SIZE),
    )
    tool = DeformableTool(("die/base",), tuple(f"cube/{name}" for name in CANDIDATES), mu)
    return Scene(
        mesh=together({"cube": cube, "die": die_of(elements)}),
        geometry=Geometry.SOLID,
        material=metal(),
        supports=supports,
        tools=(tool,),
        regions={"die": DIE},
        volume=VolumeChange.AS_IS,
    )


STUDY = Study(
    name="block_die",
    scene_of=scene_of,
    deck=BlockDieDeck,
    whole=Plan((0.0, 0.1, 0.3), (2, 3), MARKS),
    fast=Plan((0.3,), (2,), MARKS[:1]),
    given={"modulus": MODULUS, "width": WIDTH, "height": HEIGHT, "die": repr(DIE)},
    element="C3D20R",
    contact=FACES,
)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the study."""
    parser = parser_of(
        "accuracy.block_die", "A deformable die in space: the force beside CalculiX's.", fast="coarse mesh, one mark"
    )
    return STUDY.run(parser.parse_args(argv))


if __name__ == "__main__":
    sys.exit(main())
