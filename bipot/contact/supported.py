"""Supports against tools: known slips of held nodes, welds torn by supports, and tools driven into held nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import ROUND_OFF, TOUCHES, touches
from bipot.tensors import norm, unit
from bipot.tools.surfaces import across
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Ints

ALIGNED = 1e-9
"""A tangential motion below this fraction of the motions of tool and support is round-off."""


class DrivenInto(NamedTuple):
    """A tool, a held node in it, and how deep (length, 0 where there is none)."""

    tool: int
    node: int
    depth: float


class Touching(NamedTuple):
    """Where an increment starts: the ``closed`` (c,), nodes (a, d), and the poses ``placed`` (k, p) of the tools.

    These change by the ``path`` (k, p).
    """

    closed: Bools
    nodes: Floats
    placed: Floats
    path: Floats

    def gone(self, tool: Tool, number: int, nodes: Ints) -> Floats:
        """How far (n, d) the tool of that ``number`` takes its points at some ``nodes`` (n,)."""
        x, advance = self.nodes[nodes], self.path[number]
        return advance[: x.shape[1]] + tool.swept(x, self.placed[number], advance)


def driven_into(candidates: Candidates, placed: Floats, driven: Floats) -> DrivenInto:
    """The tool that is deepest in a node which supports hold along the tool's normal, so that no motion can resolve it.

    Tools are in the poses ``placed`` (k, p), and held nodes are displaced by ``driven`` (a, d).
    """
    worst, nodes_at = DrivenInto(0, 0, 0.0), candidates.scene.mesh.nodes + driven
    for k, (tool, nodes, pose) in enumerate(zip(candidates.scene.tools, candidates.held, placed, strict=True)):
        if not len(nodes):
            continue
        held = nodes_at[nodes]
        # Depth is a difference of two places, and their round-off is no depth.
        depth = -tool.distance(held, pose) - ROUND_OFF * tool.places(held, pose)
        depth[tool.face.beyond(tool.own(held, pose))] = 0.0
        if depth.max() > worst.depth:
            worst = DrivenInto(k, int(nodes[np.argmax(depth)]), float(depth.max()))
    return worst


def dragged(candidates: Candidates, travel: Floats, driven: Floats) -> Floats:
    """Slips (c, d - 1) along tangents that supports fully hold or drive; zero elsewhere, and if the motion is normal.

    Tools ``travel`` (k, d) along their paths, and supports displace held nodes by ``driven`` (a, d).
    """
    if not candidates.tangent_held.any():
        return np.zeros((len(candidates.node), candidates.scene.mesh.dimension - 1))
    drawn = candidates.met.motion(driven)
    moved = candidates.approach(travel, drawn)
    # Relative to the motions of both, so that round-off is no slip where they move together.
    lengths = norm(travel)[candidates.tool] + candidates.parts.averaged(norm(drawn))
    small = norm(moved[:, 1:]) <= ALIGNED * lengths
    return np.where((candidates.tangent_held & ~small)[:, None], -moved[:, 1:], 0.0)


def rubbed(r: Floats, limit: Callable[[], Floats], dragged: Floats) -> Floats:
    """Contact forces r (c, d) with the friction -s slip/|slip| where the slip ``dragged`` (c, d - 1) is known.

    s (c,) by ``limit`` is asked for only there: few scenes have such slips.
    """
    if not dragged.any():
        return r
    out = r.copy()
    out[:, 1:] -= limit()[:, None] * unit(dragged)
    return out


def torn(candidates: Candidates, start: Touching, travel: Floats, driven: Floats) -> int | None:
    """A node in touch with a welded tool that a support drives off it, or along it; None if there is none.

    Where supports hold a node fast and what drives the tool moves it along that alone, no unknown would feel the weld.
    ``start`` is where the increment starts, ``travel`` and ``driven`` as in :func:`dragged`.
    """
    size = candidates.scene.size
    led = _led_off(candidates, start, driven) | _held_apart(candidates, driven)
    slipping = dragged(candidates, travel, driven).any(axis=1) | led
    off_weld = candidates.welded & start.closed & slipping
    if off_weld.any():
        return int(candidates.node[np.argmax(off_weld)])
    for k, (tool, held) in enumerate(zip(candidates.scene.tools, candidates.held, strict=True)):
        apart = norm(_across(tool, driven[held] - start.gone(tool, k, held))) > TOUCHES * size
        ways = candidates.scene.drives.along(k, tool.arm(start.nodes[held], start.placed[k]))
        apart |= (norm(ways) > ALIGNED).any(axis=0)
        near = touches(tool.distance(start.nodes[held], start.placed[k]), size)
        if tool.welded and (apart & near).any():
            return int(held[apart & near][0])
    return None


def _led_off(candidates: Candidates, start: Touching, driven: Floats) -> Bools:
    """Candidates (c,) that supports hold or drive, along some direction, differently from the motion of their tool.

    Of nodes, at tools that nothing drives: a force or a moment may take its tool to where the node is.
    """
    scene, node = candidates.scene, candidates.node
    gone, led = np.zeros((len(node), scene.mesh.dimension)), np.zeros(len(node), dtype=bool)
    for k, (tool, points) in enumerate(zip(scene.tools, candidates.points, strict=True)):
        own = candidates.tool == k
        gone[own] = start.gone(tool, k, node[own])
        led[own] = not (points.in_means or tool.driven_by or tool.turned_by)
    off = np.where(scene.holding.held[node], scene.holding.axes.at(node, driven[node] - gone), 0.0)
    return led & (norm(off) > ALIGNED * (norm(gone) + norm(driven[node])))


def _held_apart(candidates: Candidates, driven: Floats) -> Bools:
    """Candidates (c,) at deformable tools of which supports hold both sides, and move one against the other."""
    if not candidates.deformable:
        return np.zeros(len(candidates.node), dtype=bool)
    free = ~candidates.scene.holding.held.all(axis=1)
    held = candidates.means.weights.astype(bool) @ free == 0
    apart = norm(candidates.means.motion(driven)) > ALIGNED * norm(driven).max()
    return candidates.between & held & apart


def _across(tool: Tool, motion: Floats) -> Floats:
    """The part of motions (…, d) that is not along a free coordinate of a driven tool."""
    if tool.turned_by is not None:
        return np.zeros_like(motion)
    if tool.driven_by is None:
        return motion
    return across(motion, tool.driven_by.direction)
