r"""From geometry to affine contact operators: the only module that knows what touches what.

With dU the unknowns of an increment (free displacements, and coordinates of driven tools), every candidate c, a point
of the boundary (:mod:`bipot.contact.sampling`), has

    gap at the end        g + G_n dU         (n,)      with g = gap at the start against the end of the tool's path,
    relative slip         w_t + G_t dU       (d - 1,)  with w_t = minus the tool's tangential motion along it,

both relative to the tool, in its frame (:func:`bipot.tools.surfaces.frames`): n from the tool into the body,
t = (n_y, -n_x), in space two tangents. Dual to them are the contact *forces* (r_n, r_t). Friction rows exist only where
the tangent is free and the tool has friction. The rows of flat tools are constant in an increment. Those of curved
tools are linearised at the :class:`~bipot.tools.meeting.Meeting` of the iterate, and means average the rows of their
nodes (:mod:`bipot.tools.parts`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.contact.closeness import REACH, ROUND_OFF
from bipot.contact.coupling import Pairs, entries_of, pairs_of
from bipot.contact.means import Means, Operators, without_zeros
from bipot.contact.mobility import along_what_is_held, movable, shares
from bipot.contact.sampling import Points
from bipot.fem.assembly import Space
from bipot.programs.data import ContactRows, rows_of
from bipot.scene.scene import Scene
from bipot.tensors import norm
from bipot.tools.meeting import Faces, Meeting
from bipot.tools.parts import Parts
from bipot.tools.slips import framed
from bipot.tools.tool import Tool
from bipot.typing import Bools, Floats, Ints, einsum


@dataclass(frozen=True)
class Candidates:
    """Points that may touch a tool, tool by tool: ``node``, ``tool``, coefficient ``mu``, and ``shear``, m or inf (c,).

    They are ``means`` of nodes, and those of the tools' ``points`` that may move; ``number`` has, tool by tool, the
    candidate (p,) of each point, or -1. ``tangent_free`` (c,) marks those that may have friction: a node of theirs may
    move along a tangent, and symmetry does not make slip and shear zero. ``tangent_held`` (c,) marks those of which
    supports hold all nodes along the tangents. Frames in space follow those ``like`` these, of a scene next to theirs.
    """

    scene: Scene
    space: Space
    points: tuple[Points, ...]
    number: tuple[Ints, ...]
    means: Means
    node: Ints
    tool: Ints
    tangent_free: Bools
    tangent_held: Bools
    mu: Floats
    shear: Floats
    like: Candidates | None = None

    @cached_property
    def capped(self) -> bool:
        """Whether the shear yield stress caps the friction of any candidate (:mod:`bipot.contact.shear`)."""
        return bool(np.isfinite(self.shear).any())

    @cached_property
    def share(self) -> Floats:
        """The part (c,) that each candidate is of a point of the whole body: less than one in planes of symmetry."""
        return self.of_points(*(shares(self.scene, k, points) for k, points in enumerate(self.points)))

    def of_points(self, *values: Floats) -> Floats:
        """Values (c, …) of candidates, by those (p, …) of the points of each tool."""
        kept = [of[number >= 0] for of, number in zip(values, self.number, strict=True)]
        return np.concatenate(kept) if kept else np.empty(0)

    @cached_property
    def alone(self) -> Bools:
        """Which candidates (c,) are the only ones at their node."""
        return np.asarray(np.bincount(self.node)[self.node] == 1)

    @cached_property
    def curved(self) -> bool:
        """Whether a tool is curved, so that rows depend on the positions of candidates."""
        return not all(tool.flat for tool in self.scene.tools)

    @cached_property
    def faces(self) -> Faces:
        """The surfaces of the tools."""
        owner = self.parts.owner
        return Faces(self.tools, self.owned[:, owner], self._reference[owner], self.parts)

    @cached_property
    def tools(self) -> tuple[Tool, ...]:
        """The scene's tools, deformable ones as their candidates meet them."""
        faced = (points.faced for points in self.points)
        return tuple(replace(tool, met=at) if at else tool for tool, at in zip(self.scene.tools, faced, strict=True))

    @cached_property
    def deformable(self) -> bool:
        """Whether a tool is deformable, so that the candidates are those of a configuration."""
        return any(at.faced is not None for at in self.points)

    @cached_property
    def between(self) -> Bools:
        """Which candidates (c,) meet deformable tools."""
        return np.array([at.faced is not None for at in self.points], dtype=bool)[self.tool]

    @cached_property
    def parts(self) -> Parts:
        """What tools meet: the nodes of means if there are any and a tool is curved, otherwise the candidates."""
        return self.means.parts(self._reference) if self.curved and self.weighted else Parts.whole(self.means.count)

    @cached_property
    def met(self) -> Means:
        """The w parts as means of nodes: the candidates themselves, or their nodes one by one."""
        return self.means if self.parts.single else self.means.apart()

    @property
    def where(self) -> Ints:
        """The node (w,) of each part: of a point at a deformable tool, a mean of several, that at which it is."""
        return self.node if self.parts.single else self.met.nodes

    @cached_property
    def _reference(self) -> Floats:
        """The frames (c, d, d) at rest: at the nodes where points are, in the planes of symmetry that cut means."""
        x = self.scene.mesh.nodes[self.node]
        normal = np.empty_like(x)
        for mine, tool in zip(self.owned, self.tools, strict=True):
            normal[mine] = tool.face.distance(x[mine]).normal
        found = framed(normal, None if self.like is None else self.like._reference)
        # At curved tools slips along held directions are zero only to round-off, so that turned tangents are no use.
        useful = x.shape[1] == 3 and not self.curved
        return along_what_is_held(found, self.means, self.scene.holding) if useful else found

    @cached_property
    def frames(self) -> Floats:
        """Derivatives (w, d, d) of gap and slip by the parts' places, at rest; at flat tools normal and tangents."""
        return self.faces.slopes(self.met.places(self.scene.mesh.nodes), self.scene.at_rest)

    def frames_at(self, nodes: Floats, placed: Floats) -> Floats:
        """The same (w, d, d) for ``nodes`` (a, d) at tools in the poses ``placed`` (k, p)."""
        return self.faces.slopes(self.met.places(nodes), placed) if self.curved else self.frames

    def distance(self, nodes: Floats, placed: Floats) -> Floats:
        """Gap (c,) for ``nodes`` (a, d) to the tools in the poses ``placed`` (k, p), to the round-off of places."""
        return self.faces.distance(self.met.places(nodes), placed)

    def reached(self, gap: Floats) -> Bools:
        """Which tools (k,) may reach the body, by the ``gap`` (c,) at the end of an increment if the body rests."""
        return np.asarray((self.owned & (gap <= REACH * self.scene.size)).any(axis=1))

    def reach(self, gap: Floats, travel: Floats, swept: Floats) -> float:
        """The longest ``travel`` (k, d) of a tool that may reach the body; one out of :data:`REACH` sets no scale.

        Turns take the nearest candidate ``swept`` (w, d) farther; ``gap`` (c,) as of :meth:`reached`.
        """
        lengths, near = norm(travel), self.reached(gap)
        for k in np.flatnonzero(self.scene.turning & near).tolist():
            lengths[k] += norm(swept[self.parts.first[self.owned[k]][np.argmin(gap[self.owned[k]])]])
        return float(lengths[near].max(initial=0.0))

    def vectors(self, r: Floats, frames: Floats | None = None) -> Floats:
        """Contact forces r (c, d) on the body as vectors (w, d), by ``frames`` (w, d, d) or by those at rest."""
        return einsum("wi,wij->wj", self.parts.spread(r), self.frames if frames is None else frames)

    def sums(self, vectors: Floats) -> Floats:
        """Sums (k, …) of vectors (w, …) over each tool's parts: for contact forces the tools' forces on the body."""
        return self.faces.owned @ vectors

    def load(self, r: Floats, nodes: Floats, placed: Floats) -> Floats:
        """Forces on the unknowns (n,) by any r (c, d) on ``nodes`` (a, d) at tools in the poses ``placed`` (k, p)."""
        arms = self.faces.arms(self.met.places(nodes), placed)
        normal, tangents = self._matrices(self.frames_at(nodes, placed), arms)
        return normal.T @ r[:, 0] + tangents.T @ r[:, 1:].ravel()

    def add_bending(self, K: Floats, meeting: Meeting, r: Floats) -> None:
        """Subtract the derivatives of contact forces r (c, d) by nodal positions from element matrices (e, dk, dk)."""
        parts, at = self._bent
        np.subtract.at(K, at, meeting.bending(self.parts.spread(r))[parts])

    @cached_property
    def _bent(self) -> tuple[Ints, tuple[Ints, Ints, Ints]]:
        """The parts (b,) at curved tools, and where their matrices are added to those of elements."""
        shaped = np.array([not tool.flat for tool in self.scene.tools], dtype=bool)
        parts = np.flatnonzero(shaped[self.tool[self.parts.owner]])
        return parts, entries_of(self.scene.mesh, self.where[parts])

    def coupling(self, meeting: Meeting, r: Floats) -> Floats:
        """Derivatives (b u u,) of contact forces r (c, d) that involve the coordinates of curved tools that are driven.

        They are to be subtracted; in the order of the space they come after the entries of elements.
        """
        return self.pairs.matrices(self.tool[self.parts.owner], self.where, meeting, self.parts.spread(r)).ravel()

    @cached_property
    def pairs(self) -> Pairs:
        """Nodes with the curved tools that forces or moments drive."""
        return pairs_of(self.scene)

    def driven_sums(self, values: Floats) -> Floats:
        """For each driven coordinate, the sum (m,) of values (c,) over the candidates of its tool."""
        return self.owned[self.scene.drives.tool] @ values

    @cached_property
    def held(self) -> tuple[Ints, ...]:
        """Tool by tool, the nodes (h,) of its boundaries of which nothing can change the gap.

        Supports hold them along the tool's normal, and no force or moment drives the tool along it.
        """
        nodes = (self.scene.mesh.boundary_nodes(*tool.candidates) for tool in self.scene.tools)
        return tuple(own[~movable(self.scene, k, own)[:, 0]] for k, own in enumerate(nodes))

    def approach(self, travel: Floats, driven: Floats) -> Floats:
        """Motion (c, d) of tools along their paths, in their frames, relative to the ``driven`` motion (w, d) of parts.

        Components that are round-off of zero are set to zero, so that a tool that only presses does not slide.
        """
        gone = travel[self.tool[self.parts.owner]]
        moved, lengths = np.vecdot(self.frames, (gone - driven)[:, None]), norm(gone) + norm(driven)
        return self.parts.motion(np.where(np.abs(moved) > ROUND_OFF * lengths[:, None], moved, 0.0))

    def rows(self, gap: Floats, closed: Bools, travel: Floats, driven: Floats) -> ContactRows:
        """Operators of an increment that starts with the gaps (c,), some of them ``closed`` (c,).

        The tools ``travel`` (k, d) along their paths, and ``driven`` (a, d) is the prescribed displacement.
        """
        moved = self.approach(travel, self.met.motion(driven))
        motion = np.column_stack([gap - moved[:, 0], -moved[:, 1:]])
        return self._rows(closed, self._resting, motion)

    def linearised(self, closed: Bools, meeting: Meeting, x: Floats) -> ContactRows:
        """Operators of an increment that starts with some ``closed`` (c,), exact at x (n,) with its ``meeting``."""
        operators = self._matrices(meeting.frames, meeting.arm)
        gone = np.column_stack([(G @ x).reshape(len(self.node), -1) for G in operators])
        return self._rows(closed, operators, meeting.motion - gone)

    def _rows(self, closed: Bools, operators: tuple[sp.csr_matrix, sp.csr_matrix], motion: Floats) -> ContactRows:
        """Rows with the ``motion`` (c, d) at zero displacement."""
        (normal_rows, tangent_rows), mu = operators, self.mu
        tied = self.welded & closed
        acts = np.isfinite(mu) | np.isfinite(self.shear)
        rubs = self.tangent_free & (mu > 0) & (self.shear > 0) & (tied | acts)
        return ContactRows(
            normal_rows,
            motion[:, 0].copy(),
            self._slipping(tangent_rows, np.repeat(rubs, motion.shape[1] - 1)),
            motion[rubs, 1:],
            np.flatnonzero(rubs),
            np.where(acts, mu, np.where(tied, np.inf, 0.0)),
            np.full(len(mu), np.inf),
            tied,
        )

    def _slipping(self, tangents: sp.csr_matrix, chosen: Bools) -> sp.csr_matrix:
        """The chosen rows; at flat tools the last ones are used again as long as the choice is the same."""
        if self.curved:
            return rows_of(tangents, chosen)
        key = chosen.tobytes()
        if key not in self._slipped:
            self._slipped.clear()
            self._slipped[key] = rows_of(tangents, chosen)
        return self._slipped[key]

    @cached_property
    def _slipped(self) -> dict[bytes, sp.csr_matrix]:
        return {}

    @cached_property
    def weighted(self) -> bool:
        """Whether any candidate is a mean of several nodes."""
        return any(points.weighted for points in self.points)

    @cached_property
    def welded(self) -> Bools:
        """Whether the candidate's tool welds (c,)."""
        return np.array([tool.welded for tool in self.scene.tools], dtype=bool)[self.tool]

    @cached_property
    def owned(self) -> Bools:
        """Which candidates belong to each tool (k, c)."""
        return np.asarray(self.tool == np.arange(len(self.scene.tools))[:, None])

    @cached_property
    def _operators(self) -> Operators:
        return Operators.of(self.space, self.scene.drives, self.means, self.owned[self.scene.drives.tool])

    @cached_property
    def _resting(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal and tangential rows of every candidate at rest."""
        return self._matrices(self.frames, np.zeros((len(self.node), self.scene.mesh.dimension)))

    def _matrices(self, frames: Floats, arm: Floats) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal and tangential rows of every candidate by ``frames`` (w, d, d) of parts, at ``arm`` (w, d).

        With curved tools zeros are stored too, so that the rows have the same entries at all iterates.
        """
        normal, tangents = self._operators.matrices(frames, arm, self.parts)
        return (normal, tangents) if self.curved else (without_zeros(normal), without_zeros(tangents))
