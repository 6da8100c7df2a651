r"""Lines of straights and rounds in sequence: the nearest places of points, and where straight paths meet them.

Along the line with the tangent tau the tool is on the right, so the normal n, which points into the body, is tau turned
to the left, and the arc grows along the tangent (n_y, -n_x) of :mod:`bipot.tools.surfaces`. A round of the radius r
around C turns to the right where it is convex (turn = 1) and to the left where it is concave (turn = -1):

    gap = turn (|x - C| - r),    curvature of the line of equal gaps = turn/|x - C|,    1 - c g = r/|x - C|.

A sharp corner is a round of radius zero: it is the nearest place of a whole sector of points, outside a convex corner
or inside the tool at a concave one, and all of these have the same arc. At the corner itself the normal is the middle
one of the sector.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bipot.tensors import norm, unit
from bipot.tools.circle import ROUND
from bipot.tools.plane import angle_between, farther, leftwards
from bipot.tools.surfaces import frames
from bipot.typing import Bools, Floats, Ints, einsum

ROUND_OFF = 16 * float(np.finfo(float).eps)
"""Relative round-off of positions, by which a point may lie beside the strip or sector of its piece."""

AT = 1e-9
"""A point no farther from an open end or a sharp corner than this, over the span, is at it."""


class Foot(NamedTuple):
    """At points (…): number of the nearest ``piece``, ``gap``, ``normal`` (…, d), ``curvature`` c and ``arc``."""

    piece: Ints
    gap: Floats
    normal: Floats
    curvature: Floats
    arc: Floats


class Rounds(NamedTuple):
    """Arcs (m,) around ``centre`` (m, d), with the tangents ``first`` and ``last`` (m, d), that begin at ``arc`` (m,)
    and ``turn`` (m,) by less than half a circle: 1 to the right, -1 to the left.
    """

    centre: Floats
    radius: Floats
    turn: Floats
    first: Floats
    last: Floats
    arc: Floats

    def angle(self, piece: Ints, out: Floats) -> Floats:
        """Angle (…) from the beginning of rounds to the directions ``out`` (…, d) from their centres."""
        begin, turn = leftwards(self.first)[piece] * self.turn[piece][..., None], self.turn[piece]
        return -turn * angle_between(begin, out)


class Straights(NamedTuple):
    """Pieces (l,) from ``start`` (l, d) ``along`` (l, d) between ``low`` and ``high`` (l,), infinite at open ends.

    They begin at ``arc`` (l,), are ``length`` (l,) long and have the ``normal`` (l, d).
    """

    start: Floats
    along: Floats
    normal: Floats
    length: Floats
    low: Floats
    high: Floats
    arc: Floats

    @property
    def ends(self) -> Floats:
        """Ends (l, 2, d); those of an open line are at its first and last point."""
        return np.stack([self.start, self.start + self.length[:, None] * self.along], axis=1)


@dataclass(frozen=True)
class ProfilePieces:
    """A line of m ``rounds`` and l ``straights``, numbered in this order, of the ``length`` (inf where it is open).

    ``span`` is the diagonal of the box around its corners, ``extent`` the magnitude of its places and lengths.
    """

    rounds: Rounds
    straights: Straights
    length: float
    span: float
    extent: float

    def gap(self, x: Floats) -> Floats:
        """The gap (…) of points x (…, d)."""
        return self._nearest(x)[1]

    def foot(self, x: Floats) -> Foot:
        """The nearest place of points x (…, d)."""
        piece, gap = self._nearest(x)
        m, round_, straight = self._numbers(piece)
        along = np.vecdot(x - self.straights.start[straight], self.straights.along[straight])
        arc, normal = self.straights.arc[straight] + along, self.straights.normal[straight]
        if not m:
            return Foot(piece, gap, normal, np.zeros_like(gap), arc)
        out, turn, is_round = x - self.rounds.centre[round_], self.rounds.turn[round_], piece < m
        far = norm(out)
        safe = np.where(far > 0, far, 1.0)
        # At the centre no direction is nearest: the middle one is taken.
        outward = unit(out, self.middle[round_])
        around = self.rounds.arc[round_] + self.rounds.radius[round_] * self.rounds.angle(round_, outward)
        normal = np.where(is_round[..., None], turn[..., None] * outward, normal)
        foot = Foot(piece, gap, normal, np.where(is_round, turn / safe, 0.0), np.where(is_round, around, arc))
        return self._at_corners(x, foot)

    def _numbers(self, piece: Ints) -> tuple[int, Ints, Ints]:
        """Number of rounds; numbers (…) of pieces among rounds and straights, arbitrary for those of the other kind."""
        m = len(self.rounds.radius)
        return m, np.minimum(piece, m - 1), np.maximum(piece - m, 0)

    def _at_corners(self, x: Floats, foot: Foot) -> Foot:
        """``foot``, with the middle normal where points x (…, d) are at a sharp corner, beside it only by round-off."""
        sharp = np.flatnonzero(self.rounds.radius == 0)
        if not sharp.size:
            return foot
        far = norm(x[..., None, :] - self.rounds.centre[sharp])
        at, nearest = far.min(axis=-1) <= self._near(x), sharp[np.argmin(far, axis=-1)]
        middle = self.rounds.turn[nearest][..., None] * self.middle[nearest]
        return foot._replace(
            normal=np.where(at[..., None], middle, foot.normal), curvature=np.where(at, 0.0, foot.curvature)
        )

    def grown(self, piece: Ints, x: Floats, by: Floats) -> Floats:
        """Growth of gap and arc (…, 2) of points x (…, d) nearest to a ``piece`` (…) that move ``by`` (…, d)."""
        m, round_, straight = self._numbers(piece)
        out = einsum("...ij,...j->...i", frames(self.straights.normal[straight]), by)
        if not m:
            return out
        start, turn = x - self.rounds.centre[round_], self.rounds.turn[round_]
        # Like the difference of the distances the angle is without the round-off of either.
        around = -self.rounds.radius[round_] * angle_between(start, start + by, by)
        around = np.stack([farther(start, by), around], axis=-1)
        return np.where((piece < m)[..., None], turn[..., None] * around, out)

    def beyond(self, x: Floats) -> Bools:
        """Whether the nearest place of points x (…, d) is past an open end (…)."""
        piece, _ = self._nearest(x)
        m, _, straight = self._numbers(piece)
        s = self.straights
        along = np.vecdot(x - s.start[straight], s.along[straight])
        past = np.maximum(-along, along - s.length[straight]) > self._near(x)
        return past & (piece >= m)

    def drawn(self) -> Floats:
        """Points (p, d) along the line: ends of straights, and between them :data:`ROUND` to a whole circle."""
        parts = list(zip(self.straights.arc.tolist(), self.straights.ends, strict=True))
        arcs, sharp = self.rounds.arc.tolist(), self.rounds.radius == 0
        parts += [(arc, self._between(k)) for k, arc in enumerate(arcs) if not sharp[k]]
        line = np.concatenate([points for _, points in sorted(parts, key=lambda part: part[0])])
        # A sharp corner ends two straights.
        return line[np.append(True, norm(np.diff(line, axis=0)) > AT * self.span)]

    def _between(self, k: int) -> Floats:
        """Points (p, d) between the ends of the k-th round."""
        first, turn = self.rounds.first[k], float(self.rounds.turn[k])
        swept = abs(float(angle_between(first, self.rounds.last[k])))
        count = int(np.ceil(swept / (2 * np.pi) * ROUND))
        angle = -turn * swept * np.arange(1, count)[:, None] / count
        begin = turn * leftwards(first)
        return self.rounds.centre[k] + self.rounds.radius[k] * (
            np.cos(angle) * begin + np.sin(angle) * leftwards(begin)
        )

    def met(self, x: Floats, by: Floats) -> Floats:
        """Where (…, p) paths from x (…, d) ``by`` (…, d) meet the line, as sorted fractions; 1 where they do not."""
        s, off = self.straights, self._off(x + by)
        across = np.vecdot(by[..., None, :], s.normal)
        gap = np.vecdot(x[..., None, :] - s.start, s.normal)
        part = np.divide(-gap, across, out=np.full_like(gap, np.nan), where=np.abs(across) > np.abs(gap))
        at = np.vecdot(x[..., None, :] + np.nan_to_num(part)[..., None] * by[..., None, :] - s.start, s.along)
        on = (part > 0) & (at >= s.low - off) & (at <= s.high + off)
        return np.sort(np.concatenate([np.where(on, part, 1.0), *self._met_rounds(x, by)], axis=-1), axis=-1)

    def _met_rounds(self, x: Floats, by: Floats) -> list[Floats]:
        """Where paths meet the rounds, as fractions (…, m) for the way in and the way out."""
        out, off = x[..., None, :] - self.rounds.centre, self._off(x + by)
        b, a = np.vecdot(out, by[..., None, :]), np.vecdot(by, by)[..., None]
        root = b**2 - a * (norm(out) ** 2 - self.rounds.radius**2)
        found = []
        for sign in (-1.0, 1.0):
            meets = (root > 0) & (a > 0) & (self.rounds.radius > 0)
            part = np.divide(-b + sign * np.sqrt(np.maximum(root, 0)), a, out=np.full_like(b, np.nan), where=meets)
            at = out + np.nan_to_num(part)[..., None] * by[..., None, :]
            found.append(np.where((part > 0) & (part < 1) & self._in_sector(at, off), part, 1.0))
        return found

    def _nearest(self, x: Floats) -> tuple[Ints, Floats]:
        """Number (…) of the piece that is nearest to points x (…, d), and the gap (…)."""
        off, s = self._off(x), self.straights
        out, ahead = x[..., None, :] - self.rounds.centre, x[..., None, :] - s.start
        along = np.vecdot(ahead, s.along)
        on = (along >= s.low - off) & (along <= s.high + off)
        gap = np.concatenate([self.rounds.turn * (norm(out) - self.rounds.radius), np.vecdot(ahead, s.normal)], axis=-1)
        beside = np.concatenate([self._in_sector(out, off), on], axis=-1)
        piece = np.argmin(np.where(beside, np.abs(gap), np.inf), axis=-1)
        chosen = np.arange(piece.size) * gap.shape[-1] + piece.ravel()
        return piece, gap.ravel()[chosen].reshape(piece.shape)

    def _in_sector(self, out: Floats, off: Floats) -> Bools:
        """Whether places ``out`` (…, m, d), seen from the centres, are in the sectors of the rounds."""
        return (np.vecdot(out, self.rounds.first) >= -off) & (np.vecdot(out, self.rounds.last) <= off)

    def _off(self, x: Floats) -> Floats:
        """Round-off (…, 1) of places x (…, d) along the pieces."""
        return ROUND_OFF * (norm(x) + self.extent)[..., None]

    def _near(self, x: Floats) -> Floats:
        """The distance (…) that counts as zero for points x (…, d)."""
        return AT * self.span + self._off(x)[..., 0]

    @cached_property
    def middle(self) -> Floats:
        """Directions (m, d) from the centres to the middle of the rounds."""
        between = self.rounds.first - self.rounds.last
        return between / norm(between)[:, None]
