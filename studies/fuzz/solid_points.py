"""Where contact is posed in a drawn body in space: drawn, and read a second time of the mesh and planes of symmetry."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from bipot.tools.deformable import AnyTool
from bipot.tools.tool import FlatTool, Sampling
from bipot.typing import Bools, Floats, Ints
from studies.fuzz.meshes import Rng
from studies.fuzz.solid_held import planes_of
from studies.fuzz.solid_placed import cuts
from studies.fuzz.solid_surfaces import bent
from studies.independent.fans import around_corners
from studies.independent.sampling import at_nodes

WEIGHTED = 0.5
"""Of the bodies of T10 have contact in weighted means: at all of their tools, or at one of two. Those of H20 must."""


@dataclass(frozen=True)
class Posed:
    """Points (p,) at a ``node``, the mean of nodes by ``weights`` (p, a).

    Beyond planes of symmetry the body goes on at some: ``within`` (p, 3, 3) is what these leave of their vectors, of
    ``moved`` (p, 3, 3) what they leave of a mean's motion: all of a node's, which supports hold. Of all points of the
    tool ``ends`` (f, m) are those of each face, at its nodes or around its corners.
    """

    node: Ints
    weights: Floats
    within: Floats
    moved: Floats
    ends: Ints

    def only(self, chosen: Bools) -> Posed:
        """Those that are chosen (p,)."""
        own = self.node[chosen], self.weights[chosen], self.within[chosen], self.moved[chosen]
        return Posed(*own, self.ends)


def weighted(rng: Rng, mesh: Mesh, tools: tuple[FlatTool, ...]) -> tuple[FlatTool, ...]:
    """The tools with contact in means, sometimes one alone; friction node by node is that of corners then."""
    if mesh.element is Element.H20:
        return tuple(_weighted(mesh, tool) for tool in tools)
    if not mesh.element.quadratic or rng.random() >= WEIGHTED:
        return tools
    alone = int(rng.integers(len(tools))) if rng.random() < 0.3 else None
    return tuple(_weighted(mesh, tool) if alone in (None, k) else tool for k, tool in enumerate(tools))


def _weighted(mesh: Mesh, tool: FlatTool) -> FlatTool:
    faces = faces_of(mesh, tool)
    corners = faces[:, : faces.shape[1] // 2]
    mu_at = {node: mu for node, mu in tool.mu_at.items() if node in corners}
    return replace(tool, sampling=Sampling.WEIGHTED, mu_at=mu_at)


def faces_of(mesh: Mesh, tool: AnyTool) -> Ints:
    """The faces (f, n) of a tool's boundaries."""
    return np.concatenate([mesh.boundaries[name] for name in tool.candidates])


def owners(mesh: Mesh, faces: Ints) -> Ints:
    """The element (f,) behind each of the faces (f, n)."""
    whole = (faces[:, None, :, None] == mesh.elements[None, :, None, :]).any(axis=-1).all(axis=-1)
    return np.argmax(whole, axis=1)


def in_means(tool: AnyTool, faces: Ints) -> bool:
    """Whether the law is posed in means: on linear faces these are the nodes."""
    return tool.sampling is Sampling.WEIGHTED and faces.shape[1] in (6, 8)


def posed(scene: Scene, number: int) -> Posed:
    """All points of the faces that a tool may touch."""
    tool, mesh = scene.tools[number], scene.mesh
    faces, planes = faces_of(mesh, tool), cuts(scene, tool)
    if not in_means(tool, faces):
        found, within = at_nodes(faces, len(mesh.nodes)), np.tile(np.eye(3), (len(np.unique(faces)), 1, 1))
        # At a tool that is not its own mirror image, and bent, a node and its image both rub.
        for way, inside in planes if bent(tool) else planes_of(scene):
            within[inside[found.node]] @= np.eye(3) - np.outer(way, way)
        return Posed(found.node, found.weights, within, np.tile(np.eye(3), (len(found.node), 1, 1)), found.ends)
    insides = mesh.nodes[mesh.elements[owners(mesh, faces)]].mean(axis=1)
    fans = around_corners(mesh.nodes, faces, insides)
    within = np.tile(np.eye(3), (len(fans.node), 1, 1))
    for way, inside in planes:
        # At another tool than its own mirror image a mean is that of its own half of the body.
        within[fans.beyond(inside, way)] @= np.eye(3) - np.outer(way, way)
    return Posed(fans.node, fans.weights, within, within, fans.ends)
