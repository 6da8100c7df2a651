r"""Where candidates meet their tools at the end of an increment, and how that changes as they move.

In the tool's own frame a candidate moves from y to y + dy in the increment. Its gap at the end is the gap at the start
plus its growth. Its slip is the arc of the surface between the nearest points at start and end, so that slips add up
over increments (:mod:`bipot.tools.surfaces`); for slips in space see :mod:`bipot.tools.slips`. For a candidate that
starts apart from the tool, slip begins where the body, if it were only carried along, would touch it: motion in the air
is no slip (:meth:`Faces.in_air`). With the frame n, t_i and C = grad n at the end (c t t' in a plane), forces
r = (r_n, r_t) dual to gap and slip are the vectors

    r_n n + sum_i r_i (1 - g C) t_i,

which are along the frame where the gap g is zero. They change with the position by

    r_n C - sum_i r_i (B_i n' + n B_i'),    B_i = C (1 - g C) t_i,

and in space by the turn of t_1 and t_2 about n. This is exact where the gap is zero or C is constant along the surface,
as on planes, cylinders and spheres. For their change with the pose of a driven tool see :mod:`bipot.contact.coupling`.
All this is for one node; the gap and the slip of a candidate that is a mean of nodes are means over these nodes
(:mod:`bipot.tools.parts`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bipot.tools.aloft import Carried, Way
from bipot.tools.parts import Parts
from bipot.tools.poses import rotation
from bipot.tools.slips import Slip, framed, measured, spin
from bipot.tools.surfaces import frames
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Ints, Scalar, einsum


@dataclass(frozen=True)
class Meeting:
    """``motion`` (c, d), the gap at the end and the slip of candidates, and fields of their w parts.

    ``frames`` (w, d, d) are the derivatives of gap and slip by position, ``curvature`` C (w, d, d) is that of the lines
    or surfaces of equal gap, and ``arm`` (w, d) the vectors from the centre about which the tool turns, zero if it does
    not. In the frame of their tool the parts were at ``place`` (w, d) and moved ``by`` (w, d).

    In space the frames turn about their normals by ``spun`` (w, 3) times the change of the normals, and gap and slip
    change by ``measured`` (c, 3, 3) times the change along the frames, in the mean over the parts; in a plane both are
    None. Left out is how the motion in the air, before which there is no slip, changes with a tool that a force drives.
    """

    motion: Floats
    frames: Floats
    curvature: Floats
    arm: Floats
    place: Floats
    by: Floats
    spun: Floats | None = None
    measured: Floats | None = None

    def bending(self, r: Floats) -> Floats:
        """Derivative (w, d, d) of the vectors of forces r (w, d) by the parts' places (module docstring)."""
        normal, along = self.frames[:, 0], self.frames[:, 1:]
        crossed = normal[:, :, None] * einsum("ci,cij,cjk->ck", r[:, 1:], along, self.curvature)[:, None]
        out = r[:, :1, None] * self.curvature - crossed - crossed.transpose(0, 2, 1)
        if self.spun is None:
            return out
        turning = einsum("wij,wj->wi", self.curvature, self.spun)
        return out + self._twisted(r)[:, :, None] * turning[:, None]

    def lag(self, r: Floats, mine: Bools, spin: Floats) -> Floats:
        """The change (m, 2, d) of friction in r (w, d) by which the parts ``mine`` (w,) lag behind their turning tools.

        ``spin`` (m, 2, d) are the turns by the two coordinates of each part's tool; the lag is zero in a plane.
        """
        if self.spun is None:
            return np.zeros((*spin.shape[:2], 2))
        rate = _lag(spin, self.frames[mine, None, 0], self.spun[mine, None])
        return rate[..., None] * self._twisted(r)[mine, None]

    def by_turn(self, parts: Parts, spin: Floats) -> Floats:
        """The change (c, 3) of motions, beside that of rows, as slips turn by ``spin`` (w, 3) with tools in space."""
        assert self.spun is not None
        rate = parts.averaged(_lag(spin, self.frames[:, 0], self.spun))
        out = np.zeros_like(self.motion)
        out[:, 1:] = rate[:, None] * self.motion[:, :0:-1] * (-1.0, 1.0)
        return out

    def _twisted(self, r: Floats) -> Floats:
        """How the vectors of forces r (w, 3) change (w, 3) as frames turn about their normals."""
        along = self.frames[:, 1:]
        return r[:, 1, None] * along[:, 1] - r[:, 2, None] * along[:, 0]


def _lag(spin: Floats, normal: Floats, spun: Floats) -> Floats:
    """How far (…) what turns by ``spin`` (…, 3) with a tool turns against the frames, about the ``normal`` (…, 3)."""
    return np.vecdot(spin, normal) - np.vecdot(spun, np.cross(spin, normal))


@dataclass(frozen=True)
class Faces:
    """The surfaces of tools as w ``parts`` of c candidates meet them; ``owned`` (k, w) marks the parts of each tool.

    Frames in space are the ``reference`` frames (w, 3, 3), transported from their normals to the current ones.
    """

    tools: Sequence[Tool]
    owned: Bools
    reference: Floats
    parts: Parts

    def distance(self, x: Floats, placed: Floats) -> Floats:
        """Gap (c,) to the tools in the poses ``placed`` (k, p) with parts at x (w, d), to the round-off of places."""
        return self.parts.gathered(self._by_tools(np.empty(len(x)), Tool.distance, [x], placed))

    def places(self, x: Floats, placed: Floats) -> Floats:
        """Magnitude (c,) of the numbers whose difference :meth:`distance` is."""
        return self.parts.averaged(self._by_tools(np.empty(len(x)), Tool.places, [x], placed))

    def slopes(self, x: Floats, placed: Floats) -> Floats:
        """Derivatives (w, d, d) of gap and arc of parts at x (w, d), their tools in the poses ``placed`` (k, p)."""
        seen = _Seen.none(x)
        for mine, tool, pose in zip(self.owned, self.tools, placed, strict=True):
            seen.take(mine, tool, tool.own(x[mine], pose), pose)
        return _slopes(self._framed(seen.normal), seen.gap, seen.curvature)

    def _framed(self, normal: Floats) -> Floats:
        """Frames (w, d, d) of the normals (w, d)."""
        return framed(normal, self.reference)

    def arms(self, x: Floats, placed: Floats) -> Floats:
        """The ``arm`` (w, d) of :class:`Meeting` of parts at x (w, d), their tools in the poses ``placed`` (k, p)."""
        return self._by_tools(np.empty_like(x), Tool.arm, [x], placed)

    def _by_tools(
        self, out: NDArray[Scalar], of: Callable[..., Any], parts: Sequence[Floats], *tools: Floats
    ) -> NDArray[Scalar]:
        """``out`` (w, …) filled in with ``of(tool, …)`` of each one's own of ``parts`` (w, …) and ``tools`` (k, …)."""
        for mine, tool, *own in zip(self.owned, self.tools, *tools, strict=True):
            out[mine] = of(tool, *(each[mine] for each in parts), *own)
        return out

    def meeting(
        self, gap: Floats, x: Floats, moved: Floats, placed: Floats, advances: Floats, before: Floats
    ) -> Meeting:
        """The meeting of candidates that start with a ``gap`` (c,), whose parts have ``moved`` (w, d) from x (w, d).

        Meanwhile the tools, from the poses ``placed`` (k, p), made the ``advances`` (k, p). The parts' motion
        ``before`` they touch (w, d), in the tools' frames, is no slip.
        """
        motion, arm, place, by, slid = (np.empty_like(x) for _ in range(5))
        begun, seen = _Seen.none(x), _Seen.none(x)
        for mine, tool, pose, advance in zip(self.owned, self.tools, placed, advances, strict=True):
            place[mine] = start = tool.own(x[mine], pose)
            by[mine] = went = tool.going(x[mine], moved[mine], pose, advance)
            slips = start + before[mine], went - before[mine]
            if motion.shape[1] == 2:
                passed = tool.face.passed(np.stack([start, slips[0]]), np.stack([went, slips[1]]))
                motion[mine] = np.stack([passed[0, :, 0], passed[1, :, 1]], axis=-1)
            else:
                motion[mine, 0] = tool.face.passed(start, went)[:, 0]
                begun.take(mine, tool, slips[0], pose + advance)
            seen.take(mine, tool, start + went, pose + advance)
            slid[mine] = tool.turned(slips[1], pose + advance)
            arm[mine] = tool.arm(x[mine] + moved[mine], pose + advance)
        framed = self._framed(seen.normal)
        gaps = gap if self.parts.single else self._by_tools(np.empty(len(x)), Tool.distance, [x], placed)
        rows = _slopes(framed, gaps + motion[:, 0], seen.curvature)
        if motion.shape[1] == 2:
            return Meeting(self._whole(gap, motion), rows, seen.curvature, arm, place, by)
        spun = spin(self.reference, seen.normal)
        turning = einsum("wij,wj->wi", seen.curvature, spun)
        slip = Slip(begun.gap, begun.normal, slid, seen.gap, framed, seen.curvature, turning)
        motion[:, 1:] = slip.components
        changes = self.parts.changes(measured(rows, slip.derivative()))
        return Meeting(self._whole(gap, motion), rows, seen.curvature, arm, place, by, spun, changes)

    def _whole(self, gap: Floats, motion: Floats) -> Floats:
        """Gap at the end and slip (c, d) of candidates with a ``gap`` (c,) whose parts have the ``motion`` (w, d)."""
        out = self.parts.motion(motion).copy()
        out[:, 0] += gap
        return out

    def in_air(self, apart: Bools, x: Floats, carried: Carried, placed: Floats, advances: Floats) -> Floats:
        """The motion (w, d) before they touch, in the tool's frame, of parts of candidates that start ``apart`` (c,).

        They are ``carried`` from x (w, d) as in a body at rest while the tools, from the poses ``placed`` (k, p), make
        the ``advances`` (k, p); seen from a turning tool this is not straight. Of those that this does not bring to the
        tool, the part of this motion counts by which it closes the gap: the rest is closed by the body's own motion,
        which is slip all the way (:mod:`bipot.tools.aloft`).
        """
        out, owner = np.zeros_like(x), self.parts.owner
        for mine, tool, pose, advance in zip(self.owned, self.tools, placed, advances, strict=True):
            if tool.flat:
                continue
            coming = np.flatnonzero(mine & apart[owner])
            way = Way(tool, x[coming], carried.only(coming), pose, advance)
            gaps = partial(self._gaps, tool, coming)
            out[coming] = way.gone(way.in_air(gaps, owner[coming]))
        return out

    def _gaps(self, tool: Tool, coming: Ints, some: Ints, places: Floats) -> Floats:
        """Gaps (c, …) of candidates, of whose ``coming`` parts ``some`` (m,) are seen at ``places`` (m, …, d)."""
        gap = np.zeros((len(self.parts.owner), *places.shape[1:-1]))
        gap[coming[some]] = tool.face.gap(places, np.zeros(places.shape[-1]))
        return self.parts.gathered(gap)

    def after(self, x: Floats, placed: Floats, before: Floats) -> Floats:
        """Gaps (c,) of candidates whose parts, seen by tools ``placed`` (k, p), go from x by ``before`` (w, d)."""
        return self.parts.gathered(self._by_tools(np.empty(len(x)), _gone, [x, before], placed))

    def crossed(self, meeting: Meeting) -> Bools:
        """Candidates (c,) of which a part went through a tool and came out on another side of it."""
        out = np.zeros(len(meeting.place), dtype=bool)
        return self.parts.any(
            self._by_tools(out, lambda tool, *way: tool.face.crossed(*way), [meeting.place, meeting.by])
        )

    def beyond(self, meeting: Meeting) -> Bools:
        """Candidates (c,) of which a part came past an open end of a tool."""
        out = np.zeros(len(meeting.place), dtype=bool)
        return self.parts.any(
            self._by_tools(out, lambda tool, end: tool.face.beyond(end), [meeting.place + meeting.by])
        )

    def swept(self, x: Floats, placed: Floats, advance: Floats) -> Floats:
        """Displacement (w, d) of the tools' points at x (w, d) by the turns in the poses' ``advance`` (k, p)."""
        return self._by_tools(np.empty_like(x), Tool.swept, [x], placed, advance)

    def carried(self, middle: Floats, placed: Floats, advance: Floats) -> Floats:
        """The same as :meth:`swept` for tool points whose paths have their middles at ``middle`` (w, d)."""
        return self._by_tools(np.empty_like(middle), Tool.carried, [middle], placed, advance)

    def turned(self, vectors: Floats, placed: Floats) -> Floats:
        """Vectors (w, d) at the parts, given in the frames of their tools, turned to the poses ``placed`` (k, p)."""
        return self._by_tools(np.empty_like(vectors), Tool.turned, [vectors], placed)

    def swirls(self, arm: Floats) -> Floats:
        """Velocities (w, d) per angle of the tools' points at the ends of ``arm`` (w, d); 0 where they do not turn."""
        return self._by_tools(np.empty_like(arm), Tool.swirl, [arm])


def _gone(tool: Tool, x: Floats, before: Floats, pose: Floats) -> Floats:
    """Gaps (m,) of points that go from x (m, d) by ``before`` (m, d), in the frame of a tool in the ``pose`` (p,)."""
    return tool.face.gap(tool.own(x, pose) + before, np.zeros(x.shape[1]))


class _Seen(NamedTuple):
    """The ``gap`` (w,), ``normal`` (w, d) and ``curvature`` C (w, d, d) of w parts, filled in tool by tool."""

    gap: Floats
    normal: Floats
    curvature: Floats

    @staticmethod
    def none(x: Floats) -> _Seen:
        """Space for parts at x (w, d), nothing filled in."""
        return _Seen(np.empty(len(x)), np.empty_like(x), np.empty((*x.shape, x.shape[1])))

    def take(self, mine: Bools, tool: Tool, own: Floats, pose: Floats) -> None:
        """Fill in the parts ``mine`` (w,) of the ``tool`` in the ``pose`` (p,), at ``own`` (m, d) in its frame."""
        self.gap[mine], normal, C = tool.face.distance(own)
        self.normal[mine] = tool.turned(normal, pose)
        if own.shape[1] == 2:
            tangent = frames(self.normal[mine])[:, 1]
            self.curvature[mine] = C[:, None, None] * tangent[:, :, None] * tangent[:, None]
        else:
            Q = np.eye(3) if tool.turn is None else rotation(pose[3:])
            self.curvature[mine] = Q @ C @ Q.T


def _slopes(framed: Floats, gap: Floats, curvature: Floats) -> Floats:
    """Derivatives (w, d, d) of gap and slip by position, n and (1 - g C) t_i, from frames (w, d, d)."""
    out = framed.copy()
    out[:, 1:] -= gap[:, None, None] * framed[:, 1:] @ curvature
    return out
