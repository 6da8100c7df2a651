"""Scenes with supports between the axes: whole ones turned about a point, and the scenes that are turned."""

import math
from dataclasses import replace

import numpy as np

from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.scene.loads import BodyForce, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Turn
from bipot.tools.tool import FlatTool, Sampling, ShapedTool, Tool

ANGLE = math.pi / 6
ABOUT = (1.3, -0.7)


def rotation(angle: float = ANGLE) -> np.ndarray:
    """What turns vectors (..., d) anticlockwise as ``v @ rotation``."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, sine], [-sine, cosine]])


def turned(scene: Scene, angle: float = ANGLE) -> Scene:
    """Mesh, supports, tools with their travels and forces, and loads, turned about :data:`ABOUT`."""
    mesh = scene.mesh
    return replace(
        scene,
        mesh=Mesh(places(mesh.nodes, angle), mesh.elements, mesh.boundaries),
        supports=tuple(replace(s, direction=_vector(s.along(2), angle)) for s in scene.supports),
        tools=tuple(_tool(tool, angle) for tool in scene.tools),
        loads=tuple(
            load if isinstance(load, Pressure) else replace(load, vector=_vector(load.vector, angle))
            for load in scene.loads
        ),
    )


def _tool(tool: Tool, angle: float) -> Tool:
    own = {"travel": _vector(tool.travel, angle)}
    if tool.driven_by is not None:
        own["driven_by"] = replace(tool.driven_by, vector=_vector(tool.driven_by.vector, angle))
    if isinstance(tool, FlatTool):
        return replace(tool, point=_place(tool.point, angle), normal=_vector(tool.normal, angle), **own)
    if tool.turn is not None:
        own["turn"] = replace(tool.turn, centre=_place(tool.turn.centre, angle))
    return replace(tool, surface=replace(tool.surface, centre=_place(tool.surface.centre, angle)), **own)


def places(points: np.ndarray, angle: float = ANGLE) -> np.ndarray:
    """Points (..., d) turned about :data:`ABOUT`."""
    return (points - ABOUT) @ rotation(angle) + ABOUT


def _place(point, angle):
    return tuple(places(np.array(point), angle).tolist())


def _vector(vector, angle):
    return tuple((np.array(vector) @ rotation(angle)).tolist())


def along(degrees: float) -> tuple[float, float]:
    """The unit vector at an angle to the first axis."""
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def body(supports, tools=(), element: Element = Element.Q8, **changes) -> Scene:
    """A block 3 x 2 of hardening steel in plane strain."""
    mesh, steel = block(3.0, 2.0, 3, 2, element=element), VonMises(Elasticity(2e5, 0.3), Linear(300.0, 2000.0))
    return Scene(mesh, Geometry.PLANE_STRAIN, steel, supports, tools, **changes)


def flat(**changes) -> FlatTool:
    """A platen on the block."""
    given = {"point": (0.0, 2.0), "normal": (0.0, -1.0), "travel": (0.0, -0.06), "candidates": ("top",), "mu": 0.3}
    return FlatTool(**(given | changes))


def roll(**changes) -> ShapedTool:
    """A circular tool that touches the block."""
    return ShapedTool(Circle((1.0, 8.0), 6.0), candidates=("top",), mu=0.3, **changes)


QUARTER = (Symmetry("left", 0), Symmetry("base", 1))
BASE = (Support("base", 0), Support("base", 1))

SCENES: dict[str, Scene] = {
    "a quarter between platens": body(QUARTER, (flat(candidates=("top", "right")),)),
    "under a circular tool": body(BASE, (roll(travel=(0.05, -0.06)),), Element.Q4),
    "weighted sampling": body(QUARTER, (flat(sampling=Sampling.WEIGHTED),)),
    "a tool that a force drives": body(QUARTER, (flat(travel=(0.0, 0.0), driven_by=Force((0.0, -2200.0))),)),
    "friction that a support takes": body((*BASE, Support("top", 0)), (flat(travel=(0.05, -0.06)),)),
    "a roll that turns": body(BASE, (roll(travel=(0.0, -0.06), turn=Turn(0.02, (1.0, 8.0))),), Element.Q4),
    "a circle cut by a plane of symmetry": body(
        (Symmetry("left", 0), Support("base", 1)),
        (ShapedTool(Circle((0.0, 6.0), 4.0), (0.0, -0.06), ("top",), 0.3),),
        Element.Q4,
    ),
    "driven aslant under every load": body(
        (*BASE, Prescribed("top", along(70.0), -0.05)),
        loads=(
            Pressure("right", 50.0),
            BodyForce((3.0, -2.0)),
            Traction("left", (1.0, 2.0)),
            PointForce(3, (0.0, 5.0)),
        ),
    ),
    "driven along two directions": body(
        (
            Support("base", along(100.0)),
            Support("base", along(40.0)),
            Prescribed("top", along(70.0), -0.05),
            Prescribed("top", along(0.0), 0.01),
        ),
    ),
    "held along the tool's normal alone": body((Support("base", 1),), (flat(),)),
    "between slants": body((Support("base", along(100.0)), Support("left", along(20.0))), (flat(),)),
}
"""Scenes along the axes and aslant; the first two are marched by every form."""


def sector(geometry, low=20.0, high=70.0, element=Element.Q8):
    """1 <= rho <= 2 between two angles, smooth supports along both slants and a pressure on all else."""
    mesh = block(1.0, math.radians(high - low), 3, 3, element=Element.T3 if element.corners == 3 else Element.Q4)
    rho, angle = 1.0 + mesh.nodes[:, 0], math.radians(low) + mesh.nodes[:, 1]
    nodes = rho[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return Scene(
        mesh=Mesh(nodes, mesh.elements, mesh.boundaries).to(element),
        geometry=geometry,
        material=Elastic(Elasticity(1000.0, 0.3)),
        supports=(Support("base", along(low + 90.0)), Support("top", along(high - 90.0))),
        configuration=Configuration.SMALL,
        quadrature=Quadrature.GAUSS3 if element is Element.Q8 else None,
        loads=(Pressure("left", 2.0), Pressure("right", 2.0)),
    )
