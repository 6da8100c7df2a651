"""Circles as tools: cylinders in plane strain, spheres and tori on a meridian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.errors import LARGEST_LENGTH, require_magnitude, require_type
from bipot.tensors import norm, unit
from bipot.tools.plane import angle_between, farther
from bipot.tools.surfaces import Distance, Surface, Tips, place, reflected
from bipot.typing import Bools, Floats, Vector, make_floats

AROUND = np.pi / 3
"""A straight way through a circle around which it goes by more than this angle comes out on another side."""

PAST = 2 * np.pi / 3
"""A straight way through a tool between normals that differ by more than this is not a slide around it."""

DEEP = 1 - float(np.cos(AROUND / 2))
"""Depth of a straight way between places of a circle that are :data:`AROUND` apart, over the radius.

The radius, here and below, is that of the largest circle in the tool.
"""

OPEN = 1e-6
"""A point with a gap of no more than this, over the radius, touches the tool."""

GRAZED = 0.02
"""A way through the tool no deeper than this, over the radius, is a graze."""

SHALLOW = 1e-6
"""A way through the tool no deeper than this, over its length, runs along it."""

ROUND = 120
"""Number of straights by which a whole circle is drawn."""


def comes_out(turned: Floats, depth: Floats, length: Floats, gap: Floats, radius: float) -> Bools:
    """Whether straight ways through a tool with a largest circle of this ``radius`` come out on another side of it (…).

    The normals where a way enters and leaves, of which ``turned`` is the cosine, differ by more than PAST; or by more
    than AROUND, and its ``depth`` is more than that of a chord of that angle in the circle; or the point touches the
    tool neither before nor after, by the lesser ``gap``, and more than grazes it. A way along the surface, over its
    ``length`` no deeper than SHALLOW, does not.
    """
    slid = (turned < np.cos(PAST)) | ((turned < np.cos(AROUND)) & (depth > DEEP * radius))
    return (depth > SHALLOW * length) & (slid | ((gap > OPEN * radius) & (depth > GRAZED * radius)))


@dataclass(frozen=True)
class Circle(Surface):
    """The circle around ``centre``: the tool is its inside, or if ``concave`` its outside.

    It is a cylinder in plane strain; on a meridian a sphere where the centre is on the axis, a torus elsewhere. At the
    centre itself, where the normal is not unique, it is the first axis.

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
        make_floats(self, of="circle.", radius="finite and > 0")
        require_magnitude(self.radius, "circle.radius", LARGEST_LENGTH)
        require_type(self.concave, bool, "circle.concave")

    def distance(self, x: Floats) -> Distance:
        """As :meth:`Surface.distance`."""
        out, sign = x - np.array(self.centre), self._sign
        far = norm(out)
        safe = np.where(far > 0, far, 1.0)
        return Distance(sign * (far - self.radius), sign * unit(out, (1.0, 0.0)), sign / safe)

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.gap`."""
        return self._sign * (norm(x - np.add(self.centre, moved)) - self.radius)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`Surface.size`."""
        return np.maximum(norm(x), norm(np.add(self.centre, moved)) + self.radius)

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`Surface.passed`."""
        start = x - np.array(self.centre)
        # Like the difference of the distances the angle is without the round-off of either.
        turned = angle_between(start, start + by, by)
        return self._sign * np.stack([farther(start, by), -self.radius * turned], axis=-1)

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`Surface.crossed`: by more than :data:`AROUND`, and deeper than a point that slides so far.

        A point that touches it neither before nor after does not slide.
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
        """As :meth:`Surface.tips`: the circle itself if it is convex."""
        count = int(not self.concave)
        return Tips(np.array([self.centre] * count).reshape(-1, 2), np.array([self.radius] * count), 2 * self.radius)

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
