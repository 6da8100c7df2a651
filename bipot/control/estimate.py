r"""An estimate of the error that an increment adds to the force.

It is a fraction of the force,

    e = GATHERED (|sum_q w (sigma_E - sigma) : de| / (2 sum_q w |sigma : de|)  +  S  +  T)  +  Y  +  l.

* sigma_E is the stress of a radial return from the start for the same motion (backward Euler, of order one in the
  flow), sigma that of the flow carried on. The force is stationary in the direction of flow, so their difference in
  power is of order two in the increment, like the error of the flow carried on. In space its measure is the work of
  strain and friction together, as that of l is: where friction does the work, what is left of strain says nothing.
* S is the mean of |de|^2/12 over the body: the difference of the midpoint strain from the logarithmic one,
  2 tanh(x/2) = x - x^3/12 + ... Where less than SMALL of the body takes the work, as a stem on a block does, or what is
  beneath a punch in a large one, S is the mean over the work, what the power misses. That part is (sum_q p)^2 over
  sum_q w sum_q p^2/w with p = w |sigma : de|.
* T = min(|v - v_0|^2 / |v|^2, TURNED) / 10 with v, v_0 the nodal velocities of the whole body, of this increment and
  the last, beyond those at which supports and tools carry it: the curvature of the motion. A change by more than TURNED
  is an event (a landing) that does not depend on the length of increments. Where nothing flows, T is zero. In the first
  increment after rest or a kink, of which no velocity before tells anything, T is UNEVEN times the variance of the
  increment of peeq over what S is: the more unevenly a body is strained, the more its motion changes by that. An upset
  cylinder has a tenth of what a square between nearly smooth tools has, in which bands of shear form. The mean velocity
  of a first increment that went past first yield is of both sides of that; T of the second is the less of the two.
* An increment that ends before the body has long yielded, by its strain since rest or a kink
  (:func:`bipot.control.yielding.yielded_strain`), ends where the body begins to yield, while the force still follows
  the strain of what has not yielded. There, instead of T, Y = |v - v_0|/|v| h/20, and not more than h/20, with h <= 1
  the strain of the increment over that at yield. Where loads, or forces on tools, change, h is no less than the body's
  strain in the increment (root of the mean square) over that at yield and the plastic strain so far together, because
  then the force is given and the error one of the displacement. Where these alone strain the body, it yields bit by bit
  to the end, and Y counts throughout. In the first increment |v - v_0|/|v| is one after rest, that of directions after
  a kink, and it counts by D, the part of sum_q w |sigma : de| that is dissipated. What yields there has no flow to
  carry on: |sum_q w (sigma_E - sigma_P) : de| / sum_q w |sigma : de| is added to Y, sigma_P of returns in PARTS parts.
* What an increment from rest stores, 1 - D of its work, says whether the body has long yielded, however far it was
  strained: one that tools or supports confine stores pressure to the end. Evenly strained it is one over the strain in
  yield strains. Where it is no more than SETTLED, Y is what remains of yielding, D ((1 - D)^2 - STORED^2)/10. Else Y is
  that of a body that begins to yield, whatever it is strained by. The power of the tools is stationary in the direction
  of flow, the force of one that presses and turns is not: beneath tools that turn the two parts are not squared. Where
  loads change, and after a kink, strain alone tells as above.
* l is by how much friction lags behind slip that turns (:mod:`bipot.control.lag`), zero in a plane. It is measured
  against the work of strain and friction together.

Kinks are those at which rates come into other proportions. Where only the pace changes (:mod:`bipot.scene.paces`),
v_0 and the lengths before are those at the pace of the increment.

l is of order one, and the other terms are of order two where the solution is smooth. Errors of the motion stay in the
shape of the body, and those of later increments add to them, which is GATHERED. It and the other factors are
calibrated: with the increments that :mod:`bipot.control.pacing` makes of it the largest error of the curve is 0.3 to 3
times the accuracy on the paper's mesh; it is less on coarse meshes, where errors cancel (studies/accuracy/paced.py).
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
"""What the errors that increments leave come to over that of one."""

TURNED = 1.6e-3
"""Relative change of velocity, squared, up to which the motion counts as curved and not as an event."""

UNEVEN = 0.4
"""Of the variance of the first increment of peeq. Over it, what shorter ones change in the force is 0.3 to 1.4 in upset
cylinders, rings and blocks, and 2 to 4 in a square and a rough slab, which have about ten times the variance.
"""

SETTLED, STORED = 1 / 6, 1 / 9
"""Parts of its work that a first increment stores: beyond the first the body still yields; up to the second nothing is
left of yielding. It is one over the strain in yield strains, and a third more in plane strain.
"""

SMALL = 1 / 3
"""Part of the body, less of which a mean over all of it does not show. Bands of shear take two fifths."""

PARTS = 8
"""Of an increment's strain in which a radial return shows how long that is for it."""


def error_estimate(start: State, solved: Solved) -> float:
    """The estimate (a fraction) of the increment ``solved`` from the accepted ``start``, before flow was carried on."""
    increment, response = solved.iterate.increment, solved.response
    kin, sigma = response.kinematics, response.returned.stress
    flows = bool(response.returned.plastic.any())
    # Where nothing flows both stresses are one, but for round-off, which may be all that an unloaded body has left.
    euler = _returned(start, solved, 1) if flows or response.state is not start else sigma
    power = kin.volume * np.abs(np.vecdot(sigma, kin.strain))
    taken = float(power.sum())
    missed = abs(vdot(kin.volume, np.vecdot(euler - sigma, kin.strain)))
    behind = lag(start, solved)
    gathered = (missed / 2 / (taken + behind.friction) if taken > 0 else 0.0) + _strained(solved, power)
    lagging = 0.0 if _is_first(increment) else behind.share(taken)
    bends = flows and is_strained(solved)
    if is_past_yield(increment):
        if _is_first(increment):
            return GATHERED * gathered + (_settles(start, solved) if bends and _is_told(increment) else 0.0)
        bent = min(_turned(increment, start, solved), TURNED) / 10 if bends else 0.0
        if follows_yield(increment):
            bent = min(bent, _uneven(solved, power))
        return GATHERED * (gathered + bent) + lagging
    # From rest the body may have settled before it ends within the strains of yielding.
    ends = _settles if _is_told(increment) else _begins
    # Where flow was carried on, that is the better one of the two.
    alone = flows * np.asarray((response.state.stress == start.stress).all(axis=-1))
    begun = abs(vdot(kin.volume * alone, np.vecdot(_returned(start, solved, PARTS) - euler, kin.strain)))
    begun = (begun / taken if taken > 0 else 0.0) + (ends(start, solved) if bends else 0.0)
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
    """Whether it starts from rest or at a kink that is no change of pace."""
    return increment.start.length == 0 or increment.past.turns


def _begins(start: State, solved: Solved) -> float:
    """|v - v_0|/|v| h/20 (module docstring)."""
    increment = solved.iterate.increment
    part = _dissipated(solved) if _is_first(increment) else 1.0
    return min(math.sqrt(_turned(increment, start, solved)), 1.0) * part * min(_over_yield(start, solved), 1.0) / 20


def _is_told(increment: Increment) -> bool:
    """Whether what it stores tells how far the body has yielded: from rest, where tools and supports strain it."""
    return increment.start.length == 0 and not increment.loads.changes


def _settles(start: State, solved: Solved) -> float:
    """Y of an increment from rest by what it stores (module docstring)."""
    increment, flowed = solved.iterate.increment, _dissipated(solved)
    if 1 - flowed > SETTLED:
        return _begins(start, solved)
    order = 1 if (increment.tools.turned != 0).any() else 2
    left = max((1 - flowed) ** order - STORED**order, 0.0)
    return flowed * left / 10


def _strained(solved: Solved, power: Floats) -> float:
    """S, and in a first increment its T, where points (e, q) take a ``power``."""
    strain = solved.response.kinematics.strain
    square = vdot(_weight(solved, power), np.vecdot(strain, strain)) / 12
    return square + _uneven(solved, power) if _is_first(solved.iterate.increment) else square


def _uneven(solved: Solved, power: Floats) -> float:
    """T by how unevenly the increment strains the body."""
    weight, flowed = _weight(solved, power), solved.response.returned.dpeeq
    return UNEVEN * vdot(weight, (flowed - vdot(weight, flowed)) ** 2)


def _weight(solved: Solved, power: Floats) -> Floats:
    """Of the mean over the body, or over the work where less of it than SMALL takes that."""
    volume = solved.response.kinematics.volume
    small = float(power.sum()) ** 2 < SMALL * float(volume.sum()) * vdot(power, power / volume)
    weight = power if small else volume
    return weight / float(weight.sum())


def _over_yield(start: State, solved: Solved) -> float:
    """h (module docstring)."""
    increment, at_yield = solved.iterate.increment, yield_strain(solved.iterate.increment.system)
    known = strain_of(increment)
    # Beside tools and supports that hardly move, loads may be what strains the body.
    if not increment.loads.changes:
        return known / at_yield
    volume = solved.response.kinematics.volume
    own, plastic = (
        math.sqrt(vdot(volume, np.vecdot(strain, strain)) / float(volume.sum()))
        for strain in (solved.response.kinematics.strain, start.plastic_strain)
    )
    return max(known / at_yield, own / (at_yield + plastic))


def _turned(increment: Increment, start: State, solved: Solved) -> float:
    """|v - v_0|^2 / |v|^2, one from rest; after a kink, where rates are others, that of directions."""
    if start.length == 0:
        return 1.0
    scene = increment.system.body.scene
    part = own_share(scene.planes, scene.mesh.nodes[:, None])

    def square(velocity: Floats) -> float:
        return vdot(part, np.vecdot(velocity, velocity))

    # A body that supports and tools carry moves no less for that.
    before = Advance(increment.system.candidates, replace(start, tau=start.tau - start.length), start.tau)
    now = (solved.response.du - increment.tools.gone) / (increment.tau - start.tau)
    then = increment.past.quicker * (start.velocity - before.gone / start.length)
    if increment.past.turns:
        size = square(then)
        then = then * math.sqrt(square(now) / size) if size > 0 else then
    size = square(now)
    return square(now - then) / size if size > 0 else 0.0


def _dissipated(solved: Solved) -> float:
    """The part of sum_q w |sigma : de| that new plastic flow takes up."""
    kin, returned = solved.response.kinematics, solved.response.returned
    taken, flowed = (
        vdot(kin.volume, np.abs(np.vecdot(returned.stress, strain))) for strain in (kin.strain, returned.plastic_strain)
    )
    return min(flowed / taken, 1.0) if taken > 0 else 0.0
