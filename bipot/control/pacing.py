r"""Increments by accuracy: an estimate of the error of the force, and the length of the next increment.

The estimate of an increment is a fraction of the force,

    e = GATHERED (|sum_q w (sigma_E - sigma) : de| / (2 sum_q w |sigma : de|)  +  sum_q w |de|^2 / (12 sum_q w)
                  +  min(|v - v_0|^2 / |v|^2, TURNED) / 10)  +  l.

* sigma_E is the stress of a radial return from the start for the same motion (backward Euler, of order one in the
  flow), sigma that of the flow carried on. The force is stationary in the direction of flow, so their difference in
  power is of order two in the increment, like the error of the flow carried on.
* |de|^2/12 is the difference of the midpoint strain from the logarithmic one, 2 tanh(x/2) = x - x^3/12 + ...
* v, v_0 are the nodal velocities of the whole body, of this increment and the last: the curvature of the motion. A
  change by more than TURNED is an event (first yield, a landing) that does not depend on the length of increments.
  After a kink, or where nothing flows, the two velocities are unrelated.
* l is by how much friction lags behind slip that turns (:mod:`bipot.control.lag`), zero in a plane. It is measured
  against the work of strain and friction together.

l is of order one, and the other terms are of order two where the solution is smooth. The next increment is AIMED
sqrt(accuracy/e) times as long, within the stability of BDF2, and an increment with an error REFUSED times the accuracy
is solved again, shorter. Errors of the motion stay in the shape of the body, and those of later increments add to them,
which is GATHERED. It and the other factors are calibrated: the largest error of the curve is 0.3 to 3 times the
accuracy on the paper's mesh, and on one of linear elements up to 4 times at 1e-4; it is less on coarse meshes, where
errors cancel (studies/accuracy/paced.py).

At rest and at a kink, the first increment has a strain of YIELDING yield strains, at least ONSET sqrt(accuracy) and at
most GROWTH times that, judged by how far tools and supports go from each other, or from where they are, over the body's
extent. Where a load changes or a tool turns, what that strains is not known, and the first increment is at most
UNDRIVEN of the way to the next kink. If flow begins in it, the next one is shorter, BEGUN of it. Increments of the size
of the yield strain have an error of the force of 1e-3 at first yield, which decays soon. A first increment that passes
first yield has the smallest error, 1e-4 to 3e-4 in a metal, which the estimate does not contain. A body with a yield
strain of one hundredth would need more strain than an increment may have, and its error is larger there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bipot.control.lag import lag_of
from bipot.increment import Solved
from bipot.iterate import Increment
from bipot.response import State
from bipot.scene.symmetry import own_share
from bipot.schedule import SAME
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import vdot

TURNED = 1.6e-3
"""Relative change of velocity, squared, up to which the motion counts as curved and not as an event."""

ONSET, YIELDING, BEGUN = 1.4, 12.0, 0.4
"""Least first strain over sqrt(accuracy), and first strain over yield stress by Young's modulus; the second increment
over the first."""

RESTS = 1e-6
"""A body rests if all its nodes move by less than this fraction of the motion expected in the increment."""

SHORTEST = 1e-9
"""The least first length in pseudo-time, far above its round-off."""

UNDRIVEN = 0.05
"""Longest first length where a load changes, a tool turns or nothing follows a path, over that of constant rates."""

AIMED, GROWTH, SHRINK = 1.05, 2.0, 0.2
"""Length aimed at over the one that the estimate allows; longest and shortest next one over the last, the longest also
the first strain over the least.

BDF2 is stable below 1 + sqrt(2).
"""

GATHERED = 2.5
"""What the errors that increments leave come to over that of one."""

REFUSED, TRIES = 4.0, 3
"""An estimate above REFUSED times the accuracy shortens the increment, up to TRIES times."""

CHEAPEST, QUICK = 2e-3, 8
"""Coarser accuracies give the increments of CHEAPEST, because longer ones cost more passes than they save. After more
passes than QUICK the next increment is not longer than the last."""


def error_estimate(start: State, solved: Solved) -> float:
    """The estimate (a fraction) of the increment ``solved`` from the accepted ``start``, before flow was carried on."""
    increment, response = solved.iterate.increment, solved.response
    kin, body, sigma = response.kinematics, increment.system.body, response.returned.stress
    euler = body.scene.material.update(kin.turned(start.stress), kin.strain, start.peeq).stress
    taken = vdot(kin.volume, np.abs(np.vecdot(sigma, kin.strain)))
    missed = abs(vdot(kin.volume, np.vecdot(euler - sigma, kin.strain)))
    square = vdot(kin.volume, np.vecdot(kin.strain, kin.strain)) / float(kin.volume.sum())
    bent = _turned(increment, start, solved) if response.returned.plastic.any() else 0.0
    lagging = 0.0 if at_kink(increment.system, start.tau) else lag_of(start, solved).share(taken)
    return GATHERED * ((missed / 2 / taken if taken > 0 else 0.0) + square / 12 + bent / 10) + lagging


def begins_flow(start: State, solved: Solved) -> bool:
    """Whether there is flow in the increment ``solved`` from ``start`` although none was carried on into it."""
    return solved.response.state is start and bool(solved.response.returned.plastic.any())


def _turned(increment: Increment, start: State, solved: Solved) -> float:
    """|v - v_0|^2 / |v|^2, at most TURNED; zero from rest, after a kink and where nothing moves."""
    velocity = solved.response.du / (increment.tau - start.tau)
    scene = increment.system.body.scene
    part = own_share(scene.planes, scene.mesh.nodes[:, None])
    speed = vdot(part, np.vecdot(velocity, velocity))
    # Motion by round-off has a random direction, as under a tool that slides over a body it no longer strains.
    moves = float(norm(solved.response.du).max()) > RESTS * increment.units.length
    if not (start.length > 0 and moves) or at_kink(increment.system, start.tau):
        return 0.0
    change = velocity - start.velocity
    return min(vdot(part, np.vecdot(change, change)) / speed, TURNED)


@dataclass(frozen=True)
class Pacer:
    """Lengths of increments (pseudo-time) for an ``accuracy``, a fraction of the force."""

    accuracy: float

    @property
    def aim(self) -> float:
        """The estimate aimed at."""
        return min(self.accuracy, CHEAPEST)

    def length(self, system: System, state: State, proposed: float, target: float) -> float:
        """The length of the next increment towards ``target``: the rest is divided equally, except for a first one."""
        left = target - state.tau
        if math.isnan(proposed) or at_kink(system, state.tau):
            return min(self._first(system, state, target), left)
        return left / max(1, math.ceil(left / proposed - SAME))

    def refuses(self, estimate: float) -> bool:
        """Whether the increment is to be solved again, shorter."""
        return estimate > REFUSED * self.aim

    def next(self, length: float, estimate: float, passes: int = 0, begun: bool = False) -> float:
        """The length after an increment of that ``length``, estimate and ``passes``; ``begun`` where its flow began."""
        allowed = AIMED * math.sqrt(self.aim / estimate) if estimate > 0 else math.inf
        growth = BEGUN if begun else GROWTH if passes <= QUICK else 1.0
        return min(length * max(min(allowed, growth), SHRINK), 1.0)

    def _first(self, system: System, state: State, target: float) -> float:
        """The first length of a stretch of constant rates."""
        whole, scene = Increment(system, state, target), system.body.scene
        # Tools out of reach of the body strain nothing.
        near = system.candidates.reached(whole.rows.gap)
        # What moves apart or together, or moves against a body at rest: beyond a plane of symmetry that is half of it.
        ways = np.concatenate([whole.driven, whole.travel[near], np.zeros((1, scene.mesh.dimension))])
        strained = float((np.ptp(ways, axis=0) / np.ptp(scene.mesh.nodes, axis=0)).sum())
        # What a load or a turn strains is not known beforehand.
        stretch, unknown = target - state.tau, bool(whole.new_load.any() or whole.tools.turned[near].any())
        most = UNDRIVEN * stretch if strained == 0 or unknown else stretch
        if strained == 0:
            return max(most, SHORTEST)
        at_yield = float(scene.material.yield_stress(0.0)) / scene.material.elasticity.young
        # Past first yield, but no farther than a following increment would go: the estimate sees little of a first one.
        least = ONSET * math.sqrt(self.aim)
        strain = min(max(least, YIELDING * at_yield), GROWTH * least)
        return max(min(strain / strained * stretch, most), SHORTEST)


def at_kink(system: System, tau: float) -> bool:
    """Whether the rate of a path or a load changes there."""
    return any(abs(kink - tau) <= SAME for kink in system.body.scene.kinks)
