"""Increments by accuracy: the length of the next increment by the estimate of the error that the last one adds.

With e of :mod:`bipot.control.estimate`, the next increment is AIMED (accuracy/1e-3)^FINER sqrt(accuracy/e) times as
long, with LANDING for FINER where first increments are halved, within the stability of BDF2. The rest of the way is
divided equally, into increments that are longer by up to SLACK if that saves one. An increment whose e is above REFUSED
times the accuracy is solved again, shorter, unless that does not lower e, as in an event.

An event turns the motion at once, and the force is off to the end of its increment, by a tenth where a whole face
lands, which no estimate sees: the mean motion hardly changes if the landing is late. The next increment has the new
motion. One that ends at a scheduled pseudo-time has no next: if a face lands in it, half of it is solved instead, and e
counts what a turn of the motion leaves in full.

At rest, and at kinks that are no changes of pace (:mod:`bipot.scene.paces`), lengths begin anew. The first increment
has the strain at which a body has long yielded (:mod:`bipot.yielding`), at least ONSET sqrt(accuracy) and at most
GROWTH times that. Its strain is how far tools and supports go from each other, or from the body that they carry, over
the body's extent, beyond what tools go through the air. Where nothing touches a body that rests, one increment takes
tools up to where the first touches (several, if one turns too far), and lengths begin anew there: slips beneath flat
tools are those of whole increments, and what a tool slides in the air does not rub. The strain by a load that changes
is not known, a tool that turns may only roll, and a curved one dents what is beneath it: the first increment is then at
most UNDRIVEN of the way to the next kink. Beneath a flat tool that turns from rest, whose force and moment are not
stationary in the direction of flow, as its power is, it ends where the body begins to yield, however long the way is.
If flow begins in one, the next has at most BEGUN of its length. Increments as long as the yield strain have an error of
the force of 1e-3 at first yield and of 1e-2 after a body has turned round, which decay soon. A first increment that
passes first yield has the smallest error, up to 4e-4 in a metal, which the estimate does not contain. At accuracies
below HALVED it carries on the flow of its own first half (:mod:`bipot.control.carrying`), which leaves a third of that
and less, unless the estimate of how unevenly it strains the body is at most EVEN of the accuracy, and tools press and
go along one line. One after a kink always does, if it passes yielding: there the error is up to 1e-2. Where a path ends
or turns sooner, or the yield strain is so large that an increment may not be so long, many short ones follow yielding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from bipot.contact.closeness import carries
from bipot.control.estimate import GATHERED, unevenness
from bipot.increment import Near, Solved
from bipot.iterate import Increment
from bipot.state import State
from bipot.system import System
from bipot.tools.surfaces import Plane
from bipot.typing import max_abs
from bipot.yielding import YIELDING, flows, goes_one_way, strain_of, through_air, until_touching, yielded_strain

ONSET, BEGUN = 1.1, 0.8
"""Least first strain over sqrt(accuracy); the second increment over the first."""

LEAST_LENGTH = 1e-9
"""The least length in pseudo-time, far above its round-off."""

UNDRIVEN = 0.05
"""Longest first length where a load changes, a tool turns or is curved, or nothing follows a path, over that of
constant rates."""

SMALL_TURN = 0.1
"""Angle by which tools turn where the strain of the way is measured: one that goes all the way round ends in place."""

AIMED, GROWTH, SHRINK = 1.05, 2.0, 0.2
"""Length aimed at over the one that the estimate allows; longest and shortest next one over the last, the longest also
the first strain over the least.

BDF2 is stable below 1 + sqrt(2).
"""

REFUSED, TRIES = 3.0, 3
"""An estimate above REFUSED times the accuracy shortens the increment, up to TRIES times."""

FINER, LANDING, USUAL = 0.12, 0.03, 1e-3
"""Errors of first yield and of landings are of lower order: the length goes with (accuracy/USUAL)^FINER, besides the
root of the accuracy, with LANDING where first increments are halved."""

SLACK = 0.25 + 1e-9
"""Part of an increment by which the last ones are lengthened to save one. The rest after a first one, if as long as it,
is just a quarter longer than BEGUN of it; hence the round-off."""

HALVED = 5e-4
"""At finer accuracies the error of a first increment in one piece is worth half as many passes again."""

EVEN = 0.2
"""Part of the accuracy up to which a first increment is so even that halves would cost more passes than they save."""

CURED = 0.7
"""A shortened increment with more than this part of the estimate before has an event, as large in any length."""

FACE = 0.25
"""Part of a tool's contact, above which a face lands: nodes that land one by one, as on a curved tool, make jumps that
are errors of the mesh."""

CHEAPEST, QUICK = 2e-3, 8
"""Coarser accuracies give the increments of CHEAPEST, because longer ones cost more passes than they save. After more
passes than QUICK the next increment is not longer than the last."""


def begins_flow(start: State, solved: Solved) -> bool:
    """Whether there is flow in the increment ``solved`` from ``start``, at rest or with none carried on from there."""
    begins = solved.response.state is start or solved.iterate.increment.in_halves
    return flows(solved.iterate) and (begins or start.length == 0)


def lands_a_face(solved: Solved) -> bool:
    """Whether a tool gets much of its contact in the increment, and the body flows."""
    owned = solved.iterate.increment.system.candidates.owned
    landed, borne = owned[:, solved.landed].sum(axis=1), owned[:, carries(solved.r)].sum(axis=1)
    return flows(solved.iterate) and bool((landed > FACE * borne).any())


@dataclass(frozen=True)
class Pacer:
    """Lengths of increments in pseudo-time for an ``accuracy``, a fraction of the force."""

    accuracy: float

    @property
    def aim(self) -> float:
        """The estimate aimed at."""
        return min(self.accuracy, CHEAPEST)

    def halves(self, start: State) -> bool:
        """Whether a first increment from ``start``, at rest or a kink, may carry on the flow of its first half."""
        return start.length > 0 or bool(start.peeq.any()) or self._fine

    def is_even(self, near: Near) -> bool:
        """Whether one from rest strains the body so evenly, along one line, that it needs no halves."""
        return goes_one_way(near.iterate.increment) and GATHERED * unevenness(near) <= EVEN * self.aim

    @property
    def _fine(self) -> bool:
        """Whether first increments from rest do."""
        return self.accuracy < HALVED

    def length(self, system: System, state: State, proposed: float, target: float) -> float:
        """The length of the next increment towards ``target``: the rest is divided equally, past first yield."""
        left, least, whole = target - state.tau, 0.0, Increment(system, state, target)
        if math.isnan(proposed) or whole.past.turns:
            proposed, least = self._first(whole)
        else:
            proposed = max(proposed / whole.past.quicker, LEAST_LENGTH)
        equal = left / max(1, math.ceil(left / proposed - SLACK))
        return equal if equal >= least else min(proposed, left)

    def ends(self, increment: Increment, target: float) -> bool:
        """Whether it ends at the scheduled ``target``, where an event within it would leave its error in the force.

        In one shorter than the accuracy of the whole path the event is as close to the target as that.
        """
        return increment.tau == target and increment.tau - increment.start.tau > self.accuracy

    def refuses(self, estimate: float) -> bool:
        """Whether the increment is to be solved again, shorter."""
        return estimate > REFUSED * self.aim

    def is_cured(self, estimate: float, before: float) -> bool:
        """Whether shortening an increment with the estimate ``before`` has lowered it enough to be of use."""
        return estimate <= CURED * before

    def next(self, length: float, estimate: float, passes: int = 0, begun: bool = False) -> float:
        """The length after one of this ``length``, ``estimate`` and ``passes``; ``begun`` if flow began in it."""
        aimed = AIMED * (self.aim / USUAL) ** (LANDING if self._fine else FINER)
        allowed = aimed * math.sqrt(self.aim / estimate) if estimate > 0 else math.inf
        growth = BEGUN if begun else GROWTH if passes <= QUICK else 1.0
        return min(max(length * max(min(allowed, growth), SHRINK), LEAST_LENGTH), 1.0)

    def _first(self, whole: Increment) -> tuple[float, float]:
        """The first length of the stretch ``whole`` of constant rates, and the least that others may have instead.

        That is the length which passes first yield, or inf for one that goes through the air up to the body.
        """
        system, state = whole.system, whole.start
        near = system.candidates.reached(whole.rows.gap)
        curved = np.array([not isinstance(tool.face, Plane) for tool in system.body.scene.tools], dtype=bool)
        stretch, unsure = whole.tau - state.tau, curved | (whole.tools.turned != 0)
        part = SMALL_TURN / max(max_abs(whole.tools.turned[near]), SMALL_TURN)
        strained = strain_of(replace(whole, tau=state.tau + part * stretch)) / part
        most = UNDRIVEN * stretch if strained == 0 or whole.loads.changes or unsure[near].any() else stretch
        if not state.forces.any() and (wait := until_touching(whole)) > LEAST_LENGTH:
            return min(wait, stretch), math.inf
        if strained == 0:
            return most, 0.0
        far = yielded_strain(system, state.peeq if state.length > 0 or state.peeq.any() else None)
        if state.length == 0 and (whole.tools.turned[near & ~curved] != 0).any():
            return max(min(far / YIELDING / strained * stretch, most), LEAST_LENGTH), 0.0
        # Past first yield, but not much farther than the least: the estimate sees little of a first increment.
        least = ONSET * math.sqrt(self.aim)
        strain, air = min(max(least, far), GROWTH * least), through_air(whole)
        return max(min(air + strain / strained * stretch, most), LEAST_LENGTH), air + far / strained * stretch
