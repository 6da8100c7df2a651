"""The scenes in which increments by accuracy are judged: all yield, most land nodes, some turn round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, ring
from bipot.paper import upsetting
from bipot.paths import Path
from bipot.scene.scene import Scene
from bipot.scene.supports import Symmetry
from bipot.tools.tool import FlatTool

STEEL = VonMises(Elasticity(210_000.0, 0.3), Perfect(300.0))
STRAIGHT: Path = ((0.0, 0.0), (1.0, 1.0))
BACK: Path = ((0.0, 0.0), (0.5, 1.0), (1.0, 0.9))
"""Of a tool that turns round."""


def cylinder(mu: float, reduction: float = 0.3, elements: int = 10, path: Path = STRAIGHT) -> Scene:
    """The paper's, by its element, under a punch that goes this path."""
    return _pressed(upsetting(mu=mu, reduction=reduction, elements=elements), path)


def default(mu: float, path: Path = STRAIGHT) -> Scene:
    """The same by the element of scenes of one's own."""
    return _pressed(upsetting(mu=mu, reduction=0.3, elements=10, element=Element.Q4, volume=VolumeChange.P0), path)


def pressed_ring(across: int = 6, up: int = 4, element: Element = Element.Q8) -> Scene:
    """A ring whose sides both may fold onto the punch."""
    tool = FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -0.5), ("top", "bore", "side"), 0.15)
    mesh = ring(3.0, 6.0, 2.0, across, up, element=element)
    return Scene(mesh, Geometry.AXISYMMETRIC, STEEL, (Symmetry("base", 1),), (tool,))


def pressed_block(across: int = 6, up: int = 3, element: Element = Element.Q8) -> Scene:
    """A quarter in plane strain."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.2), ("top", "right"), 0.2)
    planes = (Symmetry("base", 1), Symmetry("left", 0))
    return Scene(block(2.0, 1.0, across, up, element=element), Geometry.PLANE_STRAIN, STEEL, planes, (tool,))


def square(across: int = 6) -> Scene:
    """A quarter in plane strain that is nearly smooth, in which bands of shear form at once."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.35), ("top", "right"), 0.05)
    planes = (Symmetry("base", 1), Symmetry("left", 0))
    return Scene(block(1.0, 1.0, across, across, element=Element.Q8), Geometry.PLANE_STRAIN, STEEL, planes, (tool,))


def slab() -> Scene:
    """A quarter in plane strain that is wide and rough, by the default element: yielding spreads far beyond yield."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.15), ("top",), 0.5)
    planes = (Symmetry("base", 1), Symmetry("left", 0))
    mesh = block(4.0, 1.0, 12, 4, element=Element.Q4)
    return Scene(mesh, Geometry.PLANE_STRAIN, STEEL, planes, (tool,))


def _pressed(scene: Scene, path: Path) -> Scene:
    """The scene with its tool on this path."""
    return replace(scene, tools=(replace(scene.tools[0], path=path),))


SCENES: dict[str, Callable[[], Scene]] = {
    "mu = 0.1": lambda: cylinder(0.1),
    "mu = 0.3": lambda: cylinder(0.3),
    "ring": pressed_ring,
    "block": pressed_block,
    "unloading": lambda: cylinder(0.1, path=BACK),
    "q4p0 mu = 0.1": lambda: default(0.1),
    "q4p0 mu = 0.3": lambda: default(0.3),
    "q4p0 ring": lambda: pressed_ring(12, 8, Element.Q4),
    "q4p0 block": lambda: pressed_block(12, 6, Element.Q4),
    "q4p0 unloading": lambda: default(0.1, BACK),
    "square": square,
    "q4p0 slab": slab,
    "coarse mu = 0.1": lambda: cylinder(0.1, elements=5),
    "coarse mu = 0.3": lambda: cylinder(0.3, elements=5),
}
"""By the paper's element or, where the names begin so, by the default one; coarse ones of half as many."""
