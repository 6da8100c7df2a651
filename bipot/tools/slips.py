r"""Slips on surfaces in space: the displacement between two points of a surface, as a tangent vector at the second.

In a plane the slip of an increment is an arc. In space it is computed from the normals m and n of the surface at the
points p and q where slip begins and ends, which turn by alpha about their cross product. With d = q - p and
h = m - cos(alpha) n, the component of d's tangential part along h is the chord of an arc and is replaced by the arc:

    w = d - (d . n) n + k (h . d) h,    k = (alpha/sin(alpha) - 1)/sin(alpha)^2.

On planes, cylinders and spheres w is tangent at q to the shortest line and has its length, however long an increment
is; a motion in a plane slips by the arc of the plane problem. On other surfaces this holds to third order in |d| over
the radii of curvature, increment by increment.

The length of a shortest line grows by the unit tangent as its end moves, so the friction against w does the same work
by the tangential force as by the slip. Components of w refer to frames transported from normal to normal
(:func:`transported`); the law is isotropic and independent of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.tensors import norm
from bipot.tools.surfaces import frames
from bipot.typing import Floats, times

SMALL = 0.02
"""Sine of the angle between two normals below which k is its series, good to round-off."""

OPPOSITE = 1e-6
"""1 + a . n below which no rotation from a to n is the shortest: frames there are arbitrary."""

LEAST_SINE = 1e-3
"""Least sine between two nearly opposite normals, for finite numbers: no accepted slip is so long."""

SINGULAR = 1e-6
"""Singular values of rows below this, over the largest, are zero: at a sharp corner the nearest place stands still."""


def transported(reference: Floats, normal: Floats) -> Floats:
    """Frames (c, 3, 3) of unit normals (c, 3): the ``reference`` frames (c, 3, 3), turned by the shortest rotations.

    >>> square = frames(np.array([[0.0, 0.0, 1.0]]))
    >>> transported(square, np.array([[0.6, 0.0, 0.8]])).round(12).tolist()
    [[[0.6, 0.0, 0.8], [0.8, 0.0, -0.6], [0.0, 1.0, 0.0]]]
    """
    a, along = reference[:, 0], reference[:, 1:]
    beside = 1 + np.vecdot(a, normal)
    opposite = beside < OPPOSITE
    part = np.vecdot(along, normal[:, None]) / np.where(opposite, 1.0, beside)[:, None]
    carried = along - part[..., None] * (a + normal)[:, None]
    tangents = np.where(opposite[:, None, None], frames(normal)[:, 1:], carried)
    return np.concatenate([normal[:, None], tangents], axis=1)


def framed(normal: Floats, reference: Floats | None) -> Floats:
    """Frames (c, d, d) of unit normals (c, d), in space next to the ``reference`` frames (c, d, d) if there are any.

    Those of :func:`~bipot.tools.surfaces.frames` jump where the least component of a normal becomes another one.
    """
    return frames(normal) if reference is None or normal.shape[1] == 2 else transported(reference, normal)


def spin(reference: Floats, normal: Floats) -> Floats:
    """The derivative (c, 3) by the normal of how far transported frames turn about it: t_2 . dt_1 = spin . dn."""
    a = reference[:, 0]
    beside = 1 + np.vecdot(a, normal)
    opposite = beside < OPPOSITE
    return np.where(opposite[:, None], 0.0, np.cross(normal, a) / np.where(opposite, 1.0, beside)[:, None])


@dataclass(frozen=True)
class Slip:
    """Slips of c points that move ``by`` (c, 3) from where their ``gap`` is (c,) and the ``normal`` (c, 3).

    At the end their gap is ``gap_end`` (c,) and their frames are ``frames`` (c, 3, 3); ``curvature`` (c, 3, 3) is the
    derivative of the normal there, ``turning`` (c, 3) that of the frames about it, both by the place.
    """

    gap: Floats
    normal: Floats
    by: Floats
    gap_end: Floats
    frames: Floats
    curvature: Floats
    turning: Floats

    @property
    def components(self) -> Floats:
        """w (c, 2) in the tangents of the frames (module docstring)."""
        k, _ = self._arcs
        return self._along + (k * self._turned)[:, None] * self._across

    def derivative(self) -> Floats:
        """The derivative (c, 2, 3) of :attr:`components` by the places of the ends."""
        n, t, C = self.frames[:, 0], self.frames[:, 1:], self.curvature
        (k, slope), m, b = self._arcs, self._turned, self._across
        sunk, cosine = np.vecdot(n, self._chord), np.vecdot(n, self.normal)
        bent = t @ C
        feet = np.eye(3) - n[:, :, None] * n[:, None] - self.gap_end[:, None, None] * C
        by_cosine = times(C, self.normal)
        h = self.normal - cosine[:, None] * n
        by_m = times(feet, h) - sunk[:, None] * by_cosine - cosine[:, None] * times(C, self._chord)
        along = t @ feet - sunk[:, None, None] * bent + _spun(self._along, self.turning)
        by_b = -cosine[:, None, None] * bent + _spun(b, self.turning)
        return (
            along
            + b[..., None] * (slope * m)[:, None, None] * by_cosine[:, None]
            + k[:, None, None] * (b[..., None] * by_m[:, None] + m[:, None, None] * by_b)
        )

    @property
    def _chord(self) -> Floats:
        """d (c, 3) between the nearest places."""
        return self.by + self.gap[:, None] * self.normal - self.gap_end[:, None] * self.frames[:, 0]

    @property
    def _along(self) -> Floats:
        """t_i . d (c, 2), with t_i . n = 0 used exactly."""
        return np.vecdot(self.frames[:, 1:], self.by[:, None]) + self.gap[:, None] * self._across

    @property
    def _across(self) -> Floats:
        """t_i . h = t_i . m (c, 2)."""
        return np.vecdot(self.frames[:, 1:], self.normal[:, None])

    @property
    def _turned(self) -> Floats:
        """h . d (c,)."""
        n = self.frames[:, 0]
        return np.vecdot(self.normal - np.vecdot(n, self.normal)[:, None] * n, self._chord)

    @property
    def _arcs(self) -> tuple[Floats, Floats]:
        """k (c,), and its derivative by cos(alpha)."""
        n = self.frames[:, 0]
        sine, cosine = norm(np.cross(self.normal, n)), np.vecdot(self.normal, n)
        alpha, u = np.arctan2(sine, cosine), sine**2
        s = np.maximum(sine, LEAST_SINE)
        near = (sine < SMALL) & (cosine > 0)
        k = (alpha / s - 1) / s**2
        slope = -((1 / s - alpha * cosine / s**2) / s**2 - 2 * cosine * k / s) / s
        # alpha/sin(alpha) - 1 = u/6 + 3 u^2/40 + 5 u^3/112 + 35 u^4/1152 + ..., u = sin(alpha)^2.
        series = 1 / 6 + u * (3 / 40 + u * (5 / 112 + u * 35 / 1152))
        rise = -2 * cosine * (3 / 40 + u * (5 / 56 + u * 35 / 384))
        return np.where(near, series, k), np.where(near, rise, slope)


def measured(rows: Floats, derivative: Floats) -> Floats:
    """The change (c, 3, 3) of motions, gap and slip, for unit changes by the ``rows`` (c, 3, 3).

    The derivatives (c, 2, 3) of slips differ from the tangential rows by the square of the angle that normals turn by
    in the increment, and by the turn of the frames; gaps change as their rows say.
    """
    out = np.tile(np.eye(3), (len(rows), 1, 1))
    out[:, 1:] = derivative @ np.linalg.pinv(rows, rcond=SINGULAR)
    return out


def _spun(components: Floats, turning: Floats) -> Floats:
    """How ``components`` (c, 2) of a fixed vector change (c, 2, 3) as the frame turns about its normal."""
    crossed = components[:, ::-1] * (1.0, -1.0)
    return crossed[..., None] * turning[:, None]
