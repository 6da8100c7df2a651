"""Where Newton's iteration begins: tools that forces drive are moved to the body, and a body at rest begins to flow.

An increment from rest that goes far past first yield leads nowhere near the elastic answer, from which Newton finds its
way back in short steps. Its first pass instead lets a body flow that is elastic with the secant shear modulus

    G_s = sigma_Y / (3 eps),    eps the strain by which tools and supports go (:func:`bipot.yielding.strain_of`),

nearly incompressible as plastic flow is. Contacts that touch at rest are without friction where that is low, so that
all of them slide, and stick where it is high; then friction goes with the slip. Where this is still far from the
equilibrium and law of that body, because it goes far or slides where it stuck, a second pass lets it flow once more.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from bipot.errors import InvertedElement, NotConverged, ProgramError
from bipot.fem.reduction import Geometry
from bipot.forms.memory import Setup
from bipot.forms.point import Law, Point
from bipot.iterate import Increment, Iterate
from bipot.programs.data import ContactRows
from bipot.programs.factors import LinearSolver
from bipot.programs.newton import Linearised
from bipot.programs.pieces import Pieces
from bipot.tools.surfaces import ACROSS
from bipot.typing import Bools, Floats, Ints
from bipot.yielding import ROUND_OFF, strain_of, yielded_strain

LEAST = 1e-5
"""Secant shear modulus over the bulk modulus below which pressures of such flow would be round-off."""

FLOWS, SETTLED = 2, 3.0
"""Most passes of such flow, and the error (:attr:`bipot.forms.point.Point.error`) up to which the second is spared."""

LOW = 0.35
"""Coefficient of friction up to which most of a body's contacts slide in such flow."""

NEAR_ENOUGH, TRIALS = (0.5, 2.0), 40
"""Range of the force of contacts on a tool over its driving force that is accurate enough for a starting point, and the
most trials to get there."""


def flow_from_rest(iterate: Iterate, last: Point | None, law: Law, setup: Setup, linear: LinearSolver) -> Point | None:
    """The point to which the body flows in an increment from rest (module docstring), None where there is none.

    It flows once more from the ``last`` point of such flow, if there is one. None, too, if an element folds in such
    flow, or if tools that leave a body and friction alone would strain it.
    """
    increment = iterate.increment
    shear = flow_modulus(increment)
    if shear is None:
        return None
    internal, element = increment.system.body.softened(iterate.response, shear)
    residual = internal + iterate.residual - iterate.response.internal
    unloaded = np.zeros((iterate.rows.count, 1 + iterate.rows.tangents))
    pieces, r = (_pieces_of_flow(iterate, law, unloaded), unloaded) if last is None else (last.pieces, last.r)
    here = law.at(iterate, r, pieces, residual)
    if last is not None and here.error <= SETTLED:
        return None
    with suppress(InvertedElement, NotConverged, ProgramError):
        flow = Linearised.of(setup.data(element), law.frames_at(iterate), pieces, linear)
        dx, r = flow.step(residual, here.miss, r)
        there, r = increment.at(iterate.x + dx), np.where(pieces.none, 0.0, r)
        r[~there.rows.tied, 0] = np.maximum(r[~there.rows.tied, 0], 0.0)
        slipped = law.point(there, r, None)
        # Friction that goes with the slip is what the law misses.
        slides = slipped.pieces.closed & slipped.pieces.disc.slides
        r[slides, 1:] -= slipped.miss[slides, 1:]
        return law.at(there, r, slipped.pieces) if there.response.returned.plastic.any() else None
    return None


def flow_modulus(increment: Increment) -> Floats | None:
    """G_s (e, 1) of an increment from rest that goes far past first yield (:func:`bipot.yielding.yielded_strain`).

    What does not flow keeps its modulus. None where the increment does not go so far. Where forces drive tools or loads
    change, no strain is known beforehand, and in plane strain flow gathers in bands of shear, of which this one knows
    nothing.
    """
    body, start = increment.system.body, increment.start
    if start.length or start.stress.any() or body.scene.drives or body.scene.materials.drifts:
        return None
    if body.scene.geometry is Geometry.PLANE_STRAIN or increment.loads.changes:
        return None
    strain, law = strain_of(increment), body.scene.materials
    if strain < yielded_strain(increment.system, None) * (1 - ROUND_OFF) or not strain:
        return None
    stress = law.yield_stress(np.full((len(body.scene.mesh.elements), 1), strain))
    shear = np.minimum(stress / (3 * strain), law.elasticity.shear)
    return shear if bool((shear > LEAST * law.elasticity.bulk).all()) else None


def _pieces_of_flow(iterate: Iterate, law: Law, unloaded: Floats) -> Pieces:
    """The law of the contacts that touch at the start, without low friction (:data:`LOW`) if they hold the body so.

    Of a tool that touches nowhere, those that it has reached count. What folds onto a tool would be pinned there.
    """
    rows, system = iterate.rows, iterate.increment.system
    resting, owned = iterate.increment.tools.closed, system.candidates.owned
    touches = np.asarray((owned & resting).any(axis=1))
    smooth = replace(rows, mu=np.where(rows.mu > LOW, rows.mu, 0.0))
    pieces = Pieces.of(smooth, iterate.motion, unloaded, law.scale)
    closed = pieces.closed & (resting | ~touches[system.candidates.tool])
    opened = rows.G_n[np.flatnonzero(closed)] @ system.rigid
    # Older versions of numpy know no rank of an empty matrix.
    held = (np.linalg.matrix_rank(opened) if opened.size else 0) == opened.shape[1]
    pieces = pieces if held else Pieces.of(rows, iterate.motion, unloaded, law.scale)
    return replace(pieces, closed=closed, measured=iterate.measured)


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

    Before first contact Newton's matrix is singular. A contact pushes by ``stiffness`` (c,) times its depth in the
    tool, while the body rests. A tool that meets nothing stays where it is.
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
