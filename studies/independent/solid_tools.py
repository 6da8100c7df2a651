r"""Shaped tools of space in an increment, for the fuzz study's recomputation: where nodes meet them, how they slip.

A point of the tool that is at X at rest is at C + a + Q (X - C), Q the rotation by theta about the axis e: a pose is
(a, theta), of four numbers. Nodes are seen from the tool as if it rested, where one is at y and goes by dy. From its
nearest place with the normal m and the gap g to that with n and h it slips by

    w = d_t + (alpha/sin alpha - 1) (d . e) e,    d = dy + g m - h n,

d_t what of d is at a right angle to n: where normals turn by alpha about one axis the chord's part along e, the way
they turn, is R sin alpha, of which the arc R alpha is meant. A candidate is a mean of nodes: of one that starts apart
slips begin where its mean gap would come to close as the tool goes on past a body at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from studies.independent.element import Bools, Floats
from studies.independent.revolved import Face, Seen, nearest
from studies.independent.riding import swung
from studies.independent.tools import Going, OnWay, in_air

SHORT = 1e-6
"""Of an angle (radians): alpha/sin alpha is one to the last bit below."""


@dataclass(frozen=True)
class Solid:
    """A tool of ``faces`` at rest, turning about the ``axis`` through ``centre`` (3,).

    It goes from the pose ``begun`` (4,) by ``gone`` (4,), which is no difference of poses, to ``ended`` (4,). Of that
    angle it is a moment that turns it ``by_moment``: it goes along with the body then, and not through the air.
    """

    faces: tuple[Face, ...]
    centre: Floats
    axis: Floats
    begun: Floats
    ended: Floats
    gone: Floats
    by_moment: float = 0.0

    def seen(self, x: Floats, pose: Floats) -> Floats:
        """Points x (w, 3) from the tool in a pose."""
        return (x - self.centre - pose[:3]) @ about(self.axis, pose[3]) + self.centre

    def way(self, x: Floats, by: Floats) -> Floats:
        """How points x (w, 3) that go ``by`` (w, 3) go as the tool sees them (w, 3)."""
        old, angle = about(self.axis, self.begun[3]), float(self.gone[3])
        arm = (x - self.centre - self.begun[:3]) @ old
        return (by - self.gone[:3]) @ old @ about(self.axis, angle) + arm @ turned_by(self.axis, angle)

    def on_way(self, x: Floats, by: OnWay) -> OnWay:
        """How far points x (w, 3) that go ``by`` (w, 3) are after a fraction (w, 1), as the tool sees them."""
        old = about(self.axis, self.begun[3])
        arm = (x - self.centre - self.begun[:3]) @ old

        def gone(fraction: Floats) -> Floats:
            goes = (by(fraction) - fraction * self.gone[:3]) @ old
            return goes + swung(arm + goes, self.axis, -fraction * self.gone[3])

        return gone

    def carried(self, middle: Floats) -> Floats:
        """How far (w, 3) the tool's points go whose ways have their ``middle`` (w, 3): chords of circles."""
        arm = middle - self.centre - self.begun[:3] - self.gone[:3] / 2
        return self.gone[:3] + 2 * np.tan(self.gone[3] / 2) * np.cross(self.axis, arm)

    def near(self, y: Floats) -> Seen:
        """What it is to points y (w, 3) as it sees them."""
        return nearest(self.faces, y)

    @property
    def extent(self) -> float:
        """The size of its numbers."""
        return float(max(f.extent for f in self.faces) + np.abs(self.centre).max() + np.abs(self.ended[:3]).max())


@dataclass(frozen=True)
class MetInSpace:
    """How w nodes meet a tool: ``gap`` (w,), ``normal`` (w, 3) and its ``gradient`` (w, 3, 3) at start and end.

    ``past`` says who ends past an open end; ``slip`` (w, 3) is a tangent at the end, as in the module docstring, and
    ``unsure`` (w,) what it may be off by, over round-off. ``gone`` (w, 3) is how far the tool went under the node,
    ``apart`` (c,) are the candidates that start in the air, ``left`` (c,) the gaps with which they begin to slip.
    """

    gap: tuple[Floats, Floats]
    normal: tuple[Floats, Floats]
    gradient: tuple[Floats, Floats]
    past: Bools
    slip: Floats
    unsure: Floats
    gone: Floats
    apart: Bools
    left: Floats


def met(tool: Solid, nodes: Going, apart: Bools) -> MetInSpace:
    """Nodes of candidates of which those ``apart`` (c,) start in the air."""
    y, dy = tool.seen(nodes.start, tool.begun), tool.way(nodes.start, nodes.by)
    one, other = tool.near(y), tool.near(tool.seen(nodes.end, tool.ended))
    air = np.zeros_like(y)
    if apart.any():
        aloft = replace(tool, gone=tool.gone - (0.0, 0.0, 0.0, tool.by_moment))
        air = in_air(lambda at: tool.near(at).gap, nodes.parts, y, aloft.on_way(nodes.start, nodes.asked))
        air[~apart[nodes.parts.owner]] = 0.0
    begun = tool.near(y + air)
    old, new = about(tool.axis, tool.begun[3]), about(tool.axis, tool.ended[3])
    slip, turned = arc(begun, other, dy - air)
    bends = np.abs(begun.gradient).max(axis=(1, 2)) * tool.extent
    return MetInSpace(
        gap=(one.gap, other.gap),
        normal=(one.normal @ old.T, other.normal @ new.T),
        gradient=(old @ one.gradient @ old.T, new @ other.gradient @ new.T),
        past=other.past,
        slip=slip @ new.T,
        unsure=np.linalg.norm(dy, axis=1) + np.abs(begun.gap) * (1 + bends) + turned * tool.extent,
        gone=tool.carried((nodes.start + nodes.end) / 2),
        apart=apart,
        left=nodes.parts.mean(begun.gap),
    )


def arc(begun: Seen, ended: Seen, by: Floats) -> tuple[Floats, Floats]:
    """Slips (w, 3) of points that go ``by`` (w, 3), and angles (w,) by which normals turn in them."""
    m, n = begun.normal, ended.normal
    chord = by + begun.gap[:, None] * m - ended.gap[:, None] * n
    along = by + begun.gap[:, None] * m
    along = along - np.vecdot(along, n)[:, None] * n
    way = m - np.vecdot(m, n)[:, None] * n
    sine = np.linalg.norm(way, axis=1)
    alpha = np.arctan2(sine, np.vecdot(m, n))
    turns = alpha > SHORT
    way = way / np.where(turns, sine, 1.0)[:, None]
    longer = np.where(turns, alpha / np.where(turns, sine, 1.0) - 1, 0.0)
    return along + (longer * np.vecdot(chord, way))[:, None] * way, alpha


def turned_by(axis: Floats, angle: float) -> Floats:
    """Q - 1 (3, 3) of the rotation by an angle about a unit ``axis``, to its own round-off."""
    E = np.cross(np.eye(3), -axis).T
    return np.sin(angle) * E + 2 * np.sin(angle / 2) ** 2 * E @ E


def about(axis: Floats, angle: float) -> Floats:
    """Q (3, 3): columns v become Q v, rows v become v Q'.

    >>> about(np.array([0.0, 0.0, 1.0]), np.pi / 2).round(12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    return np.eye(3) + turned_by(axis, float(angle))


def carried_to(frames: Floats, normal: Floats) -> Floats:
    """Frames (w, 3, 3) turned by the shortest rotations that take their normals, the first rows, to others (w, 3).

    By the rotation Q = 1 + K + K^2/(1 + cos), K v = (n x n') x v: rows v become v + k x v + k x (k x v)/(1 + cos).
    """
    k = np.cross(frames[:, 0], normal)[:, None]
    cosine = np.vecdot(frames[:, 0], normal)[:, None, None]
    once = np.cross(k, frames)
    out = frames + once + np.cross(k, once) / (1 + cosine)
    out[:, 0] = normal
    return out
