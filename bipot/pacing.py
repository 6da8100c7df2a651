r"""Increments by accuracy: how far the force of an increment may be off, and how long the next may therefore be.

The estimate of an increment is a fraction of the force,

    e = |sum_q w (sigma_E - sigma) : de| / sum_q w |sigma : de|  +  sum_q w |de|^2 / (c sum_q w)  +  TURN |v - v_0|^2 / |v|^2.

* sigma_E is what a radial return from the start makes of the same motion: backward Euler, of order one in the flow, where
  sigma is of the flow carried on. The force is stationary in the direction of flow, so the power by which they differ is
  of order two in the increment, like the error of the flow carried on.
* |de|^2/12 is what the strain of the midpoint leaves of the logarithmic one, 2 tanh(x/2) = x - x^3/12 + ...; c = 12, and
  EULER where no flow was carried on: the velocity is then that of the increment's end.
* v, v_0 are the velocities of this increment and the last at the nodes: motion turns at first yield and landings, where
  no flow is there to be carried on. After a kink they tell nothing of each other.

All are of order two where the solution is smooth: the next increment is sqrt(accuracy/e) times as long, within what BDF2
is stable for, and an increment that is REFUSED times as wrong as asked is solved again, shorter. It is an estimate of what
one increment leaves; errors of motion that add up over many are of the same order and size (tests/test_accuracy.py).

From rest and from a kink on, the first increment has a strain of ONSET sqrt(accuracy), and of YIELDING of yield at least,
by the travel of tools and supports over the body's extent. What the force is off within first yield no increment of the
size of yield resolves, and it is forgotten soon: a first one that leaves it behind errs least. It leaves 1e-4 to 3e-4.
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

TURN, EULER = 0.01, 2.0
"""Of the change of velocity squared, and under the strain squared: measured on cylinder, ring and block."""

ONSET, YIELDING, UNDRIVEN = 1.65, 11.0, 0.05
"""First strain over sqrt(accuracy), and over yield stress by Young's modulus; first pseudo-time where nothing goes a path."""

SAFETY, GROWTH, SHRINK = 0.9, 2.0, 0.2
"""Aim at SAFETY of the length allowed; longest and shortest next one over the last. BDF2 is stable below 1 + sqrt(2)."""

REFUSED, TRIES = 4.0, 3
"""An estimate above REFUSED times the accuracy asked shortens the increment, up to TRIES times."""

CHEAPEST, QUICK = 1e-3, 8
"""Asked for less, increments are as for this: longer ones cost more passes than they save. No longer after QUICK passes."""


def error_estimate(start: State, solved: Solved) -> float:
    """That of the increment ``solved`` from the accepted state ``start``, its flow not yet carried on; a fraction."""
    increment, response = solved.iterate.increment, solved.response
    kin, body, sigma = response.kinematics, increment.system.body, response.returned.stress
    euler = body.respond(start, response.x, increment.driven).returned.stress
    taken = float(np.vdot(kin.volume, np.abs(np.vecdot(sigma, kin.strain))))
    missed = abs(float(np.vdot(kin.volume, np.vecdot(euler - sigma, kin.strain))))
    square = float(np.vdot(kin.volume, np.vecdot(kin.strain, kin.strain)) / kin.volume.sum())
    strained = square / (12 if carried(start, solved) else EULER)
    return (missed / taken if taken > 0 else 0.0) + strained + TURN * _turned(increment, start, solved)


def carried(start: State, solved: Solved) -> bool:
    """Whether flow was carried on into the increment ``solved`` from ``start``."""
    return solved.response.state is not start


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
    """Lengths of increments (pseudo-time) for an ``accuracy``, a fraction of the force."""

    accuracy: float

    @property
    def aim(self) -> float:
        """What the estimate is led to."""
        return min(self.accuracy, CHEAPEST)

    def length(self, system: System, state: State, proposed: float, target: float) -> float:
        """That of the next increment towards ``target``: what is left is shared out in equal parts, but for a first."""
        left = target - state.tau
        if math.isnan(proposed) or at_kink(system, state.tau):
            return min(self._first(system, state, target), left)
        return left / max(1, math.ceil(left / proposed - SAME))

    def refuses(self, estimate: float) -> bool:
        """Whether the increment is to be solved again, shorter."""
        return estimate > REFUSED * self.aim

    def next(self, length: float, estimate: float, passes: int = 0) -> float:
        """The length after an increment of that ``length``, estimate and cost in passes."""
        allowed = SAFETY * math.sqrt(self.aim / estimate) if estimate > 0 else math.inf
        growth = GROWTH if passes <= QUICK else 1.0
        return min(length * max(min(allowed, growth), SHRINK), 1.0)

    def _first(self, system: System, state: State, target: float) -> float:
        """The length with which a stretch of constant rates begins."""
        whole, scene = Increment(system, state, target), system.body.scene
        # Tools out of reach of the body strain nothing.
        ways = [whole.driven, whole.travel if whole.reach > 0 else np.zeros_like(whole.travel)]
        strained = float((np.abs(np.concatenate(ways)) / np.ptp(scene.mesh.nodes, axis=0)).sum(axis=1).max(initial=0.0))
        if strained == 0:
            return UNDRIVEN
        at_yield = float(scene.material.yield_stress(0.0)) / scene.material.elasticity.young
        return max(ONSET * math.sqrt(self.aim), YIELDING * at_yield) / strained * (target - state.tau)


def at_kink(system: System, tau: float) -> bool:
    """Whether the rate of a path or a load changes there."""
    return any(abs(kink - tau) <= SAME for kink in system.body.scene.kinks)
