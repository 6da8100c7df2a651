r"""Where candidates meet their tools at the end of an increment, and how that changes as they move.

A candidate that its tool sees at y goes to y + dy in the increment. Its gap at the end is that at the start and what
it grew by; its slip is the arc of the surface between the nearest points of start and end, so slips add up over
increments (:mod:`bipot.surfaces`). Of who starts apart from the tool it begins where the body at rest would come to
touch it: what goes on in the air is no slip (:func:`in_air`). Forces r = (r_n, r_t) dual to them are, with frame n, t
and curvature c at the end,

    r_n n + r_t (1 - c g) t,

along the frame where the gap g is zero, and change with the place by

    r_n c t t' - r_t c (1 - c g) (n t' + t n').
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.surfaces import frames
from bipot.tools import Tool
from bipot.typing import Bools, Floats

HALVINGS = 40
"""Of an increment: when a candidate that comes through the air touches."""


class Going(NamedTuple):
    """Points x (c, d) that go ``by`` (c, d) while tools in the poses ``placed`` (k, 3) go on by ``advance`` (k, 3)."""

    x: Floats
    by: Floats
    placed: Floats
    advance: Floats


@dataclass(frozen=True)
class Meeting:
    """Of c candidates: gap at the end and slip ``motion`` (c, d), their derivatives by the place ``frames`` (c, d, d),
    the ``curvature`` (c,) of the lines of equal gaps they are on; as their tools see them they were at ``place`` (c, d)
    and went ``by`` (c, d).
    """

    motion: Floats
    frames: Floats
    curvature: Floats
    place: Floats
    by: Floats

    @staticmethod
    def at(tools: Sequence[Tool], owned: Bools, gap: Floats, going: Going, before: Floats) -> Meeting:
        """Of candidates that start with a ``gap`` (c,) and are ``going``; ``owned`` (k, c) says whose they are.

        What arcs they come along ``before`` (c,) they touch is no slip.
        """
        motion, normal, curvature = np.empty_like(going.x), np.empty_like(going.x), np.empty(len(gap))
        place, by = np.empty_like(going.x), np.empty_like(going.x)
        for mine, tool, pose, advance in zip(owned, tools, going.placed, going.advance, strict=True):
            place[mine] = start = tool.own(going.x[mine], pose)
            by[mine] = went = tool.going(going.x[mine], going.by[mine], pose, advance)
            motion[mine] = tool.face.passed(start, went)
            _, own, curvature[mine] = tool.face.distance(start + went)
            normal[mine] = tool.turned(own, pose + advance)
        motion[:, 0] += gap
        motion[:, 1] -= before
        return Meeting(motion, _slopes(motion[:, 0], normal, curvature), curvature, place, by)

    def bending(self, r: Floats) -> Floats:
        """Derivative (c, d, d) of the vectors of forces r (c, d) by the candidates' places (module docstring)."""
        normal, along = self.frames[:, 0], self.frames[:, 1]
        tangent = frames(normal)[:, 1]
        crossed = normal[:, :, None] * along[:, None]
        c, (push, shear) = self.curvature[:, None, None], r.T[:, :, None, None]
        turned = tangent[:, :, None] * tangent[:, None]
        return c * (push * turned - shear * (crossed + crossed.transpose(0, 2, 1)))


def in_air(tools: Sequence[Tool], owned: Bools, apart: Bools, going: Going) -> Floats:
    """Arcs (c,) that candidates which start ``apart`` (c,) from their tools come along before these touch them.

    Of those that are ``going`` as in a body at rest, and on the whole way of who does not touch then.
    """
    out = np.zeros(len(apart))
    for mine, tool, pose, advance in zip(owned, tools, going.placed, going.advance, strict=True):
        own = np.flatnonzero(mine & apart)
        start, by = tool.own(going.x[own], pose), tool.going(going.x[own], going.by[own], pose, advance)
        early, late = np.zeros(len(own)), np.ones(len(own))
        off = tool.face.distance(start + by).gap >= 0
        for _ in range(HALVINGS):
            middle = (early + late) / 2
            touches = tool.face.distance(start + middle[:, None] * by).gap < 0
            early, late = np.where(touches, early, middle), np.where(touches, middle, late)
        out[own] = tool.face.passed(start, np.where(off, 1.0, early)[:, None] * by)[..., 1]
    return out


def slopes(tools: Sequence[Tool], owned: Bools, x: Floats, placed: Floats) -> Floats:
    """Derivatives (c, d, d) of gap and arc of candidates at x (c, d), their tools in the poses ``placed`` (k, 3)."""
    gap, normal, curvature = np.empty(len(x)), np.empty_like(x), np.empty(len(x))
    for mine, tool, pose in zip(owned, tools, placed, strict=True):
        gap[mine], own, curvature[mine] = tool.face.distance(tool.own(x[mine], pose))
        normal[mine] = tool.turned(own, pose)
    return _slopes(gap, normal, curvature)


def _slopes(gap: Floats, normal: Floats, curvature: Floats) -> Floats:
    out = frames(normal)
    out[:, 1] *= (1 - curvature * gap)[:, None]
    return out
