r"""The force that upsets a body of two metals beside CalculiX's: the same mesh, element and kind of contact.

    python -m studies.accuracy.clad [--fast] [--resume | --overwrite] [--out DIR]

A steel cylinder with a copper core, each with its own elasticity and linear hardening, between flat punches. The
interface lies along element edges of every mesh. What both programs share, the table and the exit code are those of
:mod:`studies.accuracy.foreign`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bipot import Elasticity, FlatTool, Linear, Mesh, Quadrature, Scene, VonMises, upsetting
from studies.accuracy.deck import Deck
from studies.accuracy.foreign import Plan, Study
from studies.command import command
from studies.outputs import parser_of

MARKS = (0.1, 0.2, 0.3, 0.4)
"""Travel of the punch over half the height."""

SIZE, CORE = 5.0, 3.0
"""Radius and half height of the cylinder, radius of the core (mm): three of five elements."""

STEEL = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 1000.0))
COPPER = VonMises(Elasticity(120_000.0, 0.34), Linear(80.0, 400.0))


@dataclass(frozen=True)
class CladDeck(Deck):
    """One calculation, as a :class:`~studies.accuracy.deck.Deck`."""

    def scene(self) -> Scene:
        """The study's."""
        return scene_of(self.mu, self.elements)

    def mesh(self) -> Mesh:
        """With the core as a region."""
        return self.scene().mesh


def scene_of(mu: float, elements: int, travel: float = MARKS[-1]) -> Scene:
    """The quarter of the cylinder, and the punch that goes this part of its height."""
    scene = upsetting(mu=mu, elements=elements, quadrature=Quadrature.GAUSS2)
    middle = scene.mesh.nodes[scene.mesh.elements, 0].mean(axis=1)
    return replace(
        scene,
        mesh=replace(scene.mesh, regions={"core": middle < CORE}),
        material=STEEL,
        regions={"core": COPPER},
        tools=(FlatTool((0.0, SIZE), (0.0, -1.0), (0.0, -travel * SIZE), ("top", "side"), mu),),
    )


def known(travel: float) -> float:
    """The force (N) without friction: both metals stay cylinders, of one height, and share no stress across.

    With eps = -ln(1 - travel) in each, sigma = (Y + H eps) / (1 + H/E), and A = A_0 exp(eps - (1 - 2 nu) sigma/E).
    """
    strain, share, force = -math.log(1 - travel), (CORE / SIZE) ** 2, 0.0
    for metal, part in ((COPPER, share), (STEEL, 1 - share)):
        young, slope = metal.elasticity.young, float(metal.slope(np.zeros(1))[0])
        stress = (float(metal.yield_stress(np.zeros(1))[0]) + slope * strain) / (1 + slope / young)
        area = math.pi * SIZE**2 * part * math.exp(strain - (1 - 2 * metal.elasticity.poisson) * stress / young)
        force += stress * area
    return force


STUDY = Study(
    name="clad",
    scene_of=scene_of,
    deck=CladDeck,
    whole=Plan((0.0, 0.1, 0.3), (5, 10), MARKS),
    fast=Plan((0.1,), (5,), MARKS[:2]),
    given={"core": CORE, "steel": repr(STEEL), "copper": repr(COPPER)},
)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the study."""
    parser = parser_of(
        "accuracy.clad", "Two metals upset as one body: the force beside CalculiX's.", fast="one coarse mesh, half way"
    )
    return STUDY.run(parser.parse_args(argv))


if __name__ == "__main__":
    sys.exit(main())
