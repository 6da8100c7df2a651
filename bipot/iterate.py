r"""An increment, and an iterate of it with everything that depends on it.

An :class:`Increment` holds what all passes share; an :class:`Iterate` is a trial end of it. Members are computed when
first used. Forces on the unknowns are summed in one place: :attr:`Iterate.residual`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.advance import Advance
from bipot.contact import supported
from bipot.contact.closeness import LEAST_MOTION
from bipot.contact.shear import caps
from bipot.errors import LARGEST_LENGTH, NotConverged
from bipot.fem.strain import Scratch
from bipot.load_change import LoadChange
from bipot.past import Past, past_of
from bipot.programs.data import ContactRows, Units
from bipot.programs.pieces import Measured
from bipot.response import Response, TangentKind
from bipot.scene.paces import Paces
from bipot.state import State
from bipot.system import System
from bipot.tensors import norm
from bipot.tools.meeting import Meeting
from bipot.typing import Floats, max_abs, vdot


@dataclass(frozen=True)
class Increment:
    """The increment of a system from the state ``start`` to pseudo-time ``tau``: what all its passes share.

    Where flow is carried on, of its own first half if ``in_halves``, ``accepted`` is the state before, in balance.
    """

    system: System
    start: State
    tau: float
    accepted: State | None = None
    in_halves: bool = False

    @cached_property
    def rows(self) -> ContactRows:
        """The contact rows of all candidates; for curved tools those of a body that rests in the increment."""
        contacts = self.system.candidates
        if contacts.curved:
            at_rest = self.tools.meeting(self.tools.driven, self.tools.path)
            return contacts.linearised(self.tools.closed, at_rest, np.zeros(self.size))
        return contacts.rows(self.tools.begun, self.tools.closed, self.tools.travel, self.tools.driven)

    @cached_property
    def tools(self) -> Advance:
        """How the tools move."""
        return Advance(self.system.candidates, self.start, self.tau)

    @property
    def unmoved(self) -> Increment:
        """The increment from the same start that ends there: tools and supports rest in it."""
        return replace(self, tau=self.start.tau)

    @property
    def size(self) -> int:
        """Number n of unknowns."""
        return self.system.body.space.size

    @cached_property
    def paces(self) -> Paces:
        """The kinks of supports, loads and tools that may reach the body, and those at which the pace alone changes.

        A tool that leaves the body counts, however far it goes, because it releases what it pressed. So does one that
        the body does not feel (:func:`~bipot.past.past_of`): what it felt at kinks before the last increment, the start
        does not know.
        """
        return self.system.body.scene.paces(self.system.candidates.reached(np.minimum(self.start.gap, self.rows.gap)))

    @cached_property
    def past(self) -> Past:
        """The increment that led to the start of this one; to the beginning of a path, that was one of another path."""
        return past_of(self.system, self.start, self.tau, lambda: self.rows)

    @cached_property
    def dragged(self) -> Floats:
        """Known slips (c, d - 1) of candidates that supports hold or drive along the tangent, zero for all others.

        The friction there acts between tool and support and on no unknown.
        """
        return supported.dragged(self.system.candidates, self.tools.travel, self.tools.driven)

    @cached_property
    def torn(self) -> int | None:
        """A node that a support drives off or along a tool to which it is welded, None if there is none."""
        if not any(tool.welded for tool in self.system.body.scene.tools):
            return None
        touching = supported.Touching(self.tools.closed, self.start.nodes, self.tools.placed, self.tools.path)
        return supported.torn(self.system.candidates, touching, self.tools.travel, self.tools.driven)

    @cached_property
    def loads(self) -> LoadChange:
        """The change of the loads in the increment."""
        return LoadChange(self.system, self.accepted or self.start, self.tau)

    @cached_property
    def reach(self) -> float:
        """The longest travel of a tool that may reach the body."""
        return self.system.candidates.reach(self.rows.gap, self.tools.travel, self.tools.swept(self.tools.path))

    @cached_property
    def driven_into(self) -> supported.DrivenInto:
        """The held node, hence no contact, that is deepest in a tool."""
        scene = self.system.body.scene
        placed = scene.placed(self.tau, self.start.translation)
        return supported.driven_into(self.system.candidates, placed, scene.driven(self.tau))

    @cached_property
    def units(self) -> Units:
        """Units of its programs; length is the motion beyond that of a carried body, which says nothing of strains."""
        change = self.loads.change if self.system.body.scene.loads or self.system.body.scene.drives else np.zeros(0)
        return self.system.units(self.start, self.tools.beyond(self.rows.gap), change)

    def at(self, x: Floats) -> Iterate:
        """The iterate of the unknowns x (n,): free displacements, and coordinates of tools that are driven.

        Raises:
            InvertedElement: an element is inverted in the trial configuration.
            NotConverged: x is so large that squares of positions would overflow.
        """
        if not max_abs(x) <= LARGEST_LENGTH:
            raise NotConverged("an iterate runs away: nothing holds the body, or next to nothing")
        return Iterate(self, self.system.body.respond(self.start, x, self.tools.driven))


@dataclass(frozen=True)
class Iterate:
    """A trial end of the ``increment``: the body's response to a displacement, and what depends on it."""

    increment: Increment
    response: Response

    @property
    def x(self) -> Floats:
        """The unknowns (n,)."""
        return self.response.x

    @property
    def nodes(self) -> Floats:
        """The trial configuration (a, d)."""
        return self.increment.start.nodes + self.response.du

    @property
    def translated(self) -> Floats:
        """The unknowns (m,) that are coordinates of tools driven by forces or moments."""
        return self.increment.system.body.space.beside(self.x)

    @cached_property
    def advance(self) -> Floats:
        """The change of each tool's pose (k, p), by its path and turn and by the forces and moments that drive it."""
        path, drives = self.increment.tools.path, self.increment.system.body.scene.drives
        return path + drives.poses(self.translated, len(path)) if drives else path

    @property
    def tool_travel(self) -> Floats:
        """Displacement (tools, d) of each tool, of its centre where it turns."""
        return self.advance[:, : self.response.du.shape[1]]

    @cached_property
    def placed(self) -> Floats:
        """Pose (k, p) of each tool."""
        return self.increment.tools.placed + self.advance

    @property
    def length(self) -> float:
        """How far tools go in the increment, or nodes if the tools rest; never zero."""
        least = LEAST_MOTION * self.increment.system.body.scene.mesh.size
        moved = max(float(norm(self.response.du).max()), least)
        return max(self.increment.reach, max_abs(self.translated)) or moved

    @cached_property
    def rows(self) -> ContactRows:
        """Contact rows of all candidates; except for caps, those of flat tools are the same at every iterate."""
        increment, contacts = self.increment, self.increment.system.candidates
        rows = contacts.linearised(increment.tools.closed, self.meeting, self.x) if contacts.curved else increment.rows
        return replace(rows, cap=self._caps) if contacts.capped else rows

    @property
    def _caps(self) -> Floats:
        """The largest friction force (c,) of each candidate by the shear yield stress, inf where none is asked."""
        contacts, volume = self.increment.system.candidates, self.response.kinematics.volume
        return caps(contacts, self.response.peeq, volume, self.balanced, self.nodes, self.placed)

    @cached_property
    def meeting(self) -> Meeting:
        """Where candidates meet their tools."""
        return self.increment.tools.meeting(self.response.du, self.advance)

    @cached_property
    def frames(self) -> Floats:
        """Derivatives (w, d, d) of gap and slip by the parts' places; at closed contacts normal and tangents."""
        contacts = self.increment.system.candidates
        return self.meeting.frames if contacts.curved else contacts.frames

    @property
    def measured(self) -> Measured | None:
        """How :attr:`motion` changes; None if as :attr:`rows` say."""
        contacts = self.increment.system.candidates
        return contacts.pairs.measured(contacts.space, contacts.faces, self.meeting) if contacts.curved else None

    @cached_property
    def motion(self) -> Floats:
        """Gap at the end and slip (c, d) of all candidates."""
        if not self.increment.system.candidates.curved:
            return self.rows.motion(self.x)
        motion = self.meeting.motion
        return np.column_stack([motion[:, 0], np.where(self.rows.rubs[:, None], motion[:, 1:], 0.0)])

    @property
    def slipped(self) -> Floats:
        """Slips (c, d - 1) of all candidates, known ones included."""
        return self.motion[:, 1:] + self.increment.dragged

    @cached_property
    def balanced(self) -> Floats:
        """The configuration (a, d) in which equilibrium is asked."""
        increment = self.increment
        return increment.system.body.scene.balanced(increment.start.nodes, self.response.du)

    @cached_property
    def nodal_load(self) -> Floats:
        """The loads at the nodes (a, d)."""
        return self.increment.system.loading.forces(self.balanced, self.increment.tau)

    @property
    def load(self) -> Floats:
        """Forces on the unknowns (n,): loads, and the forces and moments that drive tools."""
        return self.increment.system.load(self.nodal_load, self.increment.tau)

    @cached_property
    def residual(self) -> Floats:
        """Internal forces less the load (n,): what the contacts have to balance."""
        scene = self.increment.system.body.scene
        return self.response.internal - self.load if scene.loads or scene.drives else self.response.internal

    def stiffness(self, kind: TangentKind) -> sp.csc_matrix:
        """K of the convex model."""
        return self.increment.system.body.stiffness(self.response, kind)

    def tangent(self, r: Floats, scratch: Scratch | None = None) -> Floats:
        """Element matrices (e, dk, dk) of the exact derivative of :attr:`residual` minus contact forces r (c, d).

        At curved tools contact forces change as normals turn; flat tools add nothing. Where curved tools are driven,
        the entries of all matrices are returned, those of couplings last (:mod:`bipot.contact.coupling`).
        """
        increment = self.increment
        K = increment.system.body.tangent(self.response, scratch)
        if self.response.kinematics.moves:
            increment.system.loading.add_stiffness(K, self.balanced, increment.tau)
        if increment.system.candidates.curved:
            increment.system.candidates.add_bending(K, self.meeting, r)
            coupling = increment.system.candidates.coupling(self.meeting, r)
            return np.append(K, -coupling) if coupling.size else K
        return K

    def rubbed(self, r: Floats) -> Floats:
        """Contact forces r (c, d) with the friction -s slip/|slip| between tool and support where the slip is known."""
        return supported.rubbed(r, lambda: np.where(self.rows.tied, 0.0, self.rows.limit(r)), self.increment.dragged)

    def tool_forces(self, r: Floats) -> Floats:
        """Force (tools, d) of each tool on the modelled body under contact forces r (c, d)."""
        contacts = self.increment.system.candidates
        return contacts.sums(contacts.vectors(self.rubbed(r), self.frames))

    def tool_moments(self, r: Floats) -> Floats:
        """Moment (tools,) of each turning tool on the modelled body, about its centre, under r (c, d); 0 for others.

        In plane strain per unit of thickness; positive anticlockwise.
        """
        contacts = self.increment.system.candidates
        swirls = contacts.faces.swirls(contacts.faces.arms(contacts.met.places(self.nodes), self.placed))
        return contacts.sums(np.vecdot(swirls, contacts.vectors(r, self.frames)))

    def reactions(self, r: Floats) -> Floats:
        """Forces (a, d) of the supports on the modelled body under contact forces r (c, d); zero at free nodes."""
        contacts = self.increment.system.candidates.vectors(self.rubbed(r), self.frames)
        return self.increment.system.reactions(self.response.element_forces, self.nodal_load, contacts)

    def work(self, r: Floats) -> float:
        """Work of tools, loads and supports, with their forces at the end and the contact forces r (c, d)."""
        increment, contacts = self.increment, self.increment.system.candidates
        tools = vdot(self.tool_forces(r), self.tool_travel)
        if contacts.scene.turning.any():
            carried = increment.tools.carried(self.response.du, self.advance)
            tools += vdot(contacts.vectors(r, self.frames), carried)
        driven = vdot(self.reactions(r), increment.tools.driven) if increment.tools.driven.any() else 0.0
        loads = vdot(self.nodal_load, self.response.du) if increment.system.loading.loads else 0.0
        return float(tools + loads + driven)
