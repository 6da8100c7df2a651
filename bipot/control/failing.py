"""The error of an increment that fails however often it is halved: why, and what to change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.certificate import EPS
from bipot.checks.diagnosis import cornered, diagnosis, level, wavering
from bipot.control.attempt import Attempt
from bipot.control.reason import Reason
from bipot.errors import (
    BrokenSolver,
    FoldedAnswer,
    IncrementFailed,
    InvertedElement,
    LimitPassed,
    Refused,
    UnsuitedForm,
)
from bipot.forms import FormName
from bipot.forms.memory import Pace
from bipot.iterate import Increment
from bipot.limit_analysis import collapse
from bipot.programs.limit import Mechanism

AHEAD = 1e-3
"""A load within this part of the path that is not carried explains why a march paced by accuracy ends: its increments
become so short that the loads at their start and end cannot be told apart."""

BLURRED = 1e-4
"""Round-off of the stress over the yield stress above which an increment cannot be expected to be solved."""

NEXT = 4.0
"""A maximum of the load within this many lengths of the failed increment explains the failure."""

DISTORTED = "Use more increments, or a mesh that is less distorted there."

CRUSHED, CONFINED = 0.95, 2.0
"""Part of its volume at rest below which a body that yields is crushed: its mean pressure is then about a twentieth
of the bulk modulus. Where that is less than CONFINED times the yield stress it may flow freely, as soft foams do."""


def given_up(increment: Increment, attempt: Attempt, cuts: int, pace: Pace, ahead: float) -> IncrementFailed:
    """The error that says what failed after the number ``cuts`` of halvings, with one sentence on what to change.

    The load at the increment's end is examined, and that at the pseudo-time ``ahead``, not before the end.
    """
    state = increment.start
    failed = _failed(increment, _decisive(attempt))
    found = diagnosis(increment)
    if found:
        return IncrementFailed(failed + found, state)
    passed = _limit_passed(increment, failed, ahead)
    if passed is not None:
        return passed
    is_explained = isinstance(attempt.last, Refused | InvertedElement)
    corner = None if is_explained else cornered(increment)
    crushed = None if isinstance(attempt.last, Refused) else _crushed(increment)
    if crushed is not None:
        more = crushed
    elif corner is not None:
        more = corner
    elif not is_explained and (wavers := wavering(increment)) is not None:
        more = wavers
    elif isinstance(attempt.last, UnsuitedForm):
        more = "Take another form, or give it fallbacks."
    elif isinstance(attempt.last, Refused) and not attempt.last.too_far:
        more = attempt.last.advice
    elif _pushed(increment, increment.tau):
        more = _loaded(increment, attempt, pace)
    elif isinstance(attempt.last, Refused):
        more = attempt.last.advice
    elif isinstance(attempt.last, InvertedElement):
        shorter = "Remesh there: shorter increments fold the element too."
        more = " ".join(filter(None, (shorter if cuts else "Use more increments, or remesh there.", level(increment))))
    elif _decisive(attempt).form is FormName.UZAWA:
        more = "Raise K_n and K_t: the larger they are, the nearer to the law every pass comes."
    else:
        found = _rigid_in_volume(increment) or _jumping(increment)
        more = found or getattr(attempt.last, "advice", "") or DISTORTED
    return IncrementFailed(failed + more, state)


def broken(increment: Increment, error: BrokenSolver) -> IncrementFailed:
    """The error of an increment whose solver or form broke: no other form or shorter increment is to hide that."""
    advice = "Mend it, or take another: of what it does not solve it has to raise a ProgramError."
    return IncrementFailed(_failed(increment, error) + advice, increment.start)


def _failed(increment: Increment, why: object) -> str:
    return f"increment from tau = {increment.start.tau:.6g} to {increment.tau:.6g} failed ({why}). "


def _pushed(increment: Increment, tau: float) -> bool:
    """Whether loads, forces or moments act at ``tau``; a moment of zero lets a roll turn freely."""
    system = increment.system
    return bool(system.loading.forces(increment.start.nodes, tau).any() or system.body.scene.drives.at(tau).any())


def _loaded(increment: Increment, attempt: Attempt, pace: Pace) -> str:
    """The advice where there are loads, which may not be the cause where paths move tools or supports."""
    scene, start, tau = increment.system.body.scene, increment.start.tau, increment.tau
    top, cause = pace.maximum(increment), attempt.last
    at_once = increment.loads.begins and _pushed(increment, start)
    grow = "let amplitudes begin at zero, since what is on at tau = 0 comes at once, however short the increment"
    slower = f"Drive the body by displacements, or {grow if at_once else 'use more increments'}"
    if top is not None and top - start < NEXT * (tau - start):
        at = f"passes its maximum at about tau = {max(top, start):.6g}"
        return f"{slower}: the load {at}."
    if increment.reach > 0 or (scene.driven(tau) != scene.driven(start)).any():
        if isinstance(cause, Refused):
            return cause.advice
        if isinstance(cause, InvertedElement):
            return "Remesh there, or load the body less: the load may be next to, or past, its maximum."
    return f"{slower}: the load may be next to, or past, its maximum."


def _crushed(increment: Increment) -> str | None:
    """The advice where tools have compressed a body that yields, None where they have not."""
    state, body = increment.start, increment.system.body
    now, at_rest = (float(body.space.gradients(x).volume.sum()) for x in (state.nodes, body.scene.mesh.nodes))
    confined = state.pressure.mean() >= CONFINED * np.mean(body.scene.materials.yield_stress(state.peeq))
    if now > CRUSHED * at_rest or not (body.scene.tools and state.peeq.any() and confined):
        return None
    return (
        f"The body fills the room that its tools leave it, and has lost {1 - now / at_rest:.0%} of its volume: give it "
        "more room, or stop the tools earlier."
    )


def _rigid_in_volume(increment: Increment) -> str | None:
    """The advice where round-off of the volume change alone stresses the body, None where it does not."""
    law = increment.system.body.scene.materials
    K, G = law.elasticity.bulk, law.elasticity.shear
    blurred = float((EPS * K / law.yield_stress(increment.start.peeq)).max())
    if blurred < BLURRED:
        return None
    return (
        f"Lower Poisson's ratio: at 1 - 2 nu = {float(np.min(3 * G / (3 * K + G))):.2g} round-off of the volume change "
        f"alone is {blurred:.2g} of the yield stress."
    )


def _jumping(increment: Increment) -> str | None:
    """The advice where friction is a constant shear wherever contacts push, None where it is not.

    At the end of such a contact friction is neither none nor the shear, and the law has no answer.
    """
    candidates = increment.system.candidates
    jumps = np.isinf(candidates.mu) & np.isfinite(candidates.shear)
    if not jumps.any():
        return None
    return (
        f"Use more increments, or give tools[{candidates.tool[jumps.argmax()]}] a finite mu: up to its shear friction "
        "then grows with the normal force, while with mu = inf it jumps where contact begins or ends."
    )


def _decisive(attempt: Attempt) -> Reason:
    """Why the attempt failed: the reason of its refusal or fold if there is one, else the last reason."""
    if isinstance(attempt.last, Refused | FoldedAnswer):
        said = (reason for reason in reversed(attempt.failures) if reason.said == str(attempt.last))
        return next(said, attempt.failures[-1])
    return attempt.failures[-1]


def _limit_passed(increment: Increment, failed: str, ahead: float) -> LimitPassed | None:
    """The proof that the load at the increment's end, or else the load ``ahead``, is not carried; None without one."""
    space = increment.system.body.space
    for tau in dict.fromkeys((increment.tau, ahead)):
        mechanism = collapse(replace(increment, tau=tau))
        if mechanism is None:
            continue
        return LimitPassed(
            failed + _proved(mechanism, "it" if tau == increment.tau else f"that at tau = {tau:.6g}"),
            increment.start,
            ray=space.spread(mechanism.v),
            translation=space.beside(mechanism.v),
            fraction=mechanism.carried,
            tau=tau,
        )
    return None


def _proved(mechanism: Mechanism, load: str) -> str:
    """What the mechanism proves of the ``load``, a word for it, and what to change."""
    if mechanism.carried == 0 and not mechanism.rubs:
        return (
            "The load passes what contacts hold by any friction: without strain the body lifts off, tips over an edge, "
            "or pushes back what a force drives. Hold it by a support, press it harder, or load it elsewhere."
        )
    if mechanism.carried == 0:
        return (
            "The load passes what friction holds: contacts slide or open, and the body moves without strain. "
            "Hold it by a support, press it harder, or give contacts that slide more friction."
        )
    carried = f"in its present shape the body carries {mechanism.carried:.6g} of {load}"
    return f"The load passes the limit load: {carried}. Drive it by displacements, or load it less."
