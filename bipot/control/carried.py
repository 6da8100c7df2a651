"""What of the last flow is carried on into an increment, and what the solution says of it.

Formulas and guards are those of :mod:`bipot.control.carrying`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.increment import Near, Solved
from bipot.iterate import Increment
from bipot.laws.flow import Flow, fraction
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Bools, Floats, vdot
from bipot.yielding import strain_of, yielded_strain

TOO_MUCH, TOO_LITTLE = 0.1, 0.2
NEGLIGIBLE = 1e-6

TURNED = 0.2
"""Root mean square of the sine between flow and last flow above which a path that turns has turned it. Where it does
not, the flow turns by less in an increment: in upset cylinders by 0.02 to 0.08, by 0.17 in five to 45 %.
"""

REMAINING = 0.1
"""Largest part of the flow within TURNED of the last one where the landing of a whole face has turned it. After the
landing of a node, or on the way into a die, more than a tenth was seen to remain: BDF2 errs by less there.
"""

FOLLOWED = 0.4
"""Part of the strain at which a body has long yielded, over which stress follows the flow: at Y times that at yield,
Y = 4, all but exp(-3 G Y/E) of the turn, a hundredth, is done.
"""


@dataclass(frozen=True)
class CarriedFlow:
    """The flow carried on: the last one times a(``ratio``) at the points ``on`` (e, q).

    ``wrong`` counts earlier ratios that the material did not confirm; ``found`` says that the ratio was measured on a
    solution by backward Euler. ``within`` is one where the last flow is that of the increment's own first half, which
    is carried on whole besides a, and zero otherwise.
    """

    last: Flow
    ratio: float
    on: Bools
    wrong: int = 0
    found: bool = False
    within: float = 0.0

    @staticmethod
    def guess(increment: Increment) -> CarriedFlow | None:
        """The guess by the lengths of this increment and the last one, in pseudo-time; None without a last flow.

        What led to the beginning of a path was another path, whose flow does not go on.
        """
        state = increment.start
        if state.flow is None or not state.length > 0 or state.tau == 0:
            return None
        ratio = (increment.tau - state.tau) / increment.past.length
        return CarriedFlow(state.flow, ratio, np.asarray(state.flow.strain.any(axis=-1)))

    @staticmethod
    def of_half(half: Solved) -> CarriedFlow | None:
        """That of the first ``half`` of an increment, as if the second flowed as much; None where nothing flowed."""
        returned, kin = half.response.returned, half.response.kinematics
        flow = Flow(kin.turned_back(returned.plastic_strain), returned.dpeeq)
        on = np.asarray(flow.strain.any(axis=-1))
        return CarriedFlow(flow, 1.0, on, within=1.0) if on.any() else None

    @property
    def fraction(self) -> Floats:
        """a (e, q), zero where the flow is not carried on, and what is ``within`` the increment."""
        return self.within + np.where(self.on, fraction(self.ratio), 0.0)

    def is_wrong(self, ratio: float) -> bool:
        """Whether this carries too much or too little if the flow continues by the measured ``ratio``."""
        excess = fraction(self.ratio) - fraction(ratio)
        return excess > TOO_MUCH * ratio or -excess > TOO_LITTLE * ratio

    def after(self, flowed: Flowed) -> CarriedFlow:
        """What to carry instead if the flow was different; itself if it was not."""
        if self.is_wrong(flowed.overall):
            return replace(self, ratio=flowed.overall, wrong=self.wrong + 1)
        if flowed.stopped.any():
            return replace(self, ratio=flowed.ratio, on=self.on & ~flowed.stopped)
        return self

    def found_by(self, increment: Increment, euler: Solved) -> CarriedFlow | None:
        """What to carry according to a solution by backward Euler; None if that solution stands.

        Where the path turns, the guess by lengths in pseudo-time means nothing, even if the measured ratio is near it.
        """
        nothing = replace(self, ratio=0.0, within=0.0)
        ratio = Flowed.of(increment.system, nothing, euler).overall - self.within
        if not nothing.is_wrong(ratio) or nothing.misleads(increment, euler):
            return None
        measured = increment.past.turns or self.is_wrong(ratio)
        return replace(self, ratio=ratio if measured else self.ratio, found=True)

    def misleads(self, increment: Increment, solved: Solved) -> bool:
        """Whether the flow, found with this carried on, was turned at the start of the increment or before.

        Where a landing has turned all of it, stress follows over some strain, and BDF2 resolves that in short
        increments.
        """
        kin, flowed = solved.response.kinematics, solved.response.returned.plastic_strain
        last, weight = kin.turned(self.last.strain), self.on * kin.volume
        flow, square = flowed + self.fraction[..., None] * last, np.vecdot(last, last)
        along = np.divide(np.vecdot(flow, last), square, out=np.zeros_like(square), where=square > 0)
        size, across = norm(flow), norm(flow - along[..., None] * last)
        if increment.past.turns and not self.within:
            return vdot(weight, across**2) > TURNED**2 * vdot(weight, size**2)
        if float((weight * size)[across <= TURNED * size].sum()) >= REMAINING * vdot(weight, size):
            return False
        if solved.landed.size:
            return False
        return strain_of(increment) >= FOLLOWED * yielded_strain(increment.system, None)


@dataclass(frozen=True)
class Flowed:
    """The measured flow: points (e, q) where it stopped, its ratio at the others, and overall.

    ``overall`` counts the flow of points that stopped as zero. Both ratios are 0 where no flow continued.
    """

    stopped: Bools
    ratio: float
    overall: float

    @staticmethod
    def of(system: System, carried: CarriedFlow, near: Near) -> Flowed:
        """Measured at or ``near`` the solution of the increment with the flow ``carried``."""
        response, a = near.response, carried.fraction
        added, weight = response.returned.plastic_strain, response.kinematics.volume
        last = response.kinematics.turned(carried.last.strain)
        onwards, square = np.vecdot(added, last), np.vecdot(last, last)
        stopped = carried.on & (onwards <= 0)
        if stopped.any():
            flow = added + a[..., None] * last
            dissipation = weight * np.vecdot(response.returned.stress, flow)
            dropped = weight * (a - carried.within) * system.body.scene.materials.dissipation(last, response.state.peeq)
            slight = float(dropped[stopped].sum()) <= NEGLIGIBLE * float(dissipation.sum())
            if slight and not np.any(dissipation[stopped] < 0):
                stopped = np.zeros_like(stopped)
        going = carried.on & ~stopped
        continued = max(vdot(weight * going, onwards + (a - carried.within) * square), 0.0)
        if not continued > 0:
            return Flowed(stopped, 0.0, 0.0)
        ratios = (continued / vdot(weight * points, square) for points in (going, carried.on))
        return Flowed(stopped, *ratios)
