r"""Outlines of rigid tools written a second time, for the fuzz study's recomputation: nothing of the library.

An outline is a chain of straights and arcs with the tool on its right. Where the nearest place of a point x is on

    a straight through a along t:      gap = n . (x - a),           normal n, t turned to the left,
    an arc of radius r around c:       gap = turn (|x - c| - r),    normal turn (x - c)/|x - c|,

``turn`` is 1 where the chain turns to the right around c, and -1 to the left; sharp corners are arcs of the radius
zero. The arc length of the nearest place grows along (n_y, -n_x). A tool of several outlines has the least of their
gaps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.element import Bools, Floats, Ints

JOINT = 1e-9
"""Of the span: who is no farther beyond the end of a straight is still at it, or at a sharp corner."""


@dataclass(frozen=True)
class Near:
    """Of points (c, 2): the ``piece`` (c,) that is nearest, gap, unit ``normal`` (c, 2), ``arc`` (c,).

    ``stretch`` (c,) is the arc that the nearest place comes along over the way of the point, ``past`` (c,) whether it
    is past an open end.
    """

    piece: Ints
    gap: Floats
    normal: Floats
    arc: Floats
    stretch: Floats
    past: Bools


@dataclass(frozen=True)
class Outline:
    """Straights from ``start`` (l, 2) ``along`` (l, 2), ``length`` (l,) long or inf; m arcs around ``centre`` (m, 2).

    ``low`` and ``high`` (l,) are how far straights go on, without an end at open ends. Arcs reach ``half`` (m,) an
    angle to either side of the directions ``middle`` (m, 2). ``begin`` (l + m,) are the arc lengths at which straights
    and arcs begin, ``around`` is the length of a closed chain, inf of an open one. ``thick`` is the diameter of the
    tool where it is a disc, else inf.
    """

    start: Floats
    along: Floats
    length: Floats
    low: Floats
    high: Floats
    centre: Floats
    radius: Floats
    turn: Floats
    middle: Floats
    half: Floats
    begin: Floats
    around: float
    span: float
    thick: float = np.inf

    @property
    def extent(self) -> float:
        """The size of its numbers."""
        return float(max(np.abs(self.start).max(initial=0.0), np.abs(self.centre).max(initial=0.0) + self.span))

    @property
    def centroid(self) -> Floats:
        """The mean (2,) of its places."""
        return np.vstack([self.start, self.centre]).mean(axis=0)

    def near(self, x: Floats) -> Near:
        """The nearest place of points x (c, 2)."""
        at = self._at_corner(x)
        on_straights, on_arcs = self._straights(x, np.where(at.any(axis=1), 0.0, JOINT * self.span)), self._arcs(x)
        # At a sharp corner a point is on no side of it for sure: its normal is the corner's own, the middle one. What
        # side of the outline it is on is told by the piece that is nearest, with no more than its own length.
        far = np.hstack([on_straights[0], on_arcs[0]])
        piece = np.argmin(np.hstack([on_straights[0], np.where(at, -1.0, on_arcs[0])]), axis=1)
        chosen = np.argmin(far, axis=1), piece, piece, piece
        gap, stretch, arc, past = (
            np.take_along_axis(np.hstack([a, b]), which[:, None], 1)[:, 0]
            for a, b, which in zip(on_straights[1:], on_arcs[1:], chosen, strict=True)
        )
        return Near(piece, gap, self._normal(x, piece), arc, stretch, past > 0)

    def _at_corner(self, x: Floats) -> Bools:
        """Which points (c, 2) are at sharp corners (c, m)."""
        return (self.radius == 0) & (np.linalg.norm(x[:, None] - self.centre, axis=2) <= JOINT * self.span)

    def _straights(self, x: Floats, slack: Floats) -> tuple[Floats, ...]:
        """Distance, gap, stretch, arc, past (c, l); inf where the foot is on no straight, its ends ``slack`` (c,)."""
        out = x[:, None] - self.start
        s, gap = np.vecdot(out, self.along), np.vecdot(out, left(self.along))
        on = (s >= self.low - slack[:, None]) & (s <= self.high + slack[:, None])
        arc = self.begin[: len(self.length)] + s
        past = np.isfinite(self.length) & (((s < 0) & np.isinf(self.low)) | ((s > self.length) & np.isinf(self.high)))
        return np.where(on, np.abs(gap), np.inf), gap, np.ones_like(s), arc, past.astype(float)

    def _arcs(self, x: Floats) -> tuple[Floats, ...]:
        """The same of arcs (c, m)."""
        out = x[:, None] - self.centre
        far, angle = np.hypot(*np.moveaxis(out, -1, 0)), angle_of(self.middle, out)
        clipped = np.clip(angle, -self.half, self.half)
        at = self._at_corner(x)
        on = at | (np.abs(angle - clipped) * np.maximum(self.radius, far) <= JOINT * self.span)
        away = np.where(on, np.abs(far - self.radius), np.inf)
        safe = np.where(far > 0, far, 1.0)
        arc = self.begin[len(self.length) :] + self.radius * (self.half - self.turn * clipped)
        gap = self.turn * (far - self.radius)
        return away, gap, np.where(at, 1.0, self.radius / safe), arc, np.zeros_like(far)

    def _normal(self, x: Floats, piece: Ints) -> Floats:
        """Unit normals (c, 2) where the nearest pieces (c,) are these; at a sharp corner the middle one."""
        straight = left(np.vstack([self.along, np.zeros((len(self.radius), 2))]))[piece]
        if not len(self.radius):
            return straight
        k = np.maximum(piece - len(self.length), 0)
        out = x - self.centre[k]
        far = np.linalg.norm(out, axis=1)
        at = (self.radius[k] == 0) & (far <= JOINT * self.span)
        way = np.where(at[:, None], self.middle[k], out / np.where(far > 0, far, 1.0)[:, None])
        return np.where((piece < len(self.length))[:, None], straight, self.turn[k, None] * way)

    def slid(self, x: Floats, by: Floats) -> Floats:
        """What gap and arc of points x (c, 2) grow by as they go ``by`` (c, 2), as (c, 2).

        Where the nearest piece stays the same it is not the difference of two places, which round-off would blur.
        """
        one, other = self.near(x), self.near(x + by)
        arc = other.arc - one.arc
        if np.isfinite(self.around):
            arc -= self.around * np.round(arc / self.around)
        out = np.column_stack([other.gap - one.gap, arc])
        straight = (one.piece == other.piece) & (one.piece < len(self.length))
        t = self.along[one.piece[straight]]
        out[straight] = np.column_stack([np.vecdot(left(t), by[straight]), np.vecdot(t, by[straight])])
        around = (one.piece == other.piece) & ~straight & ~self._sharp(one) & ~self._sharp(other)
        for k in np.unique(one.piece[around]).tolist():
            mine, m = around & (one.piece == k), k - len(self.length)
            begun = x[mine] - self.centre[m]
            ended = begun + by[mine]
            sizes = np.linalg.norm(begun, axis=1) + np.linalg.norm(ended, axis=1)
            farther = np.vecdot(begun + ended, by[mine]) / np.where(sizes > 0, sizes, 1.0)
            swept = np.arctan2(cross(begun, by[mine]), np.vecdot(begun, ended))
            out[mine] = self.turn[m] * np.column_stack([farther, -self.radius[m] * swept])
        return out

    def jumped(self, x: Floats, by: Floats) -> Bools:
        """Whether points x (c, 2) that go ``by`` (c, 2) change the piece, or are at a sharp corner: at any of its."""
        one, other = self.near(x), self.near(x + by)
        return (one.piece != other.piece) | self._sharp(one) | self._sharp(other)

    def _sharp(self, near: Near) -> Bools:
        radius = np.append(np.ones_like(self.length), self.radius)[near.piece]
        return (radius == 0) & (np.abs(near.gap) <= JOINT * self.span)

    def places(self, count: int, reach: float) -> Floats:
        """Places (k, 2) all along the chain, ``count`` on each piece, as far as ``reach`` beyond open ends."""
        part = np.linspace(0.0, 1.0, count)[:, None]
        low, high = (np.clip(end, -reach, self.length + reach) for end in (self.low, self.high))
        found = [a + (b + part * (c - b)) * t for a, t, b, c in zip(self.start, self.along, low, high, strict=True)]
        for c, r, m, half in zip(self.centre, self.radius, self.middle, self.half, strict=True):
            angle = np.arctan2(m[1], m[0]) + (2 * part - 1) * half
            found.append(c + r * np.hstack([np.cos(angle), np.sin(angle)]))
        return np.vstack(found)


def left(v: Floats) -> Floats:
    """Vectors (…, 2) turned to the left by a right angle."""
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


def cross(a: Floats, b: Floats) -> Floats:
    """a_x b_y - a_y b_x."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def angle_of(from_: Floats, to: Floats) -> Floats:
    """The angle to the left from vectors (…, 2) to others."""
    return np.arctan2(cross(from_, to), np.vecdot(from_, to))
