"""Where force-driven tools first meet the body: before contact Newton's matrix is singular."""

from __future__ import annotations

import numpy as np

from bipot.iterate import Iterate
from bipot.programs.data import ContactRows
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints

NEAR_ENOUGH = 0.5, 2.0
"""Range of the force that pushes a tool back over the driving force: enough accuracy for a starting point."""

TRIALS = 40


def resisted(rows: ContactRows, by_motion: Floats, tools: Ints) -> Bools:
    """Which of the tool coordinates ``tools`` (s,) enter the law ``by_motion`` (c, d, d) of any contact.

    Round-off does not count: a sliding contact does not resist motion along its slip, up to a difference in space.
    """
    motion = np.zeros((*by_motion.shape[:2], len(tools)))
    motion[:, 0] = rows.G_n[:, tools].toarray()
    motion[rows.frictional, 1:] = rows.G_t[:, tools].toarray().reshape(-1, rows.tangents, len(tools))
    known, most = np.abs(by_motion @ motion), np.abs(by_motion) @ np.abs(motion)
    return np.asarray((known > ACROSS * most).any(axis=(0, 1)))


def touching(iterate: Iterate, coordinates: Ints, stiffness: Floats) -> Iterate:
    """The iterate with the tool ``coordinates`` (m,) moved until the contacts push back about as hard as the force.

    A contact pushes by ``stiffness`` (c,) times its depth in the tool, the body at rest. A tool that meets nothing
    stays.
    """
    for coordinate in coordinates.tolist():
        iterate = _gone(iterate, coordinate, stiffness)
    return iterate


def _gone(iterate: Iterate, coordinate: int, stiffness: Floats) -> Iterate:
    """The iterate with one tool moved."""
    force = -float(iterate.residual[coordinate])
    comes = -np.sign(force) * iterate.rows.G_n[:, [coordinate]].toarray()[:, 0]
    meets = np.flatnonzero(comes > 0)
    if not meets.size:
        return iterate
    # About where the first contact alone carries the force.
    ways = iterate.motion[meets, 0] / comes[meets] + abs(force) / (stiffness[meets] * comes[meets] ** 2)
    near, far, way = 0.0, np.inf, float(ways.min())
    for _ in range(TRIALS):
        x = iterate.x.copy()
        x[coordinate] += np.sign(force) * way
        there = iterate.increment.at(x)
        pushed = stiffness * np.maximum(-there.motion[:, 0], 0.0)
        part = -float(pushed @ there.rows.G_n[:, [coordinate]].toarray()[:, 0]) / force
        if NEAR_ENOUGH[0] <= part <= NEAR_ENOUGH[1]:
            return there
        near, far = (way, far) if part < 1 else (near, way)
        way = (near + far) / 2 if np.isfinite(far) else 2 * way
    return iterate
