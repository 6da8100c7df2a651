r"""The force on a domed punch beside CalculiX's: the same mesh, element and kind of contact.

    python -m studies.accuracy.domed [--fast] [--resume | --overwrite] [--out DIR]

The seed's cylinder, with linear hardening, between two punches whose faces are parts of a sphere of three times its
radius: normals turn along the contact, which grows from the pole until the whole top is in it, and slips outward. What
both programs share, the table and the exit code are those of :mod:`studies.accuracy.foreign`. The sphere is a polygon
in CalculiX.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot import Circle, Linear, Mesh, Quadrature, Scene, ShapedTool, VonMises, upsetting
from studies.accuracy.deck import HOLE, OUTSIDE, PUNCH, Deck, entries, numbered
from studies.accuracy.foreign import Plan, Study
from studies.command import command
from studies.outputs import parser_of

MARKS = (0.1, 0.2, 0.3, 0.4)
"""Travel of the pole over half the height."""

SIZE, RADIUS, MODULUS = 5.0, 15.0, 300.0
"""Radius and half height of the cylinder, radius of the sphere (mm), hardening (MPa)."""


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


def metal() -> VonMises:
    """The seed's, with linear hardening."""
    seed = upsetting(mu=0.0, elements=1).material
    return VonMises(seed.elasticity, Linear(float(seed.yield_stress(0.0)), MODULUS))


def scene_of(mu: float, elements: int, travel: float = MARKS[-1]) -> Scene:
    """The quarter of the cylinder, and the punch that goes this part of its height."""
    scene = upsetting(mu=mu, elements=elements, quadrature=Quadrature.GAUSS2)
    punch = ShapedTool(Circle((0.0, SIZE + RADIUS), RADIUS), (0.0, -travel * SIZE), ("top", "side"), mu)
    return replace(scene, material=metal(), tools=(punch,))


STUDY = Study(
    name="domed",
    scene_of=scene_of,
    deck=DomedDeck,
    whole=Plan((0.0, 0.1, 0.3), (5, 10), MARKS),
    fast=Plan((0.3,), (3,), MARKS[:2]),
    given={"modulus": MODULUS, "radius": RADIUS},
)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the study."""
    parser = parser_of(
        "accuracy.domed", "A domed punch: the force beside CalculiX's.", fast="one coarse mesh, half way"
    )
    return STUDY.run(parser.parse_args(argv))


if __name__ == "__main__":
    sys.exit(main())
