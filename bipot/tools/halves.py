"""What makes a tool half of one, where it lies in a plane of symmetry: open ends of lines, and sides with a sharp end.

Beyond an open end a line continues straight, into the other half. Along a side in the plane a tool is cut in two, and
at a sharp end of that side a point of the plane has no unique normal. The end of a meridian is a ring in space, that of
a section a straight.
"""

from __future__ import annotations

import numpy as np

from bipot.tools.extruded import Extruded
from bipot.tools.profiles.profile import Profile
from bipot.tools.profiles.union import Union
from bipot.tools.revolved import ON_AXIS, Revolved
from bipot.tools.surfaces import Surface, frames
from bipot.typing import Floats


def halved_at(surface: Surface, meridian: bool = False) -> list[Floats]:
    """Sets of points (k, d), also of parts inside others: a surface is half a tool where a plane has all points of one.

    A line on a ``meridian`` that begins on the axis is closed there by its other side.

    >>> punch = Profile(((2.0, 9.0), (2.0, 4.0), (0.0, 4.0)), fillets=0.5)
    >>> [points.tolist() for points in halved_at(punch)]
    [[[2.0, 9.0]], [[0.0, 4.0]]]
    >>> [points.shape for points in halved_at(Revolved(punch, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))]
    [(4, 3)]
    """
    if isinstance(surface, Union):
        return [points for part in surface.surfaces for points in halved_at(part, meridian)]
    if isinstance(surface, Revolved):
        return [_ring(surface, points) for points in halved_at(surface.meridian, meridian=True)]
    if isinstance(surface, Extruded):
        return [surface.straights(points) for points in halved_at(surface.section)]
    if not isinstance(surface, Profile):
        return []
    axis = ON_AXIS * surface.pieces.extent if meridian else -np.inf
    return [points for points in _of_line(surface) if np.abs(points[:, 0]).max() > axis]


def _of_line(line: Profile) -> list[Floats]:
    """Open ends (1, 2) of a line, and sides (2, 2) with a sharp end."""
    points, inner = np.array(line.points), np.array(line.fillets if isinstance(line.fillets, tuple) else [line.fillets])
    count = len(points) - 2 * (not line.closed)
    sharp = np.resize(inner == 0, count) if count else np.zeros(0, dtype=bool)
    sides = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    if line.closed:
        return list(sides[sharp | np.roll(sharp, -1)])
    sharp = np.concatenate([[False], sharp, [False]])
    return [points[:1], points[-1:], *sides[:-1][sharp[:-1] | sharp[1:]]]


def _ring(surface: Revolved, points: Floats) -> Floats:
    """Places (4 k, 3) on the circles that ``points`` (k, 2) of the meridian make."""
    axis = np.array(surface.axis)
    first, second = frames(axis)[1:]
    r, z = points[:, :1], points[:, 1:]
    ways = (first, second, -first, -second)
    return np.concatenate([np.array(surface.point) + r * way + z * axis for way in ways])
