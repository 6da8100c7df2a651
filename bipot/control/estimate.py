r"""An estimate of the error that an increment adds to the force.

It is a fraction of the force,

    e = GATHERED (|sum_q w (sigma_E - sigma) : de| / (2 sum_q w |sigma : de|)  +  S  +  T)  +  Y  +  l.

* sigma_E is the stress of a radial return from the start for the same motion (backward Euler, of order one in the
  flow), sigma that of the flow carried on. The force is stationary in the direction of flow, so the difference of their
  powers is of order two in the increment, like the error of the flow carried on. In space the work of friction is added
  to that of strain in the denominator: where friction does the work, the small rest that strain does means nothing.
  In an increment from rest, or one that carries on the flow of its own first half, it says how far backward Euler
  would be off, which the first half has cured: it is left out.
* S is the mean of |de|^2/12 over the body: the difference of the midpoint strain from the logarithmic one,
  2 tanh(x/2) = x - x^3/12 + ... Where less than SMALL of the body takes the work, as in a stem on a block or beneath a
  punch in a large body, S is the mean weighted by the work. The part of the body that takes the work is
  (sum_q p)^2 / (sum_q w sum_q p^2/w) with p = w |sigma : de|.
* T = min(|v - v_0|^2 / |v|^2, TURNED) / 10 is the curvature of the motion, with v, v_0 the velocities of the whole
  body's nodes in this increment and the last, beyond those at which supports and tools carry it. A change by more than
  TURNED is an event (a landing) that does not depend on the length of increments; at a scheduled pseudo-time, where no
  increment follows in which its error would decay, it counts in full, as up to one. Where nothing flows, T is zero. A
  first increment, after rest or a kink, has no velocity before it: there T is UNEVEN times the variance of the
  increment of peeq, with the weights of S, or IN_HALVES of it where it carries on the flow of its own first half. The
  more unevenly a body is strained, the more its motion changes: an upset cylinder has a tenth of the variance of a
  square between nearly smooth tools, in which bands of shear form. A first increment past first yield has a mean
  velocity of both sides of it, so T of the second is the less of the two.
* An increment that ends before the body has long yielded, by its strain since rest or a kink
  (:func:`bipot.yielding.yielded_strain`), ends where the body begins to yield, while the force still follows
  the strain of what has not yielded. Then T is replaced by Y = min(|v - v_0|/|v|, 1) h/20, which a first increment adds
  to its T, with h <= 1 the strain of the increment over that at yield. Where loads, or forces on tools, change, the
  force is given and the error is one of the displacement: h is then no less than the body's strain in the increment
  over the sum of that at yield and the plastic strain so far (both root mean squares). Where these alone strain the
  body, it yields bit by bit to the end, and Y counts throughout. In a first increment |v - v_0|/|v| is one after rest,
  the change of direction alone after a kink, and Y is multiplied by D, the part of sum_q w |sigma : de| that is
  dissipated. Points at which no flow was carried on add |sum_q w (sigma_E - sigma_P) : de| / sum_q w |sigma : de| to Y,
  with sigma_P of returns in PARTS parts.
* In an increment from rest the part 1 - D of its work that is stored tells whether the body has long yielded, whatever
  its strain: one that tools or supports confine stores pressure to the end. In even strain the part is one over the
  strain in yield strains. If it is at most SETTLED, Y is what remains of yielding, D max((1 - D)^2 - STORED^2, 0)/10,
  else that of a body that begins to yield. Beneath tools that turn, (1 - D) and STORED are not squared: the power of
  tools is stationary in the direction of flow, the force of one that presses and turns is not. Where loads change, and
  after a kink, strain alone tells, as above.
* l is the lag of friction behind slip that turns (:mod:`bipot.control.lag`), over the work of strain and friction
  together. It is zero in a plane and in first increments.

Kinks are those at which the proportions of rates change. Where only the pace changes (:mod:`bipot.scene.paces`), v_0
and the lengths before are those at the pace of the increment.

l is of order one, and the other terms are of order two where the solution is smooth. Errors of the motion stay in the
shape of the body, and those of later increments add to them: this is GATHERED. It and the other factors are calibrated:
with the increments that :mod:`bipot.control.pacing` makes of it the largest error of the curve is 0.3 to 3 times the
accuracy on the paper's mesh; it is less on coarse meshes, where errors cancel (studies/accuracy/paced.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bipot.advance import Advance
from bipot.control.lag import Lag, lag
from bipot.fem.kinematics import Kinematics
from bipot.increment import Near, Solved
from bipot.iterate import Increment
from bipot.response import Response
from bipot.scene.symmetry import own_share
from bipot.state import State
from bipot.typing import Floats, vdot
from bipot.yielding import flows, follows_yield, hardened, is_past_yield, strain_of, yield_strain

GATHERED = 2.5
"""The sum of the errors that increments leave, over the error of one."""

TURNED = 1.6e-3
"""Relative change of velocity, squared, up to which the motion counts as curved and not as an event."""

UNEVEN = 0.4
"""Factor of the variance of the first increment of peeq. The change of force by shorter ones, over the variance, is
0.3 to 1.4 in upset cylinders, rings and blocks, and 2 to 4 in a square and a rough slab, with ten times the variance.
"""

IN_HALVES = 1 / 3
"""Part of the error of a first increment in one piece that one leaves which carries on the flow of its first half."""

SETTLED, STORED = 1 / 6, 1 / 9
"""Stored parts of the work of a first increment: above the first the body still begins to yield; up to the second
nothing is left of that. The part is one over the strain in yield strains, and a third more in plane strain.
"""

SMALL = 1 / 3
"""A part of the body smaller than this does not show in a mean over all of it. Bands of shear take two fifths."""

PARTS = 8
"""Parts of an increment's strain whose returns show the error of a single one."""


def unevenness(near: Near) -> float:
    """T of a first increment in one piece: UNEVEN times the variance of its increment of peeq (module docstring)."""
    return _varied(near.response, near.response.returned.dpeeq)


def error_estimate(start: State, solved: Solved, last: bool = False) -> float:
    """The estimate (a fraction) of the increment ``solved`` from the accepted ``start``, before flow was carried on.

    ``last`` says that it ends at a scheduled pseudo-time, where an event counts in full.
    """
    e = _Terms(start, solved, last)
    return GATHERED * (e.missed + e.strained + e.curved) + e.yielding + e.lagging


@dataclass(frozen=True)
class _Terms:
    """The terms of the estimate of the increment ``solved`` from the accepted ``start`` (module docstring)."""

    start: State
    solved: Solved
    last: bool

    @property
    def missed(self) -> float:
        """|sum_q w (sigma_E - sigma) : de| / (2 sum_q w |sigma : de|), with the work of friction in space."""
        if not self._taken > 0 or self.start.length == 0 or self._increment.in_halves:
            return 0.0
        difference = np.vecdot(self._euler - self._stress, self._kin.strain)
        return abs(vdot(self._kin.volume, difference)) / 2 / (self._taken + self._lag.friction)

    @property
    def strained(self) -> float:
        """S, plus T in a first increment."""
        strain = self._kin.strain
        square = vdot(_weight(self.solved.response), np.vecdot(strain, strain)) / 12
        return square + self._uneven if self._first else square

    @property
    def curved(self) -> float:
        """T of an increment that is not the first of its path, where the body has long yielded."""
        if self._first or not (self._yields and self._has_yielded):
            return 0.0
        curvature = min(self._velocity_change, 1.0 if self.last else TURNED) / 10
        return min(curvature, self._uneven) if follows_yield(self._increment) else curvature

    @property
    def yielding(self) -> float:
        """Y, where the body has not long yielded, or may not have in an increment from rest."""
        if not self._yields:
            return 0.0
        # From rest the body may have settled at strains at which most still yield.
        stored_tells = self.start.length == 0 and not self._increment.loads.changes
        if self._has_yielded:
            return self._settles if self._first and stored_tells else 0.0
        # Where flow was carried on, the difference of its stress from Euler's counts already.
        uncarried = (self.solved.response.state.stress == self.start.stress).all(axis=-1)
        missed = np.vecdot(self._returned(PARTS) - self._euler, self._kin.strain)
        begun = abs(vdot(self._kin.volume * uncarried, missed)) / self._taken if self._taken > 0 else 0.0
        return begun + (self._settles if stored_tells else self._begins)

    @property
    def lagging(self) -> float:
        """l."""
        return 0.0 if self._first else self._lag.share(self._taken)

    @cached_property
    def _lag(self) -> Lag:
        return lag(self.start, self.solved)

    @property
    def _increment(self) -> Increment:
        return self.solved.iterate.increment

    @property
    def _kin(self) -> Kinematics:
        return self.solved.response.kinematics

    @property
    def _stress(self) -> Floats:
        """sigma (e, q, s)."""
        return self.solved.response.returned.stress

    @property
    def _first(self) -> bool:
        """Whether the increment starts from rest or at a kink that is no change of pace."""
        return self.start.length == 0 or self._increment.past.turns

    @cached_property
    def _yields(self) -> bool:
        return flows(self.solved.iterate)

    @cached_property
    def _has_yielded(self) -> bool:
        return is_past_yield(self._increment)

    @cached_property
    def _taken(self) -> float:
        """sum_q w |sigma : de|."""
        return float(_power(self.solved.response).sum())

    @cached_property
    def _euler(self) -> Floats:
        """sigma_E (e, q, s); where no flow was carried on it is sigma to the last bit."""
        return self._returned(1)

    def _returned(self, parts: int) -> Floats:
        """The stress (e, q, s) of radial returns from the start, of the strain in equal ``parts``."""
        kin, update = self._kin, self._increment.system.body.scene.materials.update
        stress, peeq = kin.turned(self.start.stress), self.start.peeq
        for _ in range(parts):
            part = update(stress, kin.strain / parts, peeq)
            stress, peeq = part.stress, peeq + part.dpeeq
        return stress

    @property
    def _begins(self) -> float:
        """Y of a body that begins to yield (module docstring)."""
        part = self._dissipated if self._first else 1.0
        return min(math.sqrt(self._velocity_change), 1.0) * part * min(self._over_yield, 1.0) / 20

    @property
    def _settles(self) -> float:
        """Y of an increment from rest, by the part of its work that is stored (module docstring)."""
        flowed = self._dissipated
        if 1 - flowed > SETTLED:
            return self._begins
        order = 1 if (self._increment.tools.turned != 0).any() else 2
        return flowed * max((1 - flowed) ** order - STORED**order, 0.0) / 10

    @property
    def _uneven(self) -> float:
        """T of a first increment: by how unevenly it strains the body; of a second one without what is carried on."""
        if not self._increment.in_halves:
            return unevenness(self.solved)
        response = self.solved.response
        return IN_HALVES * _varied(response, response.peeq - self.start.peeq)

    @property
    def _over_yield(self) -> float:
        """h, not yet bounded by one (module docstring)."""
        known, at_yield = strain_of(self._increment), yield_strain(self._increment.system, hardened(self._increment))
        if not self._increment.loads.changes:
            return known / at_yield
        volume = self._kin.volume
        # Loads may strain the body where tools and supports hardly move.
        present, plastic = (
            math.sqrt(vdot(volume, np.vecdot(strain, strain)) / float(volume.sum()))
            for strain in (self._kin.strain, self.start.plastic_strain)
        )
        return max(known / at_yield, present / (at_yield + plastic))

    @property
    def _velocity_change(self) -> float:
        """|v - v_0|^2 / |v|^2; one from rest; after a kink, which changes all rates, with v_0 as long as v."""
        start, increment = self.start, self._increment
        if start.length == 0:
            return 1.0
        # How supports and tools carry the body would hide its own motion.
        carried = Advance(increment.system.candidates, replace(start, tau=start.tau - start.length), start.tau)
        now = (self.solved.response.du - increment.tools.gone) / (increment.tau - start.tau)
        then = increment.past.quicker * (start.velocity - carried.gone / start.length)
        scene = increment.system.body.scene
        part = own_share(scene.planes, scene.mesh.nodes[:, None])
        size = _square(part, now)
        if increment.past.turns and (before := _square(part, then)) > 0:
            then = then * math.sqrt(size / before)
        return _square(part, now - then) / size if size > 0 else 0.0

    @property
    def _dissipated(self) -> float:
        """The part of sum_q w |sigma : de| that is dissipated by new plastic flow."""
        response = self.solved.response
        carried = self._kin.turned(response.state.plastic_strain - self.start.plastic_strain)
        strains = self._kin.strain, response.returned.plastic_strain + carried
        taken, flowed = (vdot(self._kin.volume, np.abs(np.vecdot(self._stress, strain))) for strain in strains)
        return min(flowed / taken, 1.0) if taken > 0 else 0.0


def _power(response: Response) -> Floats:
    """w |sigma : de| (e, q)."""
    return response.kinematics.volume * np.abs(np.vecdot(response.returned.stress, response.kinematics.strain))


def _weight(response: Response) -> Floats:
    """Weights (e, q) of the mean over the body, or over the work if less than SMALL of the body takes it."""
    volume, power = response.kinematics.volume, _power(response)
    small = float(power.sum()) ** 2 < SMALL * float(volume.sum()) * vdot(power, power / volume)
    weight = power if small else volume
    return weight / float(weight.sum())


def _varied(response: Response, flowed: Floats) -> float:
    """UNEVEN times the variance of the increment ``flowed`` (e, q) of peeq."""
    weight = _weight(response)
    return UNEVEN * vdot(weight, (flowed - vdot(weight, flowed)) ** 2)


def _square(part: Floats, velocity: Floats) -> float:
    """|v|^2 of the whole body's nodes, of which ``part`` (a,) each are modelled, with ``velocity`` (a, d)."""
    return vdot(part, np.vecdot(velocity, velocity))
