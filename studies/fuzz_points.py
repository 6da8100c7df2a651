"""Where contact is posed in a drawn scene: drawn, and read a second time of supports and tools."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.mesh import Mesh
from bipot.scene import Scene
from bipot.tools import FlatTool, Sampling
from bipot.typing import Bools, Floats, Ints
from studies.fuzz_meshes import Rng
from studies.fuzz_placed import directions
from studies.independent_contact import moves
from studies.independent_data import Setting
from studies.independent_sampling import Means, around_ends, at_nodes

WEIGHTED = 0.4
"""Of the scenes of quadratic elements have contact in weighted means: at all of their tools, or at one of two."""


@dataclass(frozen=True)
class Points:
    """Points at a ``node`` (c,) that touch a ``tool`` (c,) or not, as the mean of nodes by ``weights`` (c, a)."""

    node: Ints
    tool: Ints
    weights: Floats


def sampled(rng: Rng, mesh: Mesh, tools: tuple[FlatTool, ...]) -> tuple[FlatTool, ...]:
    """The tools with contact in weighted means, sometimes at one alone; friction node by node is that of ends then."""
    if not mesh.element.quadratic or rng.random() >= WEIGHTED:
        return tools
    alone = int(rng.integers(len(tools))) if rng.random() < 0.3 else None
    return tuple(_weighted(mesh, tool) if alone in (None, k) else tool for k, tool in enumerate(tools))


def _weighted(mesh: Mesh, tool: FlatTool) -> FlatTool:
    ends = np.concatenate([mesh.boundaries[name][:, [0, -1]] for name in tool.candidates])
    mu_at = {node: mu for node, mu in tool.mu_at.items() if node in ends}
    return replace(tool, sampling=Sampling.WEIGHTED, mu_at=mu_at)


def posed(scene: Scene, setting: Setting) -> Points:
    """Every candidate: a point of a tool's edges of which a node, or the tool by a force, goes along the normal."""
    found = list[Means]()
    for tool, movable in zip(scene.tools, _movable(scene, setting), strict=True):
        every = _points(setting, tool, _edges(scene, tool))
        asked = ((every.weights != 0) & movable).any(axis=1)
        found.append(Means(every.node[asked], every.weights[asked]))
    return _by_tool(found)


def held_nodes(scene: Scene, setting: Setting) -> Points:
    """The nodes of the tools' boundaries that supports hold along the normal while no force drives the tool so."""
    pairs = zip(scene.tools, _movable(scene, setting), strict=True)
    held = [np.setdiff1d(_edges(scene, tool), np.flatnonzero(movable)) for tool, movable in pairs]
    return _by_tool([at_nodes(nodes, len(setting.rest)) for nodes in held])


def _by_tool(found: list[Means]) -> Points:
    node, weights = (np.concatenate([getattr(own, name) for own in found]) for name in ("node", "weights"))
    return Points(node, np.repeat(np.arange(len(found)), [len(own.node) for own in found]), weights)


def _edges(scene: Scene, tool: FlatTool) -> Ints:
    return np.concatenate([scene.mesh.boundaries[name] for name in tool.candidates])


def _points(setting: Setting, tool: FlatTool, edges: Ints) -> Means:
    """All points of a tool's ``edges``. On linear ones means are nodes."""
    if tool.sampling is Sampling.WEIGHTED and edges.shape[1] == 3:
        return around_ends(setting.rest, edges, setting.axisymmetric)
    return at_nodes(np.unique(edges), len(setting.rest))


def _movable(scene: Scene, setting: Setting) -> Bools:
    """Whether a node can move along a tool's normal, or that tool by the force that drives it (tools, a)."""
    normals = np.array([tool.normal for tool in scene.tools])[:, None]
    return moves(~setting.held, directions(scene)[:, None], normals)
