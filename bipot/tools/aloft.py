"""Ways of points to tools through the air: seen from a tool that turns, which moves evenly, they are not straight."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bipot.tensors import norm
from bipot.tools.poses import angles_of, pose_size, turned_on
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Ints, max_abs

PARTS, TIMES = 16, 14
"""Parts into which an increment, then one of these, and so on is divided to find where a candidate first touches.

Of an increment in which something turns round more than once each turn is divided so at first, up to TURNS of them.
"""

TURNS = 64


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
        """Their displacement (w, …, d) after a ``part`` (w, …) of the increment."""
        each, angle = _each(part), part[..., None] * self.angle[_each(part)][..., None]
        return part[..., None] * self.by[each] + turned_on(self.axis[each], angle, self.arm[each])

    def only(self, own: Ints) -> Carried:
        """Those of the ``own`` points (m,)."""
        return Carried(*(field[own] for field in self))


class Aloft(NamedTuple):
    """Parts at x (w, d) that are ``carried`` while tools in the poses ``placed`` (k, p) ``advance`` (k, p)."""

    x: Floats
    carried: Carried
    placed: Floats
    advance: Floats


class Way(NamedTuple):
    """Of m points at x (m, d) that are ``carried`` as their ``tool`` in the ``pose`` (p,) advances."""

    tool: Tool
    x: Floats
    carried: Carried
    pose: Floats
    advance: Floats

    def gone(self, part: Floats) -> Floats:
        """How far (m, …, d) they have gone in the frame of the tool after a ``part`` (m, …) of the increment."""
        return self.tool.going(self.x[_each(part)], self.carried.after(part), self.pose, self.advance, part)

    def seen(self, part: Floats) -> Floats:
        """Where they are then in the frame of the tool (m, …, d)."""
        return self.tool.own(self.x, self.pose)[_each(part)] + self.gone(part)

    def in_air(self, gaps: Callable[[Ints, Floats], Floats], owner: Ints) -> Floats:
        """Parts of the increment (m,) before their candidates touch, of which some at (m, …, d) have ``gaps`` (c, …).

        Point by point the ``owner`` (m,) is its candidate. Those that do not touch at the end go the part by which
        that closes their gap.
        """
        every = np.arange(len(self.x))
        gap, left = (gaps(every, self.seen(np.full(len(self.x), part))) for part in (0.0, 1.0))
        out = np.clip(1 - np.divide(left, gap, out=np.ones_like(gap), where=gap > 0), 0.0, 1.0)
        lands = left < 0
        if lands.any():
            out[lands] = self._before(gaps, owner, lands)[lands]
        return out[owner]

    def _before(self, gaps: Callable[[Ints, Floats], Floats], owner: Ints, lands: Bools) -> Floats:
        """That (c,) of candidates that are the ones which touch at the end."""
        # Few of many land in an increment, and only those are looked for.
        some = np.flatnonzero(lands[owner])
        way = self._replace(x=self.x[some], carried=self.carried.only(some))
        early, step, parts = np.zeros(len(lands)), 1.0, PARTS * way.turns
        for _ in range(TIMES):
            step /= parts
            late = early[:, None] + step * np.arange(1, parts)
            touches = gaps(some, way.seen(late[owner[some]])) < 0
            early += step * np.where(touches.any(axis=1), np.argmax(touches, axis=1), parts - 1)
            parts = PARTS
        return early

    @property
    def turns(self) -> int:
        """How often the tool or a point turns round, rounded up, from one to TURNS."""
        own = float(norm(angles_of(self.advance)))
        return math.ceil(np.clip(max(own, max_abs(self.carried.angle)) / math.tau, 1, TURNS))


def _each(part: Floats) -> tuple[slice | None, ...]:
    """Index of the points (m, d) to which parts (m, …) of the increment apply one by one."""
    return (slice(None), *(None,) * (part.ndim - 1))
