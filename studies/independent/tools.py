r"""Shaped tools in an increment, for the fuzz study's recomputation: where nodes meet them, nothing of the library.

A point of the tool that is at X at rest is at C + a + Q(theta) (X - C) in the pose (a, theta). Nodes are seen from the
tool as if it rested. Of a node that the tool sees at y and that goes by dy there, the slip is the arc of the outline
between the nearest places of start and end, over a joint of two outlines that of both. A candidate is a mean of nodes:
of one that starts apart from the tool slips begin where its mean gap would come to close as the tool goes on past a
body that goes as it is carried.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from studies.independent.element import Bools, Floats, Ints
from studies.independent.outline import Near, Outline
from studies.independent.sampling import Parts

TOUCHES = 1e-9
"""A candidate nearer than this, over the size of the body, touches."""

LOOKS = 52
"""Halvings of an increment, until a candidate in the air touches."""


OnWay = Callable[[Floats], Floats]
"""How far nodes (w, d) have come after a fraction (w, 1) of the increment."""


@dataclass(frozen=True)
class Rigid:
    """A tool of several ``outlines`` at rest, which turns about ``centre`` (2,).

    It goes from the pose ``begun`` (3,) by ``gone`` (3,), which is no difference of poses, to ``ended`` (3,). Of that
    angle it is a moment that turns it ``by_moment``: it goes along with the body then, and not through the air.
    """

    outlines: tuple[Outline, ...]
    centre: Floats
    begun: Floats
    ended: Floats
    gone: Floats
    by_moment: float = 0.0

    def seen(self, x: Floats, pose: Floats) -> Floats:
        """Points x (c, 2) from the tool in a pose."""
        return (x - self.centre - pose[:2]) @ turning(pose[2]) + self.centre

    def placed(self, y: Floats, pose: Floats) -> Floats:
        """Points y (c, 2) of the tool at rest where it has a pose."""
        return (y - self.centre) @ turning(pose[2]).T + self.centre + pose[:2]

    def way(self, x: Floats, by: Floats) -> Floats:
        """How points x (c, 2) that go ``by`` (c, 2) go as the tool sees them (c, 2)."""
        angle, old = self.gone[2], turning(self.begun[2])
        # Q less one, of which the diagonal is no difference.
        near, across = -2 * np.sin(angle / 2) ** 2, np.sin(angle)
        arm = (x - self.centre - self.begun[:2]) @ old
        return (by - self.gone[:2]) @ old @ turning(angle) + arm @ np.array([[near, -across], [across, near]])

    def on_way(self, x: Floats, by: OnWay) -> OnWay:
        """How far points x (c, 2) that go ``by`` (c, 2) are after a fraction (c, 1), as the tool sees them.

        In the plane of complex numbers: they are turned back by what the tool has turned so far.
        """
        as_seen = np.exp(-1j * self.begun[2])
        arm = (x - self.centre - self.begun[:2]) @ (1.0, 1j) * as_seen

        def gone(fraction: Floats) -> Floats:
            back = -1j * fraction[:, 0] * self.gone[2]
            goes = (by(fraction) - fraction * self.gone[:2]) @ (1.0, 1j) * as_seen
            z = goes * np.exp(back) + arm * np.expm1(back)
            return np.column_stack([z.real, z.imag])

        return gone

    def carried(self, middle: Floats) -> Floats:
        """How far (c, 2) the tool's points go whose ways have their ``middle`` (c, 2): chords of circles."""
        arm = middle - self.centre - self.begun[:2] - self.gone[:2] / 2
        return self.gone[:2] + 2 * np.tan(self.gone[2] / 2) * np.column_stack([-arm[:, 1], arm[:, 0]])

    @property
    def extent(self) -> float:
        """The size of its numbers."""
        own = max(outline.extent for outline in self.outlines)
        return own + float(np.abs(self.centre).max() + np.abs(self.ended[:2]).max())

    def near(self, y: Floats) -> tuple[Near, Ints]:
        """The nearest places of points y (c, 2) as the tool sees them, and numbers (c,) of their outlines."""
        found = [outline.near(y) for outline in self.outlines]
        which = np.argmin([near.gap for near in found], axis=0)
        return _chosen(which, found), which

    def depth(self, x: Floats, pose: Floats) -> Floats:
        """How deep (c,) points x (c, 2) are in the tool in a pose: minus the gap; nothing past its open ends."""
        near, _ = self.near(self.seen(x, pose))
        return np.where(near.past, -np.inf, -near.gap)


@dataclass(frozen=True)
class Met:
    """How w nodes meet a tool: ``gap``, unit ``normal`` and ``stretch`` at start and end.

    ``past`` says who ends past an open end, ``opened`` what the gap grew by, ``slip`` is as in the module docstring.
    ``gone`` (w, 2) is how far the tool went under the node; ``blurred`` (w,) says where ``opened`` and ``slip`` are
    differences of places. ``apart`` (c,) are the candidates that start in the air, ``left`` (c,) their gaps where slips
    begin.
    """

    gap: tuple[Floats, Floats]
    normal: tuple[Floats, Floats]
    stretch: tuple[Floats, Floats]
    past: Bools
    opened: Floats
    slip: Floats
    gone: Floats
    blurred: Bools
    apart: Bools
    left: Floats


@dataclass(frozen=True)
class Going:
    """Nodes that are the ``parts`` of c candidates and go ``by`` (w, 2) from ``start`` to ``end`` (w, 2).

    Supports and other tools ask them to go ``asked`` (w, 2): of a body that is otherwise at rest they would go so.
    """

    parts: Parts
    start: Floats
    end: Floats
    by: Floats
    asked: OnWay


def met(tool: Rigid, nodes: Going, size: float) -> Met:
    """Nodes of a body of the ``size``."""
    y, dy = tool.seen(nodes.start, tool.begun), tool.way(nodes.start, nodes.by)
    one, other = tool.near(y)[0], tool.near(tool.seen(nodes.end, tool.ended))[0]
    passed, blurred = _passed(tool, y, dy)
    slip, left = passed[:, 1], nodes.parts.mean(one.gap)
    apart = left > TOUCHES * size
    late = apart[nodes.parts.owner]
    if late.any():
        aloft = replace(tool, gone=tool.gone - (0.0, 0.0, tool.by_moment))
        air = in_air(lambda at: tool.near(at)[0].gap, nodes.parts, y, aloft.on_way(nodes.start, nodes.asked))
        slid, jumped = _passed(tool, y + air, dy - air)
        left = np.where(apart, nodes.parts.mean(tool.near(y + air)[0].gap), left)
        slip, blurred = np.where(late, slid[:, 1], slip), blurred | (late & jumped)
    return Met(
        gap=(one.gap, other.gap),
        normal=(one.normal @ turning(tool.begun[2]).T, other.normal @ turning(tool.ended[2]).T),
        stretch=(one.stretch, other.stretch),
        past=other.past,
        opened=passed[:, 0],
        slip=slip,
        gone=tool.carried((nodes.start + nodes.end) / 2),
        blurred=blurred,
        apart=apart,
        left=left,
    )


def _passed(tool: Rigid, y: Floats, dy: Floats) -> tuple[Floats, Bools]:
    """What gap and arc (w, 2) of points that the tool sees at y grow by as they go dy (w, 2).

    Then, which (w,) of these are differences of places.
    """
    (one, before), (other, which) = tool.near(y), tool.near(y + dy)
    out, jumped = np.zeros((len(y), 2)), np.zeros(len(y), dtype=bool)
    for k, outline in enumerate(tool.outlines):
        mine = which == k
        out[mine] = outline.slid(y[mine], dy[mine])
        jumped[mine] = outline.jumped(y[mine], dy[mine])
    moved = before != which
    out[moved, 0] = (other.gap - one.gap)[moved]
    out[moved, 1] = _over_joints(tool, y[moved], dy[moved], before[moved], which[moved])
    return out, moved | jumped


def _over_joints(tool: Rigid, y: Floats, dy: Floats, before: Ints, which: Ints) -> Floats:
    """Arcs (w,) of points that go from one outline to another: on the first while that is nearest, then on the last."""
    near, far = np.zeros(len(y)), np.ones(len(y))
    for _ in range(LOOKS if len(y) else 0):
        middle = (near + far) / 2
        on = tool.near(y + middle[:, None] * dy)[1] == before
        near, far = np.where(on, middle, near), np.where(on, far, middle)
    out, part = np.zeros(len(y)), far[:, None] * dy
    for k, outline in enumerate(tool.outlines):
        out[before == k] += outline.slid(y[before == k], part[before == k])[:, 1]
        out[which == k] += outline.slid((y + part)[which == k], (dy - part)[which == k])[:, 1]
    return out


def in_air(gap: Callable[[Floats], Floats], parts: Parts, y: Floats, way: OnWay) -> Floats:
    """How far (w, d) nodes that a tool sees at y come before their candidates touch.

    They have come ``way`` (w, d) after a fraction (w, 1) of the increment. The ``gap`` of a tool is that (w,) of points
    (w, d). Candidates that do not touch come the part of it by which it brings them nearer.
    """

    def come(fraction: Floats) -> Floats:
        return way(fraction[parts.owner, None])

    low, high = np.zeros(parts.count), np.ones(parts.count)
    far, near = parts.mean(gap(y)), parts.mean(gap(y + come(high)))
    nearer = np.maximum(np.where(far > 0, (far - near) / np.where(far > 0, far, 1.0), 0.0), 0.0)
    for _ in range(LOOKS):
        middle = (low + high) / 2
        touches = parts.mean(gap(y + come(middle))) < 0
        low, high = np.where(touches, low, middle), np.where(touches, middle, high)
    return come(np.where(near < 0, low, nearer))


def turning(angle: float) -> Floats:
    """Q (2, 2)."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _chosen(which: Ints, found: list[Near]) -> Near:
    every = np.arange(len(which))
    parts = {f.name: np.stack([getattr(near, f.name) for near in found])[which, every] for f in fields(Near)}
    return Near(**parts)
