"""Surfaces of rigid tools made of straights and rounds: punches with rounded edges, wedges, cones, dies.

Wedges and punches point down, are open above, and end there where the body must not come.

There is no contact beyond an open end. The line continues straight there and the law holds against it, but an increment
in which a force acts there is refused (:mod:`bipot.checks.refusals`). So nothing passes around an end unnoticed, and
gaps are distances to one line without ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bipot.errors import LARGEST_LENGTH, require, require_magnitude, require_number, require_positive, require_type
from bipot.tensors import norm
from bipot.tools.circle import comes_out
from bipot.tools.profiles.outline import pieces_of
from bipot.tools.profiles.pieces import ProfilePieces
from bipot.tools.surfaces import Distance, Surface, Tips, place, reflected
from bipot.typing import Bools, Floats, Vector, listed, require_within

PLACES, HALVINGS = 7, 30
"""Starting points on each piece for the search of the tool's thickest place, and halvings of the bracket around it."""


@dataclass(frozen=True)
class Profile(Surface):
    """The line through ``points``, its corners rounded by ``fillets``, with the tool on its right.

    ``fillets`` is a radius for all inner points, or one for each; zero leaves the corner sharp. If ``closed``, the line
    leads back to the first point, and all points are inner: clockwise the tool is inside, anticlockwise outside. An
    open line continues straight beyond its ends, where it may not be touched. On a meridian it is a tool of
    revolution: it covers both sides of the axis, begins on the axis at a right angle to it, or stays off it; what it
    bounds beyond the axis is ignored.

    A sharp corner pushes in the direction from it to the point, and its arc is constant. A node that comes to rest on
    one has no unique normal: give such a corner a small fillet.

    Raises:
        SceneError: fewer than two points, points that are no numbers or coincide, fillets that do not fit, a line that
            meets itself, also in its continuation beyond the ends.

    >>> punch = Profile(((1.0, 4.0), (1.0, 2.0), (-1.0, 2.0), (-1.0, 4.0)), fillets=0.5)
    >>> punch.distance(np.array([[0.0, 1.5], [1.25, 2.5]])).gap.tolist()
    [0.5, 0.25]
    """

    points: tuple[tuple[float, float], ...]
    fillets: float | tuple[float, ...] = 0.0
    closed: bool = False
    pieces: ProfilePieces = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_type(self.closed, bool, "profile.closed")
        require(listed(self.points), "profile.points", self.points, "pairs of numbers")
        points = tuple(place(point, f"profile.points[{k}]") for k, point in enumerate(self.points))
        least = 3 if self.closed else 2
        require(len(points) >= least, "profile.points", points, f"at least {least}")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "fillets", self._checked_fillets())
        object.__setattr__(self, "pieces", pieces_of(self.points, self._radii, self.closed))

    def followed_back(self) -> Profile:
        """The same line from its last point to its first, with the tool on its other side."""
        fillets = self.fillets[::-1] if isinstance(self.fillets, tuple) else self.fillets
        return replace(self, points=self.points[::-1], fillets=fillets)

    def distance(self, x: Floats) -> Distance:
        """As :meth:`bipot.tools.surfaces.Surface.distance`."""
        foot = self.pieces.foot(x)
        return Distance(foot.gap, foot.normal, foot.curvature)

    def gap(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.gap`."""
        return self.pieces.gap(x - moved)

    def size(self, x: Floats, moved: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.size`."""
        return np.maximum(norm(x), norm(moved) + self.pieces.extent)

    def passed(self, x: Floats, by: Floats) -> Floats:
        """As :meth:`bipot.tools.surfaces.Surface.passed`; around a closed line the shorter way.

        Where another piece is nearest at the end, it is the difference of two distances and of two arcs.
        """
        pieces, start, end = self.pieces, self.pieces.foot(x), self.pieces.foot(x + by)
        slip = end.arc - start.arc
        if self.closed:
            slip = slip - pieces.length * np.round(slip / pieces.length)
        between = np.stack([end.gap - start.gap, slip], axis=-1)
        same = start.piece == end.piece
        return np.where(same[..., None], pieces.grown(start.piece, x, by), between)

    def crossed(self, x: Floats, by: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.crossed`, by :func:`bipot.tools.circle.comes_out`."""
        met = self.pieces.met(x, by)
        # A way between two points of the line is inside without meeting it.
        out = np.array((met < 1).any(axis=-1) | (self.pieces.foot(x + by / 2).gap < 0))
        out[out] = self._through(x[out], by[out], met[out])
        return out

    def beyond(self, x: Floats) -> Bools:
        """As :meth:`bipot.tools.surfaces.Surface.beyond`."""
        return self.pieces.beyond(x)

    def tips(self) -> Tips:
        """As :meth:`bipot.tools.surfaces.Surface.tips`: rounds to the right, with sharp corners among them."""
        rounds = self.pieces.rounds
        convex = rounds.turn > 0
        return Tips(rounds.centre[convex], rounds.radius[convex], 2 * self.inner_radius)

    def image(self, normal: Vector, position: float) -> Profile:
        """As :meth:`bipot.tools.surfaces.Surface.image`: the other way, so that the tool stays on the right."""
        points = tuple((x, y) for x, y in (reflected(point, normal, position) for point in self.points[::-1]))
        radii = self._radii[::-1]
        return Profile(points, radii if isinstance(self.fillets, tuple) else self.fillets, self.closed)

    def same(self, other: Surface, roundoff: float) -> bool:
        """As :meth:`bipot.tools.surfaces.Surface.same`: from any side of a closed line, wherever an open one ends."""
        if not isinstance(other, Profile) or self.closed != other.closed:
            return False
        sides, other_sides = (surface._sides(self.pieces.span) for surface in (self, other))
        rounds, others = self.pieces.rounds, other.pieces.rounds
        if sides.shape != other_sides.shape or rounds.radius.shape != others.radius.shape:
            return False
        for k in range(len(sides)):
            same_sides = norm(np.roll(other_sides, k, axis=0) - sides).max() <= roundoff
            same_radii = np.abs(np.roll(others.radius, k) - rounds.radius).max(initial=0.0) <= roundoff
            if same_sides and same_radii and np.array_equal(np.roll(others.turn, k), rounds.turn):
                return True
        return False

    def lines(self, middle: Floats, reach: float) -> list[Floats]:
        """As :meth:`bipot.tools.surfaces.Surface.lines`: from its first point to the last, or back to the first."""
        line = self.pieces.drawn()
        return [np.concatenate([line, line[:1]]) if self.closed else line]

    def _sides(self, span: float) -> Floats:
        """Ends (l, 2, d) of the straights; an open end is taken to be the ``span`` from the other one."""
        ends, along = self.pieces.straights.ends, self.pieces.straights.along
        if not self.closed:
            ends[0, 0], ends[-1, 1] = ends[0, 1] - span * along[0], ends[-1, 0] + span * along[-1]
        return ends

    @cached_property
    def inner_radius(self) -> float:
        """Radius of the largest circle in the tool that touches the line, at most the span of its corners."""
        s, rounds = self.pieces.straights, self.pieces.rounds
        part = (np.arange(PLACES) + 0.5)[:, None, None] / PLACES
        along = s.start + part * s.length[:, None] * s.along
        middle = rounds.centre + rounds.radius[:, None] * self.pieces.middle
        place = np.concatenate([along.reshape(-1, 2), middle[(rounds.turn > 0) & (rounds.radius > 0)]])
        normal = self.pieces.foot(place).normal
        low, high = np.zeros(len(place)), np.full(len(place), self.pieces.span)
        for _ in range(HALVINGS):
            radius = (low + high) / 2
            # A circle that touches is in the tool as long as its centre is no nearer to another place.
            touching = self.pieces.foot(place - radius[:, None] * normal).gap <= -radius * (1 - 1e-9)
            low, high = np.where(touching, radius, low), np.where(touching, high, radius)
        return float(low.max())

    def _through(self, x: Floats, by: Floats, met: Floats) -> Bools:
        """Whether ways (k,) that meet the line at the fractions ``met`` (k, p) come out on another side."""
        met = np.pad(met, ((0, 0), (1, 1)), constant_values=(0.0, 1.0))
        ends = x[:, None] + met[..., None] * by[:, None]
        middle, way = (ends[:, 1:] + ends[:, :-1]) / 2, norm(np.diff(ends, axis=1))
        depth, normal = -self.pieces.foot(middle).gap, self.pieces.foot(ends).normal
        turned = np.vecdot(normal[:, 1:], normal[:, :-1])
        gap = self.pieces.foot(ends[:, [0, -1]]).gap.min(axis=1, keepdims=True)
        return np.any(comes_out(turned, depth, way, gap, self.inner_radius), axis=1)

    def _checked_fillets(self) -> float | tuple[float, ...]:
        """One radius, or as many as there are inner points."""
        if not listed(self.fillets):
            return checked_radius(self.fillets, "profile.fillets")
        count = len(self.points) - 2 * (not self.closed)
        require(len(self.fillets) == count, "profile.fillets", self.fillets, f"a radius, or {count}: of inner points")
        return tuple(checked_radius(radius, f"profile.fillets[{k}]") for k, radius in enumerate(self.fillets))

    @property
    def _radii(self) -> tuple[float, ...]:
        """The radii at the inner points."""
        count = len(self.points) - 2 * (not self.closed)
        return self.fillets if isinstance(self.fillets, tuple) else (self.fillets,) * count


def checked_radius(value: object, field: str) -> float:
    """``value`` as a radius; raises SceneError unless it is one."""
    require_within(value, field, "finite and >= 0")
    radius = float(value)  # type: ignore[arg-type]
    require_magnitude(radius, field, LARGEST_LENGTH)
    return radius


def wedge(apex: tuple[float, float], semi_angle: float, length: float, radius: float = 0.0) -> Profile:
    """The wedge with flanks ``length`` long at ``semi_angle`` degrees to the vertical above its ``apex``.

    On a meridian, with the apex on the axis, it is a cone. A ``radius`` above zero rounds its tip, which then is above
    the apex by radius (1/sin(semi_angle) - 1).

    Raises:
        SceneError: an angle outside (0, 90), a length not above zero, a radius that does not fit; as :class:`Profile`.

    >>> round(float(wedge((0.0, 1.0), 45.0, 2.0).distance(np.array([1.0, 1.0])).gap), 12)
    0.707106781187
    """
    x, y = place(apex, "wedge.apex")
    require_number(semi_angle, "wedge.semi_angle")
    require(0 < semi_angle < 90, "wedge.semi_angle", semi_angle, "in (0, 90) degrees")
    require_positive(**{"wedge.length": length})
    # A profile would take a tuple of them.
    checked_radius(radius, "wedge.radius")
    angle = np.radians(float(semi_angle))
    out, up = length * np.sin(angle), length * np.cos(angle)
    return Profile(((x + out, y + up), (x, y), (x - out, y + up)), radius)


def flat_punch(middle: tuple[float, float], width: float, height: float, radius: float = 0.0) -> Profile:
    """The punch with a flat face of ``width`` around its ``middle``, sides ``height`` high and edges of a ``radius``.

    Raises:
        SceneError: a width or height not above zero, a radius that does not fit; as :class:`Profile`.

    >>> float(flat_punch((0.0, 1.0), 2.0, 3.0, 0.5).distance(np.array([0.0, 0.25])).gap)
    0.75
    """
    x, y = place(middle, "punch.middle")
    require_positive(**{"punch.width": width, "punch.height": height})
    checked_radius(radius, "punch.radius")
    half = width / 2
    return Profile(((x + half, y + height), (x + half, y), (x - half, y), (x - half, y + height)), radius)
