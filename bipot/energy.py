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
it, by sliding past an end (:attr:`Passage.past_ends`). It has slipped in touch then, in the means of where it faces the
tool, and what a rounded end is farther off is no air.

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
from functools import cached_property

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
from bipot.tools.pieces import Near
from bipot.typing import Bools, Floats, times, vdot


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
        theta, kin, scene = rule.value, solved.response.kinematics, solved.iterate.increment.system.body.scene
        before, plastic_before = kin.turned(start.stress), kin.turned(start.plastic_strain)
        S = (1 - theta) * kin.volume_before[..., None] * before + theta * kin.volume[..., None] * end.stress
        elastic = scene.materials.elasticity.strain(end.stress - before)
        passage = Passage(start, solved.iterate, solved.r, theta)
        loads = vdot(passage.mean(passage.loads, solved.iterate.nodal_load), end.du)
        corrected = float((1 - passage.touching) @ passage.against) + (1 - theta) * passage.missing_friction
        parts = {
            "work": passage.work_of_tools + loads + passage.work_of_supports + corrected,
            "elastic": vdot(S, elastic),
            "plastic": vdot(S, end.plastic_strain - plastic_before),
            "friction": corrected - float(passage.against.sum()),
        }
        return Energies(**{name: getattr(self, name) + scene.images * part for name, part in parts.items()})


@dataclass(frozen=True)
class Passage:
    """The candidates' way from the accepted ``start`` of an increment to its end, an ``iterate`` with forces r (c, d).

    ``theta`` is the weight of the end.
    """

    start: State
    iterate: Iterate
    r: Floats
    theta: float

    @property
    def increment(self) -> Increment:
        """The increment."""
        return self.iterate.increment

    def mean(self, begun: Floats, ended: Floats) -> Floats:
        """The mean of what is at the start and at the end."""
        return (1 - self.theta) * begun + self.theta * ended

    @cached_property
    def limit(self) -> Floats:
        """See :func:`start_limit`."""
        return start_limit(self.start, self.increment)

    @cached_property
    def begun(self) -> Floats:
        """Contact forces (c, d) of the start, with friction between tool and support against the increment's slip."""
        return rubbed(self.start.forces, lambda: self.limit, self.increment.dragged)

    @cached_property
    def ended(self) -> Floats:
        """Contact forces (c, d) of the end, with friction between tool and support."""
        return self.iterate.rubbed(self.r)

    @cached_property
    def loads(self) -> Floats:
        """Nodal loads (a, d) with which the start is in equilibrium; none at rest."""
        loads, system = self.increment.loads, self.increment.system
        if loads.begins or loads.others is not None:
            return loads.before
        return system.loading.forces(system.balanced(self.start), self.start.tau)

    @property
    def work_of_tools(self) -> float:
        """Work of the tools against the mean contact forces, with the work across gaps that open or close.

        A candidate that comes to a curved tool through the air does not move along its force at the end: its work is
        what the body takes up and what the slip dissipates.
        """
        iterate, tools, contacts = self.iterate, self.increment.tools, self.increment.system.candidates
        parts, du, r = contacts.parts, iterate.response.du, self.mean(self.begun, self.ended)
        # Vectors (w, d) whose components in frames that may turn have the mean r.
        pushed = self.mean(self._pushed_before, contacts.vectors(self.ended, iterate.frames))
        gone = iterate.tool_travel[contacts.tool[parts.owner]] + tools.carried(du, iterate.advance)
        taken = parts.sums(np.vecdot(pushed, contacts.met.motion(du))) - np.vecdot(r[:, 1:], iterate.slipped)
        done = parts.sums(np.vecdot(pushed, gone)) + r[:, 0] * (iterate.motion[:, 0] - self.opening)
        return float(np.where(~tools.closed, taken, done).sum())

    @cached_property
    def _pushed_before(self) -> Floats:
        """Vectors (w, d) of the contact forces of the start."""
        return self.increment.system.candidates.vectors(self.begun, self.increment.tools.frames)

    @property
    def work_of_supports(self) -> float:
        """Work of the supports on their prescribed displacements."""
        driven, system = self.increment.tools.driven, self.increment.system
        if not driven.any():
            return 0.0
        placed = system.body.space.gradients(system.balanced(self.start))
        before = system.reactions(element_force(placed, self.start.stress), self.loads, self._pushed_before)
        return vdot(self.mean(before, self.iterate.reactions(self.r)), driven)

    @cached_property
    def held(self) -> Bools:
        """Candidates (c,) that bear forces at the start and at the end: they stay in touch."""
        faces = np.isfinite(self.increment.tools.farther).all(axis=0)
        return np.asarray(self.start.forces.any(axis=1) & self.r.any(axis=1) & faces)

    @cached_property
    def opening(self) -> Floats:
        """Gaps (c,) of the start, from which those of points with forces at the end open."""
        return np.where(self.held, self.start.gap, self.increment.tools.opening)

    @cached_property
    def against(self) -> Floats:
        """r_t . du_t (c,) of the mean forces on the slips."""
        return np.vecdot(self.mean(self.begun, self.ended)[:, 1:], self.slip)

    @cached_property
    def past_ends(self) -> tuple[Bools, Bools]:
        """Which candidates (c,) come before a deformable tool, and which go from it, by sliding past an end.

        What is not faced because it leans away is before them, in the air.
        """
        tools = self.increment.tools
        begun, ended = tools.farther
        moved = ~self.held & (self.start.forces.any(axis=1) | self.r.any(axis=1))
        if not (moved & ((begun > 0) | (ended > 0))).any():
            none = np.zeros(len(moved), dtype=bool)
            return none, none
        before, after = (tools.felt(nodes, Near.ANY) > 0 for nodes in (self.start.nodes, self.iterate.nodes))
        come = moved & before & np.isfinite(ended)
        return come, moved & after & np.isfinite(begun) & ~come

    @cached_property
    def slip(self) -> Floats:
        """Slips (c, d - 1) to the end; of points that go past an end, that in the means of where they face the tool."""
        system, slip, (_, gone) = self.increment.system, self.iterate.slipped, self.past_ends
        if gone.any():
            before = system.facing(self.start.nodes).candidates
            tangents = before.frames_at(self.start.nodes, self.increment.tools.placed)[before.parts.first[gone], 1:]
            moved = times(tangents, before.means.motion(self.iterate.response.du)[gone])
            slip = slip.copy()
            slip[gone] = np.where(system.candidates.tangent_free[gone, None], moved, 0.0)
        return slip

    @property
    def missing_friction(self) -> float:
        """The term g of the module docstring (energy)."""
        limit = self.iterate.rows.limit(self.r)
        sticks = norm(self.ended[:, 1:]) < limit - HOLDS * float(norm(self.ended).max(initial=0.0))
        gap = self.limit * norm(self.slip) + np.vecdot(self.begun[:, 1:], self.slip)
        return float(gap[~sticks] @ self.touching[~sticks])

    @cached_property
    def touching(self) -> Floats:
        """The part b (c,) of slips to the end that is not in the air (module docstring).

        It is one where no gap opens or closes, and where there is a force neither at the start nor at the end. Of the
        slip of a point that comes past an end with a gap a, |u_t| / (|u_t| + a) rubs at least; if it goes, all of it.
        """
        system, tools = self.increment.system, self.increment.tools
        contacts, size = system.candidates, system.body.scene.size
        begun, ended, left = self.opening, self.iterate.motion[:, 0], tools.left(self.iterate.advance)
        air = np.where(touches(np.minimum(begun, left), size), 0.0, left) + np.where(touches(ended, size), 0.0, ended)
        aloft, out = (air > 0) & (self.start.forces.any(axis=1) | self.r.any(axis=1)), np.ones(len(air))
        if aloft.any():
            by = contacts.met.motion(self.iterate.response.du) - tools.taken
            followed = contacts.parts.gathered(np.vecdot(tools.frames[:, 0], by))
            sunk = np.minimum(ended, 0.0) - np.minimum(begun, 0.0)
            followed = np.abs(followed - sunk)
            out[aloft] = followed[aloft] / (followed + air)[aloft]
        if not contacts.deformable:
            return out
        (come, gone), length = self.past_ends, norm(self.slip)
        way = length + np.maximum(begun, 0.0)
        rubs = np.divide(length, way, out=gone.astype(np.float64), where=come & (way > 0))
        return np.maximum(out, rubs)


def start_limit(start: State, increment: Increment) -> Floats:
    """Largest friction forces s_0 (c,) under the forces of the start, with the caps there; 0 where tied."""
    rows, contacts, system = increment.rows, increment.system.candidates, increment.system
    if contacts.capped:
        nodes = system.balanced(start)
        volume = system.body.space.gradients(nodes).volume
        rows = replace(rows, cap=caps(contacts, start.peeq, volume, nodes, start.nodes, increment.tools.placed))
    return np.where(rows.tied, 0.0, rows.limit(start.forces))


def ended_forces(system: System, state: State) -> Floats:
    """Contact forces (c, d) of a state, with friction between tool and support against the slip that led there.

    That friction is no part of the state.
    """
    scene, begun = system.body.scene, state.tau - state.length
    # An increment that began at a kink, but for round-off of its length, has no motion from before the kink.
    begun = next((kink for kink in scene.kinks if abs(kink - begun) <= ROUND_OFF), begun)
    slip = Increment(system, replace(state, tau=begun), state.tau).dragged
    return rubbed(state.forces, lambda: start_limit(state, Increment(system, state, state.tau)), slip)
