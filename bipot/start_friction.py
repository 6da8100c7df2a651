r"""What of an increment's slip u_t rubs, and the friction that the forces r_0 of its start make of it.

A force that sticks, or that resists another direction, is not the one with which its point slides. What the slip lacks
of the start's part is the gap of the bipotential between both,

    s_0 |u_t| + r_t0 . u_t >= 0,        s_0 = min(mu r_n0, cap_0),

with cap_0 that of the start. It is zero where a point slides on in its direction, of order three in the increment where
the direction turns smoothly, and 2 s_0 |u_t| where it reverses. A point that was open has s_0 = 0, and a weld does not
slip. Where the friction at the end is below its limit the point has not slid: its motion is the creep of a penalty, or
what is left of zero.

Slip in the air is no friction. A tool that goes steadily along the normal, from where it leaves a point or to where it
lands on it, is in touch as long as the point follows it. Of its slip the part

    b = |v| / (|v| + a),        v = n . (du - du_0) less what a penalty lets it sink,

rubs, with a the gap that opens, or that closes while a point slips, and du_0 the motion of a body that its supports and
the other tools carry and that is otherwise at rest (:mod:`bipot.borne`). Slips of points that curved tools come to
begin where these touch them (:mod:`bipot.tools.meeting`): no gap is left to close.

The ``start`` is the accepted state, of which an increment of BDF2 starts from another, with its flow carried on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.borne import HOLDS
from bipot.contact.closeness import touches
from bipot.contact.shear import Strength, caps
from bipot.contact.supported import rubbed
from bipot.fem.kinematics import gradients
from bipot.iterate import Increment, Iterate
from bipot.response import State
from bipot.tensors import norm
from bipot.typing import Floats


def start_forces(start: State, increment: Increment) -> Floats:
    """Contact forces (c, d) of the start, with friction between tool and support against the increment's slip."""
    return rubbed(start.forces, start_limit(start, increment), increment.dragged)


def start_limit(start: State, increment: Increment) -> Floats:
    """Largest friction forces s_0 (c,) under the forces of the start, with the caps there; 0 where tied."""
    rows = increment.rows
    if increment.system.candidates.capped:
        rows = replace(rows, cap=_caps(start, increment))
    return np.where(rows.tied, 0.0, rows.limit(start.forces))


def missing_friction(start: State, iterate: Iterate, r: Floats, touching: Floats) -> float:
    """What the slip to the end, with forces r (c, d), lacks of the start's friction (module docstring), energy.

    Of the slip the part ``touching`` (c,) rubs, :func:`in_touch`.
    """
    increment, ended = iterate.increment, iterate.rubbed(r)
    slip, begun = slipped(iterate), start_forces(start, increment)
    holds = norm(ended[:, 1:]) < iterate.rows.limit(r) - HOLDS * float(norm(ended).max(initial=0.0))
    gap = start_limit(start, increment) * norm(slip) + np.vecdot(begun[:, 1:], slip)
    return float(gap[~holds] @ touching[~holds])


def slipped(iterate: Iterate) -> Floats:
    """Slips (c, d - 1), known ones included."""
    return iterate.motion[:, 1:] + iterate.increment.dragged


def in_touch(start: State, iterate: Iterate, r: Floats) -> Floats:
    """The part b (c,) of slips to the end, with forces r (c, d), that is not in the air (module docstring).

    It is one where there is a force neither at the start nor at the end.
    """
    contacts, size = iterate.increment.system.candidates, iterate.increment.system.body.scene.size
    begun, ended = start.gap, iterate.motion[:, 0]
    left = iterate.increment.tools.left(iterate.advance)
    air = np.where(touches(np.minimum(begun, left), size), 0.0, left) + np.where(touches(ended, size), 0.0, ended)
    aloft, out = (air > 0) & (start.forces.any(axis=1) | r.any(axis=1)), np.ones(len(air))
    if aloft.any():
        by = contacts.met.motion(iterate.response.du) - iterate.increment.tools.taken
        followed = contacts.parts.gathered(np.vecdot(iterate.increment.tools.frames[:, 0], by))
        sunk = np.minimum(ended, 0.0) - np.minimum(begun, 0.0)
        followed = np.abs(followed - sunk)
        out[aloft] = followed[aloft] / (followed + air)[aloft]
    return out


def _caps(start: State, increment: Increment) -> Floats:
    """The caps (c,) at the start, inf where none is asked."""
    body = increment.system.body
    scene, balanced = body.scene, body.scene.balanced(start.nodes - start.du, start.du)
    volume = gradients(balanced, scene.mesh.elements, body.space.reference, scene.geometry).volume
    strength = Strength(scene.material.yield_stress(start.peeq), volume)
    return caps(increment.system.candidates, strength, balanced, start.nodes, increment.tools.placed)
