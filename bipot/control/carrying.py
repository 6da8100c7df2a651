r"""Which plastic flow goes on into an increment: BDF2's ratio and its guards, found from what the material does.

The increment is solved with the last flow carried on (:mod:`bipot.laws.flow`), first by the ratio rho of the two
increments in pseudo-time, which means nothing to the material: a guess. What the body then did tells

* where the flow did not go on: de_p0 : gamma n <= 0, the point stayed elastic or returned against its last flow;
* the ratio rho = sum_q w de_p : de_p0 / sum_q w de_p0 : de_p0 over the points that carried, de_p zero where it stopped.

The increment is solved again with the measured ratio, starting from the last solution, where the excess of the flow
carried over what it should have been, (a(rho_used) - a(rho))/rho of the flow that goes on, is above TOO_MUCH or below
- TOO_LITTLE: too much lets stress relax for nothing, too little is nearer to backward Euler. Where the ratio is right,
points that stopped lose what they carried, for good, and the increment is solved again with the ratio of the others;
unless what they would dissipate of it is below NEGLIGIBLE of the increment's dissipation and nowhere negative. After
RATIOS wrong ratios or REPEATS solutions no flow is carried: backward Euler.

Where no solution is found, backward Euler is asked what the material does. It stands if less than TOO_LITTLE goes
on; else the increment is solved from there with the flow, or has failed. A solver's luck does not choose.

Not every one of these solutions is needed to the last digit: an iterate within ROUGH of one tells as well where the
flow did not go on, and the increment goes on from there. What is accepted has been solved, and asked again.

So sigma : de_p = |dev sigma| (a n : de_p0 + gamma) is positive where flow goes on, and not negative where a point that
stopped was let off. The plastic dissipation of the increment is therefore never negative. It is checked nevertheless,
and friction's with it, before an increment is accepted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from bipot.certificate import EPS
from bipot.control.reason import Reason, ReasonKind
from bipot.forms import FormName
from bipot.increment import Leave, Near, Solved
from bipot.iterate import Increment
from bipot.laws.flow import Flow, fraction
from bipot.response import State
from bipot.system import System
from bipot.typing import Bools, Floats

TOO_MUCH, TOO_LITTLE = 0.1, 0.2
NEGLIGIBLE = 1e-6
RATIOS, REPEATS = 2, 8

ROUGH = 1e-5
"""Unbalanced forces and miss of the law over the contact forces, up to which an iterate tells what the flow does.

Where many points turn back, round by round, one that is stopped too early stays so: what is rougher by a factor of ten
lets two forms, whose iterates differ, end with forces that differ by 7e-4 (`wedge_indentation` of the verification)."""


class Attempt(NamedTuple):
    """What one attempt at an increment gave: the solution or None, the form, passes spent, why forms failed.

    ``last`` is the failure of the last form that was tried; ``strayed`` says whether a form failed that was suited.
    ``left`` is where the increment was left unsolved because the flow does not go on as it was carried.
    """

    solved: Solved | None
    form: FormName
    passes: int
    failures: tuple[Reason, ...]
    last: Exception | None = None
    strayed: bool = False
    left: Near | None = None

    def failed(self, why: Reason) -> Attempt:
        """The same with one more failure."""
        return self._replace(failures=(*self.failures, why))


Solve = Callable[[State, Near | None, Leave | None], Attempt]
"""``solve(begun, near_to, leave)`` attempts the increment from a state in which flow has gone on, starting the
iteration near a solution with other flow carried on; :func:`bipot.increment.solve_increment` says when it is left."""


@dataclass(frozen=True)
class Carried:
    """The flow carried on: the last one times a(``ratio``) at the points ``on`` (e, q).

    ``wrong`` counts the ratios before it that the material did not confirm; ``found`` says that it was found by a
    solution with backward Euler.
    """

    last: Flow
    ratio: float
    on: Bools
    wrong: int = 0
    found: bool = False

    @staticmethod
    def guess(increment: Increment) -> Carried | None:
        """By the lengths in pseudo-time of the increment and the last one; None without a last flow."""
        state = increment.start
        if state.flow is None or not state.length > 0:
            return None
        ratio = (increment.tau - state.tau) / state.length
        return Carried(state.flow, ratio, np.asarray(state.flow.strain.any(axis=-1)))

    @property
    def fraction(self) -> Floats:
        """a (e, q), zero where nothing is carried."""
        return np.where(self.on, fraction(self.ratio), 0.0)

    def is_wrong(self, ratio: float) -> bool:
        """Whether this carries too much or too little where flow goes on by the measured ``ratio``."""
        excess = fraction(self.ratio) - fraction(ratio)
        return excess > TOO_MUCH * ratio or -excess > TOO_LITTLE * ratio

    def after(self, flowed: Flowed) -> Carried:
        """What to carry instead where the material took another course: itself if it did not."""
        if self.is_wrong(flowed.overall):
            return replace(self, ratio=flowed.overall, wrong=self.wrong + 1)
        if flowed.stopped.any():
            return replace(self, ratio=flowed.ratio, on=self.on & ~flowed.stopped)
        return self

    def found_by(self, system: System, euler: Solved) -> Carried | None:
        """What to carry by what the material does with backward Euler; None where that is as well."""
        none = replace(self, ratio=0.0)
        ratio = Flowed.of(system, none, euler).overall
        if not none.is_wrong(ratio):
            return None
        return replace(self, ratio=ratio if self.is_wrong(ratio) else self.ratio, found=True)


@dataclass(frozen=True)
class Flowed:
    """What the material did: points (e, q) whose flow did not go on, the ratio of it at the others, and overall.

    ``overall`` counts the flow of points that stopped as zero. Both are 0 where no flow went on.
    """

    stopped: Bools
    ratio: float
    overall: float

    @staticmethod
    def of(system: System, carried: Carried, near: Near) -> Flowed:
        """Measured at or ``near`` the solution of the increment with the flow ``carried``."""
        response, a = near.response, carried.fraction
        own, weight = response.returned.plastic_strain, response.kinematics.volume
        last = response.kinematics.turned(carried.last.strain)
        forth, square = np.vecdot(own, last), np.vecdot(last, last)
        stopped = carried.on & (forth <= 0)
        if stopped.any():
            flow = own + a[..., None] * last
            dissipation = weight * np.vecdot(response.returned.stress, flow)
            wanted = system.body.scene.material.dissipation(last, response.state.peeq)
            lost = float(np.sum((weight * a * wanted)[stopped]))
            if lost <= NEGLIGIBLE * float(dissipation.sum()) and not np.any(dissipation[stopped] < 0):
                stopped = np.zeros_like(stopped)
        going = carried.on & ~stopped
        along = max(float(np.vdot(weight * going, forth + a * square)), 0.0)
        sums = (float(np.vdot(weight * on, square)) for on in (going, carried.on))
        return Flowed(stopped, *(along / whole if along > 0 else 0.0 for whole in sums))


Objection = Callable[[Solved], Reason | None]
"""Why a solution is not accepted, None if it is."""


def carry_on(increment: Increment, solve: Solve, refused: Objection, second: bool) -> Attempt:
    """Attempt the increment, with the last flow carried on if ``second``, else without.

    The attempt returned has the passes and the failures of all.
    """
    system, state, tried = increment.system, increment.start, list[Attempt]()
    why: Reason | None = None
    near: Near | None = None
    carried = Carried.guess(increment) if second else None
    while carried is not None and carried.fraction.any() and why is None:
        begun = system.body.carried_on(state, carried.last.times(carried.fraction))
        last = len(tried) >= REPEATS
        tried.append(solve(begun, near, None if last else partial(_turned, system, carried)))
        solved = tried[-1].solved
        near = solved or tried[-1].left
        if near is None:
            if carried.found:
                return _joined(tried)
            tried.append(_without(state, solve, refused, None))
            near = euler = tried[-1].solved
            carried = None if euler is None else carried.found_by(system, euler)
            if carried is None:
                return _joined(tried)
            continue
        after = carried.after(Flowed.of(system, carried, near))
        if solved is not None and after is carried:
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


def _turned(system: System, carried: Carried, near: Near, error: float) -> bool:
    """Whether it is clear ``near`` a solution that the flow ``carried`` does not go on as such.

    What makes it carry none at all is asked of solutions.
    """
    if error > ROUGH:
        return False
    after = carried.after(Flowed.of(system, carried, near))
    return after is not carried and after.wrong <= RATIOS


def _without(state: State, solve: Solve, refused: Objection, near_to: Near | None) -> Attempt:
    """The attempt by backward Euler, without its solution if that is refused."""
    attempt = solve(state, near_to, None)
    why = None if attempt.solved is None else refused(attempt.solved)
    return attempt if why is None else attempt.failed(replace(why, form=attempt.form))._replace(solved=None)


def _joined(tried: list[Attempt]) -> Attempt:
    """The last attempt with the passes and failures of all."""
    failures = tuple(failure for attempt in tried for failure in attempt.failures)
    strayed = any(attempt.strayed for attempt in tried)
    return tried[-1]._replace(passes=sum(attempt.passes for attempt in tried), failures=failures, strayed=strayed)


class Dissipated(NamedTuple):
    """Plastic and frictional dissipation of an increment, and the energy they are measured by (energy units).

    sum_q w sigma : de_p with de_p as the states carry it, - sum_c r_t . du_t, and
    sum_q w |sigma : de| + sum_q w/2 sigma : C^-1 : sigma, what the body takes up and what it has stored; ``blur`` is
    what round-off of its length makes of the contacts' work.
    """

    plastic: float
    friction: float
    scale: float
    blur: float = 0.0

    @staticmethod
    def of(start: State, solved: Solved) -> Dissipated:
        """That of the increment ``solved`` from ``start``, with the flow carried on from there."""
        response, body = solved.response, solved.iterate.increment.system.body
        stress, kin = response.returned.stress, response.kinematics
        carried = response.kinematics.turned(response.state.plastic_strain - start.plastic_strain)
        slip = solved.iterate.motion[:, 1:]
        compliance = body.scene.material.elasticity.compliance(stress.shape[-1])
        taken = np.abs(np.vecdot(stress, kin.strain)) + np.vecdot(stress, stress @ compliance) / 2
        return Dissipated(
            float(np.vdot(kin.volume, np.vecdot(stress, carried + response.returned.plastic_strain))),
            -float(np.vdot(solved.r[:, 1:], slip)),
            float(np.vdot(kin.volume, taken)),
            EPS * float(np.abs(solved.r).sum()) * solved.iterate.increment.units.length,
        )

    def negative(self, margin: float, friction: bool) -> Reason | None:
        """Which dissipation is below - ``margin`` times the energy, and round-off; friction's only if asked."""
        found = {"plastic": self.plastic, "friction's": self.friction if friction else 0.0}
        below = {name: d for name, d in found.items() if d < -margin * self.scale - self.blur}
        said = " and ".join(f"{name} dissipation is negative, {d:.2g}" for name, d in below.items())
        return Reason(ReasonKind.DISSIPATION, said, measures=below) if below else None
