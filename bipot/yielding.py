"""How far a body is strained from rest, or from a kink of its path, and whether it has long yielded there.

Kinks are those at which the path turns, not changes of pace (:mod:`bipot.scene.paces`).
"""

from __future__ import annotations

import math

import numpy as np

from bipot.contact.closeness import TOUCHES, touches, until_closed
from bipot.fem.reduction import Geometry
from bipot.iterate import Increment, Iterate
from bipot.system import System
from bipot.tensors import norm
from bipot.tools.surfaces import imaged
from bipot.typing import Bools, Floats, max_abs, vdot

YIELDING, CONFINED, TURNED_ROUND = 10.0, 1.2, 2.0
"""A body has long yielded at YIELDING times the strain at yield: CONFINED times that in plane strain, TURNED_ROUND
times after a kink, where a body that has hardened has the mean yield stress that it has there."""

FLOWED = 2.0
"""Mean peeq of a body over the strain since rest, above which it has flowed before."""

ROUND_OFF = 1e-6
"""Relative round-off of these strains; a strain below this part of that at yield counts as none."""

STRIDE = 0.05
"""What tools go at most, over the body's size, between places at which it is seen whether they touch."""

SAME = 1e-13
"""Pseudo-times nearer than this are the same where a tool comes to touch a body: it may come from far."""


def is_past_yield(increment: Increment) -> bool:
    """Whether the increment ends so far from rest or the last kink that the body has long yielded there."""
    strain = strain_of(increment)
    if strain == 0:
        # Loads let a body yield bit by bit to the end.
        return not increment.loads.changes
    far = yielded_strain(increment.system, hardened(increment))
    return _since_turn(increment, increment.tau, strain) >= far * (1 - ROUND_OFF)


def follows_yield(increment: Increment) -> bool:
    """Whether the increment before, from rest or a kink, went past first yield: its mean velocity is of both sides."""
    start, last = increment.start, increment.past.length
    turn, passed = increment.paces.since_turn(start.tau, start.tau)
    touched = 0.0 if turn > 0 else _apart(increment, increment.system.gaps_at_rest)
    if passed - last > touched + ROUND_OFF * last:
        return False
    peeq = hardened(increment)
    if peeq is not None and start.flow is not None:
        peeq = peeq - start.flow.peeq
    far = yielded_strain(increment.system, peeq)
    return _since_turn(increment, start.tau, strain_of(increment)) >= far * (1 - ROUND_OFF)


def hardened(increment: Increment) -> Floats | None:
    """peeq (e, q) at the start of an increment whose path has turned since rest, None of another."""
    start = increment.accepted or increment.start
    turn, _ = increment.paces.since_turn(start.tau, increment.tau)
    return start.peeq if turn > 0 else None


def _since_turn(increment: Increment, tau: float, strain: float) -> float:
    """The strain from rest or the last kink to ``tau``, at the rates of an ``increment`` with that ``strain``.

    From rest it is that beyond what tools go through the air.
    """
    begun = increment.start.tau
    turn, length = increment.paces.since_turn(begun, tau)
    rate, system = strain / (increment.tau - begun), increment.system
    touched = length if turn > 0 else max(length - _apart(increment, system.gaps_at_rest), 0.0)
    # A body that another march has left has flowed before, and is not at rest where the mesh is.
    left = vdot(system.body.parts, (increment.accepted or increment.start).peeq) > FLOWED * rate * touched
    return rate * (length if left else touched)


def through_air(increment: Increment) -> float:
    """How long, in pseudo-time, tools go in the ``increment`` before any touches the body, if that rests meanwhile."""
    return min(_apart(increment, increment.start.gap), increment.tau - increment.start.tau)


def _apart(increment: Increment, gap: Floats) -> float:
    """How long tools with such a ``gap`` (c,) from a body that rests go, at the ``increment``'s rates, to touch it.

    Zero where one touches it already, and where supports that move or loads that change strain it meanwhile.
    """
    start, moves = increment.start, _coming(increment, gap)
    rate = (increment.rows.gap - start.gap) / (increment.tau - start.tau)
    wait = until_closed(gap[moves], rate[moves])
    return wait if math.isfinite(wait) else 0.0


def until_touching(stretch: Increment) -> float:
    """How long tools go in a ``stretch`` in which the body rests, until one is as near as counts as touching.

    It is looked for as far on as no gap can close before, but at least :data:`STRIDE` of the body's size farther; inf
    if none comes so near. Zero as in :func:`through_air`.
    """
    start, moves, contacts = stretch.start, _coming(stretch, stretch.start.gap), stretch.system.candidates
    if not moves.any():
        return 0.0
    length, size, pace = stretch.tau - start.tau, contacts.scene.size, _pace(stretch)

    def gap(time: float) -> float:
        placed = contacts.scene.placed(start.tau + time, start.translation)
        return float(contacts.distance(start.nodes, placed)[moves].min()) - TOUCHES / 2 * size

    begin, apart = 0.0, gap(0.0)
    if apart <= 0:
        return 0.0
    while begin < length:
        end = min(begin + max(apart, STRIDE * size) / pace, length)
        apart = gap(end)
        if apart <= 0:
            # scipy.optimize takes long to import, and most marches begin with tools that touch.
            from scipy.optimize import brentq

            return float(brentq(gap, begin, end, xtol=SAME))
        begin = end
    return math.inf


def _pace(increment: Increment) -> float:
    """A bound, per pseudo-time, on how fast tools pass the places of a body that rests."""
    contacts, tools, start = increment.system.candidates, increment.tools, increment.start
    tool, gone = contacts.tool[contacts.parts.owner], norm(tools.travel)
    arms = norm(contacts.faces.arms(contacts.met.places(start.nodes), tools.placed))
    ways = gone[tool] + np.abs(tools.turned[tool]) * (arms + gone[tool])
    return float(ways.max()) / (increment.tau - start.tau)


def _coming(increment: Increment, gap: Floats) -> Bools:
    """Candidates (c,) of tools that move, with such a ``gap`` (c,) from a body that rests meanwhile.

    None where one touches it already, and where supports that move or loads that change strain it.
    """
    tools, contacts = increment.tools, increment.system.candidates
    moves = (tools.travel.any(axis=1) | (tools.turned != 0))[contacts.tool]
    strained = bool(tools.driven.any()) or increment.loads.changes
    return moves & (not (strained or touches(gap[moves], contacts.scene.size).any()))


def flows(iterate: Iterate) -> bool:
    """Whether there is flow, by more strain than round-off, by which a resting body at yield flows here or there."""
    strain = float(norm(iterate.response.kinematics.strain).max())
    is_strained = strain > ROUND_OFF * yield_strain(iterate.increment.system)
    return is_strained and bool(iterate.response.returned.plastic.any())


def yield_strain(system: System, peeq: Floats | None = None) -> float:
    """The yield stress over Young's modulus: the largest at rest, or the mean of a body hardened by ``peeq`` (e, q).

    Of several materials those count that flow.
    """
    law = system.body.scene.materials
    strain = (system.body.yield_stress if peeq is None else law.yield_stress(peeq)) / law.elasticity.young
    flows = np.isfinite(strain)
    if peeq is None or not flows.any():
        return float(strain[flows].max(initial=0.0)) or np.inf
    return vdot(system.body.parts[flows], strain[flows]) / float(system.body.parts[flows].sum())


def yielded_strain(system: System, turned: Floats | None) -> float:
    """The strain at which a body has long yielded, from rest, or after a kink at which it had the peeq ``turned``."""
    confined = system.body.scene.geometry is Geometry.PLANE_STRAIN
    far = YIELDING * (CONFINED if confined else 1.0) * (1.0 if turned is None else TURNED_ROUND)
    return far * yield_strain(system, turned)


def strain_of(increment: Increment) -> float:
    """How far tools and supports go from each other, or from the body as they carry it, over the body's extent.

    Of a tool that turns, each place at which it meets the body goes its own way. A tool that a force drives goes along
    that as the body is carried. Tools out of reach of the body strain nothing.
    """
    ways, scene = _ways(increment), increment.system.body.scene
    # The mirror images beyond a plane of symmetry go the other way.
    for plane in scene.planes:
        ways = np.vstack([ways, imaged(ways, plane.normal, 0.0)])
    return scene.calipers.strain(ways)


def goes_one_way(increment: Increment) -> bool:
    """Whether tools press along one line, along which tools and supports go.

    The power of all tools is stationary in the direction of flow, and so is a force of one such. What several forces
    share is not, nor the friction on a tool at rest, which is a part of a force that is not.
    """
    contacts, ways = increment.system.candidates, _ways(increment)
    near = contacts.reached(increment.rows.gap)[contacts.tool[contacts.parts.owner]]
    apart = (ways - ways[0]) / max_abs(ways) if ways.any() else ways
    lines = np.concatenate([apart, increment.tools.frames[near, 0]])
    return int(np.linalg.matrix_rank(lines, tol=ROUND_OFF * len(lines))) <= 1


def _ways(increment: Increment) -> Floats:
    """The different ways (m, d) of tools and supports (:func:`strain_of`), without mirror images."""
    near, scene = increment.system.candidates.reached(increment.rows.gap), increment.system.body.scene
    led = scene.drives.poses(increment.tools.led, len(near))[:, : scene.mesh.dimension]
    ways = np.concatenate([increment.tools.rest, (increment.tools.travel + led)[near], _turning(increment)])
    # Most supports rest, and each way is measured along many normals.
    return np.unique(ways, axis=0)


def _turning(increment: Increment) -> Floats:
    """Motions (m, d) of tools that turn, at the places where they touch the body or come to touch it if it rests."""
    contacts, start = increment.system.candidates, increment.start
    meets = touches(np.minimum(start.gap, increment.rows.gap), contacts.scene.size)
    owner = contacts.parts.owner
    tool = contacts.tool[owner]
    chosen = meets[owner] & (increment.tools.turned != 0)[tool]
    return (increment.tools.travel[tool] + increment.tools.swept(increment.tools.path))[chosen]
