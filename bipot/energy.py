r"""Energy of a run: external work against elastic energy, plastic and frictional dissipation.

Every part weighs the start of an increment by 1 - theta and its end by theta:

    work      f . dU + r_n dgap,         f   = (1 - theta) f_0 + theta f_1,         r likewise,
    elastic   sum_q S : C^-1 dsigma,     S   = (1 - theta) w_0 R sigma_0 R' + theta w_1 sigma_1,
    plastic   sum_q S : de_p,            dsigma = sigma_1 - R sigma_0 R',
    friction  - sum_c b r_t . du_t + (1 - theta) g,

with f the forces of tools, loads and supports at the points that they move (for turning tools, those where candidates
are halfway; at tau = 0 those that the body carries, at rest none), r those of the candidates, de_p
the flow as stored, and w_0 = w_1 exp(-tr de), or w_1 in the ``paper`` configuration, whose strain is that of x_n. The
forces f_0 are those that were in balance at the start (in ``paper`` on x_{n-1}), so that no work is done on a body that
is carried along as a whole. The term r_n dgap removes the work that the mean force of an opening or closing contact
would do across its gap; it is zero elsewhere. For a candidate that comes to a curved tool through the air the work is
f . du - r_t . du_t, which is what the body takes up; for a flat tool this is the same.

The term g corrects the start's part of friction,

    g = sum_c b (s_0 |du_t| + r_t0 . du_t),        s_0 = min(mu r_n0, cap_0),

to that of a force that opposes the slip at its limit, with cap_0 that of the start: the force r_t0 of a point that
sticks, or that slid in another direction, is not such a force. The term is the gap of the bipotential between force and
slip, never negative. It is zero where a point slides on in its direction, of order three in the increment where the
direction turns smoothly, and 2 s_0 |du_t| where it reverses. A point that was open has s_0 = 0, and a weld does not
slip. Where friction at the end is below its limit the point has not slid: its motion is the creep of a penalty or a
remainder of zero. Tools move on against the corrected force, and through the air against none: what friction is more
than - r_t . du_t is added to work too, and the balance is as it would be without.

Slip in the air is no friction. A tool that moves steadily along the normal, from where it leaves a point or to where it
lands on it, is in touch as long as the point follows it. Of its slip the part

    b = |v| / (|v| + a),        v = n . (du - du_0) less what a penalty lets it sink,

rubs, with a the gap that opens, or that closes while a point slips, and du_0 the motion of a body that its supports and
the other tools carry and that is otherwise at rest (:mod:`bipot.borne`). At a deformable tool v is how the two sides go
to each other, du_0 that of parts that their own supports carry. Where curved tools come to points, slips begin where
they touch (:mod:`bipot.tools.meeting`): no gap is left to close. A point may come before a deformable tool, or leave
it, by sliding past an end (:func:`passing`). It has slipped in touch then, in the means of where it faces the tool, and
what a rounded end is farther off is no air.

The ``start`` is the accepted state; an increment of BDF2 is solved from another one, with the flow carried on.

With theta = 1/2 the elastic part is the stored energy sigma : C^-1 sigma/2, up to the effect of the change of volume (a
fraction sigma/E), and in ``midpoint`` work = elastic + plastic + friction to order two in the increment where the
solution is smooth. With theta = 1 in ``paper`` and flat tools, the identity holds increment by increment to round-off
and the certificate, because it is equilibrium at the end tested with dU. The elastic part then exceeds the stored
energy by sum_q w/2 dsigma : C^-1 dsigma, the dissipation of backward differences.

All energies are those of the whole body: those of the modelled part times its number of images.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from bipot.borne import HOLDS
from bipot.contact.closeness import touches
from bipot.contact.shear import caps
from bipot.contact.supported import rubbed
from bipot.fem.assembly import element_force
from bipot.increment import Solved
from bipot.iterate import Increment, Iterate
from bipot.schedule import ROUND_OFF
from bipot.state import State
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Bools, Floats, vdot


class Rule(Enum):
    """theta: the weight of an increment's end in its energies."""

    TRAPEZOIDAL = 0.5
    END = 1.0


@dataclass(frozen=True)
class Energies:
    """External work, elastic energy, plastic and frictional dissipation of the whole body since the start (energy)."""

    work: float = 0.0
    elastic: float = 0.0
    plastic: float = 0.0
    friction: float = 0.0

    @property
    def imbalance(self) -> float:
        """work - (elastic + plastic + friction), energy units."""
        return self.work - (self.elastic + self.plastic + self.friction)

    @property
    def energy_error(self) -> float:
        """:attr:`imbalance` over the accumulated work, a fraction; 0 where no work was done."""
        return self.imbalance / self.work if self.work != 0 else 0.0

    def after(self, start: State, end: State, solved: Solved, rule: Rule = Rule.TRAPEZOIDAL) -> Energies:
        """Add the increment from ``start`` to ``end``, solved by ``solved``."""
        increment = solved.iterate.increment
        system = increment.system
        theta, kin, scene = rule.value, solved.response.kinematics, system.body.scene
        before, plastic_before = kin.turned(start.stress), kin.turned(start.plastic_strain)
        S = (1 - theta) * kin.volume_before[..., None] * before + theta * kin.volume[..., None] * end.stress
        elastic = scene.materials.elasticity.strain(end.stress - before)
        r = (1 - theta) * start_forces(start, increment) + theta * solved.iterate.rubbed(solved.r)
        slip, by_sliding = passing(start, solved.iterate, solved.r)
        against = np.vecdot(r[:, 1:], slip)
        touching = np.maximum(in_touch(start, solved.iterate, solved.r), by_sliding)
        in_air = float((1 - touching) @ against)
        corrected = in_air + (1 - theta) * missing_friction(start, solved.iterate, solved.r, touching, slip)
        load = (1 - theta) * start_loads(start, increment) + theta * solved.iterate.nodal_load
        loads = vdot(load, end.du) + _driven(start, solved, theta)
        parts = {
            "work": _tools(start, solved, r, theta) + loads + corrected,
            "elastic": vdot(S, elastic),
            "plastic": vdot(S, end.plastic_strain - plastic_before),
            "friction": corrected - float(against.sum()),
        }
        return Energies(**{name: getattr(self, name) + scene.images * part for name, part in parts.items()})


def _tools(start: State, solved: Solved, r: Floats, theta: float) -> float:
    """Work of the tools against mean contact forces r (c, d), with the work across gaps that open or close.

    A candidate that comes to a curved tool through the air does not move along its force at the end: its work is what
    the body takes up and what the slip dissipates.
    """
    increment, motion = solved.iterate.increment, solved.iterate.motion
    contacts = increment.system.candidates
    pushed, travel = _pushed(start, solved, r, theta), solved.iterate.tool_travel
    opened = motion[:, 0] - opening(start, solved.iterate, solved.r)
    parts, du = contacts.parts, solved.response.du
    gone = travel[contacts.tool[parts.owner]] + increment.tools.carried(du, solved.iterate.advance)
    taken = parts.sums(np.vecdot(pushed, contacts.met.motion(du))) - np.vecdot(r[:, 1:], solved.iterate.slipped)
    done = parts.sums(np.vecdot(pushed, gone)) + r[:, 0] * opened
    closing = ~increment.tools.closed
    return float(np.where(closing, taken, done).sum())


def _pushed(start: State, solved: Solved, r: Floats, theta: float) -> Floats:
    """Mean vectors (w, d) of the contact forces, whose components in frames that may turn have the mean r (c, d)."""
    increment = solved.iterate.increment
    contacts = increment.system.candidates
    before = contacts.vectors(start_forces(start, increment), increment.tools.frames)
    return (1 - theta) * before + theta * contacts.vectors(solved.iterate.rubbed(solved.r), solved.iterate.frames)


def _driven(start: State, solved: Solved, theta: float) -> float:
    """Work of the supports on their prescribed displacements."""
    increment = solved.iterate.increment
    driven, system = increment.tools.driven, increment.system
    if not driven.any():
        return 0.0
    body = system.body
    placed = body.space.gradients(balanced_at(start, increment))
    contacts = system.candidates.vectors(start_forces(start, increment), increment.tools.frames)
    before = system.reactions(element_force(placed, start.stress), start_loads(start, increment), contacts)
    return vdot((1 - theta) * before + theta * solved.iterate.reactions(solved.r), driven)


def balanced_at(start: State, increment: Increment) -> Floats:
    """The configuration (a, d) in which the start is in equilibrium."""
    return increment.system.body.scene.balanced(start.nodes - start.du, start.du)


def start_loads(start: State, increment: Increment) -> Floats:
    """Nodal loads (a, d) with which the start is in equilibrium; none at rest."""
    loads = increment.loads
    if loads.begins or loads.others is not None:
        return loads.before
    return increment.system.loading.forces(balanced_at(start, increment), start.tau)


def start_forces(start: State, increment: Increment) -> Floats:
    """Contact forces (c, d) of the start, with friction between tool and support against the increment's slip."""
    return rubbed(start.forces, lambda: start_limit(start, increment), increment.dragged)


def ended_forces(system: System, state: State) -> Floats:
    """Contact forces (c, d) of a state, with friction between tool and support against the slip that led there.

    That friction is no part of the state.
    """
    scene, begun = system.body.scene, state.tau - state.length
    # An increment that began at a kink, but for round-off of its length, has no motion from before the kink.
    begun = next((kink for kink in scene.kinks if abs(kink - begun) <= ROUND_OFF), begun)
    slip = Increment(system, replace(state, tau=begun), state.tau).dragged
    return rubbed(state.forces, lambda: start_limit(state, Increment(system, state, state.tau)), slip)


def start_limit(start: State, increment: Increment) -> Floats:
    """Largest friction forces s_0 (c,) under the forces of the start, with the caps there; 0 where tied."""
    rows, contacts = increment.rows, increment.system.candidates
    if contacts.capped:
        nodes = balanced_at(start, increment)
        volume = increment.system.body.space.gradients(nodes).volume
        rows = replace(rows, cap=caps(contacts, start.peeq, volume, nodes, start.nodes, increment.tools.placed))
    return np.where(rows.tied, 0.0, rows.limit(start.forces))


def held(start: State, iterate: Iterate, r: Floats) -> Bools:
    """Candidates (c,) that bear forces at the start and r (c, d) at the end: they stay in touch."""
    faces = np.isfinite(iterate.increment.tools.farther).all(axis=0)
    return np.asarray(start.forces.any(axis=1) & r.any(axis=1) & faces)


def opening(start: State, iterate: Iterate, r: Floats) -> Floats:
    """Gaps (c,) of the start, from which those of points with forces r (c, d) open to the end."""
    return np.where(held(start, iterate, r), start.gap, iterate.increment.tools.opening)


def passing(start: State, iterate: Iterate, r: Floats) -> tuple[Floats, Floats]:
    """Slips (c, d - 1), and the part (c,) that rubs of those by which points come before deformable tools, or go.

    Of a point that faces it, beside a rounded end, at one end of the increment alone the slip is that in the means
    there. One that comes with a gap a rubs by |u_t| / (|u_t| + a) of its slip, one that goes by all of it. The part is
    zero of other points.
    """
    increment, slip = iterate.increment, iterate.slipped
    part = np.zeros(len(slip))
    if not increment.system.candidates.deformable:
        return slip, part
    contacts, (begun, ended), stays = increment.system.candidates, increment.tools.farther, held(start, iterate, r)
    come = (begun > 0) & np.isfinite(ended) & ~stays
    gone = np.isfinite(begun) & (ended > 0) & ~stays & ~come
    if gone.any():
        before = increment.system.facing(start.nodes).candidates
        tangents = before.frames_at(start.nodes, increment.tools.placed)[before.parts.first[gone], 1:]
        moved = before.means.motion(iterate.response.du)[gone]
        slip = slip.copy()
        slip[gone] = np.where(contacts.tangent_free[gone, None], (tangents @ moved[..., None])[..., 0], 0.0)
    length = norm(slip)
    way = length + np.maximum(opening(start, iterate, r), 0.0)
    np.divide(length, way, out=part, where=come & (way > 0))
    part[gone] = 1.0
    return slip, part


def missing_friction(start: State, iterate: Iterate, r: Floats, touching: Floats, slip: Floats) -> float:
    """The term g of the module docstring (energy), for the ``slip`` (c, d - 1) to the end, with forces r (c, d) there.

    Of the slip the part b, ``touching`` (c,), rubs (:func:`in_touch`).
    """
    increment, ended = iterate.increment, iterate.rubbed(r)
    begun = start_forces(start, increment)
    sticks = norm(ended[:, 1:]) < iterate.rows.limit(r) - HOLDS * float(norm(ended).max(initial=0.0))
    gap = start_limit(start, increment) * norm(slip) + np.vecdot(begun[:, 1:], slip)
    return float(gap[~sticks] @ touching[~sticks])


def in_touch(start: State, iterate: Iterate, r: Floats) -> Floats:
    """The part b (c,) of slips to the end, with forces r (c, d), that is not in the air (module docstring).

    It is one where no gap opens or closes, and where there is a force neither at the start nor at the end.
    """
    contacts, size = iterate.increment.system.candidates, iterate.increment.system.body.scene.size
    begun, ended = opening(start, iterate, r), iterate.motion[:, 0]
    left = iterate.increment.tools.left(iterate.advance)
    air = np.where(touches(np.minimum(begun, left), size), 0.0, left) + np.where(touches(ended, size), 0.0, ended)
    aloft, out = (air > 0) & (start.forces.any(axis=1) | r.any(axis=1)), np.ones(len(air))
    if aloft.any():
        by = contacts.met.motion(iterate.response.du) - iterate.increment.tools.taken
        followed = contacts.parts.gathered(np.vecdot(iterate.increment.tools.frames[:, 0], by))
        sunk = np.minimum(ended, 0.0) - np.minimum(begun, 0.0)
        followed = np.abs(followed - sunk)
        out[aloft] = followed[aloft] / (followed + air)[aloft]
    return out
