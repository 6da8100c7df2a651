"""Prisms as tools in space: dies, punches and wedges that have the same section all along.

With (s, t) the coordinates of a point along the two directions of the section's plane, the point is as far from the
prism as (s, t) is from the section. The surface of equal gaps is curved as the section is, and straight along it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_type
from bipot.paths import require_components, vector
from bipot.tensors import norm
from bipot.tools.plane import leftwards
from bipot.tools.surfaces import ACROSS, Distance, Plane, Surface, Tips, coordinates, direction, reflected
from bipot.typing import Bools, Floats, Vector

STATIONS = np.array([-1.0, 0.0, 1.0])
"""Where along a prism its section is drawn, over the reach."""


@dataclass(frozen=True)
class Extruded(Surface):
    """The infinite prism of a ``section`` in the plane through ``point`` along the unit vectors ``first``, ``second``.

    The section is a :class:`~bipot.tools.profiles.Profile`, a :class:`~bipot.tools.circle.Circle` or any other surface
    of a plane, whose two coordinates are the distances from the point along ``first`` and ``second``. By default these
    are the first and the third axis, and the prism goes along the second.

    Raises:
        SceneError: vectors that are not three finite numbers, directions that are no unit vectors or not at a right
            angle, a section that is no surface of a plane.

    >>> from bipot.tools.circle import Circle
    >>> rail = Extruded(Circle((0.0, 5.0), 2.0))
    >>> rail.distance(np.array([0.0, 7.0, 2.5])).gap
    np.float64(0.5)
    """

    section: Surface
    point: tuple[float, ...] = (0.0, 0.0, 0.0)
    first: tuple[float, ...] = (1.0, 0.0, 0.0)
    second: tuple[float, ...] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", vector(self.point, "extruded.point", LARGEST_LENGTH))
        for name in ("first", "second"):
            object.__setattr__(self, name, direction(getattr(self, name), f"extruded.{name}"))
        for name in ("point", "first", "second"):
            require_components(getattr(self, name), 3, f"extruded.{name}")
        square = abs(float(np.dot(self.first, self.second))) <= ACROSS
        require(square, "extruded.second", self.second, f"at a right angle to first = {self.first}")
        require_type(self.section, Surface, "extruded.section")
        plane = coordinates(self.section, "extruded.section") == 2
        require(plane, "extruded.section", self.section, "a surface of a plane: (along first, along second)")

    def distance(self, x: Floats) -> Distance:
        """As :meth:`bipot.tools.surfaces.Surface.distance`."""
        gap, normal, c = self.section.distance(self._place(x))
        across = leftwards(normal) @ self._axes
        return Distance(gap, normal @ self._axes, (c[..., None] * across)[..., None] * across[..., None, :])

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.gap`."""
        return self.section.gap(self._place(x), self._axes @ moved)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.size`."""
        own = self.section.size(self._place(x), self._axes @ moved)
        return np.maximum(np.abs(x).max(axis=-1), float(np.abs(self.point).max()) + own)

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.passed`."""
        return self.section.passed(self._place(x), by @ self._axes.T)[..., :1]

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.crossed`."""
        return self.section.crossed(self._place(x), by @ self._axes.T)

    def tips(self) -> Tips:
        """As :meth:`bipot.tools.surfaces.Surface.tips`: none, as of a roll, whose convex parts have no ends either."""
        return Tips(np.empty((0, 3)), np.empty(0), self.section.tips().thickness)

    def beyond(self, x: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.beyond`."""
        return self.section.beyond(self._place(x))

    def image(self, normal: Vector, position: float) -> Extruded:
        """As :meth:`bipot.tools.surfaces.Surface.image`."""
        ways = (reflected(way, normal, 0.0) for way in (self.first, self.second))
        return Extruded(self.section, reflected(self.point, normal, position), *ways)

    def same(self, other: Surface, roundoff: float) -> bool:
        """As :meth:`bipot.tools.surfaces.Surface.same`, in whatever directions each gives its section; planes as such.

        Its mirror images in planes across it, and in those of a symmetric section, are itself.
        """
        if not isinstance(other, Extruded):
            return False
        one, two = self._flat, other._flat
        if one is not None and two is not None:
            return one.same(two, roundoff)
        if float(norm(np.cross(self._along, other._along))) > ACROSS:
            return False
        turn, apart = self._axes @ other._axes.T, self._axes @ np.subtract(other.point, self.point)
        return self.section.same(_seen(other.section, turn, apart), roundoff)

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """As :meth:`bipot.tools.surfaces.Surface.lines`: sections, and straights between them."""
        beside = float(np.subtract(middle, self.point) @ self._along)
        out = list[Floats]()
        for line in self.section.lines(self._place(middle), reach):
            sections = self.straights(line, beside + reach * STATIONS).reshape(len(STATIONS), -1, 3)
            out += [*sections, *np.moveaxis(sections, 0, 1)]
        return out

    def straights(self, points: Floats, along: Floats = STATIONS) -> Floats:
        """Places (k n, 3) on the straights through ``points`` (n, 2) of the section, ``along`` (k,) the prism."""
        ways = np.multiply.outer(along, self._along)
        return (np.array(self.point) + points @ self._axes + ways[:, None]).reshape(-1, 3)

    @property
    def _flat(self) -> Plane | None:
        """The plane in space that the prism of a straight is."""
        if not isinstance(self.section, Plane):
            return None
        point, normal = np.array(self.point) + self.section.point @ self._axes, self.section.normal @ self._axes
        return Plane(tuple(point.tolist()), tuple((normal / norm(normal)).tolist()))

    @property
    def _along(self) -> Floats:
        """The direction (3,) of the prism."""
        return np.cross(self.first, self.second)

    @cached_property
    def _axes(self) -> Floats:
        """The directions of the section's coordinates, (2, 3)."""
        return np.array([self.first, self.second])

    def _place(self, x: Floats) -> Floats:
        """Coordinates (…, 2) of points x (…, 3) in the plane of the section."""
        return np.asarray((x - np.array(self.point)) @ self._axes.T)


def _seen(section: Surface, turn: Floats, apart: Floats) -> Surface:
    """A section in other coordinates: at turn x + ``apart`` (2,), by reflections that make up the ``turn`` (2, 2)."""
    if np.linalg.det(turn) > 0:
        section, turn = section.image((1.0, 0.0), 0.0), turn * (-1.0, 1.0)
    # It is a reflection by now, 1 - 2 m m'.
    across = np.eye(2) - turn
    way = across[:, np.argmax(norm(across))]
    section = section.image(tuple((way / norm(way)).tolist()), 0.0)
    if (far := float(norm(apart))) > 0:
        along = tuple((apart / far).tolist())
        section = section.image(along, 0.0).image(along, far / 2)
    return section
