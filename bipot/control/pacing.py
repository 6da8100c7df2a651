r"""Increments by accuracy: an estimate of the error of the force, and the length of the next increment.

The estimate of an increment is a fraction of the force,

    e = |sum_q w (sigma_E - sigma) : de| / (2 sum_q w |sigma : de|)  +  sum_q w |de|^2 / (12 sum_q w)
        +  T  +  L / sum_q w |sigma : de|.

* sigma_E is the stress of a radial return from the start for the same motion (backward Euler, of order one in the
  flow), sigma that of the flow carried on. The force is stationary in the direction of flow, so their difference in
  power is of order two in the increment, like the error of the flow carried on.
* |de|^2/12 is the difference of the midpoint strain from the logarithmic one, 2 tanh(x/2) = x - x^3/12 + ...
* T = min(|v - v_0|^2 / |v|^2, TURNED) / 10 with v, v_0 the nodal velocities of the whole body, of this increment and
  the last, beyond those at which supports carry it: the curvature of the motion. A change by more than TURNED is an
  event (a landing) that does not depend on the length of increments. After a kink, or where nothing flows, the two
  velocities are unrelated: T is zero.
* An increment that ends less than YIELDING yield strains after rest, TURNING after a kink, ends where the body begins
  to yield, while the force still follows the strain of what has not yielded. There T = |v - v_0|/|v| h/20, and not more
  than h/20, with h <= 1 the strain of the increment over that at yield. In the first one |v - v_0|/|v| is one after
  rest, that of directions after a kink, and it counts as far as sum_q w |sigma : de| is dissipated. What yields there
  has no flow to carry on: |sum_q w (sigma_E - sigma_P) : de| is added, sigma_P of returns in PARTS parts.
* L is the energy by which friction lags behind slip that turns (:mod:`bipot.control.lag`), zero in a plane.

L is of order one, and the other terms are of order two where the solution is smooth. The next increment is AIMED
sqrt(accuracy/e) times as long, within the stability of BDF2, and an increment with an error REFUSED times the accuracy
is solved again, shorter. The factors one half and one tenth are calibrated: with them the largest error of the curve,
accumulated errors of motion included, is 0.3 to 3 times the accuracy (studies/accuracy/paced.py).

At rest, the first increment has a strain of YIELDING yield strains, at a kink of TURNING, at least ONSET sqrt(accuracy)
and at most GROWTH times that, judged by how far tools and supports go from each other, or from where they are, over the
body's extent. Where a load changes or a tool turns, what that strains is not known, and the first increment is at most
UNDRIVEN of the way to the next kink. If flow begins in it, the next one is shorter, BEGUN of it. Increments of the size
of the yield strain have an error of the force of 1e-3 at first yield and of 1e-2 after a body has turned round, which
decay soon. A first increment that passes first yield has the smallest error, 1e-4 to 3e-4 in a metal, which the
estimate does not contain. Where a path ends or turns sooner, or the yield strain is so large that an increment may not
be so long, many short ones follow yielding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from bipot.advance import Advance
from bipot.control.lag import lag
from bipot.control.yielding import TURNING, YIELDING, at_kink, is_past_yield, strain_of, yield_strain
from bipot.increment import Solved
from bipot.iterate import Increment
from bipot.response import State
from bipot.schedule import SAME
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Floats, vdot

TURNED = 1.6e-3
"""Relative change of velocity, squared, up to which the motion counts as curved and not as an event."""

ONSET, BEGUN = 1.4, 0.4
"""Least first strain over sqrt(accuracy); the second increment over the first."""

RESTS = 1e-6
"""A body rests if all its nodes move by less than this fraction of the motion expected in the increment."""

PARTS = 8
"""Of an increment's strain in which a radial return shows how long that is for it."""

SHORTEST = 1e-9
"""The least first length in pseudo-time, far above its round-off."""

UNDRIVEN = 0.05
"""Longest first length where a load changes, a tool turns or nothing follows a path, over that of constant rates."""

AIMED, GROWTH, SHRINK = 1.05, 2.0, 0.2
"""Length aimed at over the one that the estimate allows; longest and shortest next one over the last, the longest also
the first strain over the least.

BDF2 is stable below 1 + sqrt(2).
"""

REFUSED, TRIES = 4.0, 3
"""An estimate above REFUSED times the accuracy shortens the increment, up to TRIES times."""

CHEAPEST, QUICK = 1e-3, 8
"""Coarser accuracies give the increments of CHEAPEST, because longer ones cost more passes than they save. After more
passes than QUICK the next increment is not longer than the last."""


def error_estimate(start: State, solved: Solved) -> float:
    """The estimate (a fraction) of the increment ``solved`` from the accepted ``start``, before flow was carried on."""
    increment, response = solved.iterate.increment, solved.response
    kin, sigma = response.kinematics, response.returned.stress
    taken = vdot(kin.volume, np.abs(np.vecdot(sigma, kin.strain)))
    square = float(vdot(kin.volume, np.vecdot(kin.strain, kin.strain)) / kin.volume.sum())
    bent = _bent(increment, start, solved) if response.returned.plastic.any() else 0.0
    lagging = 0.0 if at_kink(increment.system, start.tau) else lag(start, solved)
    return ((_missed(start, solved) + lagging) / taken if taken > 0 else 0.0) + square / 12 + bent


def _missed(start: State, solved: Solved) -> float:
    """|sum_q w (sigma_E - sigma) : de| / 2, where the body begins to yield that of sigma_P, too."""
    kin, sigma = solved.response.kinematics, solved.response.returned.stress
    update, begun = solved.iterate.increment.system.body.scene.material.update, kin.turned(start.stress)
    euler = update(begun, kin.strain, start.peeq).stress
    missed = abs(vdot(kin.volume, np.vecdot(euler - sigma, kin.strain))) / 2
    if is_past_yield(solved.iterate.increment):
        return missed
    stress, peeq = begun, start.peeq
    for _ in range(PARTS):
        part = update(stress, kin.strain / PARTS, peeq)
        stress, peeq = part.stress, peeq + part.dpeeq
    alone = np.asarray((solved.response.state.stress == start.stress).all(axis=-1))
    return missed + abs(vdot(kin.volume * alone, np.vecdot(stress - euler, kin.strain)))


def begins_flow(start: State, solved: Solved) -> bool:
    """Whether there is flow in the increment ``solved`` from ``start`` although none was carried on into it."""
    return solved.response.state is start and bool(solved.response.returned.plastic.any())


def _bent(increment: Increment, start: State, solved: Solved) -> float:
    """T (module docstring), zero where nothing moves."""
    # Motion by round-off has a random direction, as under a tool that slides over a body it no longer strains.
    if not float(norm(solved.response.du).max()) > RESTS * increment.units.length:
        return 0.0
    first = start.length == 0 or at_kink(increment.system, start.tau)
    if is_past_yield(increment):
        return 0.0 if first else min(_turned(increment, start, solved), TURNED) / 10
    part = _dissipated(solved) if first else 1.0
    strain = strain_of(increment) / yield_strain(increment.system)
    return min(math.sqrt(_turned(increment, start, solved)), 1.0) * part * min(strain, 1.0) / 20


def _turned(increment: Increment, start: State, solved: Solved) -> float:
    """|v - v_0|^2 / |v|^2, one from rest; after a kink, where rates are others, that of directions."""
    if start.length == 0:
        return 1.0
    # Of the whole body, which has nodes in planes of symmetry once and others twice.
    planes, x = increment.system.body.scene.planes, increment.system.body.scene.mesh.nodes
    part = 0.5 ** np.sum([np.zeros(len(x)), *(plane.holds(x) for plane in planes)], axis=0)

    def square(velocity: Floats) -> float:
        return vdot(part, np.vecdot(velocity, velocity))

    # A body that supports carry moves no less for that.
    before = Advance(increment.system.candidates, replace(start, tau=start.tau - start.length), start.tau)
    now = (solved.response.du - increment.tools.way) / (increment.tau - start.tau)
    then = start.velocity - before.way / start.length
    if at_kink(increment.system, start.tau):
        size = square(then)
        then = then * math.sqrt(square(now) / size) if size > 0 else then
    size = square(now)
    return square(now - then) / size if size > 0 else 0.0


def _dissipated(solved: Solved) -> float:
    """The part of sum_q w |sigma : de| that new plastic flow takes up."""
    kin, returned = solved.response.kinematics, solved.response.returned
    taken, flowed = (
        vdot(kin.volume, np.abs(np.vecdot(returned.stress, strain))) for strain in (kin.strain, returned.plastic_strain)
    )
    return min(flowed / taken, 1.0) if taken > 0 else 0.0


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
        whole = Increment(system, state, target)
        strained, near = strain_of(whole), system.candidates.reached(whole.rows.gap)
        # What a load or a turn strains is not known beforehand.
        stretch, unknown = target - state.tau, bool(whole.new_load.any() or whole.tools.turned[near].any())
        most = UNDRIVEN * stretch if strained == 0 or unknown else stretch
        if strained == 0:
            return max(most, SHORTEST)
        # Past first yield, but no farther than a following increment would go: the estimate sees little of a first one.
        least = ONSET * math.sqrt(self.aim)
        far = TURNING if state.length > 0 else YIELDING
        strain = min(max(least, far * yield_strain(system)), GROWTH * least)
        return max(min(strain / strained * stretch, most), SHORTEST)
