r"""Tools in space that are inside the body where no candidate touches them: between the nodes of a face.

This is the check of :mod:`bipot.scene.between` for faces. A face is represented by the triangles between its outline
and its middle; L is its longest edge. No part of a tool may come more than DEPTH L, or DEPTH times the tool's
thickness, behind any face: not at rest, not at the end of an increment, and not on the straight way to it from the
start, which is checked in steps no longer than that depth or the distance from the faces. Three things are checked:

* the gap at points of the triangles, dense enough for tools :data:`THIN` L thick; thinner tools are refused;
* spheres inscribed in the tool (:class:`~bipot.tools.surfaces.Tips`) with centres off the body, at the nearest place of
  each triangle;
* such spheres with centres in the body (by the solid angle of its surface), as at tips of cones or on rings of edges
  and fillets around an axis: they are too deep if they reach farther behind the nearest triangle than allowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bipot.errors import require
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.scene.between import DEPTH, Ends, first_of, uncut
from bipot.scene.symmetry import Mirror
from bipot.tensors import norm
from bipot.tools.surfaces import Plane, Surface, Tips
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Ints, einsum

THIN = 0.25
"""Thickness over a candidate's longest edge: thinner tools might pass unnoticed between the points of its faces."""

PARTS = 6
"""Parts into which the points divide the sides of a triangle."""

SHARP = 1e-6
"""Over the allowed depth of a tool: a point up to so far outside the tool counts as part of it."""

STEPS = 256
"""Largest number of steps in an increment; longer motions are checked less densely."""


@dataclass(frozen=True)
class Skin:
    """The whole body's surface: outlines of faces, ``rings`` (f, m), anticlockwise, and ``planes`` of symmetry."""

    rings: Ints
    planes: Sequence[Mirror]

    @staticmethod
    def of(mesh: Mesh, planes: Sequence[Mirror]) -> Skin:
        """The surface of the modelled part without what is in a plane of symmetry."""
        faces = uncut(mesh, planes)
        return Skin(faces[:, _around(faces.shape[1])], planes)

    def triangles(self, nodes: Floats) -> Floats:
        """Triangles (f', m, 3, 3) between outlines of the whole body's faces and their middles, by ``nodes`` (a, 3)."""
        ring = nodes[self.rings]
        middle = np.broadcast_to(ring.mean(axis=1, keepdims=True), ring.shape)
        out = np.stack([ring, np.roll(ring, -1, axis=1), middle], axis=2)
        for plane in self.planes:
            out = np.concatenate([out, plane.images(out[:, :, [1, 0, 2]])])
        return out

    def inside(self, tool: Tool, nodes: Floats, pose: Floats) -> Ends | None:
        """Two nodes of a face behind which the tool in the ``pose`` (6,) is too deep, or None."""
        if isinstance(tool.face, Plane):
            return None
        return first_of(self.rings, _deep(tool.own(self.triangles(nodes), pose), tool.face))

    def between(self, tool: Tool, start: Floats, end: Floats, poses: Floats) -> Ends | None:
        """Two nodes of a face behind which the tool gets too deep as nodes go from ``start`` to ``end``, or None.

        The tool moves from the first to the second of the ``poses`` (2, 6).
        """
        if isinstance(tool.face, Plane):
            return None
        before, after = (tool.own(self.triangles(x), pose) for x, pose in zip((start, end), poses, strict=True))
        moved = norm(after - before).max(axis=(1, 2))
        deep = np.zeros(len(before), dtype=bool)
        near = _off(before, tool.face) <= moved
        if not near.any():
            return None
        allowed, done = _allowed(after, tool.face.tips())[near], 0.0
        for left in range(STEPS, 0, -1):
            # A gap shrinks by no more than the motion: until then nothing is deep.
            free = np.maximum(_off((1 - done) * before[near] + done * after[near], tool.face), allowed)
            part = np.divide(free, moved[near], out=np.ones_like(free), where=moved[near] > free)
            done = min(done + max(float(part.min()), (1 - done) / left), 1.0)
            deep |= _deep((1 - done) * before + done * after, tool.face)
            if done == 1.0:
                break
        return first_of(self.rings, deep)


def require_thick(mesh: Mesh, tool: Tool, label: str) -> None:
    """Refuse a tool so thin that it might enter the body unnoticed."""
    faces = mesh.edges(*tool.candidates)
    longest = float(_longest(mesh.nodes[faces[:, _around(faces.shape[1])]]).max())
    thickness = tool.face.tips().thickness
    allowed = f"{THIN * longest:.3g} thick or more, not {thickness:.3g}: {THIN:g} of its candidates' longest edge"
    require(thickness >= THIN * longest, f"{label}.surface", tool.face, allowed)


def _points(triangles: Floats) -> Floats:
    """Points (f, m, p, 3) spread over triangles (f, m, 3, 3)."""
    return einsum("pk,fmkd->fmpd", PLACES, triangles)


def _around(nodes: int) -> Ints:
    """The columns of a face with this number of ``nodes`` in their order around it."""
    return Element.of(nodes).edges[:, :-1].ravel()


def _longest(rings: Floats) -> Floats:
    """Longest sides (f,) of outlines (f, m, 3)."""
    return norm(np.roll(rings, -1, axis=1) - rings).max(axis=1)


def _allowed(triangles: Floats, tips: Tips) -> Floats:
    """How deep (f,) a tool may be behind faces (f, m, 3, 3)."""
    return DEPTH * np.minimum(_longest(triangles[:, :, 0]), tips.thickness)


def _off(triangles: Floats, surface: Surface) -> Floats:
    """Lower bounds (f,) of the distance of faces (f, m, 3, 3) from the tool, by their middles."""
    middle = triangles[:, 0, 2]
    return surface.distance(middle).gap - norm(triangles[:, :, 0] - middle[:, None]).max(axis=1)


def _deep(triangles: Floats, surface: Surface) -> Bools:
    """Behind which faces, as triangles (f, m, 3, 3) seen from the tool, it is too deep."""
    tips = surface.tips()
    allowed = _allowed(triangles, tips)
    out = np.zeros(len(triangles), dtype=bool)
    near = _off(triangles, surface) <= 0
    out[near] = -surface.distance(_points(triangles[near])).gap.min(axis=(1, 2), initial=np.inf) > allowed[near]
    out[near] |= _dented(triangles[near], surface, allowed[near])
    corners = triangles.reshape(-1, 3)
    boxed = ((tips.centre > corners.min(axis=0)) & (tips.centre < corners.max(axis=0))).all(axis=1)
    # At a sharp corner of the tool the gap is zero but for round-off.
    boxed &= surface.distance(tips.centre).gap <= SHARP * allowed.max()
    for centre, radius in zip(tips.centre[boxed], tips.radius[boxed], strict=True):
        if _around_it(triangles, centre) > 2 * np.pi:
            # The tool came in through the nearest face.
            far = norm(_points(triangles) - centre).min(axis=(1, 2))
            face = int(np.argmin(far))
            out[face] |= bool(radius + far[face] > allowed[face])
    return out


def _dented(triangles: Floats, surface: Surface, allowed: Floats) -> Bools:
    """Which faces (f, m, 3, 3) a sphere of the tool, its centre off the body, comes deeper behind than ``allowed``."""
    tips, out = surface.tips(), np.zeros(len(triangles), dtype=bool)
    for centre, radius in zip(tips.centre, tips.radius, strict=True) if len(triangles) else ():
        place = _nearest(triangles.reshape(-1, 3, 3), centre)
        way = place - centre
        far = norm(way)
        deep = (far > 0) & (radius - far > np.repeat(allowed, triangles.shape[1]))
        if deep.any():
            deepest = centre + radius * way[deep] / far[deep, None]
            # This point of the sphere may be outside the tool.
            deep[deep] = surface.distance(deepest).gap <= SHARP * allowed.max()
            out |= deep.reshape(len(triangles), -1).any(axis=1)
    return out


def _nearest(triangles: Floats, point: Floats) -> Floats:
    """The place (t, 3) on each triangle (t, 3, 3) that is nearest to the point (3,)."""
    along = np.roll(triangles, -1, axis=1) - triangles
    lengths = np.maximum(np.vecdot(along, along), np.finfo(float).tiny)
    part = np.clip(np.vecdot(point - triangles, along) / lengths, 0.0, 1.0)
    places = triangles + part[..., None] * along
    which = np.argmin(norm(places - point), axis=1)
    out = places[np.arange(len(places)), which]
    normal = np.cross(along[:, 0], along[:, 1])
    inside = (np.vecdot(np.cross(along, point - triangles), normal[:, None]) > 0).all(axis=1)
    normal = normal[inside] / norm(normal[inside])[:, None]
    out[inside] = point - np.vecdot(point - triangles[inside, 0], normal)[:, None] * normal
    return out


def _around_it(triangles: Floats, centre: Floats) -> float:
    """The solid angle of a closed surface of triangles (f, m, 3, 3) as seen from a point: 4 pi inside, 0 outside."""
    a, b, c = np.moveaxis(triangles - centre, 2, 0)
    one, two, three = norm(a), norm(b), norm(c)
    volume = np.vecdot(a, np.cross(b, c))
    beside = one * two * three + np.vecdot(a, b) * three + np.vecdot(b, c) * one + np.vecdot(c, a) * two
    return float(2 * np.arctan2(volume, beside).sum())


def _places() -> Floats:
    """Barycentric coordinates (p, 3) of the points of a triangle."""
    i, j = np.meshgrid(np.arange(PARTS + 1), np.arange(PARTS + 1))
    inside = i + j <= PARTS
    return np.stack([i[inside], j[inside], PARTS - i[inside] - j[inside]], axis=1) / PARTS


PLACES = _places()
