"""The march: a generator of accepted states, with increment control. The only loop over time.

Under friction the increments start small, because first yield defeats large ones, then grow to the uniform size. A
failing increment first falls back on the next form, then is cut in half; every scheduled pseudo-time is landed on
exactly, and what happened is recorded in words.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bipot.accepted import Accepted
from bipot.carrying import Attempt, Dissipated, carry_on
from bipot.diagnosis import diagnosis
from bipot.energy import Energies
from bipot.errors import (
    IncrementFailed,
    InvertedElement,
    LimitPassed,
    NotConverged,
    ProgramError,
    UnsuitedForm,
    require,
    require_count,
    require_tuple,
    require_type,
)
from bipot.forms import Cache, Dissipation, Form, Newton, Tangent
from bipot.increment import Limits, Observer, Solved, Trial, advance, solve_increment, unobserved
from bipot.iterate import Increment
from bipot.landing import Locate, locate
from bipot.laws.flow import Integration
from bipot.limit_analysis import collapse
from bipot.reason import Reason, ReasonKind
from bipot.response import State
from bipot.scene import Scene
from bipot.schedule import Schedule
from bipot.starting import require_start
from bipot.system import System, system_of

NEXT = 4.0
"""Lengths of the increment that failed within which a maximum of the load explains it."""

FAILURES = (NotConverged, ProgramError, InvertedElement)


@dataclass(frozen=True)
class Control:
    """Form, what it falls back on, acceptance, how often an increment may be halved, integration.

    ``locate`` cuts an increment to where an open candidate lands; None leaves landings inside increments.

    Raises:
        SceneError: a wrong type, a negative count.
    """

    form: Form = Tangent()
    fallbacks: tuple[Form, ...] = (Newton(), Dissipation())
    limits: Limits = Limits()
    cuts: int = 8
    integration: Integration = Integration.BDF2
    locate: Locate | None = None

    def __post_init__(self) -> None:
        require_type(self.form, Form, "control.form")
        object.__setattr__(self, "fallbacks", require_tuple(self.fallbacks, Form, "control.fallbacks"))
        require_type(self.limits, Limits, "control.limits")
        require_count(self.cuts, "cuts", 0)
        require(self.cuts <= 50, "cuts", self.cuts, "at most 50: a pseudo-time has no more digits to halve")
        require_type(self.integration, Integration, "control.integration")
        require_type(self.locate, Locate, "control.locate", optional=True)

    @property
    def forms(self) -> tuple[Form, ...]:
        """The form and its fallbacks, none twice; the same form with other options is another one."""
        forms = (self.form, *self.fallbacks)
        return tuple(form for k, form in enumerate(forms) if form not in forms[:k])


def march(
    scene: Scene,
    schedule: Schedule,
    control: Control = Control(),
    start: State | None = None,
    observe: Observer = unobserved,
) -> Iterator[Accepted]:
    """Yield accepted increments from ``start`` (default: at rest) to the end of the path.

    ``number`` and ``energies`` count from the given ``start``, whatever run it is taken from: a resumed march numbers
    its first increment 1 and its work, dissipation and stored energy start at zero. ``observe`` sees every pass.

    Raises:
        SceneError: at once, a wrong type, a start state of another scene, BDF2 of a material whose stress is not
            returned, naming its field.
        LimitPassed: as the next, where the load is proved to be above what the body carries; with the mechanism.
        IncrementFailed: with the last accepted state attached, when an increment fails that is the scheduled one, or
            what a landing left of it, halved ``control.cuts`` times.
    """
    require_type(scene, Scene, "scene")
    require_type(schedule, Schedule, "schedule")
    require_type(control, Control, "control")
    require_type(start, State, "start", optional=True)
    # Flow carried on takes the stress off the yield surface until the return brings it back.
    allowed = f"{Integration.BACKWARD_EULER.value!r} where the stress is not returned to the yield surface"
    second = control.integration is Integration.BDF2
    require(not (second and scene.material.drifts), "integration", control.integration.value, allowed)
    system = system_of(scene)
    if start is not None:
        require_start(start, system, control.limits.bounds.equilibrium)
    return _increments(system, schedule, control, system.rest() if start is None else start, observe)


def _increments(
    system: System, schedule: Schedule, control: Control, state: State, observe: Observer
) -> Iterator[Accepted]:
    """The march from a checked start."""
    cache, energies = Cache(), Energies()
    largest = float(np.abs(state.forces).max(initial=0.0))
    number = 0
    for target in schedule.landing_on(system.body.scene.kinks):
        size, known = target - state.tau, frozenset[int]()
        least = size / 2**control.cuts
        while state.tau < target:
            began, cuts, passes, reasons = time.perf_counter(), 0, 0, list[Reason]()
            attempted = partial(attempt_increment, control=control, cache=cache, largest=largest, observe=observe)
            while True:
                # Landing on the target itself, not on a sum that round-off moves.
                tau = target if state.tau + size >= target * (1 - 1e-12) else state.tau + size
                increment = Increment(system, state, tau)
                attempt = attempted(increment)
                passes += attempt.passes
                reasons += attempt.failures
                if attempt.solved is not None:
                    break
                # Counted from what was scheduled: from the last success they creep up to a wall without an end.
                if tau - state.tau < 2 * least * (1 - 1e-9):
                    raise _failed(increment, attempt, cuts, cache)
                cuts += 1
                size = (tau - state.tau) / 2
                reasons.append(Reason(ReasonKind.CUT, "cut", measures={"tau": tau}))
            solved, end, landing = attempt.solved, tau, None
            if control.locate is not None:
                landing, spent = locate(increment, solved, attempted, control.locate, known)
                passes += spent
            if landing is not None:
                attempt, solved, tau, known = landing.attempt, landing.solved, landing.tau, known | {landing.candidate}
                said = f"cut to the landing of node {landing.node} at tau = {tau:.6g}"
                landed = Reason(ReasonKind.LANDING, said, measures={"node": landing.node, "tau": tau})
                reasons += [*attempt.failures, landed]
            if solved.almost:
                said = f"{solved.almost} passes almost solved, certificate re-checked"
                reasons.append(Reason(ReasonKind.ALMOST, said, measures={"passes": solved.almost}))
            accepted = advance(state, solved)
            energies = energies.after(state, accepted, solved)
            largest = max(largest, float(np.abs(solved.r).max(initial=0.0)))
            number += 1
            seconds = time.perf_counter() - began
            yield Accepted(
                number,
                state,
                accepted,
                solved,
                solved.iterate.tool_forces(solved.r),
                energies,
                attempt.form,
                passes,
                cuts,
                tuple(reasons),
                seconds,
                None if landing is None else landing.node,
                cuts > 0 or attempt.strayed,
            )
            state, size = accepted, 2 * (tau - state.tau) if landing is None else end - tau
            least = least if landing is None else size / 2**control.cuts


def attempt_increment(
    increment: Increment, control: Control, cache: Cache, largest: float, observe: Observer = unobserved
) -> Attempt:
    """Try the increment, each time with the forms in turn.

    ``largest`` is as in solve_increment; how often it is tried :mod:`bipot.carrying` says.
    """

    def solve(begun: State, near_to: Solved | None) -> Attempt:
        passes, failures, last, strayed = 0, list[Reason](), None, False
        begins = replace(increment, start=begun)

        def count(trial: Trial) -> None:
            nonlocal passes
            passes += 1
            observe(trial)

        for form in control.forms:
            try:
                solved = solve_increment(begins, form, control.limits, cache, largest, count, near_to)
            except FAILURES as failure:
                failures.append(Reason.of(form.name, failure))
                last, strayed = failure, strayed or not isinstance(failure, UnsuitedForm)
            else:
                return Attempt(solved, form.name, passes, tuple(failures), strayed=strayed)
        return Attempt(None, control.forms[-1].name, passes, tuple(failures), last, strayed)

    def refused(solved: Solved) -> Reason | None:
        dissipation = Dissipated.of(increment.start, solved)
        return dissipation.negative(control.limits.bounds.relative_gap, friction=solved.posed is None)

    return carry_on(increment, solve, refused, control.integration is Integration.BDF2)


def _failed(increment: Increment, attempt: Attempt, cuts: int, cache: Cache) -> IncrementFailed:
    """What failed, and one sentence on what to change after so many ``cuts``."""
    system, state, tau = increment.system, increment.start, increment.tau
    failed = f"increment from tau = {state.tau:.6g} to {tau:.6g} failed ({attempt.failures[-1]}). "
    found = diagnosis(system, state, tau)
    if found:
        return IncrementFailed(failed + found, state)
    given_way = collapse(increment)
    if given_way is not None:
        carried = f"The load passes the limit load: in its present shape the body carries {given_way.carried:.6g} of it"
        space = system.body.space
        advice = f"{failed}{carried}. Drive it by displacements, or load it less."
        return LimitPassed(
            advice,
            state,
            ray=space.spread(given_way.v),
            translation=space.beside(given_way.v),
            fraction=given_way.carried,
            tau=tau,
        )
    if system.loading.loads or system.body.scene.pushed:
        top = cache.pace.maximum()
        most = "may be next to, or past, its maximum"
        if top is not None and top - state.tau < NEXT * (tau - state.tau):
            most = f"passes its maximum at about tau = {max(top, state.tau):.6g}"
        more = f"Drive the body by displacements, or use more increments: the load {most}."
    elif isinstance(attempt.last, InvertedElement):
        more = (
            "Remesh there: shorter increments fold the element too."
            if cuts
            else "Use more increments, or remesh there."
        )
    else:
        more = "Use more increments, or a mesh that is less distorted there."
    return IncrementFailed(failed + more, state)
