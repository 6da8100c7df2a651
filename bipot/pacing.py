r"""Increments by accuracy: how far the force of an increment may be off, and how long the next may therefore be.

The estimate of an increment is a fraction of the force,

    e = |B| / sum_q w |sigma : de|  +  sum_q w |de|^2 / (12 sum_q w)  +  TURN |v - v_0|^2 / |v|^2.

* B = sum_q w (sigma_E - sigma) : de, with sigma_E what a radial return from the start makes of the same motion: the power
  by which backward Euler, of order one in the flow, differs from the flow carried on. The force is stationary in the
  direction of flow, so the difference is of order two in the increment, like the error of what carries the flow on.
* |de|^2/12 is what the strain of the midpoint leaves of the logarithmic one: 2 tanh(x/2) = x - x^3/12.
* v, v_0 are the velocities of this increment and the last, in the norm of nodes: the motion turns at first yield and
  landings, where no flow is there to be carried on. After a kink they tell nothing of each other.

All three are of order two where the solution is smooth, so the next increment is sqrt(accuracy/e) times as long, within
what BDF2 is stable for. One that is REFUSED times as wrong as asked is solved again, shorter. Into a stretch whose rate is
not that of the last, from rest or after a kink, an increment starts with a strain of ONSET sqrt(accuracy), by the travel of
tools and supports over the size of the body: long enough to leave first yield behind.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bipot.increment import Solved
from bipot.iterate import Increment
from bipot.response import State
from bipot.schedule import SAME
from bipot.system import System
from bipot.tensors import norm

TURN = 0.01
"""Of the square of what the velocity changes by: measured on cylinder, ring and block while they begin to yield."""

ONSET, UNDRIVEN = 2.5, 0.05
"""First strain over sqrt(accuracy); first pseudo-time where nothing goes a path, which tells no strain."""

SAFETY, GROWTH, SHRINK = 0.9, 2.0, 0.2
"""Aim at SAFETY of the length allowed; longest and shortest next one over the last. BDF2 is stable below 1 + sqrt(2)."""

REFUSED, TRIES = 3.0, 3
"""An estimate above REFUSED times the accuracy asked shortens the increment, up to TRIES times."""

LONGEST, QUICK = 0.08, 8
"""Longest strain of an increment, and the passes above which the next is no longer: beyond, solvers fall back."""


@dataclass(frozen=True)
class Estimate:
    """What is estimated of an increment: the ``error`` of its force, a fraction, and the mean ``strain`` |de|."""

    error: float
    strain: float

    @staticmethod
    def of(start: State, solved: Solved) -> Estimate:
        """That of the increment ``solved`` from the accepted state ``start``, its flow not yet carried on."""
        increment, response = solved.iterate.increment, solved.response
        kin, body = response.kinematics, increment.system.body
        euler = body.respond(start, response.x, increment.driven).returned.stress
        sigma, weight = response.returned.stress, kin.volume
        taken = float(np.vdot(weight, np.abs(np.vecdot(sigma, kin.strain))))
        missed = abs(float(np.vdot(weight, np.vecdot(euler - sigma, kin.strain))))
        square = float(np.vdot(weight, np.vecdot(kin.strain, kin.strain)) / weight.sum())
        turned = _turned(increment, start, solved)
        return Estimate((missed / taken if taken > 0 else 0.0) + square / 12 + TURN * turned, math.sqrt(square))


def _turned(increment: Increment, start: State, solved: Solved) -> float:
    """|v - v_0|^2 / |v|^2, at most 1; zero from rest, after a kink and where nothing moves."""
    velocity = solved.response.du / (increment.tau - start.tau)
    speed = float(np.vdot(velocity, velocity))
    if not (start.length > 0 and speed > 0) or at_kink(increment.system, start.tau):
        return 0.0
    change = velocity - start.velocity
    return min(float(np.vdot(change, change)) / speed, 1.0)


@dataclass(frozen=True)
class Pacer:
    """Lengths of increments for an ``accuracy``, a fraction of the force."""

    accuracy: float

    def first(self, system: System, state: State, target: float) -> float:
        """The length (pseudo-time) with which a stretch of constant rates begins, that to ``target`` at most."""
        whole = Increment(system, state, target)
        driven = max(whole.reach, float(norm(whole.driven).max(initial=0.0))) / system.body.scene.mesh.size
        strain = min(ONSET * math.sqrt(self.accuracy), LONGEST)
        return strain / driven * (target - state.tau) if driven > 0 else UNDRIVEN

    def length(self, system: System, state: State, proposed: float, target: float) -> float:
        """The length of the next increment towards ``target``: what is left is shared out in equal parts."""
        anew = math.isnan(proposed) or at_kink(system, state.tau)
        length = self.first(system, state, target) if anew else proposed
        left = target - state.tau
        return left / max(1, math.ceil(left / length - SAME))

    def refuses(self, estimate: Estimate) -> bool:
        """Whether the increment is to be solved again, shorter."""
        return estimate.error > REFUSED * self.accuracy

    def next(self, length: float, estimate: Estimate, passes: int = 0) -> float:
        """The length after an increment of that ``length`` and estimate; no longer one after more passes than QUICK."""
        allowed = math.sqrt(self.accuracy / estimate.error) if estimate.error > 0 else math.inf
        longest = LONGEST / estimate.strain if estimate.strain > 0 else math.inf
        growth = GROWTH if passes <= QUICK else 1.0
        return min(length * max(min(SAFETY * allowed, longest, growth), SHRINK), 1.0)


def at_kink(system: System, tau: float) -> bool:
    """Whether the rate of a path or a load changes there."""
    return any(abs(kink - tau) <= SAME for kink in system.body.scene.kinks)
