"""Tools of drawn scenes: seen in other units or in a mirror, and read as outlines of the study's own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bipot.scene.supports import Prescribed, Support
from bipot.tools.circle import Circle
from bipot.tools.deformable import AnyTool
from bipot.tools.profiles import Profile, Union
from bipot.tools.surfaces import Plane, Surface
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from studies.independent.chains import chain, disc, half_plane
from studies.independent.outline import Outline
from studies.independent.tools import turning

FLAT = 1e-9
"""A normal with less than this along a direction has none: a plane of symmetry across that cuts the tool."""

ROUND, AWAY = 96, 3.0
"""Directions, and radii over the length that a plane of symmetry is near, in which outlines are compared in it."""


@dataclass(frozen=True)
class Seen:
    """x becomes (``matrix`` x + ``shift``) ``length``: other units, a mirror image, or turned about the origin."""

    matrix: Floats
    shift: Floats
    length: float = 1.0

    @staticmethod
    def scaled(length: float) -> Seen:
        """In units of which a length has so many more."""
        return Seen(np.eye(2), np.zeros(2), length)

    @staticmethod
    def turned(angle: float) -> Seen:
        """By an angle anticlockwise."""
        return Seen(turning(angle), np.zeros(2))

    @staticmethod
    def mirrored(direction: int, position: float = 0.0) -> Seen:
        """In the plane x_direction = position."""
        across = np.arange(2) == direction
        return Seen(np.diag(np.where(across, -1.0, 1.0)), np.where(across, 2 * position, 0.0))

    @property
    def turns(self) -> float:
        """What angles are multiplied by."""
        return float(np.sign(np.linalg.det(self.matrix)))

    def points(self, x: Floats) -> Floats:
        """Places (a, 2)."""
        return (x @ self.matrix.T + self.shift) * self.length

    def point(self, x: tuple[float, ...]) -> tuple[float, float]:
        """A place."""
        return pair(self.points(np.array(x)))

    def way(self, v: tuple[float, ...], length: float = 1.0) -> tuple[float, float]:
        """A direction, or a vector with components in units of a ``length``."""
        return pair(self.matrix @ v * length)

    def surface(self, surface: Surface) -> Surface:
        """A surface."""
        if isinstance(surface, Plane):
            return Plane(self.point(surface.point), self.way(surface.normal))
        if isinstance(surface, Circle):
            return Circle(self.point(surface.centre), surface.radius * self.length, surface.concave)
        if isinstance(surface, Union):
            return Union(tuple(self.surface(part) for part in surface.surfaces))
        if isinstance(surface, Profile):
            # In a mirror the tool is on the other side, unless its line is followed the other way.
            step = 1 if self.turns > 0 else -1
            fillets = tuple(radius * self.length for radius in radii(surface))[::step]
            return Profile(tuple(self.point(x) for x in surface.points)[::step], fillets, surface.closed)
        raise TypeError(f"no surface known: {surface!r}")

    def tool(self, tool: AnyTool, force: float = 1.0) -> AnyTool:
        """A tool, forces in units of which one has ``force`` more."""
        led, path = tool.driven_by, self._path(tool)
        push = None if led is None else replace(led, vector=self.way(led.vector, force))
        if isinstance(tool, FlatTool):
            place = self.point(tool.point), self.way(tool.normal)
            return replace(tool, point=place[0], normal=place[1], **path, driven_by=push)
        turn = tool.turn
        if turn is not None:
            moment = turn.driven_by
            if moment is not None:
                moment = replace(moment, value=self.turns * moment.value * force * self.length + 0.0)
            turn = replace(turn, angle=self.turns * turn.angle + 0.0, centre=self.point(turn.centre), driven_by=moment)
        return replace(tool, surface=self.surface(tool.face), **path, turn=turn, driven_by=push)

    def _path(self, tool: AnyTool) -> dict[str, Any]:
        """Travel and path: turned, multiples of each component of the travel are those of others."""
        if self.straight or all(np.size(multiple) == 1 for _, multiple in tool.path):
            return {"travel": self.way(tool.travel, self.length)}
        size = float(np.abs(tool.travel).max()) or 1.0
        path = tuple((tau, self.way(tuple(np.multiply(m, tool.travel) / size))) for tau, m in tool.path)
        return {"travel": (size * self.length, size * self.length), "path": path}

    def support(self, support: Support) -> Support:
        """A support, or one that moves."""
        along = support.direction
        if isinstance(along, int) and not self.straight:
            along = pair(np.eye(2)[along])
        far = {}
        if isinstance(support, Prescribed):
            way = self.length if not isinstance(along, int) else self.length * float(self.matrix[along, along])
            far = {"displacement": support.displacement * way + 0.0}
        return replace(support, direction=along if isinstance(along, int) else self.way(along), **far)

    @property
    def straight(self) -> bool:
        """Whether axes stay along axes, each along its own."""
        return not (self.matrix * (1 - np.eye(2))).any()


def pair(vector: Floats) -> tuple[float, float]:
    """Two numbers, without signed zeros: they are other numbers to whoever compares representations."""
    return float(vector[0]) + 0.0, float(vector[1]) + 0.0


def radii(profile: Profile) -> tuple[float, ...]:
    """The fillets of a profile's inner corners."""
    count = len(profile.points) - 2 * (not profile.closed)
    return profile.fillets if isinstance(profile.fillets, tuple) else (profile.fillets,) * count


def outlines(surface: Surface) -> tuple[Outline, ...]:
    """The study's own outlines of a surface, from what it was made of."""
    if isinstance(surface, Plane):
        return (half_plane(surface.point, surface.normal),)
    if isinstance(surface, Circle):
        return (disc(surface.centre, surface.radius, surface.concave),)
    if isinstance(surface, Profile):
        return (chain(surface.points, radii(surface), surface.closed),)
    if isinstance(surface, Union):
        return tuple(outline for part in surface.surfaces for outline in outlines(part))
    raise TypeError(f"no surface known: {surface!r}")


def cut(tool: AnyTool, direction: int, position: float) -> bool:
    """Whether the tool is its own mirror image in the plane x_direction = position: its own outlines say so."""
    if isinstance(tool, FlatTool):
        return abs(tool.normal[direction]) < FLAT
    own = outlines(tool.face)
    size = max(outline.extent for outline in own)
    angle = np.linspace(0.0, 2 * np.pi, ROUND, endpoint=False)
    middle = np.where(np.arange(2) == direction, position, own[0].centroid)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    x = middle + size * np.linspace(0.1, AWAY, 8)[:, None, None] * around
    image = np.where(np.arange(2) == direction, 2 * position - x, x)
    gaps = [np.min([o.near(at.reshape(-1, 2)).gap for o in own], axis=0) for at in (x, image)]
    return bool(np.abs(gaps[0] - gaps[1]).max() <= FLAT * size)
