"""Checks of scenes with several parts and deformable tools."""

from __future__ import annotations

import numpy as np

from bipot.errors import require
from bipot.meshes.mesh import Mesh
from bipot.tools.deformable import AnyTool, DeformableTool
from bipot.tools.facing import facing
from bipot.tools.passing import deep
from bipot.tools.seeming import means_of, missed
from bipot.tools.tool import Sampling

INSIDE = 1e-9
"""Depth of candidates in a deformable tool at rest, over the body's size, up to which it is round-off."""


def require_joined(mesh: Mesh, tools: tuple[AnyTool, ...]) -> None:
    """Require one connected body, or parts without a common node each of which faces another one.

    Raises:
        SceneError: parts that touch only in a corner, or not at all, and would move independently; nodes of two parts.
    """
    part = mesh.connected
    count = int(part.max()) + 1
    if count == 1:
        return
    facing_tools = [tool for tool in tools if isinstance(tool, DeformableTool)]
    what = "edge" if mesh.dimension == 2 else "face"
    apart = int(np.flatnonzero(part != part[0])[0])
    lonely = f"one body, or parts that deformable tools join: element {apart} shares no {what} with those of element 0"
    require(bool(facing_tools), "scene.mesh", "in parts", lonely)
    touched = set[int]()
    for tool in facing_tools:
        touched |= {*part[mesh.owners(*tool.surface)].tolist(), *part[mesh.owners(*tool.candidates)].tolist()}
    missing = sorted({*range(count)} - touched)
    lonely = "parts of which each has the surface or the candidates of a deformable tool"
    first = np.flatnonzero(np.isin(part, missing[:1])).min(initial=len(part))
    require(not missing, "scene.mesh", f"with part {missing[:1]}, of element {first}", lonely)
    crowded = np.flatnonzero(mesh.part[mesh.elements] != part[:, None])
    lonely = "parts without a node in common"
    require(not crowded.size, "scene.mesh", f"node {mesh.elements.ravel()[crowded[:1]]} in two parts", lonely)


def require_nodes(mesh: Mesh, tools: tuple[AnyTool, ...]) -> None:
    """Refuse means of nodes that are seen one by one, at curved tools, beside means that are vectors between parts.

    Raises:
        SceneError: a curved tool that samples means of quadratic elements, beside a deformable one.
    """
    beside = mesh.element.quadratic and any(isinstance(tool, DeformableTool) for tool in tools)
    for k, tool in enumerate(tools):
        means = beside and not tool.flat and tool.sampling is Sampling.WEIGHTED
        require(not means, f"tools[{k}].sampling", tool.sampling, f"{Sampling.NODES} beside a deformable tool")


def require_facing(mesh: Mesh, ring: bool, tool: DeformableTool, label: str) -> None:
    """Refuse a deformable tool that does not fit the body, naming its field by the ``label``.

    Raises:
        SceneError: inner edges, or some that two boundaries of one side have in common;
            nodes in both boundaries, or coefficients at nodes of none; candidates in the surface at rest, or sides that
            are deep in each other beside their means.
    """
    mesh.require_outer(f"{label}.surface", *tool.surface)
    mesh.require_outer(f"{label}.candidates", *tool.candidates)
    node = mesh.boundary_nodes(*tool.candidates)
    both = np.intersect1d(node, mesh.boundary_nodes(*tool.surface))[:1].tolist()
    require(not both, f"{label}.candidates", tool.candidates, f"without a node of the surface, as {both} is")
    sides = tool.sides
    found = facing(mesh.nodes, sides, ring, tool.near)
    gap = np.vecdot(found.normal, means_of(mesh.nodes, found))
    allowed = INSIDE * mesh.size + missed(sides, found, tool.met.planes if tool.welded else None)
    least = int(np.argmin(gap + allowed))
    off = f"off the tool's surface, not {-gap[least]:.3g} in it at node {sides.node[least]}"
    require(gap[least] >= -allowed[least], f"{label}.candidates", tool.candidates, off)
    depth = max(deep(mesh.nodes, *of, ring) for of in ((sides.one, sides.other), (sides.other, sides.one)))
    beside = f"off the tool's surface, not {depth:.3g} in it beside nodes: refine the mesh there"
    require(depth == 0, f"{label}.candidates", tool.candidates, beside)
