r"""Tools that come into the body between two nodes, where no candidate feels them.

The law is posed at nodes. A convex part of a tool, a circle of radius rho around c (rho = 0 where it is a corner), that
is smaller than an edge goes through it while both its ends are open. Of an edge that runs anticlockwise around its body
from a to b, of length L, with the outward normal n, the part is as deep as

    rho - n . (c - a)

behind the edge. What nodes outside the circle let it come in by is less than :data:`DEPTH` L where L < 1.6 rho: only
larger edges are passed. The edge and the part go straight from the start of an increment to its end, and the edge is
passed where the part gets deeper than DEPTH L on the way, at a foot between a and b.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bipot.mesh import Mesh
from bipot.surfaces import Tips
from bipot.tensors import norm
from bipot.tools import Tool
from bipot.typing import Bools, Floats, Ints

DEPTH = 0.25
"""Of an edge: deeper behind it no part of a tool may come between its nodes."""

HALVINGS = 40
"""Of an increment: when a part got too deep."""


def between(mesh: Mesh, tool: Tool, start: Floats, end: Floats) -> tuple[int, int] | None:
    """Two candidates that a part of the tool comes between, or None.

    Relative to the tool, which rests, nodes go from ``start`` to ``end`` (a, d).
    """
    tips = tool.face.tips()
    if not len(tips.radius):
        return None
    lines = _segments(np.concatenate([mesh.surface(name)[0] for name in tool.candidates]))
    passed = _passed(start[lines], end[lines], tips)
    first = lines[np.argmax(passed)]
    return (int(first[0]), int(first[1])) if passed.any() else None


def inside(mesh: Mesh, tool: Tool) -> bool:
    """Whether at rest the centre of a part of the tool is in the body, and the part deep behind its surface."""
    tips, ends = tool.face.tips(), mesh.nodes[_segments(mesh.outline)]
    foot = np.clip(_Place.of(ends, tips).foot, 0.0, 1.0)
    along = ends[:, 1] - ends[:, 0]
    ways = ends[:, None] - tips.centre[:, None]
    near = norm(ways[:, :, 0] + foot[..., None] * along[:, None])
    one, other = ways[:, :, 0], ways[:, :, 1]
    turned = np.arctan2(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0], np.vecdot(one, other))
    deep = near.min(axis=0) + tips.radius > DEPTH * norm(along)[np.argmin(near, axis=0)]
    return bool((deep & (turned.sum(axis=0) > np.pi)).any())


def _segments(edges: Ints) -> Ints:
    """Pairs (f, 2) of neighbours on edges (f, n), which keep their direction."""
    return np.vstack([edges[:, k : k + 2] for k in range(edges.shape[1] - 1)])


class _Place(NamedTuple):
    """Where tips are from segments: ``above`` (f, m) what may be behind them, ``foot`` (f, m) in [0, 1] between."""

    above: Floats
    foot: Floats

    @staticmethod
    def of(ends: Floats, tips: Tips) -> _Place:
        """Of segments (f, 2, d)."""
        along, out = ends[:, 1] - ends[:, 0], tips.centre - ends[:, :1]
        length = norm(along)[:, None]
        outward = np.stack([along[:, 1], -along[:, 0]], axis=-1)
        height = np.vecdot(out, outward[:, None]) / length
        return _Place(height - tips.radius + DEPTH * length, np.vecdot(out, along[:, None]) / length**2)


def _passed(start: Floats, end: Floats, tips: Tips) -> Bools:
    """Which segments (f,) that go from ``start`` to ``end`` (f, 2, d) are passed by a tip."""
    out = np.zeros(len(start), dtype=bool)
    sinks = (_Place.of(start, tips).above >= 0) & (_Place.of(end, tips).above < 0)
    for f, m in np.argwhere(sinks).tolist():
        own, tip = slice(f, f + 1), Tips(tips.centre[m : m + 1], tips.radius[m : m + 1])
        early, late = 0.0, 1.0
        for _ in range(HALVINGS):
            when = (early + late) / 2
            above = _Place.of((1 - when) * start[own] + when * end[own], tip).above
            early, late = (when, late) if above.item() >= 0 else (early, when)
        foot = _Place.of((1 - late) * start[own] + late * end[own], tip).foot.item()
        out[f] |= 0 < foot < 1
    return out
