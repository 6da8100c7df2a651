r"""Increments by accuracy: how far the force of an increment may be off, and how long the next may therefore be.

The estimate of an increment is a fraction of the force,

    e = |sum_q w (sigma_E - sigma) : de| / (2 sum_q w |sigma : de|)  +  sum_q w |de|^2 / (12 sum_q w)
        +  min(|v - v_0|^2 / |v|^2, TURNED) / 10.

* sigma_E is what a radial return from the start makes of the same motion: backward Euler, of order one in the flow,
  where sigma is of the flow carried on. The force is stationary in the direction of flow, so the power by which they
  differ is of order two in the increment, like the error of the flow carried on.
* |de|^2/12 is what the strain of the midpoint leaves of the logarithmic one, 2 tanh(x/2) = x - x^3/12 + ...
* v, v_0 are the velocities of this increment and the last at the nodes: how far the motion bends while it goes. Where
  it turns by more than TURNED something happens (first yield, a landing) that tells nothing of the length of
  increments, and after a kink or where nothing flows the two have nothing to do with each other.

All are of order two where the solution is smooth: the next increment is AIMED sqrt(accuracy/e) times as long, within
what BDF2 is stable for, and one that is REFUSED times as wrong as asked is solved again, shorter. Half and a tenth are
measured: with them the largest error of the curve, errors of motion that add up included, is 0.3 to 3 times what is
asked (studies/accuracy/paced.py).

From rest and from a kink on, the first increment has a strain of ONSET sqrt(accuracy), and of YIELDING of yield at
least, by the travel of tools and supports over the body's extent; where its flow begins the next is shorter, BEGUN of
it. Within first yield the force is off by 1e-3 in increments of the size of yield, and that is forgotten soon: a first
increment that leaves yield behind errs least, by 1e-4 to 3e-4 in a metal, which the estimate does not hold. A body with
a yield strain of one hundredth asks for more than an increment may strain, and errs by more there.
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

TURNED = 1.6e-3
"""Change of velocity squared that still is a bend."""

ONSET, YIELDING, BEGUN = 1.4, 12.0, 0.4
"""First strain over sqrt(accuracy), and over yield stress by Young's modulus; the second increment over the first."""

RESTS = 1e-6
"""A body whose nodes all move by less than this fraction of what its increment may be expected to move them rests."""

SHORTEST = 1e-9
"""Of pseudo-time: the least length to begin with, far above its round-off."""

UNDRIVEN = 0.05
"""First pseudo-time where no tool or support goes a path."""

AIMED, GROWTH, SHRINK = 1.05, 2.0, 0.2
"""Length aimed at over the one that the estimate allows; longest and shortest next one over the last.

BDF2 is stable below 1 + sqrt(2).
"""

REFUSED, TRIES = 4.0, 3
"""An estimate above REFUSED times the accuracy asked shortens the increment, up to TRIES times."""

CHEAPEST, QUICK = 1e-3, 8
"""Asked for less, increments are as for CHEAPEST: longer ones cost more passes than they save. After more passes than
QUICK none is longer than the last."""


def error_estimate(start: State, solved: Solved) -> float:
    """That of the increment ``solved`` from the accepted state ``start``, its flow not yet carried on; a fraction."""
    increment, response = solved.iterate.increment, solved.response
    kin, body, sigma = response.kinematics, increment.system.body, response.returned.stress
    euler = body.scene.material.update(kin.turned(start.stress), kin.strain, start.peeq).stress
    taken = float(np.vdot(kin.volume, np.abs(np.vecdot(sigma, kin.strain))))
    missed = abs(float(np.vdot(kin.volume, np.vecdot(euler - sigma, kin.strain))))
    square = float(np.vdot(kin.volume, np.vecdot(kin.strain, kin.strain)) / kin.volume.sum())
    flowing = bool(response.returned.plastic.any())
    bent = _turned(increment, start, solved) / 10 if flowing else 0.0
    return (missed / taken / 2 if taken > 0 else 0.0) + square / 12 + bent


def begins_flow(start: State, solved: Solved) -> bool:
    """Whether there is flow in the increment ``solved`` from ``start``, and none was carried on into it."""
    return solved.response.state is start and bool(solved.response.returned.plastic.any())


def _turned(increment: Increment, start: State, solved: Solved) -> float:
    """|v - v_0|^2 / |v|^2, at most TURNED; zero from rest, after a kink and where nothing moves."""
    velocity = solved.response.du / (increment.tau - start.tau)
    speed = float(np.vdot(velocity, velocity))
    # What round-off moves turns as it likes, as under a tool that slides over a body that it no longer strains.
    moves = float(norm(solved.response.du).max()) > RESTS * increment.units.length
    if not (start.length > 0 and moves) or at_kink(increment.system, start.tau):
        return 0.0
    change = velocity - start.velocity
    return min(float(np.vdot(change, change)) / speed, TURNED)


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

    def next(self, length: float, estimate: float, passes: int = 0, begun: bool = False) -> float:
        """The length after an increment of that ``length``, estimate and ``passes``; ``begun`` where its flow began."""
        allowed = AIMED * math.sqrt(self.aim / estimate) if estimate > 0 else math.inf
        growth = BEGUN if begun else GROWTH if passes <= QUICK else 1.0
        return min(length * max(min(allowed, growth), SHRINK), 1.0)

    def _first(self, system: System, state: State, target: float) -> float:
        """The length with which a stretch of constant rates begins."""
        whole, scene = Increment(system, state, target), system.body.scene
        # Tools out of reach of the body strain nothing.
        ways = [whole.driven, whole.travel[system.candidates.reached(whole.rows.gap)]]
        strained = float((np.abs(np.concatenate(ways)) / np.ptp(scene.mesh.nodes, axis=0)).sum(axis=1).max(initial=0.0))
        if strained == 0:
            return UNDRIVEN
        at_yield = float(scene.material.yield_stress(0.0)) / scene.material.elasticity.young
        length = max(ONSET * math.sqrt(self.aim), YIELDING * at_yield) / strained * (target - state.tau)
        return max(length, SHORTEST)


def at_kink(system: System, tau: float) -> bool:
    """Whether the rate of a path or a load changes there."""
    return any(abs(kink - tau) <= SAME for kink in system.body.scene.kinks)
