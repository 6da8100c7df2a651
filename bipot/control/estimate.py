r"""An estimate of the error that an increment adds to the force.

It is a fraction of the force,

    e = GATHERED (|sum_q w (sigma_E - sigma) : de| / (2 sum_q w |sigma : de|)  +  S  +  T)  +  Y  +  l.

* sigma_E is the stress of a radial return from the start for the same motion (backward Euler, of order one in the
  flow), sigma that of the flow carried on. The force is stationary in the direction of flow, so the difference of their
  powers is of order two in the increment, like the error of the flow carried on. In space the work of friction is added
  to that of strain in the denominator: where friction does the work, the small rest that strain does means nothing.
* S is the mean of |de|^2/12 over the body: the difference of the midpoint strain from the logarithmic one,
  2 tanh(x/2) = x - x^3/12 + ... Where less than SMALL of the body takes the work, as in a stem on a block or beneath a
  punch in a large body, S is the mean weighted by the work. The part of the body that takes the work is
  (sum_q p)^2 / (sum_q w sum_q p^2/w) with p = w |sigma : de|.
* T = min(|v - v_0|^2 / |v|^2, TURNED) / 10 is the curvature of the motion, with v, v_0 the velocities of the whole
  body's nodes in this increment and the last, beyond those at which supports and tools carry it. A change by more than
  TURNED is an event (a landing) that does not depend on the length of increments. Where nothing flows, T is zero. A
  first increment, after rest or a kink, has no velocity before it: there T is UNEVEN times the variance of the
  increment of peeq, with the weights of S. The more unevenly a body is strained, the more its motion changes: an upset
  cylinder has a tenth of the variance of a square between nearly smooth tools, in which bands of shear form. A first
  increment past first yield has a mean velocity of both sides of it, so T of the second is the less of the two.
* An increment that ends before the body has long yielded, by its strain since rest or a kink
  (:func:`bipot.control.yielding.yielded_strain`), ends where the body begins to yield, while the force still follows
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
from dataclasses import replace

import numpy as np

from bipot.advance import Advance
from bipot.control.lag import lag
from bipot.control.yielding import follows_yield, is_past_yield, is_strained, strain_of, yield_strain
from bipot.increment import Solved
from bipot.iterate import Increment
from bipot.response import State
from bipot.scene.symmetry import own_share
from bipot.typing import Floats, vdot

GATHERED = 2.5
"""The sum of the errors that increments leave, over the error of one."""

TURNED = 1.6e-3
"""Relative change of velocity, squared, up to which the motion counts as curved and not as an event."""

UNEVEN = 0.4
"""Factor of the variance of the first increment of peeq. The change of force by shorter ones, over the variance, is
0.3 to 1.4 in upset cylinders, rings and blocks, and 2 to 4 in a square and a rough slab, with ten times the variance.
"""

SETTLED, STORED = 1 / 6, 1 / 9
"""Stored parts of the work of a first increment: above the first the body still begins to yield; up to the second
nothing is left of that. The part is one over the strain in yield strains, and a third more in plane strain.
"""

SMALL = 1 / 3
"""A part of the body smaller than this does not show in a mean over all of it. Bands of shear take two fifths."""

PARTS = 8
"""Parts of an increment's strain whose returns show the error of a single one."""


def error_estimate(start: State, solved: Solved) -> float:
    """The estimate (a fraction) of the increment ``solved`` from the accepted ``start``, before flow was carried on."""
    increment, response = solved.iterate.increment, solved.response
    kin, sigma = response.kinematics, response.returned.stress
    first, flows = _is_first(increment), bool(response.returned.plastic.any())
    # Where nothing flows the stresses differ by round-off, which may be all that an unloaded body has left.
    euler = _returned(start, solved, 1) if flows or response.state is not start else sigma
    power = kin.volume * np.abs(np.vecdot(sigma, kin.strain))
    taken = float(power.sum())
    missed = abs(vdot(kin.volume, np.vecdot(euler - sigma, kin.strain)))
    friction = lag(start, solved)
    gathered = (missed / 2 / (taken + friction.friction) if taken > 0 else 0.0) + _strained(solved, power)
    lagging = 0.0 if first else friction.share(taken)
    yields, stored_tells = flows and is_strained(solved), increment.start.length == 0 and not increment.loads.changes
    if is_past_yield(increment):
        if first:
            return GATHERED * gathered + (_settles(start, solved) if yields and stored_tells else 0.0)
        curvature = min(_velocity_change(increment, start, solved), TURNED) / 10 if yields else 0.0
        if follows_yield(increment):
            curvature = min(curvature, _uneven(solved, power))
        return GATHERED * (gathered + curvature) + lagging
    # From rest the body may have settled at strains at which most still yield.
    yielding = _settles if stored_tells else _begins
    # Where flow was carried on, the difference of its stress from Euler's counts already.
    uncarried = flows * np.asarray((response.state.stress == start.stress).all(axis=-1))
    begun = abs(vdot(kin.volume * uncarried, np.vecdot(_returned(start, solved, PARTS) - euler, kin.strain)))
    begun = (begun / taken if taken > 0 else 0.0) + (yielding(start, solved) if yields else 0.0)
    return GATHERED * gathered + begun + lagging


def _returned(start: State, solved: Solved, parts: int) -> Floats:
    """The stress (e, q, s) of radial returns from the start, of the strain in equal ``parts``."""
    kin, update = solved.response.kinematics, solved.iterate.increment.system.body.scene.material.update
    stress, peeq = kin.turned(start.stress), start.peeq
    for _ in range(parts):
        part = update(stress, kin.strain / parts, peeq)
        stress, peeq = part.stress, peeq + part.dpeeq
    return stress


def _is_first(increment: Increment) -> bool:
    """Whether the increment starts from rest or at a kink that is no change of pace."""
    return increment.start.length == 0 or increment.past.turns


def _begins(start: State, solved: Solved) -> float:
    """Y of a body that begins to yield (module docstring)."""
    increment = solved.iterate.increment
    part, change = _dissipated(solved) if _is_first(increment) else 1.0, _velocity_change(increment, start, solved)
    return min(math.sqrt(change), 1.0) * part * min(_over_yield(start, solved), 1.0) / 20


def _settles(start: State, solved: Solved) -> float:
    """Y of an increment from rest, by the part of its work that is stored (module docstring)."""
    increment, flowed = solved.iterate.increment, _dissipated(solved)
    if 1 - flowed > SETTLED:
        return _begins(start, solved)
    order = 1 if (increment.tools.turned != 0).any() else 2
    left = max((1 - flowed) ** order - STORED**order, 0.0)
    return flowed * left / 10


def _strained(solved: Solved, power: Floats) -> float:
    """S, plus T in a first increment, where points take the work ``power`` (e, q)."""
    strain = solved.response.kinematics.strain
    square = vdot(_weight(solved, power), np.vecdot(strain, strain)) / 12
    return square + _uneven(solved, power) if _is_first(solved.iterate.increment) else square


def _uneven(solved: Solved, power: Floats) -> float:
    """T of a first increment: by how unevenly it strains the body."""
    weight, flowed = _weight(solved, power), solved.response.returned.dpeeq
    return UNEVEN * vdot(weight, (flowed - vdot(weight, flowed)) ** 2)


def _weight(solved: Solved, power: Floats) -> Floats:
    """Weights (e, q) of the mean over the body, or over the work if less than SMALL of the body takes it."""
    volume = solved.response.kinematics.volume
    small = float(power.sum()) ** 2 < SMALL * float(volume.sum()) * vdot(power, power / volume)
    weight = power if small else volume
    return weight / float(weight.sum())


def _over_yield(start: State, solved: Solved) -> float:
    """h, not yet bounded by one (module docstring)."""
    increment, at_yield = solved.iterate.increment, yield_strain(solved.iterate.increment.system)
    known = strain_of(increment)
    if not increment.loads.changes:
        return known / at_yield
    volume = solved.response.kinematics.volume
    # Loads may strain the body where tools and supports hardly move.
    present, plastic = (
        math.sqrt(vdot(volume, np.vecdot(strain, strain)) / float(volume.sum()))
        for strain in (solved.response.kinematics.strain, start.plastic_strain)
    )
    return max(known / at_yield, present / (at_yield + plastic))


def _velocity_change(increment: Increment, start: State, solved: Solved) -> float:
    """|v - v_0|^2 / |v|^2; one from rest; after a kink, which changes all rates, with v_0 as long as v."""
    if start.length == 0:
        return 1.0
    scene = increment.system.body.scene
    part = own_share(scene.planes, scene.mesh.nodes[:, None])

    def square(velocity: Floats) -> float:
        return vdot(part, np.vecdot(velocity, velocity))

    # How supports and tools carry the body would hide its own motion.
    carried = Advance(increment.system.candidates, replace(start, tau=start.tau - start.length), start.tau)
    now = (solved.response.du - increment.tools.gone) / (increment.tau - start.tau)
    then = increment.past.quicker * (start.velocity - carried.gone / start.length)
    if increment.past.turns:
        size = square(then)
        then = then * math.sqrt(square(now) / size) if size > 0 else then
    size = square(now)
    return square(now - then) / size if size > 0 else 0.0


def _dissipated(solved: Solved) -> float:
    """The part of sum_q w |sigma : de| that is dissipated by new plastic flow."""
    kin, returned = solved.response.kinematics, solved.response.returned
    taken, flowed = (
        vdot(kin.volume, np.abs(np.vecdot(returned.stress, strain))) for strain in (kin.strain, returned.plastic_strain)
    )
    return min(flowed / taken, 1.0) if taken > 0 else 0.0
