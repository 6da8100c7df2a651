"""How far a body is strained from rest, or from a kink of its path, and whether it has long yielded there.

Kinks are those at which the path turns, not changes of pace (:mod:`bipot.scene.paces`).
"""

from __future__ import annotations

import numpy as np

from bipot.contact.closeness import touches
from bipot.increment import Solved
from bipot.iterate import Increment
from bipot.system import System
from bipot.tensors import norm
from bipot.tools.surfaces import imaged
from bipot.typing import Floats

YIELDING = 12.0
"""Of the strain at yield, from rest: where a body has long yielded."""

TURNING = 24.0
"""As YIELDING, after a kink: a body that turns round goes twice as far before it yields again."""

ROUND_OFF = 1e-6
"""Of these strains; of that at yield, a strain by which a body is not."""


def is_past_yield(increment: Increment) -> bool:
    """Whether it ends so far from rest or the last kink that the body has long yielded there."""
    begun = increment.start.tau
    turn, length = increment.paces.since_turn(begun, increment.tau)
    far = (TURNING if turn > 0 else YIELDING) * yield_strain(increment.system)
    strain = strain_of(increment) * length / (increment.tau - begun)
    if strain == 0:
        # Loads let a body yield bit by bit to the end.
        return not increment.loads.changes
    return strain >= far * (1 - ROUND_OFF)


def is_strained(solved: Solved) -> bool:
    """Whether the body is strained by more than round-off: at yield a body that rests flows by that, here or there."""
    strain = float(norm(solved.response.kinematics.strain).max())
    return strain > ROUND_OFF * yield_strain(solved.iterate.increment.system)


def yield_strain(system: System) -> float:
    """Yield stress at rest by Young's modulus."""
    material = system.body.scene.material
    return float(material.yield_stress(0.0)) / material.elasticity.young


def strain_of(increment: Increment) -> float:
    """How far tools and supports go from each other, or from a body that these carry, over the body's extent.

    A tool that turns goes differently where it meets the body from place to place. One that a force drives goes along
    that as the body is carried.
    """
    # Tools out of reach of the body strain nothing.
    near, scene = increment.system.candidates.reached(increment.rows.gap), increment.system.body.scene
    led = scene.drives.poses(increment.tools.led, len(near))[:, : scene.mesh.dimension]
    ways = np.concatenate([increment.tools.rest, (increment.travel + led)[near], _turning(increment)])
    # Beyond a plane of symmetry, which keeps the body in its place, all goes the other way.
    for plane in scene.planes:
        ways = np.vstack([ways, imaged(ways, plane.normal, 0.0)])
    return scene.calipers.strain(ways)


def _turning(increment: Increment) -> Floats:
    """How far (m, d) tools that turn go where they touch the body, or come to one that rests."""
    contacts, start = increment.system.candidates, increment.start
    meets = touches(np.minimum(start.gap, increment.rows.gap), contacts.scene.size)
    tool = contacts.tool[contacts.parts.owner]
    chosen = meets[contacts.parts.owner] & (increment.tools.turned != 0)[tool]
    return (increment.tools.travel[tool] + increment.tools.swept(increment.tools.path))[chosen]
