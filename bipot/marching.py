"""The march: a generator of accepted increments, with increment control. It is the only loop over time.

Under friction a schedule starts with small increments, because large ones fail at first yield, and grows to uniform
ones. An increment that fails is first tried by the fallback forms, then halved. Increments end exactly at every
scheduled pseudo-time, and the reasons for fallbacks and cuts are recorded in words.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

from bipot.control.accepted import Accepted
from bipot.control.attempt import Attempt
from bipot.control.attempting import attempt_increment
from bipot.control.control import Control
from bipot.control.course import Course
from bipot.control.estimate import error_estimate
from bipot.control.failing import AHEAD, broken, given_up
from bipot.control.halving import Found, Halving
from bipot.control.landing import locate
from bipot.control.pacing import TRIES, Pacer, begins_flow, lands_a_face
from bipot.control.reason import Reason, ReasonKind
from bipot.control.starting import course_of
from bipot.errors import BrokenSolver, require, require_type
from bipot.fem.strain import Configuration
from bipot.forms import Cache
from bipot.forms.memory import Pace
from bipot.increment import Observer, unobserved
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.scene.scene import Scene
from bipot.schedule import ROUND_OFF, Schedule
from bipot.state import State
from bipot.system import System, system_of
from bipot.yielding import is_past_yield, through_air

DIGITS = 2.0
"""Least length of an increment, over the spacing of floating-point numbers at its pseudo-time."""


def march(
    scene: Scene,
    schedule: Schedule,
    control: Control = Control(),
    start: State | Course | None = None,
    observe: Observer = unobserved,
) -> Iterator[Accepted]:
    """Yield accepted increments from ``start`` (default: at rest) to the end of the path.

    From a :class:`~bipot.control.course.Course`, e.g. the ``course`` of an accepted increment, the march is continued:
    except for ``seconds`` it yields to the last bit what the march of that course yields next. From a state a new march
    begins: ``number`` and ``energies`` count from there, and nothing is known of earlier increments. ``observe`` is
    called with every pass.

    A course may be continued by another schedule or control. If its pseudo-time is one of the schedule's, increment
    control begins anew there. Otherwise the next increment has the length stored in the course, unless a scheduled
    pseudo-time comes first, and ``control.cuts`` count from the course's uncut length.

    Raises:
        SceneError: at once, a wrong type, a start of another scene, BDF2 of a material whose stress is not returned,
            an accuracy without BDF2 or with the paper's strain, naming its field.
        LimitPassed: an ``IncrementFailed`` with a proof that the body cannot carry the load, and the mechanism.
        IncrementFailed: with the last accepted state, when a scheduled increment, or the rest of one after a landing,
            still fails after it was halved ``control.cuts`` times; at once from the error of a solver that breaks.
    """
    require_type(scene, Scene, "scene")
    require_type(schedule, Schedule, "schedule")
    require_type(control, Control, "control")
    require(callable(observe), "observe", observe, "a function of a Trial")
    # Flow carried on takes the stress off the yield surface until the return brings it back.
    allowed = f"{Integration.BACKWARD_EULER.value!r} where the stress is not returned to the yield surface"
    second = control.integration is Integration.BDF2
    require(not (second and scene.materials.drifts), "integration", control.integration.value, allowed)
    system = system_of(scene)
    course = course_of(start, system, control.limits.bounds.equilibrium)
    pacer = None if schedule.accuracy is None else Pacer(schedule.accuracy)
    allowed = f"{Integration.BDF2.value!r} with an accuracy, which is estimated by what flow carried on changes"
    require(pacer is None or second, "integration", control.integration.value, allowed)
    # The paper's strain is of order one in an increment, of which the estimate tells nothing.
    seen = pacer is None or scene.configuration is not Configuration.PAPER
    allowed = f"{Configuration.MIDPOINT.value!r} or {Configuration.SMALL.value!r} with an accuracy"
    require(seen, "configuration", scene.configuration.value, allowed)
    return _increments(Shared(system, control, observe, pacer), schedule, course)


@dataclass(frozen=True)
class Shared:
    """What the increments of a march share; the cache holds nothing that depends on an increment's numbers.

    ``pacer`` chooses the lengths of increments between scheduled pseudo-times; None takes each stretch as one.
    """

    system: System
    control: Control
    observe: Observer
    pacer: Pacer | None = None
    cache: Cache = field(default_factory=Cache)

    def attempt(self, increment: Increment, largest: float, sparing: bool = False, halves: bool = False) -> Attempt:
        """Try the increment, or give up early if it is to be halved instead: see :func:`attempt_increment`."""
        pacer = self.pacer
        staged = pacer.is_even if pacer is not None and pacer.halves(increment.start) else None
        options = sparing, halves, staged
        try:
            return attempt_increment(increment, self.control, self.cache, largest, self.observe, *options)
        except BrokenSolver as error:
            raise broken(increment, error) from error.__cause__


def _increments(shared: Shared, schedule: Schedule, course: Course) -> Iterator[Accepted]:
    """The march from a checked start."""
    times = schedule.landing_on(shared.system.body.scene.kinks)
    if any(abs(course.state.tau - target) <= ROUND_OFF * target for target in times):
        course = course.scheduled()
    system = shared.system
    for target in times:
        while course.state.tau < target * (1 - ROUND_OFF):
            accepted = _Next(shared, system.facing(course.state.nodes), course, target).accepted()
            yield accepted
            system, course = accepted.solved.iterate.increment.system, accepted.course


@dataclass(frozen=True)
class _Next:
    """The next increment of a ``course``, whose start the ``system`` faces, on the way to the scheduled ``target``."""

    shared: Shared
    system: System
    course: Course
    target: float

    def accepted(self) -> Accepted:
        """Solve it."""
        began = time.perf_counter()
        self.shared.cache.begin(Pace(self.course.before, self.shared.control.predicts))
        found = self._located(self._accurate())
        solved, reasons = found.solved, found.reasons
        if solved.almost:
            words = f"{solved.almost} passes almost solved, certificate re-checked"
            reasons += (Reason(ReasonKind.ALMOST, words, measures={"passes": solved.almost}),)
        return Accepted(
            start=self.course.state,
            course=self._after(found),
            solved=solved,
            tool_forces=solved.iterate.tool_forces(solved.r),
            form=found.attempt.form,
            passes=found.passes,
            cuts=found.cuts,
            reasons=reasons,
            seconds=time.perf_counter() - began,
            landed=None if found.landing is None else found.landing.node,
            strayed=found.cuts > 0 or found.attempt.strayed,
        )

    def _accurate(self) -> Found:
        """The next increment, solved again and shorter while its estimated error is too far above the accuracy.

        Half as long, too, if it ends at the ``target`` and a face lands in it: the next one shows what that has turned.
        """
        found, pacer, began = self._estimated(self._halved()), self.shared.pacer, self.course.state.tau
        if pacer is None:
            return found
        for _ in range(TRIES):
            if not pacer.refuses(found.estimate):
                break
            before, air = found.estimate, through_air(found.increment)
            shorter = air + pacer.next(found.increment.tau - began - air, before)
            found = self._again(found, shorter, f"error estimated at {before:.2g}")
            if is_past_yield(found.increment) and not pacer.is_cured(found.estimate, before):
                break
        if pacer.ends(found.increment, self.target) and lands_a_face(found.solved):
            shorter = (found.increment.tau - began + through_air(found.increment)) / 2
            return self._again(found, shorter, "a face lands before the end")
        return found

    def _again(self, refused: Found, length: float, why: str) -> Found:
        """The increment of that ``length``, after one that was ``refused``."""
        found = replace(self, course=replace(self.course, size=length, uncut=length))._halved()
        measures = {"estimate": refused.estimate, "tau": refused.increment.tau}
        shortened = Reason(ReasonKind.ACCURACY, f"shortened: {why}", measures=measures)
        reasons = (*refused.reasons, shortened, *found.reasons)
        passes, cuts = refused.passes + found.passes, refused.cuts + found.cuts
        return self._estimated(found._replace(passes=passes, cuts=cuts, reasons=reasons))

    def _estimated(self, found: Found) -> Found:
        """The increment found, with the estimate of its error if that is to choose the next length."""
        if self.shared.pacer is None:
            return found
        last = self.shared.pacer.ends(found.solved.iterate.increment, self.target)
        return found._replace(estimate=error_estimate(self.course.state, found.solved, last))

    def _halved(self) -> Found:
        """The increment, of the course's length or less, halved until an attempt solves it, if a form suits the scene.

        If none does, the attempts that were spared a program are repeated with it.
        """
        shared, state, target, (size, uncut) = self.shared, self.course.state, self.target, self._length()
        # Half of an increment of one spacing of pseudo-times would be none, or all of it again.
        least = max(uncut / 2**shared.control.cuts, DIGITS * math.ulp(state.tau))
        # Halvings count from the scheduled length: from the last one that was solved they would go on without end.
        halvable = 2 * least * (1 - 1e-9)
        # A program is spared only where the length is free: scheduled increments are kept if any form solves them.
        spared = math.inf if shared.pacer is None else max(uncut / 2**shared.control.spared * (1 + 1e-9), halvable)
        halving = Halving(lambda part, *options: shared.attempt(part, self.course.largest, *options), uncut)
        while True:
            # The target itself, not a sum that round-off moves.
            tau = target if state.tau + size >= target * (1 - ROUND_OFF) else state.tau + size
            increment = Increment(self.system, state, tau)
            length = tau - state.tau
            tried = halving.tried(increment, sparing=length >= spared, halves=length >= halvable)
            if isinstance(tried, Found):
                return tried
            if length < halvable or tried.unsuited:
                break
            halving.cut(tau)
            size = length / 2
        if (found := halving.unspared()) is None:
            ahead = tau if shared.pacer is None else max(tau, min(target, state.tau + AHEAD))
            raise given_up(increment, tried, halving.cuts, shared.cache.pace, ahead)
        return found

    def _length(self) -> tuple[float, float]:
        """The length of the next increment towards the target, and that from which its halvings are counted."""
        course, shared = self.course, self.shared
        if not math.isnan(course.size):
            return course.size, course.uncut
        length = self.target - course.state.tau
        if shared.pacer is not None:
            length = shared.pacer.length(self.system, course.state, course.proposed, self.target)
        return length, length

    def _located(self, found: Found) -> Found:
        """The increment found, cut to its first landing if landings are to be located."""
        asked = self.shared.control.locate
        if asked is None:
            return found
        solve = partial(self.shared.attempt, largest=self.course.largest)
        landing, spent = locate(found.increment, found.solved, solve, asked, self.course.landed)
        found = found._replace(passes=found.passes + spent)
        if landing is None:
            return found
        words = f"cut to the landing of node {landing.node} at tau = {landing.tau:.6g}"
        landed = Reason(ReasonKind.LANDING, words, measures={"node": landing.node, "tau": landing.tau})
        reasons = (*found.reasons, *landing.attempt.failures, landed)
        found = found._replace(attempt=landing.attempt, solved=landing.solved, reasons=reasons, landing=landing)
        return self._estimated(found)

    def _after(self, found: Found) -> Course:
        """The course after the increment ``found``, which ends at the target or on the way to it."""
        course, pacer, target = self.course, self.shared.pacer, self.target
        length, proposed = found.solved.iterate.increment.tau - course.state.tau, math.nan
        if pacer is not None:
            begun = begins_flow(course.state, found.solved)
            # After a way through the air alone lengths begin anew.
            if (strained := length - through_air(found.solved.iterate.increment)) > 0:
                proposed = pacer.next(strained, found.estimate, found.attempt.passes, begun)
        after = course.after(found.solved, proposed)
        tau, landed = after.state.tau, course.landed.copy()
        # If one by accuracy was not cut, or the next is to be shorter, control begins anew as at a scheduled end; so it
        # does on a way through the air, which does not end twice as far on.
        anew = length >= found.uncut * (1 - 1e-9) or proposed < length or math.isnan(proposed)
        if tau == target or (pacer is not None and found.landing is None and anew):
            return after
        if found.landing is None:
            longer = 2 * length if math.isnan(proposed) else proposed
            return replace(after, size=min(longer, target - tau), uncut=found.uncut, landed=landed)
        landed[found.landing.candidate] = True
        rest = found.increment.tau - tau
        return replace(after, size=rest, uncut=rest, landed=landed)
