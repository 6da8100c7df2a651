"""Where force-driven tools first meet the body; before contact Newton's matrix is singular."""

from __future__ import annotations

import numpy as np

from bipot.iterate import Iterate
from bipot.programs.data import ContactRows
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints

NEAR_ENOUGH = 0.5, 2.0
"""Range of the force of contacts on a tool over its driving force that is accurate enough for a starting point."""

TRIALS = 40


def resisted(rows: ContactRows, by_motion: Floats, tools: Ints) -> Bools:
    """Which tool coordinates ``tools`` (s,) change the law of any contact, with its slopes ``by_motion`` (c, d, d).

    Round-off does not count: a sliding contact in space resists motion along its slip by a difference of zero.
    """
    motion = np.zeros((*by_motion.shape[:2], len(tools)))
    motion[:, 0] = rows.G_n[:, tools].toarray()
    motion[rows.frictional, 1:] = rows.G_t[:, tools].toarray().reshape(-1, rows.tangents, len(tools))
    change, most = np.abs(by_motion @ motion), np.abs(by_motion) @ np.abs(motion)
    return np.asarray((change > ACROSS * most).any(axis=(0, 1)))


def touching(iterate: Iterate, coordinates: Ints, stiffness: Floats) -> Iterate:
    """The iterate with the tool ``coordinates`` (m,) moved until the contacts push back about as hard as the force.

    A contact pushes by ``stiffness`` (c,) times its depth in the tool, while the body rests. A tool that meets nothing
    stays where it is.
    """
    for coordinate in coordinates.tolist():
        iterate = _moved(iterate, coordinate, stiffness)
    return iterate


def _moved(iterate: Iterate, coordinate: int, stiffness: Floats) -> Iterate:
    """The iterate with one tool moved by :func:`touching`."""
    force = -float(iterate.residual[coordinate])
    comes = -np.sign(force) * iterate.rows.G_n[:, [coordinate]].toarray()[:, 0]
    meets = np.flatnonzero(comes > 0)
    if not meets.size:
        return iterate
    # The first trial is about where the first contact alone would carry the force.
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
