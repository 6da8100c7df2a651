r"""How deep tools are in the body, and the body in tools, anywhere on their surfaces: nothing of the library.

The body is what the closed line through the nodes of its surface goes around, with its mirror images; the tool's
outline is sampled densely. Of a place of the one in the other the depth is its distance from the surface of that: no
more than a quarter of the surface's edge there, nor of the tool's thickness. On a meridian no place beyond the axis is
asked: what is there is the mirror image of what goes around.
"""

from __future__ import annotations

import numpy as np

from studies.independent.data import Floats, Ints, Setting
from studies.independent.outline import angle_of
from studies.independent.tools import Rigid

ALLOWED = 0.25
"""Of an edge, or of the tool's thickness."""

COUNT = 129
"""Places on each piece of an outline, and a quarter of it on each segment of the body."""


def between(s: Setting, tools: tuple[Rigid, ...], nodes: Floats) -> float:
    """Largest depth over the one allowed, of convex tools at the end, the body's nodes at ``nodes`` (a, 2)."""
    convex = [tool for tool in tools if any((outline.turn > 0).any() for outline in tool.outlines)]
    if not convex:
        return 0.0
    ends = whole(s, nodes)
    ring = s.axisymmetric
    own = ends[ends[:, :, 0].min(axis=1) >= 0] if ring else ends
    return max(max(_in_body(ends, tool, ring), _in_tool(own, tool)) for tool in convex)


def whole(s: Setting, nodes: Floats) -> Floats:
    """Segments (f, 2, 2) of the whole body's surface, anticlockwise."""
    out = nodes[s.surface]
    for direction, position in s.mirrors:
        image = out[:, ::-1].copy()
        image[..., direction] = 2 * position - image[..., direction]
        out = np.concatenate([out, image])
    return out


def surface_of(elements: Ints, mirrors: list[Ints]) -> Ints:
    """Pairs (f, 2) of neighbours on the surface, with the body on the left, of ``elements`` (e, k).

    Edges of which all nodes are in one of the ``mirrors`` are left out.
    """
    count = elements.shape[1]
    corners = np.arange(3 if count in (3, 6) else 4)
    local = np.column_stack([corners, corners + len(corners), np.roll(corners, -1)][:: 2 if count < 6 else 1])
    every = elements[:, local].reshape(-1, local.shape[1])
    _, first, seen = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    outer = every[np.sort(first[seen == 1])]
    for nodes in mirrors:
        outer = outer[~np.isin(outer, nodes).all(axis=1)]
    return np.vstack([outer[:, k : k + 2] for k in range(outer.shape[1] - 1)])


def _in_body(ends: Floats, tool: Rigid, ring: bool) -> float:
    """Of places of the tool."""
    reach = 2 * float(np.ptp(ends.reshape(-1, 2), axis=0).max())
    worst = 0.0
    for outline in tool.outlines:
        if not (outline.turn > 0).any():
            continue
        x = tool.placed(outline.places(COUNT, reach), tool.ended)
        x = x[x[:, 0] >= 0] if ring else x
        # What another outline of the tool covers is none of its surface, but no less in the body.
        out = ends[:, None] - x[:, None]
        turned = angle_of(out[:, :, 0], out[:, :, 1]).sum(axis=0)
        inner = x[turned > np.pi]
        if len(inner):
            far, length = _far(ends, inner)
            nearest = np.argmin(far, axis=0)
            allowed = ALLOWED * np.minimum(length[nearest], outline.thick)
            worst = max(worst, float((far.min(axis=0) / allowed).max()))
    return worst


def _in_tool(ends: Floats, tool: Rigid) -> float:
    """Of places of the body."""
    part = np.linspace(0.0, 1.0, COUNT // 4)[:, None]
    x = ends[:, None, 0] + part * (ends[:, None, 1] - ends[:, None, 0])
    near, _ = tool.near(tool.seen(x.reshape(-1, 2), tool.ended))
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    allowed = ALLOWED * np.minimum(length, min(outline.thick for outline in tool.outlines))
    return float((-near.gap.reshape(len(ends), -1) / allowed[:, None]).max(initial=0.0))


def _far(ends: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Distances (f, k) of points x (k, 2) from segments (f, 2, 2), and lengths (f,) of these."""
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    out = x - ends[:, :1]
    foot = np.clip(np.vecdot(out, along[:, None]) / length[:, None] ** 2, 0.0, 1.0)
    return np.linalg.norm(out - foot[..., None] * along[:, None], axis=-1), length
