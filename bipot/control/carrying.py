r"""How much plastic flow is carried on into an increment: BDF2's ratio and its guards, measured from the material.

The increment is solved with the last flow carried on (:mod:`bipot.laws.flow`). The ratio rho of the two increments in
pseudo-time, at one pace (:mod:`bipot.scene.paces`), is only a first guess, because the material is rate-independent.
The solution shows

* where the flow did not continue: de_p0 : gamma n <= 0, the point stayed elastic or flowed against its last flow;
* the ratio rho = sum_q w de_p : de_p0 / sum_q w de_p0 : de_p0 over points that carried flow, de_p = 0 where it stopped.

The excess of the flow carried on, over the flow that continues, is (a(rho_used) - a(rho))/rho. Where it is above
TOO_MUCH or below -TOO_LITTLE, the increment is solved again with the measured ratio, starting from the last solution.
Too much flow lets stress relax without cause; too little is nearer to backward Euler. Where the ratio is right, points
whose flow stopped drop what they carried, for good, and the increment is solved again with the ratio of the others;
unless dropping it takes less than NEGLIGIBLE off the increment's dissipation, which is negative at none of them. After
more than RATIOS wrong ratios or REPEATS solutions no flow is carried: backward Euler.

Where no solution is found, and where the path turns, the increment is solved by backward Euler. That solution stands
if a(rho)/rho, measured in it, is at most TOO_LITTLE; otherwise the increment is solved from there with the flow, or has
failed. Which of the two is accepted therefore does not depend on the luck of a solver.

The flow carried on extrapolates its direction: stress is along gamma n = de_p - a de_p0, which is as much farther round
from de_p0 than de_p as in a steady turn. Where a path turns, the direction jumps, and that would be an error of stress
of the size of the jump, in increments however short. There backward Euler also stands if the flow has another direction
than the last one: sum_q w |de_p - P de_p|^2 > TURNED^2 sum_q w |de_p|^2, P the projection on de_p0. The same holds if
a landing, as of a whole face, has turned nearly all of the flow before the increment, unless that is so short that it
resolves how the stress follows.

An increment from rest has no last flow: where a fine accuracy chooses increments, and backward Euler strains the body
unevenly, it carries on that of its own first half, which is attempted beforehand: backward Euler in the first half, and
BDF2 in the second. Up to the error SEEN an iterate by backward Euler shows whether it is even; if it is not, the
first half begins at half its motion. So it is, with any accuracy, where backward Euler would stand after a turn and the
body flows. What flowed in the first half lies within the increment: points whose flow stopped keep it, and drop only
what was carried on besides.

Solutions that only measure need not be converged to the last digit: an iterate within ROUGH of one shows as well where
the flow did not continue, and so does one within EARLY if this is clear at every point. The iteration continues from
there. The accepted solution is converged and measured again.

Thus sigma : de_p = |dev sigma| (a n : de_p0 + gamma) is positive where flow continues, and not negative where a point
dropped its flow: the plastic dissipation of the increment is never negative. It is checked nevertheless, together with
that of friction (:mod:`bipot.control.attempting`), before an increment is accepted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from bipot.control.carried import CarriedFlow, Flowed
from bipot.control.reason import Reason, ReasonKind
from bipot.errors import InvertedElement, NotConverged, UnsuitedForm
from bipot.forms import FormName
from bipot.increment import Leave, Near, Solved
from bipot.iterate import Increment
from bipot.response import State
from bipot.system import System
from bipot.tensors import equivalent_stress
from bipot.typing import Floats
from bipot.yielding import flows

RATIOS, REPEATS = 2, 8

ROUGH = 1e-5
"""Unbalanced forces and error of the law over the contact forces, up to which an iterate shows what the flow does.

A point whose flow is dropped too early never takes it up again. Where many points reverse, a value ten times larger
lets two forms, whose iterates differ, end with forces that differ by 7e-4 (`wedge_indentation` of the verification).
"""

EARLY, MARGIN = 1e-2, 200.0
"""Up to the error EARLY an iterate shows which points stop, if each is clear of the limit by MARGIN times the error.

A point's distance from that limit (:func:`_short`) was seen to change, to the end of the iteration, by up to 140 times
the error, and by more only where the last flow was a twentieth of that of most points or less.
"""

SEEN = 0.5
"""Up to this error an iterate shows how unevenly a body is strained: somewhat too little."""


class Attempt(NamedTuple):
    """The result of one attempt at an increment: the solution or None, the form, passes spent, why forms failed.

    ``last`` is the failure of the last form whose solution was inadmissible, or else of the last form tried, which says
    less. ``strayed`` says whether a suited form failed, ``spared`` whether a form was left out, and ``refused`` whether
    the attempt ended early because the remaining forms would find the same inadmissible solution. ``left`` is the
    iterate at which the increment was left unsolved because the flow does not continue as it was carried on.
    """

    solved: Solved | None
    form: FormName
    passes: int
    failures: tuple[Reason, ...]
    last: Exception | None = None
    strayed: bool = False
    left: Near | None = None
    spared: bool = False
    refused: bool = False

    @property
    def unsuited(self) -> bool:
        """Whether no form suits the scene, so that a shorter increment would not help."""
        return isinstance(self.last, UnsuitedForm) and not self.strayed

    def failed(self, why: Reason) -> Attempt:
        """The same attempt with one more failure."""
        return self._replace(failures=(*self.failures, why))


Solve = Callable[[State, Near | None, Leave | None], Attempt]
"""``solve(begun, near_to, leave)`` attempts the increment from the state ``begun``, after the flow carried on.

The iteration starts at ``near_to``; for this and ``leave`` see :func:`bipot.increment.solve_increment`."""


Even = Callable[[Near], bool]
"""Says whether an increment by backward Euler strains the body so evenly that it needs no halves."""


class Halves(NamedTuple):
    """An increment in halves: ``first(near_to)`` attempts its first ``half``, ``whole`` the rest with the flow of that.

    One from rest that is ``even`` is not halved.
    """

    half: Increment
    first: Callable[[Near | None], Attempt]
    whole: Solve
    even: Even


Objection = Callable[[Solved], Reason | None]
"""Says why a solution is not accepted; None if it is accepted."""


def carry_on(
    increment: Increment,
    solve: Solve,
    refused: Objection,
    second: bool,
    halves: Halves | None = None,
) -> Attempt:
    """Attempt the increment, with the last flow carried on if ``second`` (order two), otherwise without.

    One without a last flow, or in which that does not continue because the path turns, is solved in ``halves``, if they
    are given and, from rest, backward Euler is not even. The attempt returned has the passes and the failures of all.
    """
    system, state, tried = increment.system, increment.start, list[Attempt]()
    why: Reason | None = None
    near: Near | None = None
    carried = CarriedFlow.guess(increment) if second else None
    # Rates change where the path turns, and a body whose motion reverses is elastic at first: the last flow misleads.
    unknown = increment.past.turns
    onwards = solve
    if carried is None and halves is not None:
        shown: Near | None = None
        if state.length == 0:
            tried.append(solve(state, None, partial(_uneven, halves.even)))
            whole = tried[-1].solved
            if tried[-1].refused or (whole is not None and halves.even(whole) and refused(whole) is None):
                return tried[-1]
            shown = whole or tried[-1].left
        tried.append(halves.first(_scaled(halves.half, shown, 0.5)))
        if (half := tried[-1].solved) is not None:
            carried, near, unknown = CarriedFlow.of_half(half), _scaled(increment, half, 2.0), False
            onwards = halves.whole
    while carried is not None and carried.fraction.any() and why is None:
        if unknown:
            tried.append(_without(state, solve, refused, None))
            near = euler = tried[-1].solved
            carried = None if euler is None else carried.found_by(increment, euler)
            if carried is None and halves is not None and euler is not None and flows(euler.iterate):
                tried.insert(-1, halves.first(None))
                if (half := tried[-2].solved) is not None:
                    carried, halves, onwards = CarriedFlow.of_half(half), None, halves.whole
            if carried is None:
                return _joined(tried)
        begun = system.body.carried_on(state, carried.last.times(carried.fraction))
        last = len(tried) >= REPEATS
        tried.append(onwards(begun, near, None if last else partial(_turned, system, carried)))
        if tried[-1].refused:
            return _joined(tried)
        solved = tried[-1].solved
        near = solved or tried[-1].left
        unknown = near is None
        if near is None:
            if carried.found:
                return _joined(tried)
            continue
        after = carried.after(Flowed.of(system, carried, near))
        if solved is not None and after is carried:
            if carried.misleads(increment, solved):
                break
            why = refused(solved)
            if why is None:
                return _joined(tried)
        elif after.wrong > RATIOS or len(tried) > REPEATS:
            why = Reason(ReasonKind.FLOW, f"unsettled after {len(tried)} solutions", measures={"solutions": len(tried)})
        carried = after
    if why is not None:
        dropped = Reason(ReasonKind.FLOW, f"flow not carried on: {why.said}", measures=why.measures)
        tried[-1] = tried[-1].failed(dropped)
    return _joined([*tried, _without(state, solve, refused, near)])


def _scaled(increment: Increment, near: Near | None, times: float) -> Near | None:
    """The increment with so many ``times`` the motion ``near`` another, None where that is inadmissible."""
    try:
        return near and Near(increment.at(times * near.response.x), near.r)
    except (InvertedElement, NotConverged):
        return None


def _uneven(even: Even, near: Near, error: float) -> bool:
    """Whether an iterate shows that the increment is not ``even``."""
    return error <= SEEN and not even(near)


def _turned(system: System, carried: CarriedFlow, near: Near, error: float) -> bool:
    """Whether it is clear already ``near`` a solution that the flow does not continue as ``carried``.

    That no flow is to be carried at all is decided on solutions only.
    """
    if error > EARLY:
        return False
    early = error > ROUGH
    if early:
        # It is clear where points stop, and each one that carries flow is far from a change of that.
        short = _short(system, carried, near)[carried.on]
        if not ((short > 0).any() and (np.abs(short) > MARGIN * error).all()):
            return False
    flowed = Flowed.of(system, carried, near)
    after = carried.after(flowed)
    return after is not carried and after.wrong <= RATIOS and not (early and carried.is_wrong(flowed.overall))


def _short(system: System, carried: CarriedFlow, near: Near) -> Floats:
    """How far each point (e, q) is from continuing its flow, over the last flow; negative where it continues.

    It is - gamma n : de_p0 / |de_p0|^2 where a point flows by gamma n beyond what is carried, and
    (sigma_Y - sigma_eq)/(3 G) over the equivalent strain of de_p0 where it stays elastic with the stress sigma.
    """
    response, material = near.response, system.body.scene.material
    last, returned = response.kinematics.turned(carried.last.strain), response.returned
    square = np.vecdot(last, last)
    square = np.where(square > 0, square, 1.0)
    below = material.yield_stress(response.state.peeq) - equivalent_stress(returned.trial)
    elastic = below / (3 * material.elasticity.shear * np.sqrt(square * 2 / 3))
    return np.where(returned.plastic, -np.vecdot(returned.plastic_strain, last) / square, elastic)


def _without(state: State, solve: Solve, refused: Objection, near_to: Near | None) -> Attempt:
    """The attempt by backward Euler, without its solution if that is refused."""
    attempt = solve(state, near_to, None)
    why = None if attempt.solved is None else refused(attempt.solved)
    return attempt if why is None else attempt.failed(replace(why, form=attempt.form))._replace(solved=None)


def _joined(tried: list[Attempt]) -> Attempt:
    """The last attempt with what was spent on, failed, strayed or was spared in any."""
    return tried[-1]._replace(
        passes=sum(attempt.passes for attempt in tried),
        failures=tuple(failure for attempt in tried for failure in attempt.failures),
        strayed=any(attempt.strayed for attempt in tried),
        spared=any(attempt.spared for attempt in tried),
    )
