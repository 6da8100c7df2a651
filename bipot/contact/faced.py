"""Points of deformable tools: what the candidates of a scene face in a configuration."""

from __future__ import annotations

import numpy as np

from bipot.contact.sampling import Points
from bipot.scene.scene import Scene
from bipot.tools.deformable import DeformableTool, Faced
from bipot.tools.facing import facing, in_planes, rounding
from bipot.tools.pieces import Near
from bipot.typing import Floats

FAR = 1e3
"""Gap, over the body's size, of points that face nothing."""


def points(scene: Scene, tool: DeformableTool, nodes: Floats, near: Near | None = None) -> Points:
    """The points of the tool's candidates, with the weights and normals of the configuration ``nodes`` (a, d).

    In a plane of symmetry, and on an axis, normals lie in it. What leans away is faced as far as the tool says, or as
    ``near`` allows.
    """
    met, sides, at = tool.met, tool.sides, tool.sides.node
    found = facing(nodes, sides, met.ring, near or tool.near)
    normal = in_planes(found.normal, sides.nodes[at], met.planes)
    apart, far = rounding(nodes, sides, found), found.unfaced
    apart[far] = FAR * scene.mesh.size - np.vecdot(normal[far], nodes[at[far]])
    faced = Faced(
        sides=sides,
        ring=met.ring,
        planes=met.planes,
        normals=normal,
        places=np.abs(nodes[at]).max(axis=1),
        apart=apart,
        none=tool.seeming,
        part=found.part,
        shares=found.shares,
    )
    return Points(at, found.weights, sides.point, sides.flats, faced)
