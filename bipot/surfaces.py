r"""Surfaces of rigid tools as signed distances: the gap g of a point, the normal n there, how both change as it moves.

The gap is positive outside the tool, n = grad g points from the tool into the body, and t = (n_y, -n_x). A surface of
curvature k where a point is nearest to it, positive where the tool is convex, has at the point

    grad n = c t t',    c = k / (1 + k g),

so c is the curvature of the line of equal gaps through the point. How far a point has come along the surface is the
arc s of its nearest point, whose derivatives are

    grad s = (1 - c g) t,    grad grad s = -c (1 - c g) (n t' + t n')

on pieces of constant k. Slips measured by s add up over increments to what they are over all of them, however long
those are: the measure is path-consistent. Dual to s is the shear force, along t where g = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_magnitude, require_positive, require_type
from bipot.paths import pair, require_components, vector
from bipot.reflection import reflected
from bipot.tensors import norm
from bipot.typing import Bools, Floats, Pair, Vector

ACROSS = 1e-12
"""A component below this fraction of a vector is round-off of its direction."""

AROUND = np.pi / 3
"""Who goes around a circle by more in one increment, and on a straight way through it, came out on another side."""


OPEN = 1e-6
"""Of a tool's radius or thickness: who is no farther from it touches it."""

GRAZED = 0.02
"""Of a tool's radius or half its thickness: who comes through it no deeper, and does not touch it, grazed it."""


SQUARE = ((-1, 1, 1, -1, -1), (-1, -1, 1, 1, -1))
"""Corners of a square by the first and the second tangent, anticlockwise for who looks against the normal."""

ROUND = 120
"""Straights by which a whole circle is drawn."""


class Distance(NamedTuple):
    """Of points (…, d): ``gap`` (…), unit ``normal`` (…, d) and ``curvature`` c (…) of the line of equal gaps."""

    gap: Floats
    normal: Floats
    curvature: Floats


class Tips(NamedTuple):
    """Convex parts that may come between nodes: circles around ``centre`` (m, d) of ``radius`` (m,), 0 of corners.

    ``thickness`` is the diameter of the largest circle in the tool.
    """

    centre: Floats
    radius: Floats
    thickness: float


@runtime_checkable
class Surface(Protocol):
    """What a tool asks of its surface, which rests; ``moved`` (d,) is how far the tool has gone since."""

    def distance(self, x: Floats) -> Distance:
        """Signed distance of points x (…, d), exact to round-off."""
        ...

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """Signed distance (…) of points x (…, d) to the moved surface."""
        ...

    def size(self, x: Floats, moved: Floats) -> Floats:
        """Magnitude (…) of the numbers whose difference :meth:`gap` is."""
        ...

    def passed(self, x: Floats, by: Floats) -> Floats:
        """What gap and arc of points x (…, d) grow by as they go ``by`` (…, d), as (…, 2): to round-off of ``by``."""
        ...

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """Whether points x (…, d) that go ``by`` (…, d) come through the tool and out on another side of it (…)."""
        ...

    def tips(self) -> Tips:
        """Its convex parts: circles of which an arc is the surface."""
        ...

    def beyond(self, x: Floats) -> Bools:
        """Whether points x (…, d) are past an open end, where the surface may not be touched (…)."""
        ...

    def mirrored(self, normal: Vector, position: float, roundoff: float) -> bool:
        """Whether it is its own mirror image in the plane normal . x = position, to ``roundoff`` of places."""
        ...

    def image(self, normal: Vector, position: float) -> Surface:
        """Its mirror image in the plane normal . x = position, of a unit normal."""
        ...

    def same(self, other: Surface, roundoff: float) -> bool:
        """Whether the ``other`` is the same, to ``roundoff`` of places."""
        ...

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """Lines (p, d) on it, to draw it, with the tool on the right of who follows one.

        Of what has no end they hold what is about within ``reach`` of the point ``middle`` (d,).
        """
        ...


@dataclass(frozen=True)
class Plane:
    """The plane through ``point`` with the unit ``normal``; the tool is the half-space behind it.

    Raises:
        SceneError: a vector that is not two finite numbers, or three in space, a normal that is none.

    >>> Plane((0.0, 1.0), (0.0, -1.0)).distance(np.array([3.0, 0.25])).gap
    np.float64(0.75)
    """

    point: tuple[float, ...]
    normal: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", vector(self.point, "plane.point"))
        require_magnitude(max(map(abs, self.point)), "plane.point", LARGEST_LENGTH)
        object.__setattr__(self, "normal", direction(self.normal, "plane.normal"))
        require_components(self.point, len(self.normal), "plane.point")

    def offset(self, moved: Floats) -> float:
        """n . x of its points."""
        return float(np.dot(self.normal, np.add(self.point, moved)))

    def distance(self, x: Floats) -> Distance:
        """As :meth:`Surface.distance`."""
        gap = self.gap(x, np.zeros(len(self.point)))
        return Distance(gap, np.broadcast_to(self.normal, x.shape), np.zeros_like(gap))

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.gap`."""
        return x @ np.array(self.normal) - self.offset(moved)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.size`."""
        return np.maximum(np.abs(x @ np.array(self.normal)), abs(self.offset(moved)))

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`Surface.passed`."""
        return by @ frames(np.array(self.normal)).T

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`Surface.crossed`: out of a half-space there is one way."""
        return np.zeros(x.shape[:-1], dtype=bool)

    def tips(self) -> Tips:
        """As :meth:`Surface.tips`: none."""
        return Tips(np.empty((0, len(self.point))), np.empty(0), np.inf)

    def beyond(self, x: Floats) -> Bools:
        """As :meth:`Surface.beyond`: it has no end."""
        return np.zeros(x.shape[:-1], dtype=bool)

    def mirrored(self, normal: Vector, position: float, roundoff: float) -> bool:
        """As :meth:`Surface.mirrored`."""
        return abs(float(np.dot(self.normal, normal))) <= ACROSS

    def image(self, normal: Vector, position: float) -> Plane:
        """As :meth:`Surface.image`."""
        return Plane(reflected(self.point, normal, position), reflected(self.normal, normal, 0.0))

    def same(self, other: Surface, roundoff: float) -> bool:
        """As :meth:`Surface.same`."""
        return (
            isinstance(other, Plane)
            and bool(np.abs(np.subtract(self.normal, other.normal)).max() <= ACROSS)
            and abs(float(self.gap(np.array(other.point), np.zeros(len(self.point))))) <= roundoff
        )

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """As :meth:`Surface.lines`: one straight around the foot of the ``middle``, in space a square."""
        normal, *tangents = frames(np.array(self.normal))
        foot = middle - self.gap(middle, np.zeros(len(normal))) * normal
        ways = ((-1, 1),) if len(tangents) == 1 else SQUARE
        return [foot + reach * np.transpose(ways) @ np.array(tangents)]


@dataclass(frozen=True)
class Circle:
    """The circle around ``centre``: the tool is what is inside it, or where it is ``concave`` what is outside.

    It is a cylinder in plane strain; on a meridian a sphere where the centre is on the axis, a torus elsewhere. At the
    centre itself, where no direction is the nearest, the normal is the first axis.

    Raises:
        SceneError: a centre that is not two finite numbers, a radius that is not above zero.

    >>> Circle((0.0, 3.0), 2.0).distance(np.array([0.0, 0.5]))
    Distance(gap=np.float64(0.5), normal=array([ 0., -1.]), curvature=np.float64(0.4))
    """

    centre: tuple[float, float]
    radius: float
    concave: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", place(self.centre, "circle.centre"))
        require_positive(**{"circle.radius": self.radius})
        object.__setattr__(self, "radius", float(self.radius))
        require_magnitude(self.radius, "circle.radius", LARGEST_LENGTH)
        require_type(self.concave, bool, "circle.concave")

    def distance(self, x: Floats) -> Distance:
        """As :meth:`Surface.distance`."""
        out, sign = x - np.array(self.centre), self._sign
        far = norm(out)
        safe = np.where(far > 0, far, 1.0)
        normal = np.where((far > 0)[..., None], out / safe[..., None], (1.0, 0.0))
        return Distance(sign * (far - self.radius), sign * normal, sign / safe)

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.gap`."""
        return self._sign * (norm(x - np.add(self.centre, moved)) - self.radius)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.size`."""
        return np.maximum(norm(x), norm(np.add(self.centre, moved)) + self.radius)

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`Surface.passed`."""
        start = x - np.array(self.centre)
        end = start + by
        far = norm(start) + norm(end)
        # The difference of two distances, without the round-off of either; the angle between them likewise.
        farther = np.vecdot(start + end, by) / np.where(far > 0, far, 1.0)
        across = start[..., 0] * by[..., 1] - start[..., 1] * by[..., 0]
        turned = np.arctan2(across, np.vecdot(start, end))
        return self._sign * np.stack([farther, -self.radius * turned], axis=-1)

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`Surface.crossed`: by more than :data:`AROUND`, and deeper than who slides so far.

        Who touches it neither before nor after does not slide.
        """
        start, length = x - np.array(self.centre), norm(by)
        end = start + by
        along = -np.vecdot(start, by) / np.where(length > 0, length, 1.0) ** 2
        nearest = norm(start + np.clip(along, 0.0, 1.0)[..., None] * by)
        turns = np.vecdot(start, end) < np.cos(AROUND) * norm(start) * norm(end)
        slid = turns & (nearest < np.cos(AROUND / 2) * self.radius)
        open_at_both = np.minimum(norm(start), norm(end)) > (1 + OPEN) * self.radius
        return (slid | (open_at_both & (nearest < (1 - GRAZED) * self.radius))) & (not self.concave)

    def tips(self) -> Tips:
        """As :meth:`Surface.tips`: itself, where it is convex."""
        own = int(not self.concave)
        return Tips(np.array([self.centre] * own).reshape(-1, 2), np.array([self.radius] * own), 2 * self.radius)

    def beyond(self, x: Floats) -> Bools:
        """As :meth:`Surface.beyond`: it has no end."""
        return np.zeros(x.shape[:-1], dtype=bool)

    def mirrored(self, normal: Vector, position: float, roundoff: float) -> bool:
        """As :meth:`Surface.mirrored`."""
        return abs(float(np.dot(self.centre, normal)) - position) <= roundoff

    def image(self, normal: Vector, position: float) -> Circle:
        """As :meth:`Surface.image`."""
        x, y = reflected(self.centre, normal, position)
        return Circle((x, y), self.radius, self.concave)

    def same(self, other: Surface, roundoff: float) -> bool:
        """As :meth:`Surface.same`."""
        if not isinstance(other, Circle) or self.concave != other.concave:
            return False
        apart = np.subtract((*self.centre, self.radius), (*other.centre, other.radius))
        return bool(np.abs(apart).max() <= roundoff)

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """As :meth:`Surface.lines`: the whole circle."""
        angle = -self._sign * np.linspace(0.0, 2 * np.pi, ROUND + 1)
        return [self.centre + self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)]

    @property
    def _sign(self) -> float:
        return -1.0 if self.concave else 1.0


def frames(normal: Floats) -> Floats:
    """Frames (…, d, d) of normals (…, d): rows are the normal and, in a plane, the tangent (n_y, -n_x).

    In space the first tangent is the axis least along the normal, across it, the second their product: a plane of
    symmetry that cuts a flat tool has its own normal among them.

    >>> frames(np.array([0.6, 0.8])).tolist()
    [[0.6, 0.8], [0.8, -0.6]]
    >>> frames(np.array([0.6, 0.0, 0.8])).tolist()
    [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]
    """
    if normal.shape[-1] == 3:
        first = np.eye(3)[np.argmin(np.abs(normal), axis=-1)]
        first = first - np.vecdot(first, normal)[..., None] * normal
        first /= norm(first)[..., None]
        return np.stack([normal, first, np.asarray(np.cross(normal, first), dtype=np.float64)], axis=-2)
    return np.stack([normal, normal[..., ::-1] * (1.0, -1.0)], axis=-2)


def place(value: object, field: str) -> Pair:
    """``value`` as a point; raises SceneError where it is none."""
    point = pair(value, field, "two finite numbers")
    require_magnitude(max(map(abs, point)), field, LARGEST_LENGTH)
    return point


def direction(value: object, field: str) -> Vector:
    """``value`` as a unit vector; raises SceneError where it is none."""
    normal = vector(value, field)
    require(abs(math.hypot(*normal) - 1) < 1e-12, field, normal, "a unit vector")
    return normal
