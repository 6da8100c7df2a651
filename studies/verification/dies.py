r"""Bodies that go up through a converging die: its profile, and the mesh of a body that fills it at rest.

Coordinates are (across, along): the middle plane, or the axis, is x = 0, and the body, of half-width one, goes along y.
The die narrows it from y = 0 on, on its right. Perfect plasticity needs no history, so a body that fills the die flows
steadily at once.
"""

from __future__ import annotations

import numpy as np

from bipot import Element, Mesh, Profile
from bipot.typing import Floats
from studies.element_scenes import tensor

FAR = 4.0
"""How far the die reaches below its entry and above its exit."""

RELIEF = np.radians(10.0)
"""At which the die gives way beyond the exit."""

LINES, HALVINGS = 4001, 60
"""Places along the body at which its half-width is tabulated, and of the bracket around each."""


def converging(angle: float, exit_: float, fillet: float, entry: float = 0.0) -> Profile:
    """The die of semi-angle ``angle`` (radians) to the half-width ``exit_``, its exit rounded by ``fillet``.

    Below y = 0 it is a container of half-width one where ``entry``, the radius of that corner, is above zero; else the
    cone goes on outwards.
    """
    length = (1 - exit_) / np.tan(angle)
    out = (exit_ + FAR * np.tan(RELIEF), length + FAR)
    if entry:
        return Profile(((1.0, -FAR), (1.0, 0.0), (exit_, length), out), (entry, fillet))
    return Profile(((1.0 + np.tan(angle), -1.0), (exit_, length), out), fillet)


def half_width(die: Profile, y: Floats) -> Floats:
    """Of the body that fills the die at y (k,), straight beyond the narrowest place and below the entry."""
    order = np.argsort(y)
    low, high = np.zeros_like(y), np.ones_like(y)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        outside = die.distance(np.column_stack([middle, y])).gap >= 0
        low, high = np.where(outside, middle, low), np.where(outside, high, middle)
    low[order] = np.minimum.accumulate(low[order])
    return low


def filling(die: Profile, n: int, ends: tuple[float, float], power: int, lead: float = 0.0) -> Mesh:
    """The body between the ``ends`` with n elements over its half-width, as long as wide below the entry.

    Rows have the same volume: area in a plane (``power`` 1), ring in a meridian (2). At the wall they lead by ``lead``,
    because there they fall back later.
    """
    y = np.linspace(*ends, LINES)
    width = half_width(die, y)
    volume = np.append(0.0, np.cumsum(np.diff(y) * ((width[1:] + width[:-1]) / 2) ** power))
    rows = round(volume[-1] * n)
    mesh = tensor(np.linspace(0, 1, n + 1), np.interp(np.linspace(0, volume[-1], rows + 1), volume, y), Element.Q4)
    s, along = mesh.nodes.T
    along = along + lead * (s * half_width(die, along)) ** 2 * np.clip(along - ends[0], 0, 1)
    across = s * half_width(die, along)
    return Mesh(np.column_stack([across, along]), mesh.elements, mesh.boundaries)
