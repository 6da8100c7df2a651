"""The small scenes in which increments by accuracy are judged: all yield, most land nodes, one turns round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, ring
from bipot.paths import Path
from bipot.scene.scene import Scene, upsetting
from bipot.scene.supports import Symmetry
from bipot.tools.tool import FlatTool

STEEL = VonMises(Elasticity(210_000.0, 0.3), Perfect(300.0))
STRAIGHT: Path = ((0.0, 0.0), (1.0, 1.0))
BACK: Path = ((0.0, 0.0), (0.5, 1.0), (1.0, 0.9))
"""Of a tool that turns round."""


def cylinder(mu: float, reduction: float = 0.3, elements: int = 5, path: Path = STRAIGHT) -> Scene:
    """The paper's, coarse, under a punch that goes this path."""
    scene = upsetting(mu=mu, reduction=reduction, elements=elements)
    return replace(scene, tools=(replace(scene.tools[0], path=path),))


def pressed_ring() -> Scene:
    """A ring whose sides both may fold onto the punch."""
    tool = FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -0.5), ("top", "bore", "side"), 0.15)
    return Scene(
        ring(3.0, 6.0, 2.0, 6, 4, element=Element.Q8), Geometry.AXISYMMETRIC, STEEL, (Symmetry("base", 1),), (tool,)
    )


def pressed_block() -> Scene:
    """A quarter in plane strain."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.2), ("top", "right"), 0.2)
    planes = (Symmetry("base", 1), Symmetry("left", 0))
    return Scene(block(2.0, 1.0, 6, 3, element=Element.Q8), Geometry.PLANE_STRAIN, STEEL, planes, (tool,))


SCENES: dict[str, Callable[[], Scene]] = {
    "mu = 0.1": lambda: cylinder(0.1),
    "mu = 0.3": lambda: cylinder(0.3),
    "ring": pressed_ring,
    "block": pressed_block,
    "unloading": lambda: cylinder(0.1, elements=4, path=BACK),
}
