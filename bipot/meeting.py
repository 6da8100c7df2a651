r"""Where candidates meet their tools at the end of an increment, and how that changes as they move.

A candidate at y relative to its tool goes to y + dy in the increment. Its gap at the end is that at the start and what
it grew by; its slip is the arc of the surface between the nearest points of start and end, so slips add up over
increments (:mod:`bipot.surfaces`). Forces r = (r_n, r_t) dual to them are, with frame n, t and curvature c at the end,

    r_n n + r_t (1 - c g) t,

along the frame where the gap g is zero, and change with the place by

    r_n c t t' - r_t c (1 - c g) (n t' + t n').
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bipot.surfaces import frames
from bipot.tools import Tool
from bipot.typing import Bools, Floats


@dataclass(frozen=True)
class Meeting:
    """Of c candidates: gap at the end and slip ``motion`` (c, d), their derivatives by the place ``frames`` (c, d, d),
    the ``curvature`` (c,) of the lines of equal gaps they are on, who ``crossed`` (c,) the tool on the way, and who
    came ``beyond`` (c,) an open end of it.
    """

    motion: Floats
    frames: Floats
    curvature: Floats
    crossed: Bools
    beyond: Bools

    @staticmethod
    def at(tools: Sequence[Tool], owned: Bools, gap: Floats, place: Floats, by: Floats) -> Meeting:
        """Of candidates at a ``place`` (c, d) relative to their tools with a ``gap`` (c,) there, that go ``by`` (c, d).

        ``owned`` (k, c) says whose they are.
        """
        motion, normal, curvature = np.empty_like(place), np.empty_like(place), np.empty(len(place))
        crossed, beyond = np.zeros((2, len(place)), dtype=bool)
        for mine, tool in zip(owned, tools, strict=True):
            face, start, end = tool.face, place[mine], place[mine] + by[mine]
            crossed[mine], beyond[mine] = face.crossed(start, by[mine]), face.beyond(end)
            motion[mine] = face.passed(start, by[mine])
            _, normal[mine], curvature[mine] = face.distance(end)
        motion[:, 0] += gap
        return Meeting(motion, _slopes(motion[:, 0], normal, curvature), curvature, crossed, beyond)

    def bending(self, r: Floats) -> Floats:
        """Derivative (c, d, d) of the vectors of forces r (c, d) by the candidates' places (module docstring)."""
        normal, along = self.frames[:, 0], self.frames[:, 1]
        tangent = frames(normal)[:, 1]
        crossed = normal[:, :, None] * along[:, None]
        c, (push, shear) = self.curvature[:, None, None], r.T[:, :, None, None]
        turned = tangent[:, :, None] * tangent[:, None]
        return c * (push * turned - shear * (crossed + crossed.transpose(0, 2, 1)))


def slopes(tools: Sequence[Tool], owned: Bools, place: Floats) -> Floats:
    """Derivatives (c, d, d) of gap and arc of candidates at a ``place`` (c, d) relative to their tools."""
    gap, normal, curvature = np.empty(len(place)), np.empty_like(place), np.empty(len(place))
    for mine, tool in zip(owned, tools, strict=True):
        gap[mine], normal[mine], curvature[mine] = tool.face.distance(place[mine])
    return _slopes(gap, normal, curvature)


def _slopes(gap: Floats, normal: Floats, curvature: Floats) -> Floats:
    out = frames(normal)
    out[:, 1] *= (1 - curvature * gap)[:, None]
    return out
