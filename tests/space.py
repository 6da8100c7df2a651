"""Scenes under shaped tools in space, which tests share."""

from dataclasses import replace

import numpy as np

from bipot.fem.reduction import Geometry
from bipot.laws.material import Elastic, Material
from bipot.laws.von_mises import Elasticity
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.revolved import Revolved, sphere
from bipot.tools.surfaces import Surface
from bipot.tools.tool import FlatTool, ShapedTool
from tests.curved import STEEL

BALL = sphere((0.0, 0.0, 3.0), 2.0)
POINTED = sphere((0.45, 0.55, 1.6), 0.6)
RUBBER = Elastic(Elasticity(1e3, 0.3))
PRESSED_THEN = ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (1.0, (1.0, 1.0, 1.0)))


def dented(
    surface: Surface = BALL,
    travel: tuple[float, float, float] = (0.0, 0.0, -0.1),
    mu: float = 0.2,
    elements: int = 3,
    material: Material = STEEL,
    element: Element = Element.H8,
    **tool,
) -> Scene:
    """A quarter of a block under a sphere that begins where they touch."""
    return Scene(
        brick(1.0, 1.0, 1.0, elements, elements, elements, element=element),
        Geometry.SOLID,
        material,
        (Symmetry("left", 0), Symmetry("front", 1), Support("base", 2)),
        (ShapedTool(surface, travel, ("top",), mu, **tool),),
    )


def rubbed(surface: Surface = POINTED, elements: int = 2, material: Material = RUBBER, **tool) -> Scene:
    """The whole block, held at its base, under a small sphere that presses and then goes aside, askew."""
    given = {"travel": (0.1, 0.06, -0.05), "path": PRESSED_THEN, "mu": 0.2} | tool
    return Scene(
        brick(1.0, 1.0, 1.0, elements, elements, elements),
        Geometry.SOLID,
        material,
        tuple(Support("base", d) for d in range(3)),
        (ShapedTool(surface, candidates=("top",), **given),),
    )


def turned_scene(scene: Scene, Q: np.ndarray) -> Scene:
    """All of a scene without loads turned about the origin by Q."""

    def way(v):
        return tuple((Q @ v).tolist())

    mesh = Mesh(scene.mesh.nodes @ Q.T, scene.mesh.elements, scene.mesh.boundaries)
    supports = tuple(replace(support, direction=way(support.along(3))) for support in scene.supports)
    return replace(scene, mesh=mesh, supports=supports, tools=tuple(_moved(tool, way) for tool in scene.tools))


def mirrored_scene(scene: Scene) -> Scene:
    """The mirror image of a scene without supports in x = 0."""
    mesh, flip = scene.mesh, np.array([-1.0, 1.0, 1.0])
    mesh = Mesh(mesh.nodes * flip, mesh.elements[:, mesh.element.mirrored], mesh.boundaries)
    tools = tuple(_moved(tool, lambda v: tuple((flip * v).tolist())) for tool in scene.tools)
    return replace(scene, mesh=mesh, tools=tools)


def _moved(tool, way):
    """The tool with all its vectors changed: it goes straight."""
    if tool.driven_by is not None:
        tool = replace(tool, driven_by=replace(tool.driven_by, vector=way(tool.driven_by.vector)))
    if isinstance(tool, FlatTool):
        return replace(tool, point=way(tool.point), normal=way(tool.normal), travel=way(tool.travel))
    surface = tool.face
    along = {"axis": way(surface.axis)} if isinstance(surface, Revolved) else {"normal": way(surface.normal)}
    return replace(tool, surface=replace(surface, point=way(surface.point), **along), travel=way(tool.travel))
