"""Points of deformable tools: what the candidates of a scene face in a configuration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.contact.sampling import Points
from bipot.scene.scene import Scene
from bipot.tensors import unit
from bipot.tools.deformable import DeformableTool, Faced
from bipot.tools.facing import Facing, facing
from bipot.tools.surfaces import across
from bipot.typing import Floats, Ints

FAR = 1e3
"""Gap, over the body's size, of points that face nothing."""


def faced(scene: Scene, tool: DeformableTool, own: Points, nodes: Floats) -> Points:
    """The points ``own`` of the tool with the weights and normals of the configuration ``nodes`` (a, d).

    In a plane of symmetry, and on an axis, normals lie in it.
    """
    found = met_by(scene, tool, own.node, nodes)
    normal, x = found.normal.copy(), scene.mesh.nodes[own.node]
    for plane in scene.mirrors:
        there = plane.holds(x)
        normal[there] = across(normal[there], plane.normal)
    normal, apart = unit(normal), np.zeros(len(x))
    far = found.apart
    apart[far] = FAR * scene.mesh.size - np.vecdot(normal[far], nodes[own.node[far]])
    return replace(own, weights=found.weights, faced=Faced(normal, np.abs(nodes[own.node]).max(axis=1), apart))


def met_by(scene: Scene, tool: DeformableTool, node: Ints, nodes: Floats) -> Facing:
    """What the points at ``node`` (p,) of the tool's candidates face where nodes are at ``nodes`` (a, d)."""
    one, other = (
        np.concatenate([scene.mesh.surface(name)[0] for name in names]) for names in (tool.candidates, tool.surface)
    )
    return facing(nodes, node, one, other, scene.ring)
