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

from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from bipot.control.attempt import Attempt, Even, Halves, Objection, Solve, joined
from bipot.control.carried import CarriedFlow, Flowed
from bipot.control.reason import Reason, ReasonKind
from bipot.errors import InvertedElement, NotConverged
from bipot.increment import Near, Solved
from bipot.iterate import Increment
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
    return _Carrying(increment, solve, refused, halves).settled(CarriedFlow.guess(increment) if second else None)


class _Going(NamedTuple):
    """The flow to be ``carried`` next, by what solver of an increment, from what start."""

    carried: CarriedFlow
    onwards: Solve
    near: Near | None = None


@dataclass
class _Carrying:
    """The attempts ``tried`` at an increment; the other fields are the arguments of :func:`carry_on`.

    Its methods append attempts and say how to go on, None where the last attempt stands.
    """

    increment: Increment
    solve: Solve
    refused: Objection
    halves: Halves | None
    tried: list[Attempt] = field(default_factory=list)

    def settled(self, guess: CarriedFlow | None) -> Attempt:
        """The last attempt, with what was spent on all."""
        going = self._begun(guess)
        while going is not None:
            going = self._tried(going) if going.carried.fraction.any() else self._dropped(going.near)
        return joined(self.tried)

    def _begun(self, guess: CarriedFlow | None) -> _Going | None:
        if guess is not None:
            going = _Going(guess, self.solve)
            # Rates change where the path turns, and a body whose motion reverses is elastic at first.
            return self._measured(going) if self.increment.past.turns else going
        return self._dropped(None) if self.halves is None else self._from_half(self.halves)

    def _from_half(self, halves: Halves) -> _Going | None:
        """Without a last flow, that of the first half, unless backward Euler shows that the increment is even."""
        shown: Near | None = None
        if self.increment.start.length == 0:
            whole = self.solve(self.increment.start, None, partial(_uneven, halves.even))
            self.tried.append(whole)
            if _stands(whole, halves.even, self.refused):
                return None
            shown = whole.solved or whole.left
        self.tried.append(halves.first(_scaled(halves.half, shown, 0.5)))
        if (half := self.tried[-1].solved) is None:
            return self._dropped(None)
        carried, near = CarriedFlow.of_half(half), _scaled(self.increment, half, 2.0)
        return self._dropped(near) if carried is None else _Going(carried, halves.whole, near)

    def _measured(self, going: _Going) -> _Going | None:
        """What a solution by backward Euler tells, where it does not stand."""
        self.tried.append(self._euler(None))
        if (euler := self.tried[-1].solved) is None:
            return None
        if (carried := going.carried.found_by(self.increment, euler)) is not None:
            return going._replace(carried=carried, near=euler)
        if self.halves is None or not flows(euler.iterate):
            return None
        self.tried.insert(-1, self.halves.first(None))
        half, whole = self.tried[-2].solved, self.halves.whole
        if half is None or (carried := CarriedFlow.of_half(half)) is None:
            return None
        self.halves = None
        return _Going(carried, whole, euler)

    def _tried(self, going: _Going) -> _Going | None:
        """One attempt with this flow carried on, and what its solution, or an iterate near it, says of that."""
        carried, body = going.carried, self.increment.system.body
        begun = body.carried_on(self.increment.start, carried.last.times(carried.fraction))
        leave = None if len(self.tried) >= REPEATS else partial(_turned, self.increment.system, carried)
        attempt = going.onwards(begun, going.near, leave)
        self.tried.append(attempt)
        near = attempt.solved or attempt.left
        if attempt.refused or (near is None and carried.found):
            return None
        return self._measured(going) if near is None else self._judged(going, attempt.solved, near)

    def _judged(self, going: _Going, solved: Solved | None, near: Near) -> _Going | None:
        carried, tried = going.carried, len(self.tried)
        after = carried.after(Flowed.of(self.increment.system, carried, near))
        if solved is not None and after is carried:
            if carried.misleads(self.increment, solved):
                return self._dropped(near)
            why = self.refused(solved)
            return None if why is None else self._dropped(near, why)
        if after.wrong > RATIOS or tried > REPEATS:
            said = f"unsettled after {tried} solutions"
            return self._dropped(near, Reason(ReasonKind.FLOW, said, measures={"solutions": tried}))
        return going._replace(carried=after, near=near)

    def _dropped(self, near: Near | None, why: Reason | None = None) -> None:
        """Backward Euler from ``near``, after an attempt that is not accepted if it is said ``why``."""
        if why is not None:
            dropped = Reason(ReasonKind.FLOW, f"flow not carried on: {why.said}", measures=why.measures)
            self.tried[-1] = self.tried[-1].failed(dropped)
        self.tried.append(self._euler(near))

    def _euler(self, near: Near | None) -> Attempt:
        """The attempt by backward Euler, without its solution if that is refused."""
        attempt = self.solve(self.increment.start, near, None)
        why = None if attempt.solved is None else self.refused(attempt.solved)
        return attempt if why is None else attempt.failed(replace(why, form=attempt.form))._replace(solved=None)


def _scaled(increment: Increment, near: Near | None, times: float) -> Near | None:
    """The increment with so many ``times`` the motion ``near`` another, None where that is inadmissible."""
    try:
        return near and Near(increment.at(times * near.response.x), near.r)
    except (InvertedElement, NotConverged):
        return None


def _uneven(even: Even, near: Near, error: float) -> bool:
    """Whether an iterate shows that the increment is not ``even``."""
    return error <= SEEN and not even(near)


def _stands(attempt: Attempt, even: Even, refused: Objection) -> bool:
    """Whether an ``attempt`` in one piece is the last one: the increment is solved and ``even``, or inadmissible."""
    solved = attempt.solved
    return attempt.refused or (solved is not None and even(solved) and refused(solved) is None)


def _turned(system: System, carried: CarriedFlow, near: Near, error: float) -> bool:
    """Whether it is clear already ``near`` a solution that the flow does not continue as ``carried``.

    That no flow is to be carried at all is decided on solutions only.
    """
    early = error > ROUGH
    if error > EARLY or (early and not _is_clear(system, carried, near, MARGIN * error)):
        return False
    flowed = Flowed.of(system, carried, near)
    after = carried.after(flowed)
    return after is not carried and after.wrong <= RATIOS and not (early and carried.is_wrong(flowed.overall))


def _is_clear(system: System, carried: CarriedFlow, near: Near, margin: float) -> bool:
    """Whether points stop, and each point that carries flow is farther than ``margin`` from a change of that."""
    short = _short(system, carried, near)[carried.on]
    return bool((short > 0).any() and (np.abs(short) > margin).all())


def _short(system: System, carried: CarriedFlow, near: Near) -> Floats:
    """How far each point (e, q) is from continuing its flow, over the last flow; negative where it continues.

    It is - gamma n : de_p0 / |de_p0|^2 where a point flows by gamma n beyond what is carried, and
    (sigma_Y - sigma_eq)/(3 G) over the equivalent strain of de_p0 where it stays elastic with the stress sigma.
    """
    response, material = near.response, system.body.scene.materials
    last, returned = response.kinematics.turned(carried.last.strain), response.returned
    square = np.vecdot(last, last)
    square = np.where(square > 0, square, 1.0)
    below = material.yield_stress(response.state.peeq) - equivalent_stress(returned.trial)
    elastic = below / (3 * material.elasticity.shear * np.sqrt(square * 2 / 3))
    return np.where(returned.plastic, -np.vecdot(returned.plastic_strain, last) / square, elastic)
