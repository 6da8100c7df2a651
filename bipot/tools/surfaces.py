r"""Surfaces of rigid tools as signed distances: the gap g of a point, the normal n there, how both change as it moves.

The gap is positive outside the tool, n = grad g points from the tool into the body, and t = (n_y, -n_x). If the surface
has the curvature k at the place nearest to a point, positive where the tool is convex, then at the point

    grad n = c t t',    c = k / (1 + k g),

so c is the curvature of the line of equal gaps through the point. The position of a point along the surface is the arc
s of its nearest point, whose derivatives are

    grad s = (1 - c g) t,    grad grad s = -c (1 - c g) (n t' + t n')

on pieces of constant k. Slips measured by s add up over increments of any length, so the measure is path-consistent.
Dual to s is the shear force, along t where g = 0. In space a surface has two principal curvatures,
grad n = sum_i c_i e_i e_i', and slips are those of :mod:`bipot.tools.slips`.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_magnitude, require_type
from bipot.paths import pair, require_components, vector
from bipot.tensors import norm
from bipot.typing import Bools, Floats, Pair, Vector

ACROSS = 1e-12
"""A component below this fraction of a vector is round-off of its direction."""


class Distance(NamedTuple):
    """At points (…, d): ``gap`` (…), unit ``normal`` (…, d) and ``curvature`` c (…) of the line of equal gaps.

    In space ``curvature`` is that of the surface of equal gaps, as grad n (…, 3, 3).
    """

    gap: Floats
    normal: Floats
    curvature: Floats

    @staticmethod
    def flat(gap: Floats, normal: Floats | Vector) -> Distance:
        """That at points with the ``gap`` (…) where no surface is curved, of one ``normal`` (d,) or of each (…, d)."""
        d = np.shape(normal)[-1]
        return Distance(gap, np.broadcast_to(normal, (*gap.shape, d)), np.zeros(gap.shape + (3, 3) * (d == 3)))


class Tips(NamedTuple):
    """Convex parts that may come between nodes: circles of ``radius`` (m,), 0 at corners, around ``centre`` (m, d).

    ``thickness`` is the diameter of the largest circle in the tool.
    """

    centre: Floats
    radius: Floats
    thickness: float


@runtime_checkable
class Surface(Protocol):
    """What a tool needs of its surface at rest; ``moved`` (d,) is the displacement of the tool since."""

    @abstractmethod
    def distance(self, x: Floats) -> Distance:
        """Signed distance of points x (…, d), exact to round-off."""
        ...

    @abstractmethod
    def gap(self, x: Floats, moved: Floats) -> Floats:
        """Signed distance (…) of points x (…, d) to the moved surface."""
        ...

    @abstractmethod
    def size(self, x: Floats, moved: Floats) -> Floats:
        """Magnitude (…) of the numbers whose difference :meth:`gap` is."""
        ...

    @abstractmethod
    def passed(self, x: Floats, by: Floats) -> Floats:
        """Growth of gap and arc (…, 2) of points x (…, d) that move ``by`` (…, d), to the round-off of ``by``.

        In space the gap alone, as (…, 1).
        """
        ...

    @abstractmethod
    def crossed(self, x: Floats, by: Floats) -> Bools:
        """Whether (…) points x (…, d) that move ``by`` (…, d) go through the tool and come out on another side."""
        ...

    @abstractmethod
    def tips(self) -> Tips:
        """Its convex parts: circles of which an arc is the surface; in space spheres, of which a part is."""
        ...

    def beyond(self, x: Floats) -> Bools:
        """Whether points x (…, d) are past an open end, where the surface may not be touched (…); most have none."""
        return np.zeros(x.shape[:-1], dtype=bool)

    def mirrored(self, normal: Vector, position: float, roundoff: float) -> bool:
        """Whether it is its own mirror image in the plane normal . x = position, to ``roundoff`` of places."""
        return self.same(self.image(normal, position), roundoff)

    @abstractmethod
    def image(self, normal: Vector, position: float) -> Surface:
        """Its mirror image in the plane normal . x = position, of a unit normal."""
        ...

    @abstractmethod
    def same(self, other: Surface, roundoff: float) -> bool:
        """Whether the ``other`` is the same, to ``roundoff`` of places."""
        ...

    @abstractmethod
    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """Lines (p, d) on it for drawing, with the tool on their right.

        Of an infinite surface they show the part within about ``reach`` of the point ``middle`` (d,).
        """
        ...


STRAIGHT = np.array([[-1.0], [1.0]])
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
"""How planes are drawn, along their tangents, in a plane and in space."""


@dataclass(frozen=True)
class Plane(Surface):
    """The plane through ``point`` with the unit ``normal``; the tool is the half-space behind it.

    Raises:
        SceneError: a vector that is not two finite numbers, or three in space, a normal that is no unit vector.

    >>> Plane((0.0, 1.0), (0.0, -1.0)).distance(np.array([3.0, 0.25])).gap
    np.float64(0.75)
    """

    point: tuple[float, ...]
    normal: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", vector(self.point, "plane.point", LARGEST_LENGTH))
        object.__setattr__(self, "normal", direction(self.normal, "plane.normal"))
        require_components(self.point, len(self.normal), "plane.point")

    def offset(self, moved: Floats) -> float:
        """n . x of the points of the plane."""
        return float(np.dot(self.normal, np.add(self.point, moved)))

    def distance(self, x: Floats) -> Distance:
        """As :meth:`Surface.distance`."""
        return Distance.flat(self.gap(x, np.zeros(len(self.point))), self.normal)

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.gap`."""
        return x @ np.array(self.normal) - self.offset(moved)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.size`."""
        return np.maximum(np.abs(x @ np.array(self.normal)), abs(self.offset(moved)))

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`Surface.passed`."""
        return by @ frames(np.array(self.normal))[:2].T if len(self.normal) == 2 else by @ np.array([self.normal]).T

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`Surface.crossed`: never, since a half-space has one side only."""
        return np.zeros(x.shape[:-1], dtype=bool)

    def tips(self) -> Tips:
        """As :meth:`Surface.tips`: none."""
        return Tips(np.empty((0, len(self.point))), np.empty(0), np.inf)

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
        foot = middle - self.gap(middle, np.zeros(len(middle))) * normal
        ends = STRAIGHT if len(tangents) == 1 else SQUARE
        return [foot + reach * ends @ np.array(tangents)]


def frames(normal: Floats) -> Floats:
    """Frames (…, d, d) of normals (…, d): rows are the normal and, in a plane, the tangent (n_y, -n_x).

    In space the first tangent is the coordinate axis least along the normal, projected across it, the second
    n x first: the normal of a plane of symmetry that cuts a flat tool is then one of them.

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


def coordinates(surface: Surface, field: str) -> int:
    """How many coordinates places on a surface have; raises SceneError where its tips are no circles or spheres."""
    tips = surface.tips()
    require_type(tips, Tips, f"{field}.tips")
    (centre, radius, thickness), arrays = tips, all(isinstance(part, np.ndarray) for part in tips[:2])
    sound = arrays and centre.ndim == 2 and radius.shape == centre.shape[:1] and bool(np.isfinite(centre).all())
    allowed = "arrays of finite centres (m, d) and of radii (m,) >= 0, and a thickness > 0"
    require(sound and bool((radius >= 0).all()) and thickness > 0, f"{field}.tips", tips, allowed)
    return centre.shape[1]


def place(value: object, field: str) -> Pair:
    """``value`` as a point; raises SceneError unless it is one."""
    point = pair(value, field, "two finite numbers")
    require_magnitude(max(map(abs, point)), field, LARGEST_LENGTH)
    return point


def direction(value: object, field: str) -> Vector:
    """``value`` as a unit vector; raises SceneError unless it is a direction."""
    normal = vector(value, field)
    require(abs(math.hypot(*normal) - 1) < 1e-12, field, normal, "a unit vector")
    return normal


def reflected(point: Vector, normal: Vector, position: float) -> Vector:
    """The mirror image of a point in the plane normal . x = position, of a unit normal.

    >>> reflected((3.0, 1.0), (1.0, 0.0), 0.5)
    (-2.0, 1.0)
    """
    return tuple(imaged(np.array(point), normal, position).tolist())


def imaged(points: Floats, normal: Vector, position: float) -> Floats:
    """Mirror images of points (…, d) in the plane normal . x = position, of a unit normal."""
    return points + 2 * np.asarray(position - points @ np.array(normal))[..., None] * normal


def across(vectors: Floats, normal: Floats | Vector) -> Floats:
    """The part of vectors (…, d) at a right angle to the unit normal (d,)."""
    return vectors - np.asarray(vectors @ np.asarray(normal))[..., None] * normal
