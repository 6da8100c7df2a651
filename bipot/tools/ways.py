"""Straight ways of points through tools in space, by the distance alone: whether they come out on another side.

Along a way the gap changes by no more than its length, so a way is checked only where it may be in the tool, in steps
of a small part of the tool's thickness, or of its own length where that is short.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bipot.tensors import norm
from bipot.tools.circle import AROUND, DEEP, GRAZED, OPEN, PAST, SHALLOW
from bipot.tools.surfaces import Distance
from bipot.typing import Bools, Floats

LEAST, MOST = 17, 4096
"""Range of the number of points checked on a way: enough to detect a depth of GRAZED of the tool."""


def comes_through(distance: Callable[[Floats], Distance], thickness: float, x: Floats, by: Floats) -> Bools:
    """Whether points x (…, 3) that go straight ``by`` (…, 3) come through the tool and out on another side of it (…).

    The tool has this ``distance`` and ``thickness``, the diameter of the largest sphere in it. Its normals where a way
    enters and leaves differ by more than PAST; or by more than AROUND, and the way is deeper than a chord of
    that angle in a sphere as thick; or the point touches the tool neither before nor after, and more than grazes it.
    """
    out = np.zeros(x.shape[:-1], dtype=bool)
    length = norm(by)
    near = (distance(x).gap < length) & (length > 0)
    if not near.any() or not np.isfinite(thickness):
        return out
    x, by, length = x[near], by[near], length[near]
    count = int(np.clip(np.ceil(2 * length.max() / (GRAZED * thickness)), LEAST, MOST))
    way = x[:, None] + np.linspace(0.0, 1.0, count)[:, None] * by[:, None]
    found = distance(way)
    inside = found.gap < 0
    first, last = np.argmax(inside, axis=1), count - 1 - np.argmax(inside[:, ::-1], axis=1)
    rows = np.arange(len(x))
    turned = np.vecdot(found.normal[rows, first], found.normal[rows, last])
    depth = -found.gap.min(axis=1)
    radius = thickness / 2
    far = (turned < np.cos(PAST)) | ((turned < np.cos(AROUND)) & (depth > DEEP * radius))
    open_at_both = (found.gap[:, [0, -1]] > OPEN * radius).all(axis=1)
    grazes = open_at_both & (depth > GRAZED * radius)
    out[near] = inside.any(axis=1) & (depth > SHALLOW * length) & (far | grazes)
    return out
