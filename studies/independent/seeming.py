"""Gaps at rest between curved sides in a plane that are none, written a second time for the fuzz study.

An edge of three nodes with its middle at the height s over its length L turns by a = 4 s/L and may be s a^2/8 off the
curve through its nodes; places on two such edges that face each other are off each other along the curve, and have gaps
of a times that. A straight edge at an angle b to the curve at its nodes is L b/4 off it.
"""

from __future__ import annotations

import numpy as np

from studies.independent.element import Floats, Ints
from studies.independent.facing import Seen, Straight, points


def seeming(rest: Floats, one: Ints, other: Ints, found: Seen, normal: Floats) -> Floats:
    """Gaps (p,) along a ``normal`` (p, 2) of the points ``found`` at rest, zero where they are more than seem to be."""
    means = found.weights @ rest
    means[found.part <= 0] = 0.0
    along = np.linalg.norm(means - np.vecdot(found.normal, means)[:, None] * found.normal, axis=1)
    heights, turns = np.transpose([_bent(rest[of]) for of in (one, other)])
    allowed = along * turns.max() + heights @ turns**2 / 8
    if one.shape[1] == 2:
        allowed = allowed + _chord(rest, one) + _chord(rest, other)
    gap = np.vecdot(normal, means)
    return np.where(np.abs(gap) <= allowed, gap, 0.0)


def _bent(x: Floats) -> tuple[float, float]:
    """The largest s and a of edges (f, n, 2)."""
    height = np.linalg.norm(x[:, x.shape[1] // 2] - (x[:, 0] + x[:, -1]) / 2, axis=1) * (x.shape[1] == 3)
    return float(height.max()), float((4 * height / np.linalg.norm(x[:, -1] - x[:, 0], axis=1)).max())


def _chord(rest: Floats, edges: Ints) -> float:
    """The largest L b/4 of straight edges (f, 2)."""
    ends = Straight.of(edges).ends
    node, at = points(rest, ends)
    way = rest[ends[:, 1]] - rest[ends[:, 0]]
    length = np.linalg.norm(way, axis=1)
    across, mean = np.stack([way[:, 1], -way[:, 0]], axis=1) / length[:, None], np.zeros((len(node), 2))
    np.add.at(mean, at, across[:, None])
    mean /= np.linalg.norm(mean, axis=1)[:, None]
    return float((length * np.linalg.norm(mean[at] - across[:, None], axis=2).max(axis=1)).max() / 4)
