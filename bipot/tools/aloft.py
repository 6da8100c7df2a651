"""Ways of points to tools through the air: seen from a tool that turns, which moves evenly, they are not straight."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bipot.tools.tool import Tool
from bipot.typing import Floats, Ints

PARTS, TIMES = 16, 14
"""Parts into which an increment, then one of these, and so on is divided to find where a candidate first touches."""


class Way(NamedTuple):
    """Of m points at x (m, d) that move ``by`` (m, d), evenly, as their ``tool`` in the ``pose`` (p,) advances."""

    tool: Tool
    x: Floats
    by: Floats
    pose: Floats
    advance: Floats

    def gone(self, part: Floats) -> Floats:
        """How far (m, …, d) they have gone in the frame of the tool after a ``part`` (m, …) of the increment."""
        each = _each(part)
        return self.tool.going(self.x[each], self.by[each], self.pose, self.advance, part)

    def seen(self, part: Floats) -> Floats:
        """Where they are then in the frame of the tool (m, …, d)."""
        return self.tool.own(self.x, self.pose)[_each(part)] + self.gone(part)

    def in_air(self, gaps: Callable[[Floats], Floats], owner: Ints) -> Floats:
        """Parts of the increment (m,) before their candidates touch, whose points at (m, …, d) have ``gaps`` (c, …).

        Point by point the ``owner`` (m,) is its candidate. Those that do not touch at the end go the part by which
        that closes their gap.
        """
        gap, left = (gaps(self.seen(np.full(len(self.x), part))) for part in (0.0, 1.0))
        out = np.clip(1 - np.divide(left, gap, out=np.ones_like(gap), where=gap > 0), 0.0, 1.0)
        lands = left < 0
        if lands.any():
            out[lands] = self._before(gaps, owner, len(gap))[lands]
        return out[owner]

    def _before(self, gaps: Callable[[Floats], Floats], owner: Ints, count: int) -> Floats:
        """That (c,) of candidates that touch at the end."""
        early, step = np.zeros(count), 1.0
        for _ in range(TIMES):
            step /= PARTS
            late = early[:, None] + step * np.arange(1, PARTS)
            touches = gaps(self.seen(late[owner])) < 0
            early += step * np.where(touches.any(axis=1), np.argmax(touches, axis=1), PARTS - 1)
        return early


def _each(part: Floats) -> tuple[slice | None, ...]:
    """Index of the points (m, d) to which parts (m, …) of the increment apply one by one."""
    return (slice(None), *(None,) * (part.ndim - 1))
