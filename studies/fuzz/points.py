"""Where contact is posed in a drawn scene: drawn, and read a second time of supports and tools."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Symmetry
from bipot.tools.deformable import AnyTool
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from bipot.typing import Bools, Floats, Ints
from studies.flat import axis_of
from studies.fuzz.meshes import Rng
from studies.fuzz.placed import directions, directions_of, planes
from studies.fuzz.surfaces import cut, outlines
from studies.independent.contact import FREE, moves
from studies.independent.data import Setting
from studies.independent.sampling import Means, around_ends, at_nodes
from studies.independent.tools import turning

WEIGHTED = 0.4
"""Of the scenes of quadratic elements have contact in weighted means: at all of their tools, or at one of two."""

Tool = TypeVar("Tool", FlatTool, ShapedTool)

ON_AXIS = 1e-9
"""A radius below this fraction of the largest is none."""

TURNS = np.linspace(0.0, 2 * np.pi, 12)[1:-1]
"""Angles of a tool: one to whose nodes the gaps are the same at all is round about its centre."""

ROUND = 1e-12
"""Round-off of gaps over the numbers that they are differences of."""


@dataclass(frozen=True)
class Points:
    """Points at a ``node`` (c,) that touch a ``tool`` (c,) or not, as the mean of nodes by ``weights`` (c, a).

    ``number`` (c,) is which they are of all points of their tool. ``fixed`` (c,) are those of which supports hold all
    nodes along the tangent, and no force moves the tool so. Others rub (``rubs``), but for those where the body beyond
    them slips the other way: on an axis, or a plane of symmetry.
    """

    node: Ints
    tool: Ints
    number: Ints
    weights: Floats
    fixed: Bools
    rubs: Bools


def sampled(rng: Rng, mesh: Mesh, tools: tuple[Tool, ...]) -> tuple[Tool, ...]:
    """The tools with contact in weighted means, sometimes at one alone; friction node by node is that of ends then."""
    if not mesh.element.quadratic or rng.random() >= WEIGHTED:
        return tools
    alone = int(rng.integers(len(tools))) if rng.random() < 0.3 else None
    return tuple(_weighted(mesh, tool) if alone in (None, k) else tool for k, tool in enumerate(tools))


def _weighted(mesh: Mesh, tool: Tool) -> Tool:
    ends = np.concatenate([mesh.boundaries[name][:, [0, -1]] for name in tool.candidates])
    mu_at, shear_at = ({a: v for a, v in by.items() if a in ends} for by in (tool.mu_at, tool.shear_at))
    return replace(tool, sampling=Sampling.WEIGHTED, mu_at=mu_at, shear_at=shear_at)


def posed(scene: Scene, setting: Setting) -> Points:
    """Every candidate: a point of a tool's edges of which a node, or the tool by a force, goes along the normal."""
    found = [points_of(scene, setting, tool) for tool in scene.tools]
    pairs = zip(found, _approaches(scene, setting), strict=True)
    return _by_tool(scene, setting, found, [((every.weights != 0) & moves).any(axis=1) for every, moves in pairs])


def held_nodes(scene: Scene, setting: Setting) -> Points:
    """The nodes of the tools' boundaries that supports hold along the normal while no force drives the tool so."""
    pairs = zip(scene.tools, _approaches(scene, setting), strict=True)
    held = [np.setdiff1d(edges_of(scene, tool), np.flatnonzero(movable)) for tool, movable in pairs]
    found = [at_nodes(nodes, len(setting.rest)) for nodes in held]
    return _by_tool(scene, setting, found, [np.ones(len(nodes), dtype=bool) for nodes in held])


def _by_tool(scene: Scene, setting: Setting, found: list[Means], asked: list[Bools]) -> Points:
    """Those of the points ``found`` that are ``asked`` (p,) for, tool by tool."""
    number = np.concatenate([np.flatnonzero(mine) for mine in asked])
    node = np.concatenate([every.node[mine] for every, mine in zip(found, asked, strict=True)])
    weights = np.concatenate([every.weights[mine] for every, mine in zip(found, asked, strict=True)])
    tool = np.repeat(np.arange(len(found)), [np.count_nonzero(mine) for mine in asked])
    tangents = _normals(scene, setting)[..., ::-1] * (1.0, -1.0)
    slides = ((weights != 0) & _slides(scene, setting, tangents)[tool]).any(axis=1)
    beyond = moves(~_mirrored(scene, setting)[tool, node], np.zeros((1, 2)), tangents[tool, node])
    return Points(node, tool, number, weights, ~slides, slides & beyond)


def edges_of(scene: Scene, tool: AnyTool) -> Ints:
    """Edges (f, n) of a tool's boundaries, end, middle, end."""
    return np.concatenate([scene.mesh.boundaries[name] for name in tool.candidates])


def points_of(scene: Scene, setting: Setting, tool: AnyTool) -> Means:
    """All points of a tool's edges. On linear ones means are nodes."""
    edges = edges_of(scene, tool)
    if tool.sampling is Sampling.WEIGHTED and edges.shape[1] == 3:
        return around_ends(setting.rest, edges, setting.axisymmetric)
    return at_nodes(edges, len(setting.rest))


def _normals(scene: Scene, setting: Setting) -> Floats:
    """Normals (tools, a, 2) at rest where a tool is nearest to a node; in a plane that cuts it that of the plane."""
    out = np.empty((len(scene.tools), *setting.rest.shape))
    for k, tool in enumerate(scene.tools):
        if isinstance(tool, FlatTool):
            out[k] = tool.normal
            continue
        found = [outline.near(setting.rest) for outline in outlines(tool.face)]
        nearest = np.argmin([near.gap for near in found], axis=0)
        out[k] = np.stack([near.normal for near in found])[nearest, np.arange(len(nearest))]
        for d, position in planes(scene):
            inside = np.abs(setting.rest[:, d] - position) <= ON_AXIS * setting.size
            out[k, inside & cut(tool, d, position), d] = 0.0
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def _approaches(scene: Scene, setting: Setting) -> Bools:
    """Whether (tools, a) a node, or a tool by a force, can move along the normal: that of a curved tool may turn.

    One that is driven may come to nodes that do not move at all.
    """
    out = _movable(scene, setting, _normals(scene, setting))
    for k, tool in enumerate(scene.tools):
        if not isinstance(tool, FlatTool):
            out[k] = (~setting.held).any(axis=1) | _comes(scene, k)
    return out


def _comes(scene: Scene, number: int) -> Bools:
    """Whether (a,) the force or moment that drives a shaped tool ever changes its gap to a node."""
    tool, x = scene.tools[number], scene.mesh.nodes
    if tool.driven_by is not None or tool.turn is None or tool.turn.driven_by is None:
        return np.full(len(x), tool.driven_by is not None)
    own, centre = outlines(tool.face), np.array(tool.turn.centre)
    seen = [(x - centre) @ turning(angle) + centre for angle in TURNS]
    gaps = np.array([np.min([outline.near(y).gap for outline in own], axis=0) for y in seen])
    far = max(outline.extent for outline in own) + float(np.abs(centre).max() + np.abs(x).max())
    return np.ptp(gaps, axis=0) > ROUND * far


def _slides(scene: Scene, setting: Setting, tangents: Floats) -> Bools:
    """Whether (tools, a) the two can move along the tangent, which of a curved tool turns to where they do."""
    out, moved = _movable(scene, setting, tangents), np.zeros(setting.held.shape, dtype=bool)
    for number, support in enumerate(scene.supports):
        if isinstance(support, Prescribed) and support.displacement != 0:
            there = np.isin(np.arange(len(moved)), np.unique(scene.mesh.boundaries[support.boundary]))
            along = setting.along(directions_of(scene)[number] + 0 * setting.rest)
            moved |= there[:, None] & (np.abs(along) > FREE)
    for k, tool in enumerate(scene.tools):
        if not isinstance(tool, FlatTool):
            ways = np.array([tool.travel, directions(scene)[k]])[:, None] + 0 * setting.rest
            goes = moved | (np.abs(setting.along(ways)) > FREE * np.abs(ways).max(axis=-1)[..., None]).any(axis=0)
            goes |= tool.turn is not None
            out[k] = (~setting.held).any(axis=1) & (out[k] | (setting.held & goes).any(axis=1))
            out[k] |= _comes(scene, k)
    return out


def _movable(scene: Scene, setting: Setting, ways: Floats) -> Bools:
    """Whether a node can move along its way of ``ways`` (tools, a, 2), or that tool by a force (tools, a)."""
    by_tool = np.abs(np.vecdot(directions(scene)[:, None], ways)) > FREE
    return moves(~setting.held, np.zeros(2), setting.along(ways)) | by_tool


def _mirrored(scene: Scene, setting: Setting) -> Bools:
    """Which displacements (tools, a, 2) the body beyond an axis or a plane of symmetry has the other way.

    Of a curved tool those alone where it is its own mirror image: the tangents of another turn.
    """
    out, radius = np.zeros((len(scene.tools), *setting.rest.shape), dtype=bool), setting.rest[:, 0]
    on_axis = setting.axisymmetric & (radius <= ON_AXIS * radius.max())
    across = dict(planes(scene))
    for k, tool in enumerate(scene.tools):
        out[k, :, 0] = on_axis & (not setting.axisymmetric or cut(tool, 0, 0.0) or isinstance(tool, FlatTool))
        for support in scene.supports:
            if isinstance(support, Symmetry):
                d = axis_of(support)
                own = isinstance(tool, FlatTool) or cut(tool, d, across[d])
                out[k, np.unique(scene.mesh.boundaries[support.boundary]), d] |= own
    return out
