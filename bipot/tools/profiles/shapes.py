"""Profiles by name: they point down, are open above, and end there where the body must not come."""

from __future__ import annotations

import numpy as np

from bipot.errors import require, require_number, require_positive
from bipot.tools.profiles.profile import Profile, checked_radius
from bipot.tools.surfaces import place


def wedge(apex: tuple[float, float], semi_angle: float, length: float, radius: float = 0.0) -> Profile:
    """The wedge with flanks ``length`` long at ``semi_angle`` degrees to the vertical above its ``apex``.

    On a meridian, with the apex on the axis, it is a cone. A ``radius`` above zero rounds its tip, which then is above
    the apex by radius (1/sin(semi_angle) - 1).

    Raises:
        SceneError: an angle outside (0, 90), a length not above zero, a radius that does not fit; as :class:`Profile`.

    >>> round(float(wedge((0.0, 1.0), 45.0, 2.0).distance(np.array([1.0, 1.0])).gap), 12)
    0.707106781187
    """
    x, y = place(apex, "wedge.apex")
    require_number(semi_angle, "wedge.semi_angle")
    require(0 < semi_angle < 90, "wedge.semi_angle", semi_angle, "in (0, 90) degrees")
    require_positive(**{"wedge.length": length})
    # A profile would take a tuple of them.
    checked_radius(radius, "wedge.radius")
    angle = np.radians(float(semi_angle))
    out, up = length * np.sin(angle), length * np.cos(angle)
    return Profile(((x + out, y + up), (x, y), (x - out, y + up)), radius)


def flat_punch(middle: tuple[float, float], width: float, height: float, radius: float = 0.0) -> Profile:
    """The punch with a flat face of ``width`` around its ``middle``, sides ``height`` high and edges of a ``radius``.

    Raises:
        SceneError: a width or height not above zero, a radius that does not fit; as :class:`Profile`.

    >>> float(flat_punch((0.0, 1.0), 2.0, 3.0, 0.5).distance(np.array([0.0, 0.25])).gap)
    0.75
    """
    x, y = place(middle, "punch.middle")
    require_positive(**{"punch.width": width, "punch.height": height})
    checked_radius(radius, "punch.radius")
    half = width / 2
    return Profile(((x + half, y + height), (x + half, y), (x - half, y), (x - half, y + height)), radius)
