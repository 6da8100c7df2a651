"""How far a body is strained from rest, or from a kink of its path, and whether it has long yielded there.

Kinks are those at which the path turns, not changes of pace (:mod:`bipot.scene.paces`).
"""

from __future__ import annotations

import numpy as np

from bipot.contact.closeness import touches
from bipot.fem.reduction import Geometry
from bipot.increment import Solved
from bipot.iterate import Increment
from bipot.system import System
from bipot.tensors import norm
from bipot.tools.surfaces import imaged
from bipot.typing import Floats

YIELDING, CONFINED = 10.0, 1.2
"""Of the strain at yield, from rest: where a body has long yielded, and so much farther in plane strain."""

TURNED_ROUND = 2.0
"""How much farther a body goes after a kink before it has long yielded again."""

ROUND_OFF = 1e-6
"""Of these strains; of that at yield, a strain by which a body is not."""


def is_past_yield(increment: Increment) -> bool:
    """Whether it ends so far from rest or the last kink that the body has long yielded there."""
    strain, far = _since_turn(increment, increment.tau)
    if strain == 0:
        # Loads let a body yield bit by bit to the end.
        return not increment.loads.changes
    return strain >= far * (1 - ROUND_OFF)


def follows_yield(increment: Increment) -> bool:
    """Whether the last increment, from rest or a kink, went past first yield: its mean velocity is of both."""
    start = increment.start
    turn, _ = increment.paces.since_turn(start.tau, increment.tau)
    if start.tau - start.length > turn + ROUND_OFF * start.length or increment.past.turns:
        return False
    strain, far = _since_turn(increment, start.tau)
    return strain >= far * (1 - ROUND_OFF)


def _since_turn(increment: Increment, tau: float) -> tuple[float, float]:
    """The strain at ``tau`` since rest or the last kink, by rates of the ``increment``, and :func:`yielded_strain`."""
    begun = increment.start.tau
    turn, length = increment.paces.since_turn(begun, tau)
    return strain_of(increment) * length / (increment.tau - begun), yielded_strain(increment.system, turn > 0)


def is_strained(solved: Solved) -> bool:
    """Whether the body is strained by more than round-off: at yield a body that rests flows by that, here or there."""
    strain = float(norm(solved.response.kinematics.strain).max())
    return strain > ROUND_OFF * yield_strain(solved.iterate.increment.system)


def yield_strain(system: System) -> float:
    """Yield stress at rest by Young's modulus."""
    material = system.body.scene.material
    return float(material.yield_stress(0.0)) / material.elasticity.young


def yielded_strain(system: System, turned: bool) -> float:
    """That at which a body has long yielded, from rest or where it has ``turned`` round."""
    confined = system.body.scene.geometry is Geometry.PLANE_STRAIN
    far = YIELDING * (CONFINED if confined else 1.0) * (TURNED_ROUND if turned else 1.0)
    return far * yield_strain(system)


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
