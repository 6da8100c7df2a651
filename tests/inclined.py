"""Whole scenes turned about a point, and ones with supports between the axes, which tests share."""

import math
from dataclasses import replace

import numpy as np

from bipot.mesh import Mesh
from bipot.scene import Scene
from bipot.supports import Support
from bipot.surfaces import Circle, Plane, Surface
from bipot.tools import FlatTool, ShapedTool, Tool

ANGLE = math.pi / 6
ABOUT = (1.3, -0.7)


def rotation(angle: float = ANGLE) -> np.ndarray:
    """What turns vectors (..., d) as ``v @ rotation``, anticlockwise."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, sine], [-sine, cosine]])


def turned(scene: Scene, angle: float = ANGLE) -> Scene:
    """Mesh, supports, tools with their travels and forces, and loads, turned about :data:`ABOUT`."""
    mesh = scene.mesh
    return replace(
        scene,
        mesh=Mesh(_places(mesh.nodes, angle), mesh.elements, mesh.boundaries),
        supports=tuple(replace(s, direction=_vector(s.vector, angle)) for s in scene.supports),
        tools=tuple(_tool(tool, angle) for tool in scene.tools),
        loads=tuple(
            replace(load, vector=_vector(load.vector, angle)) if hasattr(load, "vector") else load
            for load in scene.loads
        ),
    )


def _tool(tool: Tool, angle: float) -> Tool:
    own = {"travel": _vector(tool.travel, angle)}
    if tool.driven_by is not None:
        own["driven_by"] = replace(tool.driven_by, vector=_vector(tool.driven_by.vector, angle))
    if isinstance(tool, FlatTool):
        return replace(tool, point=_place(tool.point, angle), normal=_vector(tool.normal, angle), **own)
    assert isinstance(tool, ShapedTool)
    if tool.turn is not None:
        own["turn"] = replace(tool.turn, centre=_place(tool.turn.centre, angle))
    return replace(tool, surface=_surface(tool.surface, angle), **own)


def _surface(surface: Surface, angle: float) -> Surface:
    if isinstance(surface, Plane):
        return Plane(_place(surface.point, angle), _vector(surface.normal, angle))
    assert isinstance(surface, Circle)
    return replace(surface, centre=_place(surface.centre, angle))


def _places(points, angle):
    return (np.asarray(points) - ABOUT) @ rotation(angle) + ABOUT


def _place(point, angle):
    return tuple(_places(point, angle).tolist())


def _vector(vector, angle):
    return tuple((np.asarray(vector) @ rotation(angle)).tolist())


def held_along(*directions, boundary="base", **changes) -> tuple[Support, ...]:
    """Supports of one boundary along directions."""
    return tuple(Support(boundary, direction, **changes) for direction in directions)
