"""The error of an increment that fails however often it is halved: why, and what to change."""

from __future__ import annotations

from dataclasses import replace

from bipot.checks.diagnosis import cornered, diagnosis
from bipot.control.carrying import Attempt
from bipot.control.reason import Reason
from bipot.errors import FoldedAnswer, IncrementFailed, InvertedElement, LimitPassed, Refused
from bipot.forms.memory import Pace
from bipot.iterate import Increment
from bipot.limit_analysis import collapse
from bipot.programs.limit import Mechanism

AHEAD = 1e-3
"""Part of the path within which a load that is not carried explains why a march paced by accuracy ends: its increments
become too short for the load at their end to be told from the one carried."""

NEXT = 4.0
"""A maximum of the load within so many lengths of the failed increment explains the failure."""


def given_up(increment: Increment, attempt: Attempt, cuts: int, pace: Pace, ahead: float) -> IncrementFailed:
    """The error that says what failed after so many ``cuts``, with one sentence on what to change.

    The load is followed as far ``ahead``, a pseudo-time not before the increment's end.
    """
    system, state, tau = increment.system, increment.start, increment.tau
    failed = f"increment from tau = {state.tau:.6g} to {tau:.6g} failed ({_decisive(attempt)}). "
    found = diagnosis(increment)
    if found:
        return IncrementFailed(failed + found, state)
    passed = _limit_passed(increment, failed, ahead)
    if passed is not None:
        return passed
    told = isinstance(attempt.last, Refused | InvertedElement)
    corner = None if told else cornered(increment)
    if corner is not None:
        more = corner
    elif system.loading.loads or system.body.scene.drives:
        top = pace.maximum(increment)
        most = "may be next to, or past, its maximum"
        if top is not None and top - state.tau < NEXT * (tau - state.tau):
            most = f"passes its maximum at about tau = {max(top, state.tau):.6g}"
        more = f"Drive the body by displacements, or use more increments: the load {most}."
    elif isinstance(attempt.last, Refused):
        more = attempt.last.advice
    elif isinstance(attempt.last, InvertedElement):
        more = (
            "Remesh there: shorter increments fold the element too."
            if cuts
            else "Use more increments, or remesh there."
        )
    else:
        more = "Use more increments, or a mesh that is less distorted there."
    return IncrementFailed(failed + more, state)


def _decisive(attempt: Attempt) -> Reason:
    """Why the attempt failed: in the words of its refusal or fold if there is one, else the last reason."""
    found = isinstance(attempt.last, Refused | FoldedAnswer)
    told = [reason for reason in attempt.failures if found and reason.said == str(attempt.last)]
    return told[-1] if told else attempt.failures[-1]


def _limit_passed(increment: Increment, failed: str, ahead: float) -> LimitPassed | None:
    """The proof that the load at the increment's end is not carried, or else that one ``ahead``; None without one."""
    space = increment.system.body.space
    for tau in dict.fromkeys((increment.tau, ahead)):
        given_way = collapse(replace(increment, tau=tau))
        if given_way is None:
            continue
        return LimitPassed(
            failed + _told(given_way, "it" if tau == increment.tau else f"that at tau = {tau:.6g}"),
            increment.start,
            ray=space.spread(given_way.v),
            translation=space.beside(given_way.v),
            fraction=given_way.carried,
            tau=tau,
        )
    return None


def _told(given_way: Mechanism, whose: str) -> str:
    """What the mechanism proves of the load, and what to change."""
    if given_way.carried == 0 and not given_way.rubs:
        return (
            "The load passes what contacts hold by any friction: without strain the body lifts off, tips over an edge, "
            "or pushes back what a force drives. Hold it by a support, press it harder, or load it elsewhere."
        )
    if given_way.carried == 0:
        return (
            "The load passes what friction holds: contacts slide or open, and the body moves without strain. "
            "Hold it by a support, press it harder, or give contacts that slide more friction."
        )
    carried = f"in its present shape the body carries {given_way.carried:.6g} of {whose}"
    return f"The load passes the limit load: {carried}. Drive it by displacements, or load it less."
