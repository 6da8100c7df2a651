"""Ways of points to tools through the air; seen from a tool that turns, they are not straight."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bipot.tools.poses import pose_size, turned_on
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Ints

PARTS, TIMES = 16, 14
"""To find when a candidate first touches, the increment is divided into PARTS, then one of these, and so on, TIMES.

No tool turns by more than a part of a circle in one (:mod:`bipot.checks.refusals`).
"""


class Carried(NamedTuple):
    """How w points are carried along: evenly ``by`` (w, d), and by a turn of their ``arm`` (w, d) by ``angle`` (w,).

    The turn is about the ``axis`` (w, 1), in space (w, 3).
    """

    by: Floats
    arm: Floats
    angle: Floats
    axis: Floats

    @staticmethod
    def evenly(by: Floats) -> Carried:
        """Along ``by`` (w, d), without any turn."""
        count, d = by.shape
        return Carried(by, np.zeros_like(by), np.zeros(count), np.zeros((count, pose_size(d) - d)))

    def after(self, part: Floats) -> Floats:
        """The points' displacement (w, …, d) after a ``part`` (w, …) of the increment."""
        each, angle = _each(part), part[..., None] * self.angle[_each(part)][..., None]
        return part[..., None] * self.by[each] + turned_on(self.axis[each], angle, self.arm[each])

    def only(self, points: Ints) -> Carried:
        """The same of some ``points`` (m,) only."""
        return Carried(*(field[points] for field in self))


class Way(NamedTuple):
    """The way of m points that are ``carried`` from x (m, d) while their ``tool`` in the ``pose`` (p,) advances."""

    tool: Tool
    x: Floats
    carried: Carried
    pose: Floats
    advance: Floats

    def gone(self, part: Floats) -> Floats:
        """The points' motion (m, …, d) in the frame of the tool after a ``part`` (m, …) of the increment."""
        return self.tool.going(self.x[_each(part)], self.carried.after(part), self.pose, self.advance, part)

    def seen(self, part: Floats) -> Floats:
        """The points' places (m, …, d) in the frame of the tool after a ``part`` (m, …) of the increment."""
        return self.tool.own(self.x, self.pose)[_each(part)] + self.gone(part)

    def in_air(self, gaps: Callable[[Ints, Floats], Floats], owner: Ints) -> Floats:
        """The part of the increment (m,) before each point's candidate, its ``owner`` (m,), touches.

        ``gaps(some, places)`` are those (c, …) of candidates if ``some`` points (s,) are at ``places`` (s, …, d). For
        candidates that do not touch by the end, it is the part of their gap that closes.
        """
        every = np.arange(len(self.x))
        gap, left = (gaps(every, self.seen(np.full(len(self.x), part))) for part in (0.0, 1.0))
        out = np.clip(1 - np.divide(left, gap, out=np.ones_like(gap), where=gap > 0), 0.0, 1.0)
        lands = left < 0
        if lands.any():
            out[lands] = self._before(gaps, owner, lands)[lands]
        return out[owner]

    def _before(self, gaps: Callable[[Ints, Floats], Floats], owner: Ints, lands: Bools) -> Floats:
        """The part (c,) before candidates touch, computed for those that ``lands`` (c,) marks."""
        # Few of many candidates land in an increment, and only their points are followed.
        some = np.flatnonzero(lands[owner])
        way = self._replace(x=self.x[some], carried=self.carried.only(some))
        early, step = np.zeros(len(lands)), 1.0
        for _ in range(TIMES):
            step /= PARTS
            late = early[:, None] + step * np.arange(1, PARTS)
            touches = gaps(some, way.seen(late[owner[some]])) < 0
            early += step * np.where(touches.any(axis=1), np.argmax(touches, axis=1), PARTS - 1)
        return early


def _each(part: Floats) -> tuple[slice | None, ...]:
    """The index that makes arrays of points (m, d) broadcast with parts (m, …) of the increment."""
    return (slice(None), *(None,) * (part.ndim - 1))
