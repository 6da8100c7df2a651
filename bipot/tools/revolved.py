"""Surfaces of revolution as tools in space: spheres, cylinders, cones, and any profile turned about an axis.

With r the distance from the axis and z the height along it, a point is as far from the surface as (r, z) is from the
meridian. Where the meridian has the normal (n_r, n_z) and curvature c, the surface of equal gaps has the principal
curvatures

    c along the meridian,    n_r / r around the axis,

which are equal on the axis where the normal is along it.

Whether the straight way of a point comes out on another side is decided by distances alone. Along a way the gap changes
by no more than its length, so only ways that may be in the tool are checked, in steps of a small part of the tool's
thickness, or of the way if that is short.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_number, require_positive, require_type
from bipot.paths import require_components, vector
from bipot.tensors import norm, unit
from bipot.tools.circle import GRAZED, Circle, comes_out
from bipot.tools.plane import farther
from bipot.tools.profiles import wedge
from bipot.tools.surfaces import ACROSS, Distance, Plane, Surface, Tips, coordinates, direction, frames, reflected
from bipot.typing import Bools, Floats, Vector

RING = 48
"""Number of points of a ring around the axis: each may come between nodes, and straights between them draw it."""

ON_AXIS = 1e-12
"""Points no farther from the axis than this, over the lengths of the surface, are on it."""

NEXT_TO_AXIS = 1e-9
"""Nearer to the axis than this, over the lengths of the surface, n_r / r is round-off and both curvatures are equal."""

HALF, FAR = (1.0, 0.0), 1e6
"""The normal of the axis in the meridian's plane; how far infinite lines are checked, over the size of the others."""

MERIDIANS, CIRCLES = 12, 9
"""Numbers of meridians and circles by which a surface is drawn."""

LEAST, MOST = 17, 4096
"""Range of the number of points checked on a way: enough to detect a depth of GRAZED of the tool."""


@dataclass(frozen=True)
class Revolved(Surface):
    """The surface that the ``meridian`` makes as it turns about the axis through ``point`` along the unit ``axis``.

    The meridian is a :class:`~bipot.tools.circle.Circle`, a :class:`~bipot.tools.profiles.Profile` or any other surface
    of a plane, whose first coordinate is the distance from the axis and whose second is the height along it above
    the point. It must be its own mirror image in the axis, or lie on one side of it only, such that no point is nearer
    to a part beyond the axis.

    Raises:
        SceneError: vectors that are not three finite numbers, an axis that is no unit vector, a meridian that is no
            surface of a plane, or on both sides of the axis without being its own mirror image.

    >>> ball = Revolved(Circle((0.0, 0.0), 2.0), (0.0, 0.0, 5.0), (0.0, 0.0, 1.0))
    >>> ball.distance(np.array([0.0, 0.0, 2.5])).gap
    np.float64(0.5)
    """

    meridian: Surface
    point: tuple[float, ...]
    axis: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", _in_space(self.point, "revolved.point"))
        object.__setattr__(self, "axis", _in_space(direction(self.axis, "revolved.axis"), "revolved.axis"))
        require_type(self.meridian, Surface, "revolved.meridian")
        plane = coordinates(self.meridian, "revolved.meridian") == 2
        require(plane, "revolved.meridian", self.meridian, "a surface of a plane: (distance from the axis, height)")
        # A plane through the origin has no length of its own, and any will do.
        lines = self.meridian.lines(np.zeros(2), FAR * (self._extent or 1.0))
        beside = min(float(line[:, 0].min()) for line in lines) >= -ON_AXIS * self._extent
        sound = beside or self.meridian.mirrored(HALF, 0.0, ON_AXIS * self._extent)
        allowed = "its own mirror image in the axis, r = 0, or at r >= 0"
        require(sound, "revolved.meridian", self.meridian, allowed)

    def distance(self, x: Floats) -> Distance:
        """As :meth:`bipot.tools.surfaces.Surface.distance`."""
        place, outward = self._place(x)
        gap, normal, c = self.meridian.distance(place)
        (n_r, n_z), axis = np.moveaxis(normal, -1, 0)[..., None], np.array(self.axis)
        r = place[..., :1]
        off = r > NEXT_TO_AXIS * self.meridian.size(place, np.zeros(2))[..., None]
        along, around = n_z * outward - n_r * axis, np.cross(axis, outward)
        hoop = np.where(off, n_r / np.where(off, r, 1.0), c[..., None])
        curvature = (c[..., None] * along)[..., None] * along[..., None, :]
        curvature = curvature + (hoop * around)[..., None] * around[..., None, :]
        return Distance(gap, n_r * outward + n_z * axis, curvature)

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.gap`."""
        return self.meridian.gap(self._place(x - moved)[0], np.zeros(2))

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.size`."""
        own = self.meridian.size(self._place(x - moved)[0], np.zeros(2))
        return np.maximum(norm(x), norm(moved) + norm(np.array(self.point)) + own)

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.passed`."""
        axis, (place, outward) = np.array(self.axis), self._place(x)
        up = by @ axis
        beside, start = by - up[..., None] * axis, place[..., :1] * outward
        return self.meridian.passed(place, np.stack([farther(start, beside), up], axis=-1))[..., :1]

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.crossed`."""
        return comes_through(self.distance, self.tips().thickness, x, by)

    @cached_property
    def _tips(self) -> Tips:
        """The meridian's tips on the axis, and :data:`RING` for each other one; as thick as the meridian."""
        tips = self.meridian.tips()
        solid = isinstance(self.meridian, Plane) and self.meridian.normal[0] > ACROSS
        thickness = -2 * float(self.meridian.gap(np.zeros(2), np.zeros(2))) if solid else tips.thickness
        on = np.abs(tips.centre[:, 0]) <= ON_AXIS * self._extent
        angle = 2 * np.pi / RING * np.arange(RING)[:, None]
        first, second = frames(np.array([self.axis]))[0, 1:]
        ring = np.cos(angle) * first + np.sin(angle) * second
        beside = (tips.centre[~on, :1, None] * ring).reshape(-1, 3)
        beside += np.repeat(tips.centre[~on, 1:] * np.array(self.axis), RING, axis=0)
        centres = np.array(self.point) + np.concatenate([tips.centre[on, 1:] * np.array(self.axis), beside])
        return Tips(centres, np.concatenate([tips.radius[on], np.repeat(tips.radius[~on], RING)]), thickness)

    def tips(self) -> Tips:
        """As :meth:`bipot.tools.surfaces.Surface.tips`."""
        return self._tips

    def beyond(self, x: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.beyond`."""
        return self.meridian.beyond(self._place(x)[0])

    def image(self, normal: Vector, position: float) -> Revolved:
        """As :meth:`bipot.tools.surfaces.Surface.image`."""
        return Revolved(self.meridian, reflected(self.point, normal, position), reflected(self.axis, normal, 0.0))

    def same(self, other: Surface, roundoff: float) -> bool:
        """As :meth:`bipot.tools.surfaces.Surface.same`; spheres are compared whatever their axes are."""
        if not isinstance(other, Revolved):
            return False
        one, two = self._sphere, other._sphere
        if one is not None and two is not None:
            alike = one[2] == two[2] and abs(one[1] - two[1]) <= roundoff
            return alike and float(norm(np.subtract(one[0], two[0]))) <= roundoff
        apart, axis = np.subtract(other.point, self.point), np.array(self.axis)
        way, up = float(axis @ np.array(other.axis)), float(apart @ axis)
        on_axis = float(norm(apart - up * axis)) <= roundoff and 1 - abs(way) <= ACROSS
        # Mirrored at half the height between the points; where both axes go the same way, mirrored twice.
        meridian = other.meridian if way < 0 else other.meridian.image((0.0, 1.0), 0.0)
        return on_axis and self.meridian.same(meridian.image((0.0, 1.0), up / 2), roundoff)

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """As :meth:`bipot.tools.surfaces.Surface.lines`: meridians, and circles around the axis."""
        first, second = frames(np.array(self.axis))[1:]
        out, angle = list[Floats](), np.linspace(0.0, 2 * np.pi, RING + 1)
        for line in self.meridian.lines(self._place(middle)[0], reach):
            half = line[line[:, 0] >= -ON_AXIS * reach]
            ways = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
            r, z = half[:, :1], half[:, 1:]
            out += [self.point + r * way + z * self.axis for way in ways[: -1 : RING // MERIDIANS]]
            chosen = half[np.linspace(0, len(half) - 1, min(CIRCLES, len(half))).astype(int)]
            out += [self.point + r * ways + z * np.array(self.axis) for r, z in chosen[chosen[:, 0] > ON_AXIS * reach]]
        return out

    @cached_property
    def _extent(self) -> float:
        """The magnitude of the meridian's places and lengths; zero of a plane through the origin."""
        return float(self.meridian.size(np.zeros(2), np.zeros(2)))

    @property
    def _sphere(self) -> tuple[Vector, float, bool] | None:
        """Centre, radius and whether it is hollow, if this is a sphere."""
        circle = self.meridian
        if not isinstance(circle, Circle) or abs(circle.centre[0]) > ON_AXIS * circle.radius:
            return None
        centre = np.array(self.point) + circle.centre[1] * np.array(self.axis)
        return tuple(centre.tolist()), circle.radius, circle.concave

    def _place(self, x: Floats) -> tuple[Floats, Floats]:
        """Distance from the axis and height (…, 2) of points x (…, d), and the unit vector (…, d) from the axis."""
        axis, out = np.array(self.axis), x - np.array(self.point)
        z = out @ axis
        out = out - z[..., None] * axis
        # Next to the axis this leaves round-off along it, which is comparable with the rest.
        out = out - (out @ axis)[..., None] * axis
        return np.stack([norm(out), z], axis=-1), unit(out, frames(axis)[1])


def _in_space(value: Vector, field: str) -> Vector:
    """The value as a vector of three components."""
    value = vector(value, field, LARGEST_LENGTH)
    require_components(value, 3, field)
    return value


def sphere(centre: Vector, radius: float, concave: bool = False) -> Revolved:
    """The sphere around ``centre``: the tool is its inside, or if ``concave`` its outside.

    Raises:
        SceneError: as :class:`Revolved` and :class:`~bipot.tools.circle.Circle`.

    >>> float(sphere((0.0, 0.0, 3.0), 2.0).distance(np.zeros(3)).gap)
    1.0
    """
    centre = _in_space(centre, "sphere.centre")
    require_positive(**{"sphere.radius": radius})
    return Revolved(Circle((0.0, 0.0), radius, concave), centre, (0.0, 0.0, 1.0))


def roll(point: Vector, axis: Vector, radius: float, concave: bool = False) -> Revolved:
    """The infinite cylinder around the ``axis`` through ``point``; if ``concave`` the tool is its outside.

    Raises:
        SceneError: a radius that is not above zero; as :class:`Revolved`.

    >>> float(roll((0.0, 0.0, 3.0), (1.0, 0.0, 0.0), 2.0).distance(np.array([7.0, 0.0, 0.0])).gap)
    1.0
    """
    point, axis = _in_space(point, "roll.point"), _in_space(direction(axis, "roll.axis"), "roll.axis")
    require_positive(**{"roll.radius": radius})
    require_type(concave, bool, "roll.concave")
    return Revolved(Plane((radius, 0.0), (-1.0 if concave else 1.0, 0.0)), point, axis)


def cone(tip: Vector, axis: Vector, semi_angle: float, length: float, radius: float = 0.0) -> Revolved:
    """The cone that opens from its ``tip`` along the ``axis``, by ``semi_angle`` degrees to it, with flanks ``length``.

    A ``radius`` above zero rounds its tip, as for a :func:`~bipot.tools.profiles.wedge`. Past the ends of its flanks it
    may not be touched.

    Raises:
        SceneError: an angle outside (0, 90), a length not above zero, a radius that does not fit; as :class:`Revolved`.

    >>> round(float(cone((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 45.0, 2.0).distance(np.array([0.0, 1.0, 1.0])).gap), 12)
    0.707106781187
    """
    tip, axis = _in_space(tip, "cone.tip"), _in_space(direction(axis, "cone.axis"), "cone.axis")
    require_number(semi_angle, "cone.semi_angle")
    require(0 < semi_angle < 90, "cone.semi_angle", semi_angle, "in (0, 90) degrees")
    require_positive(**{"cone.length": length})
    return Revolved(wedge((0.0, 0.0), semi_angle, length, radius), tip, axis)


def comes_through(distance: Callable[[Floats], Distance], thickness: float, x: Floats, by: Floats) -> Bools:
    """Whether points x (…, 3) that go straight ``by`` (…, 3) come through the tool and out on another side of it (…).

    The tool has this ``distance`` and ``thickness``, the diameter of the largest sphere in it; the rule is that of
    :func:`bipot.tools.circle.comes_out`.
    """
    out = np.zeros(x.shape[:-1], dtype=bool)
    length = norm(by)
    near = (distance(x).gap < length) & (length > 0)
    if not near.any() or not np.isfinite(thickness):
        return out
    x, by, length = x[near], by[near], length[near]
    count = int(np.clip(np.ceil(2 * length.max() / (GRAZED * thickness)), LEAST, MOST))
    way = x[:, None] + np.linspace(0.0, 1.0, count)[:, None] * by[:, None]
    found = distance(way)
    inside = found.gap < 0
    first, last = np.argmax(inside, axis=1), count - 1 - np.argmax(inside[:, ::-1], axis=1)
    rows = np.arange(len(x))
    turned = np.vecdot(found.normal[rows, first], found.normal[rows, last])
    depth, gap = -found.gap.min(axis=1), found.gap[:, [0, -1]].min(axis=1)
    out[near] = inside.any(axis=1) & comes_out(turned, depth, length, gap, thickness / 2)
    return out
