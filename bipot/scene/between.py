r"""Tools inside the body where no candidate touches them: between two nodes, beside them, or beyond them.

The law is posed at nodes. A convex part of a tool, an arc of radius rho around c (rho = 0 for a corner), may pass
through an edge that is longer while both ends of the edge are open. Its depth is

    rho - d        where c is at the distance d off the surface, rho + d where c is at the depth d in the body.

Between nodes that are outside it and at most 1.6 rho apart, a circle is less than 0.4 rho deep. No part may come more
than :data:`DEPTH` L behind an edge of length L, or DEPTH times the tool's thickness behind any edge: not at rest, not
at the end of an increment, and not on the straight way to it from the start. The surface is that of the whole body,
candidates or not, with its mirror images beyond planes of symmetry and beyond the axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.symmetry import Mirror
from bipot.tensors import norm
from bipot.tools.plane import angle_between, leftwards
from bipot.tools.surfaces import Surface, Tips
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Ints

DEPTH = 0.25
"""Largest depth of a tool in the body, over the length of an edge (the longest of a face) or the tool's thickness."""

ON = 1e-6
"""Over an edge's length: a point up to so far outside the tool is on it, one up to so far past an end is at the end."""

SAMPLES = 9
"""Points on an edge at which its depth in the tool is sampled."""

STEPS, HALVINGS = 8, 40
"""Steps of an increment, in each of which a part enters at most once; halvings of one to find when it is too deep."""


def uncut(mesh: Mesh, planes: Sequence[Mirror]) -> Ints:
    """Edges or faces (f, n) of the modelled part's surface that are in none of the planes."""
    facets = mesh.outline
    cut = [plane.holds(mesh.nodes[facets]).all(axis=1) for plane in planes]
    return facets[~np.any(cut, axis=0)] if cut else facets


@dataclass(frozen=True)
class Surroundings:
    """The whole body's surface: ``lines`` (f, 2) between neighbouring nodes, anticlockwise, and ``planes`` of symmetry.

    For a ``ring`` the last plane is that through its axis.
    """

    lines: Ints
    planes: Sequence[Mirror]
    ring: bool

    @staticmethod
    def of(mesh: Mesh, planes: Sequence[Mirror], ring: bool) -> Surroundings:
        """The surface of the modelled part without what is in a plane of symmetry."""
        edges = uncut(mesh, planes)
        return Surroundings(np.vstack([edges[:, k : k + 2] for k in range(edges.shape[1] - 1)]), planes, ring)

    def ends(self, nodes: Floats) -> Floats:
        """Ends (f', 2, d) of the whole body's segments for the modelled part's ``nodes`` (a, d)."""
        out = nodes[self.lines]
        for plane in self.planes:
            out = np.concatenate([out, plane.images(out[:, ::-1])])
        return out

    def inside(self, tool: Tool, nodes: Floats, pose: Floats) -> Ends | None:
        """Two neighbours on the surface behind which a part of the tool is too deep, or None.

        Nodes are at ``nodes`` (a, d), the tool is in the ``pose`` (p,).
        """
        tips = tool.face.tips()
        if not len(tips.radius):
            return None
        ends = tool.own(self.ends(nodes), pose)
        return first_of(self.lines, self._deep(ends, tips, tool.face))

    def between(self, tool: Tool, start: Floats, end: Floats, poses: Floats) -> Ends | None:
        """Two neighbours on the surface between which a part of the tool comes in, or None.

        Nodes move from ``start`` to ``end`` (a, d), the tool from the first to the second of the ``poses`` (2, 3).
        """
        tips = tool.face.tips()
        if not len(tips.radius):
            return None
        before, after = tool.own(self.ends(start), poses[0]), tool.own(self.ends(end), poses[1])
        return first_of(self.lines, self._deep(after, tips, tool.face) | _passed(before, after, tips, tool.face))

    def _deep(self, ends: Floats, tips: Tips, surface: Surface) -> Bools:
        """Which segments (f', 2, d) have a tip too deep behind them, or are too deep in the tool."""
        out = _behind(ends, tips, surface)
        here = slice(len(ends) // 2 if self.ring else len(ends))
        out[here] |= _sunk(ends[here], tips, surface)
        return out


class Ends(NamedTuple):
    """Two nodes of an edge or face; ``mirrored`` where it is their mirror images that are meant."""

    one: int
    other: int
    mirrored: bool = False

    def __str__(self) -> str:
        return f"{'the mirror images of ' * self.mirrored}nodes {self.one} and {self.other}"


def first_of(outlines: Ints, found: Bools) -> Ends | None:
    """Two nodes far apart on the first of the ``outlines`` (f, m) that was ``found`` (f',) on it or on an image."""
    if not found.any():
        return None
    first = int(np.argmax(found))
    nodes = outlines[first % len(outlines)]
    return Ends(int(nodes[0]), int(nodes[len(nodes) // 2]), first >= len(outlines))


class _Place(NamedTuple):
    """Where tips (m,) are by segments (f,): the ``foot`` (f, m) of c, 0 to 1 between the segment's ends, the ``height``
    (f, m) of c above the segment's line, positive outside, and the ``allowed`` depth (f, m).
    """

    foot: Floats
    height: Floats
    allowed: Floats

    @staticmethod
    def of(ends: Floats, tips: Tips) -> _Place:
        """The place by segments with these ``ends`` (f, 2, d)."""
        along, way = ends[:, 1] - ends[:, 0], tips.centre - ends[:, :1]
        length = norm(along)[:, None]
        outward = -leftwards(along)[:, None]
        allowed = DEPTH * np.minimum(length, tips.thickness)
        return _Place(np.vecdot(way, along[:, None]) / length**2, np.vecdot(way, outward) / length, allowed)


def _behind(ends: Floats, tips: Tips, surface: Surface) -> Bools:
    """Which segments (f, 2, d) have a tip too deep behind them."""
    place, along = _Place.of(ends, tips), ends[:, 1] - ends[:, 0]
    nearest = ends[:, :1] + np.clip(place.foot, 0.0, 1.0)[..., None] * along[:, None]
    way = nearest - tips.centre
    far = norm(way)
    one, other = ends[:, :1] - tips.centre, ends[:, 1:] - tips.centre
    turned = angle_between(one, other).sum(axis=0)
    # Whether a centre is in the body does not depend on the segment; its depth is that behind the nearest one.
    near, inner = far == far.min(axis=0), (turned > np.pi) & (surface.distance(tips.centre).gap <= 0)
    out = inner & near & (tips.radius + far > place.allowed)
    for f, m in np.argwhere(~inner & (tips.radius - far > place.allowed)).tolist():
        deepest = tips.centre[m] + tips.radius[m] * way[f, m] / max(far[f, m], np.finfo(float).tiny)
        # This point of the arc's circle may be outside the tool.
        out[f, m] = float(surface.distance(deepest).gap) <= ON * float(norm(along[f]))
    return out.any(axis=1)


def _sunk(ends: Floats, tips: Tips, surface: Surface) -> Bools:
    """Which segments (f, 2, d) are too deep in the tool somewhere."""
    s = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    gap = surface.distance((1 - s) * ends[:, None, 0] + s * ends[:, None, 1]).gap.min(axis=1)
    return -gap > DEPTH * np.minimum(norm(ends[:, 1] - ends[:, 0]), tips.thickness)


def _passed(start: Floats, end: Floats, tips: Tips, surface: Surface) -> Bools:
    """Which segments (f,) that go from ``start`` to ``end`` (f, 2, d) are passed by a tip."""
    out = np.zeros(len(start), dtype=bool)
    times = np.linspace(0.0, 1.0, STEPS + 1)
    above = np.array([_above((1 - s) * start + s * end, tips) for s in times])
    step, f, m = np.nonzero((above[:-1] >= 0) & (above[1:] < 0))
    early, late = times[step], times[step + 1]
    one, other = start[f], end[f]
    # One tip for each segment, in the shape of tips for all segments.
    tip = Tips(tips.centre[m, None], tips.radius[m, None], tips.thickness)
    for _ in range(HALVINGS if len(f) else 0):
        when = (early + late) / 2
        still = _above(_between(one, other, when), tip)[:, 0] >= 0
        early, late = np.where(still, when, early), np.where(still, late, when)
    ends = _between(one, other, late)
    foot = _Place.of(ends, tip).foot[:, 0]
    on = (foot >= -ON) & (foot <= 1 + ON)
    passed = f[on][_holds(surface, ends[on], tips.centre[m[on]], tips.radius[m[on]])]
    out[passed] = True
    return out


def _between(start: Floats, end: Floats, when: Floats) -> Floats:
    """Segments (n, 2, d) on their way from ``start`` to ``end`` at the times (n,)."""
    s = when[:, None, None]
    return (1 - s) * start + s * end


def _above(ends: Floats, tips: Tips) -> Floats:
    """How much deeper (f, m) the tips may come behind the lines through segments (f, 2, d)."""
    place = _Place.of(ends, tips)
    return place.height - tips.radius + place.allowed


def _holds(surface: Surface, ends: Floats, centre: Floats, radius: Floats) -> Bools:
    """Whether the deepest point of each circle (n, d), (n,) behind its segment, ``ends`` (n, 2, d), is in the tool."""
    along = ends[:, 1] - ends[:, 0]
    length = norm(along)
    outward = -leftwards(along) / length[:, None]
    return surface.distance(centre - radius[:, None] * outward).gap <= ON * length
