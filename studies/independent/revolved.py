r"""Surfaces of tools in space written a second time, for the fuzz study's recomputation: nothing of the library.

A half-space, or what outlines in the half-plane (r, z) make as they turn about an axis: r is the distance from it, z
the height along it. Where (r, z) has the gap g, the normal (n_r, n_z) and the line of equal gaps the curvature c, which
is turn/|x - c| at an arc and none at a straight, the surface of equal gaps has

    n = n_r rho + n_z e,    grad n = c m m' + n_r/r (e x rho)(e x rho)',    m = n_z rho - n_r e,

rho the unit vector away from the axis e. On the axis both curvatures are one. A tool of several has the least gap.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from studies.independent.element import Bools, Floats, Ints
from studies.independent.outline import Outline

BESIDE = 1e-9
"""Of the surface's numbers: nearer to the axis than this n_r/r is a quotient of round-off."""


@dataclass(frozen=True)
class Seen:
    """Of points (w, 3): gap (w,), unit ``normal`` (w, 3), its gradient (w, 3, 3), whether they are past open ends."""

    gap: Floats
    normal: Floats
    gradient: Floats
    past: Bools


@dataclass(frozen=True)
class HalfSpace:
    """What is behind the plane through ``point`` with the ``normal``."""

    point: Floats
    normal: Floats

    @property
    def extent(self) -> float:
        """The size of its numbers."""
        return float(np.abs(self.point).max())

    @property
    def middle(self) -> Floats:
        """A place (3,) of it."""
        return self.point

    @property
    def thick(self) -> float:
        """The diameter of the largest ball in it."""
        return np.inf

    def near(self, x: Floats) -> Seen:
        """What it is to points x (w, 3)."""
        count = len(x)
        normal = np.broadcast_to(self.normal, x.shape)
        return Seen((x - self.point) @ self.normal, normal, np.zeros((count, 3, 3)), np.zeros(count, dtype=bool))


@dataclass(frozen=True)
class Round:
    """What ``outlines`` make about the unit ``axis`` through ``point``."""

    outlines: tuple[Outline, ...]
    point: Floats
    axis: Floats

    @property
    def extent(self) -> float:
        """The size of its numbers."""
        return float(np.abs(self.point).max() + max(outline.extent for outline in self.outlines))

    @property
    def middle(self) -> Floats:
        """A place (3,) on its axis."""
        return self.point + self.outlines[0].centroid[1] * self.axis

    @property
    def thick(self) -> float:
        """The diameter of the largest ball in it, where that is that of an arc."""
        return min(outline.thick for outline in self.outlines)

    def near(self, x: Floats) -> Seen:
        """What it is to points x (w, 3)."""
        out = x - self.point
        z = out @ self.axis
        away = out - z[:, None] * self.axis
        # What is left along the axis is round-off of the height.
        away -= (away @ self.axis)[:, None] * self.axis
        r = np.linalg.norm(away, axis=1)
        on = r == 0
        away[on] = np.cross(self.axis, np.eye(3)[np.argmin(np.abs(self.axis))])
        rho = away / np.linalg.norm(away, axis=1, keepdims=True)
        place = np.column_stack([r, z])
        found = [outline.near(place) for outline in self.outlines]
        which, every = np.argmin([near.gap for near in found], axis=0), np.arange(len(x))
        bends = np.array([_bends(own, near.piece, place) for own, near in zip(self.outlines, found, strict=True)])
        gap, past = (np.array([getattr(near, name) for near in found])[which, every] for name in ("gap", "past"))
        (n_r, n_z), c = np.array([near.normal for near in found])[which, every].T[..., None], bends[which, every, None]
        off = r[:, None] > BESIDE * self.extent
        around = np.where(off, n_r / np.where(off, r[:, None], 1.0), c)
        m, hoop = n_z * rho - n_r * self.axis, np.cross(self.axis, rho)
        gradient = (c * m)[..., None] * m[:, None] + (around * hoop)[..., None] * hoop[:, None]
        return Seen(gap, n_r * rho + n_z * self.axis, gradient, past)


Face = HalfSpace | Round


def nearest(faces: tuple[Face, ...], x: Floats) -> Seen:
    """What the one of the ``faces`` that has the least gap is to points x (w, 3)."""
    found = [face.near(x) for face in faces]
    which, every = np.argmin([seen.gap for seen in found], axis=0), np.arange(len(x))
    return Seen(**{f.name: np.stack([getattr(seen, f.name) for seen in found])[which, every] for f in fields(Seen)})


def _bends(outline: Outline, piece: Ints, place: Floats) -> Floats:
    """The curvature (w,) of the lines of equal gaps of an outline through places (w, 2) nearest to those pieces."""
    arc = piece - len(outline.length)
    if not len(outline.radius):
        return np.zeros(len(place))
    own = np.maximum(arc, 0)
    far = np.linalg.norm(place - outline.centre[own], axis=1)
    return np.where(arc >= 0, outline.turn[own] / np.where(far > 0, far, 1.0), 0.0)
