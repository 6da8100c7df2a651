"""What no increment may do, whatever its certificate says: what forces and gaps at the nodes alone do not see."""

from __future__ import annotations

import numpy as np

from bipot.between import between
from bipot.certificate import Bounds
from bipot.contact import TOUCHES
from bipot.errors import NotConverged
from bipot.iterate import Increment, Iterate
from bipot.tensors import norm

RUNAWAY = 10.0
"""Farthest motion of a node in an increment, over the size of the body and the tools' travel together."""


def refuse_blocked(increment: Increment, bounds: Bounds) -> None:
    """Refuse a tool that ends in a node held along its normal, and a weld torn by a support: no motion helps."""
    inside = increment.inside / increment.system.body.scene.mesh.size
    if inside > bounds.penetration:
        raise NotConverged(f"a tool ends {inside:.2g} times the body's size inside a node that a support holds")
    if increment.torn is not None:
        raise NotConverged(f"a support moves node {increment.torn} against the tool that it is welded to")


def refuse_motion(iterate: Iterate) -> None:
    """Refuse what a motion may not do: run away, go through a tool or let one between nodes, meet a mirror image."""
    _refuse_runaway(iterate)
    if iterate.increment.system.candidates.curved:
        _refuse_crossed(iterate)
        _refuse_between(iterate)
    _refuse_image(iterate)


def _refuse_runaway(iterate: Iterate) -> None:
    """Refuse a motion so long that its round-off hides every strain."""
    body = iterate.increment.system.body
    size, moved = body.scene.mesh.size, float(norm(iterate.response.du).max())
    allowed = RUNAWAY * (size + iterate.increment.reach + float(norm(iterate.increment.driven).max()))
    if moved > allowed:
        raise NotConverged(f"the body runs away by {moved / size:.2g} times its size: nothing holds it")


def _refuse_crossed(iterate: Iterate) -> None:
    """Refuse nodes that go through a tool: gaps of the end alone do not see it."""
    contacts = iterate.increment.system.candidates
    crossed = np.flatnonzero(iterate.meeting.crossed)
    if len(crossed):
        tool, node = contacts.tool[crossed[0]], contacts.node[crossed[0]]
        raise NotConverged(f"tools[{tool}] goes through node {node}: the increment is too long for so small a tool")


def _refuse_between(iterate: Iterate) -> None:
    """Refuse tools that come into the body between two nodes, which feel nothing of it."""
    increment, scene = iterate.increment, iterate.increment.system.body.scene
    for k, (tool, placed, travel) in enumerate(
        zip(scene.tools, increment.placed_before, iterate.tool_travel, strict=True)
    ):
        start = increment.start.nodes - placed
        passed = between(scene.mesh, tool, start, start + iterate.response.du - travel)
        if passed is not None:
            raise NotConverged(
                f"tools[{k}] comes into the body between nodes {passed[0]} and {passed[1]}: refine the boundary there"
            )


def _refuse_image(iterate: Iterate) -> None:
    """Refuse bodies in the mirror image of a tool that a plane of symmetry does not cut: it is no part of the scene."""
    increment, scene = iterate.increment, iterate.increment.system.body.scene
    for plane in scene.planes:
        for k, tool in enumerate(scene.tools):
            if not plane.cuts(tool):
                at = scene.mesh.boundary_nodes(*tool.candidates)
                x = increment.start.nodes[at] + iterate.response.du[at]
                x[:, plane.direction] = 2 * plane.position - x[:, plane.direction]
                depth = -float(tool.distance(x, increment.placed_before[k] + iterate.tool_travel[k]).min())
                if depth > TOUCHES * scene.mesh.size:
                    raise NotConverged(
                        f"the mirror image of tools[{k}] beyond x_{plane.direction} = {plane.position:g} is"
                        f" {depth:.2g} deep in the body: it is to be a tool of the scene"
                    )
