"""Points of deformable tools: what the candidates of a scene face in a configuration."""

from __future__ import annotations

import numpy as np

from bipot.contact.sampling import Points
from bipot.scene.scene import Scene
from bipot.tensors import unit
from bipot.tools.deformable import DeformableTool, Faced
from bipot.tools.facing import facing, rounding
from bipot.tools.surfaces import across
from bipot.typing import Floats

FAR = 1e3
"""Gap, over the body's size, of points that face nothing."""


def points(scene: Scene, tool: DeformableTool, nodes: Floats) -> Points:
    """The points of the tool's candidates, with the weights and normals of the configuration ``nodes`` (a, d).

    In a plane of symmetry, and on an axis, normals lie in it.
    """
    sides = tool.sides
    found, at = facing(nodes, sides, scene.ring), sides.node
    normal, x = found.normal.copy(), scene.mesh.nodes[at]
    for plane in scene.mirrors:
        there = plane.holds(x)
        normal[there] = across(normal[there], plane.normal)
    normal, apart, far = unit(normal), rounding(nodes, sides, found.reach), found.unfaced
    apart[far] = FAR * scene.mesh.size - np.vecdot(normal[far], nodes[at[far]])
    faced = Faced(
        sides=sides,
        normals=normal,
        places=np.abs(nodes[at]).max(axis=1),
        apart=apart,
        part=found.part,
    )
    return Points(at, found.weights, sides.point, sides.flats, faced)
