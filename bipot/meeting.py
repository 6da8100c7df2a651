r"""Where candidates meet their tools at the end of an increment, and how that changes as they move.

A candidate that its tool sees at y goes to y + dy in the increment. Its gap at the end is that at the start and what
it grew by; its slip is the arc of the surface between the nearest points of start and end, so slips add up over
increments (:mod:`bipot.surfaces`). Of who starts apart from the tool it begins where the body at rest would come to
touch it: what goes on in the air is no slip (:meth:`Faces.in_air`). Forces r = (r_n, r_t) dual to them are, with frame
n, t and curvature c at the end,

    r_n n + r_t (1 - c g) t,

along the frame where the gap g is zero, and change with the place by

    r_n c t t' - r_t c (1 - c g) (n t' + t n').

By the pose of the tool that is driven they change as :mod:`bipot.coupling` says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.poses import across
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
    the ``curvature`` (c,) of the lines of equal gaps they are on, ``arm`` (c, d) where they are seen from the centre
    about which their tool turns, zero if it does not; as their tools see them they were at ``place`` (c, d) and went
    ``by`` (c, d).
    """

    motion: Floats
    frames: Floats
    curvature: Floats
    arm: Floats
    place: Floats
    by: Floats

    def bending(self, r: Floats) -> Floats:
        """Derivative (c, d, d) of the vectors of forces r (c, d) by the candidates' places (module docstring)."""
        normal, along = self.frames[:, 0], self.frames[:, 1]
        tangent = frames(normal)[:, 1]
        crossed = normal[:, :, None] * along[:, None]
        c, (push, shear) = self.curvature[:, None, None], r.T[:, :, None, None]
        turned = tangent[:, :, None] * tangent[:, None]
        return c * (push * turned - shear * (crossed + crossed.transpose(0, 2, 1)))


@dataclass(frozen=True)
class Faces:
    """The surfaces of tools as c candidates meet them; ``owned`` (k, c) says whose they are."""

    tools: Sequence[Tool]
    owned: Bools

    def distance(self, x: Floats, placed: Floats) -> Floats:
        """Gap (c,) of points x (c, d) to the tools in the poses ``placed`` (k, 3), good to its round-off."""
        gap = np.empty(len(x))
        for mine, tool, pose in zip(self.owned, self.tools, placed, strict=True):
            gap[mine] = tool.distance(x[mine], pose)
        return gap

    def places(self, x: Floats, placed: Floats) -> Floats:
        """Magnitude (c,) of the numbers whose difference :meth:`distance` is."""
        out = np.empty(len(x))
        for mine, tool, pose in zip(self.owned, self.tools, placed, strict=True):
            out[mine] = tool.places(x[mine], pose)
        return out

    def slopes(self, x: Floats, placed: Floats) -> Floats:
        """Derivatives (c, d, d) of gap and arc of points x (c, d), their tools in the poses ``placed`` (k, 3)."""
        gap, normal, curvature = np.empty(len(x)), np.empty_like(x), np.empty(len(x))
        for mine, tool, pose in zip(self.owned, self.tools, placed, strict=True):
            gap[mine], own, curvature[mine] = tool.face.distance(tool.own(x[mine], pose))
            normal[mine] = tool.turned(own, pose)
        return _slopes(gap, normal, curvature)

    def arms(self, x: Floats, placed: Floats) -> Floats:
        """The ``arm`` (c, d) of :class:`Meeting` of points x (c, d), their tools in the poses ``placed`` (k, 3)."""
        out = np.empty_like(x)
        for mine, tool, pose in zip(self.owned, self.tools, placed, strict=True):
            out[mine] = tool.arm(x[mine], pose)
        return out

    def meeting(self, gap: Floats, going: Going, before: Floats) -> Meeting:
        """Of candidates that start with a ``gap`` (c,) and are ``going``.

        What arcs they come along ``before`` (c,) they touch is no slip.
        """
        motion, normal, curvature = np.empty_like(going.x), np.empty_like(going.x), np.empty(len(gap))
        place, by, arm = (np.empty_like(going.x) for _ in range(3))
        for mine, tool, pose, advance in zip(self.owned, self.tools, going.placed, going.advance, strict=True):
            place[mine] = start = tool.own(going.x[mine], pose)
            by[mine] = went = tool.going(going.x[mine], going.by[mine], pose, advance)
            motion[mine] = tool.face.passed(start, went)
            _, own, curvature[mine] = tool.face.distance(start + went)
            normal[mine] = tool.turned(own, pose + advance)
            arm[mine] = tool.arm(going.x[mine] + going.by[mine], pose + advance)
        motion[:, 0] += gap
        motion[:, 1] -= before
        return Meeting(motion, _slopes(motion[:, 0], normal, curvature), curvature, arm, place, by)

    def in_air(self, apart: Bools, going: Going) -> Floats:
        """Arcs (c,) that candidates which start ``apart`` (c,) from curved tools come along before these touch them.

        Of those that are ``going`` as in a body at rest, and on the whole way of who does not touch then.
        """
        out = np.zeros(len(apart))
        for mine, tool, pose, advance in zip(self.owned, self.tools, going.placed, going.advance, strict=True):
            own = np.flatnonzero(mine & apart & (not tool.flat))
            start, by = tool.own(going.x[own], pose), tool.going(going.x[own], going.by[own], pose, advance)
            early, late = np.zeros(len(own)), np.ones(len(own))
            off = tool.face.distance(start + by).gap >= 0
            for _ in range(HALVINGS):
                middle = (early + late) / 2
                touches = tool.face.distance(start + middle[:, None] * by).gap < 0
                early, late = np.where(touches, early, middle), np.where(touches, middle, late)
            out[own] = tool.face.passed(start, np.where(off, 1.0, early)[:, None] * by)[..., 1]
        return out

    def crossed(self, meeting: Meeting) -> Bools:
        """Who (c,) went through a tool and came out on another side of it."""
        out = np.zeros(len(meeting.place), dtype=bool)
        for mine, tool in zip(self.owned, self.tools, strict=True):
            out[mine] = tool.face.crossed(meeting.place[mine], meeting.by[mine])
        return out

    def beyond(self, meeting: Meeting) -> Bools:
        """Who (c,) came past an open end of a tool."""
        out = np.zeros(len(meeting.place), dtype=bool)
        for mine, tool in zip(self.owned, self.tools, strict=True):
            out[mine] = tool.face.beyond(meeting.place[mine] + meeting.by[mine])
        return out

    def swept(self, x: Floats, placed: Floats, advance: Floats) -> Floats:
        """How far (c, d) turns take the tools' points at x (c, d), half an ``advance`` (k, 3) on."""
        out = np.zeros_like(x)
        for mine, tool, pose, by in zip(self.owned, self.tools, placed, advance, strict=True):
            if tool.turn is not None:
                out[mine] = tool.turn.carried(x[mine], pose, by)
        return out

    def moments(self, vectors: Floats, x: Floats, placed: Floats) -> Floats:
        """Moments (k,) of vectors (c, d) at x (c, d) about the centres of tools that turn; 0 of others."""
        return self.owned @ np.vecdot(across(self.arms(x, placed)), vectors)


def _slopes(gap: Floats, normal: Floats, curvature: Floats) -> Floats:
    out = frames(normal)
    out[:, 1:] *= (1 - curvature * gap)[:, None, None]
    return out
