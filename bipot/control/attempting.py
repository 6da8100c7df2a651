"""One attempt at an increment: the forms are tried in turn, again whenever the flow carried on has changed.

Neither plastic flow nor friction may dissipate a negative energy in a solution that is accepted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from bipot.certificate import EPS
from bipot.control.attempt import Attempt, Even, Halves
from bipot.control.carrying import carry_on
from bipot.control.control import Control
from bipot.control.facing import solve_facing
from bipot.control.reason import Reason, ReasonKind
from bipot.errors import FoldedAnswer, InvertedElement, NotConverged, ProgramError, Refused, UnsuitedForm
from bipot.forms import Cache, FormName
from bipot.increment import Leave, LeftOff, Near, Observer, Solved, Trial, unobserved
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.state import State
from bipot.tensors import norm
from bipot.typing import vdot
from bipot.yielding import is_past_yield, through_air

STRAYED = (NotConverged, InvertedElement)
FAILURES = (*STRAYED, ProgramError)
INADMISSIBLE = (Refused, FoldedAnswer)


def attempt_increment(
    increment: Increment,
    control: Control,
    cache: Cache,
    largest: float,
    observe: Observer = unobserved,
    sparing: bool = False,
    halves: bool = False,
    staged: Even | None = None,
) -> Attempt:
    """Try the increment with the forms in turn, as often as :mod:`bipot.control.carrying` changes the flow carried on.

    With ``sparing`` the dissipation program is left out after a form that strayed, but not after one that is not suited
    or met a singular matrix, where a shorter increment would not help. A solution that is refused or folded would be
    found by all forms. If the increment ``halves`` after a failure, the first such solution ends the attempt; otherwise
    all forms are tried once, and with other flow the first such solution ends it. An increment from rest or a kink that
    goes past yield under loads that last carries on the flow of its own first half if ``staged`` is given, unless that
    says, from rest, that it is even. For ``largest`` see :func:`~bipot.increment.solve_increment`.
    """
    forms = _Forms(control, cache, largest, observe, sparing, ends_if_inadmissible=halves)
    margin = control.limits.bounds.relative_gap

    def refused(solved: Solved) -> Reason | None:
        # Friction by a penalised law may dissipate a negative energy.
        return Dissipated.of(increment.start, solved).negative(margin, friction=solved.posed is None)

    second = control.integration is Integration.BDF2
    in_halves = None
    begins = second and (increment.start.length == 0 or increment.past.turns)
    if staged is not None and begins and is_past_yield(increment) and not increment.loads.changes:
        half = replace(increment, tau=(increment.start.tau + through_air(increment) + increment.tau) / 2)
        whole = replace(increment, in_halves=True)
        first = partial(forms.solve, half, increment.start, leave=None)
        in_halves = Halves(half, first, partial(forms.solve, whole), staged)
    return carry_on(increment, partial(forms.solve, increment), refused, second, in_halves)


@dataclass
class _Forms:
    """The forms of a ``control``, tried in turn as :func:`attempt_increment` says, whose arguments are the fields."""

    control: Control
    cache: Cache
    largest: float
    observe: Observer
    sparing: bool
    ends_if_inadmissible: bool

    def solve(self, increment: Increment, begun: State, near_to: Near | None, leave: Leave | None) -> Attempt:
        """The attempt at the ``increment`` from the state ``begun`` (:data:`bipot.control.carrying.Solve`)."""
        limits, passes = self.control.limits, 0

        def counted(trial: Trial) -> None:
            nonlocal passes
            passes += 1
            self.observe(trial)

        increment = replace(increment, start=begun, accepted=increment.start)
        failures, strayed, spared = list[Reason](), False, False
        last: Exception | None = None
        inadmissible: Exception | None = None
        for form in self.control.forms:
            if self.sparing and form.name is FormName.DISSIPATION and isinstance(last, STRAYED):
                spared = True
                continue
            try:
                solved = solve_facing(increment, form, limits, self.cache, self.largest, counted, near_to, leave)
            except LeftOff as left:
                return Attempt(None, form.name, passes, tuple(failures), strayed=strayed, left=left.near)
            except FAILURES as failure:
                failures.append(Reason.of(form.name, failure))
                last, strayed = failure, strayed or not isinstance(failure, UnsuitedForm)
                if isinstance(failure, INADMISSIBLE):
                    inadmissible = failure
                    if self.ends_if_inadmissible:
                        return Attempt(None, form.name, passes, tuple(failures), last, strayed, refused=True)
            else:
                return Attempt(solved, form.name, passes, tuple(failures), strayed=strayed)
        self.ends_if_inadmissible |= isinstance(last, INADMISSIBLE)
        name, why = self.control.forms[-1].name, inadmissible or last
        return Attempt(None, name, passes, tuple(failures), why, strayed, spared=spared)


class Dissipated(NamedTuple):
    """Plastic and frictional dissipation of an increment, and their ``scale`` (energy units).

    They are sum_q w sigma : de_p with the stored de_p, and - sum_c r_t . du_t. The scale is
    sum_q w |sigma : de| + sum_q w/2 sigma : C^-1 : sigma, the energy taken up plus the energy stored. ``blur`` is the
    work at contacts that round-off alone may do: that of motions against r, and that of nodal forces on the slip.
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
        carried = kin.turned(response.state.plastic_strain - start.plastic_strain)
        # The slip of a welded point is only a remainder of zero.
        slip = np.where(solved.iterate.rows.tied[:, None], 0.0, solved.iterate.motion[:, 1:])
        stored = np.vecdot(stress, body.scene.materials.elasticity.strain(stress)) / 2
        taken = np.abs(np.vecdot(stress, kin.strain)) + stored
        length = solved.iterate.increment.units.length
        unsure = solved.iterate.increment.system.round_off(response.rotated, length)
        return Dissipated(
            vdot(kin.volume, np.vecdot(stress, carried + response.returned.plastic_strain)),
            -vdot(solved.r[:, 1:], slip),
            vdot(kin.volume, taken),
            EPS * float(np.abs(solved.r).sum()) * length + unsure * float(norm(slip).sum()),
        )

    def negative(self, margin: float, friction: bool) -> Reason | None:
        """The dissipations below -(``margin`` times the scale + ``blur``), or None; that of ``friction`` if asked."""
        found = {"plastic": self.plastic, "friction's": self.friction if friction else 0.0}
        below = {name: d for name, d in found.items() if d < -margin * self.scale - self.blur}
        said = " and ".join(f"{name} dissipation is negative, {d:.2g}" for name, d in below.items())
        return Reason(ReasonKind.DISSIPATION, said, measures=below) if below else None
