"""Motion of tools in an increment: along their paths, by their turns, and through the air before candidates touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import orth

from bipot.basics.nonnegative import nonnegative
from bipot.borne import Riding
from bipot.contact.candidates import Candidates
from bipot.contact.closeness import closed
from bipot.contact.faced import points
from bipot.scene.supports import Support
from bipot.scene.translation import prescribed
from bipot.state import State
from bipot.tensors import norm
from bipot.tools.aloft import Carried
from bipot.tools.deformable import DeformableTool
from bipot.tools.meeting import Meeting
from bipot.tools.pieces import Near
from bipot.tools.poses import pose_size
from bipot.typing import Bools, Floats, max_abs

ROUND_OFF = 1e-12
"""A mean no longer than this, over the longest way, is zero."""

FEW = 0.5
"""A tool that touches the body at less than this fraction of another one's points does not carry it."""


def shortest(ways: Floats) -> Floats:
    """The shortest (d,) of all means of ``ways`` (k, d), that is of all points in their convex hull.

    It is sum_i w_i ways_i / sum_i w_i with the w >= 0 that minimise |sum_i w_i ways_i|^2 + (sum_i w_i - 1)^2, in units
    of the longest way; zero if these are not found.

    >>> shortest(np.array([[0.0, 2.0], [4.0, 2.0]])).tolist()
    [0.0, 2.0]
    """
    size, d = max_abs(ways), ways.shape[1]
    weights = None if size == 0 else nonnegative(np.vstack([ways.T / size, np.ones(len(ways))]), np.eye(d + 1)[d])
    if weights is None:
        return np.zeros(d)
    mean = np.asarray(weights @ ways / weights.sum())
    return np.where(norm(mean) > ROUND_OFF * size, mean, 0.0)


@dataclass(frozen=True)
class Advance:
    """The motion of the tools of the ``candidates`` from the state ``start`` to pseudo-time ``tau``."""

    candidates: Candidates
    start: State
    tau: float

    @cached_property
    def travel(self) -> Floats:
        """Displacement (k, d) of each tool along its path."""
        return self.candidates.scene.travel(self.start.tau, self.tau)

    @cached_property
    def turned(self) -> Floats:
        """The prescribed angle (k,) by which each tool turns."""
        turns = [tool.turn for tool in self.candidates.scene.tools]
        return np.array([0.0 if turn is None else turn.at(self.tau) - turn.at(self.start.tau) for turn in turns])

    @cached_property
    def path(self) -> Floats:
        """The change of poses (k, p) along paths and by prescribed turns."""
        return self.by(self.travel)

    @cached_property
    def driven(self) -> Floats:
        """The prescribed displacement (a, d), zero where none is prescribed."""
        scene = self.candidates.scene
        return scene.driven(self.tau) - scene.driven(self.start.tau)

    @cached_property
    def along(self) -> Floats:
        """Displacement (a, d) of a body that is carried by its supports and otherwise at rest.

        The body is carried by the translation within all planes of symmetry that is nearest, by least squares over the
        areas held, to what other supports prescribe; held nodes move as prescribed. This is continuous in that, exact
        where that is a translation, and the same for half a body as for the whole.
        """
        holding = self.candidates.scene.holding
        missing = np.where(holding.held, holding.axes.components(self.driven - self.way), 0.0)
        return self.way + holding.axes.field(missing)

    @cached_property
    def rest(self) -> Floats:
        """Displacement (a, d) of a body that is carried by its supports and tools and otherwise at rest."""
        return self.along + (self.gone - self.way)

    @cached_property
    def way(self) -> Floats:
        """The translation (d,) in :attr:`along`."""
        return self._nearest(self.candidates.scene.supports)

    def _nearest(self, supports: Sequence[Support]) -> Floats:
        """The translation (d,) within all planes of symmetry that is nearest to what these ``supports`` prescribe."""
        scene = self.candidates.scene
        if not self.driven.any():
            return np.zeros(scene.mesh.dimension)
        return prescribed(scene, supports, self.start.tau, self.tau)

    @cached_property
    def closed(self) -> Bools:
        """Which candidates (c,) are in touch at the start."""
        return closed(self.start.gap, self.start.forces, self.candidates.scene.size)

    @cached_property
    def gone(self) -> Floats:
        """The translation (d,) of a body that goes the :attr:`way` of its supports, and beyond that with its tools.

        Tools that touch it take it along, in directions that supports leave free, by the shortest mean of their ways:
        this is the common way of tools that go together, and zero where one rests. A tool that touches it at few points
        dents it and does not count, nor does a tool that a force drives, which goes with the body. Without friction
        only motion along normals counts. A body from which all these tools recede stays.
        """
        contacts, scene, touching = self.candidates, self.candidates.scene, self.closed
        free = scene.directions.free
        if not free.size:
            return self.way
        points = (contacts.owned & touching) @ contacts.share
        points[scene.drives.tool[scene.drives.spins == 0]] = 0.0
        tools = np.flatnonzero((points > 0) & (points >= FEW * points.max(initial=0.0)))
        if not (tools.size and self.travel[tools].any(axis=1).all()):
            return self.way
        normals = self.frames[touching[contacts.parts.owner], 0]
        if not contacts.mu[touching].any():
            free = free @ orth(free.T @ normals.T, rcond=ROUND_OFF)
        beyond = free @ shortest((self.travel[tools] - self.way) @ free)
        pushed = (normals @ beyond).max() >= -ROUND_OFF * norm(beyond)
        return self.way + beyond if pushed else self.way

    def beyond(self, gap: Floats) -> float:
        """How far a tool that may reach the body, by its ``gap`` (c,) at the end, or a support goes beyond the body.

        The body is that which goes :attr:`gone`, for supports :attr:`way`.
        """
        reach = self.candidates.reach(gap, self.travel - self.gone, self.swept(self.path))
        return max(reach, float(norm(self.along - self.way).max()))

    @property
    def led(self) -> Floats:
        """Coordinates (m,) of driven tools that go with the body: along their forces by :attr:`gone`."""
        return self.candidates.scene.drives.ways[:, : len(self.gone)] @ self.gone

    @cached_property
    def taken(self) -> Floats:
        """Displacement (w, d) of parts of a body at rest, carried by supports and by tools other than the part's.

        At deformable tools it is how the sides go to each other that their own supports carry: :attr:`parted`.
        """
        alone = self.carried_on.after(np.ones(len(self.frames)))
        if not self.candidates.deformable:
            return alone
        both = self.candidates.met.motion(self.parted)
        return np.where(self.candidates.between[self.candidates.parts.owner, None], both, alone)

    @cached_property
    def parted(self) -> Floats:
        """Displacement (a, d) of the parts of the mesh, each by the translation nearest to what its supports ask."""
        scene, out = self.candidates.scene, np.zeros(self.start.nodes.shape)
        for part in range(scene.mesh.part.max() + 1):
            own = scene.mesh.part == part
            out[own] = self._nearest([s for s in scene.supports if own[scene.mesh.boundaries[s.boundary]].any()])
        return out

    @cached_property
    def carried_on(self) -> Carried:
        """How these parts (w,) get there: :attr:`along` with supports, and beyond as in :mod:`bipot.borne`."""
        contacts, scene = self.candidates, self.candidates.scene
        along = contacts.met.motion(self.along)
        # A single tool without a mirror image leaves no other that could carry the body.
        if len(scene.tools) < 2 - bool(scene.planes):
            return Carried.evenly(along)
        motion = self.travel[contacts.tool[contacts.parts.owner]] + self.swept(self.path) - self.way
        under = self.places, self.frames[:, 0], motion
        ridden = Riding(contacts, self.start, *under, self.placed, self.turned).carried()
        return ridden._replace(by=ridden.by + along)

    @cached_property
    def placed(self) -> Floats:
        """Pose (k, p) of each tool at the start."""
        return self.candidates.scene.placed(self.start.tau, self.start.translation)

    @cached_property
    def places(self) -> Floats:
        """Places (w, d) of the parts at the start."""
        return self.candidates.met.places(self.start.nodes)

    @cached_property
    def frames(self) -> Floats:
        """Derivatives (w, d, d) of gap and slip with respect to the parts' places, at the start."""
        return self.candidates.frames_at(self.start.nodes, self.placed)

    def by(self, travel: Floats) -> Floats:
        """The change of poses (k, p) if the tools ``travel`` (k, d) and turn as prescribed."""
        angles = np.zeros((len(travel), pose_size(travel.shape[1]) - travel.shape[1]))
        for k, tool in enumerate(self.candidates.scene.tools):
            if tool.turn is not None:
                angles[k] = self.turned[k] * tool.turn.about
        return np.hstack([travel, angles])

    def swept(self, advance: Floats) -> Floats:
        """Displacement (w, d) of the tools' points where parts start, by the turns in the poses' ``advance`` (k, p)."""
        return self.candidates.faces.swept(self.places, self.placed, advance)

    def carried(self, du: Floats, advance: Floats) -> Floats:
        """Displacement (w, d) of the tools' points where parts are, by the turns in the poses' ``advance`` (k, p).

        Parts are taken halfway along ``du`` (a, d), where an increment's forces do the work of the tools.
        """
        middle = self.places + self.candidates.met.motion(du) / 2
        return self.candidates.faces.carried(middle, self.placed, advance)

    def meeting(self, du: Floats, advance: Floats) -> Meeting:
        """Where candidates meet their tools if nodes move by ``du`` (a, d) and poses ``advance`` by (k, p)."""
        way = self.places, self.candidates.met.motion(du), self.placed, advance
        return self.candidates.faces.meeting(self.begun, *way, self._before(advance))

    @cached_property
    def begun(self) -> Floats:
        """Gaps (c,) from which those at the end follow: of the start, at deformable tools in the means of the end."""
        contacts = self.candidates
        if not contacts.deformable:
            return self.start.gap
        return np.where(contacts.between, contacts.distance(self.start.nodes, self.placed), self.start.gap)

    @cached_property
    def farther(self) -> Floats:
        """How much farther off (2, c) deformable tools are felt at start and end (:mod:`bipot.contact.faced`)."""
        ended = self.candidates.of_points(*(at.farther for at in self.candidates.points))
        return np.stack([self.felt(self.start.nodes), ended])

    def felt(self, nodes: Floats, near: Near | None = None) -> Floats:
        """How much farther off (c,) they are felt with ``nodes`` at (a, d); ``near`` as of :func:`points`."""
        contacts, scene = self.candidates, self.candidates.scene
        every = [
            points(scene, tool, nodes, near) if isinstance(tool, DeformableTool) else at
            for tool, at in zip(scene.tools, contacts.points, strict=True)
        ]
        return contacts.of_points(*(at.farther for at in every))

    @cached_property
    def opening(self) -> Floats:
        """Gaps (c,) of the start, from which gaps open: :attr:`begun` where a deformable tool ends, now or then."""
        return np.where(self.farther.any(axis=0), self.begun, self.start.gap)

    def left(self, advance: Floats) -> Floats:
        """Gaps (c,) with which slips begin if poses ``advance`` by (k, p); for flat tools those of the start."""
        if not self.candidates.curved:
            return self.opening
        gap = self.candidates.faces.after(self.places, self.placed, self._before(advance))
        flat = np.array([tool.flat for tool in self.candidates.scene.tools], dtype=bool)
        return np.where(flat[self.candidates.tool], self.opening, gap)

    def _before(self, advance: Floats) -> Floats:
        """The part (w, d) of the parts' motion that is no slip, if poses ``advance`` by (k, p)."""
        # How a tool that a force drives goes through the air depends on the iterate.
        forced = any(tool.driven_by is not None and not tool.flat for tool in self.candidates.scene.tools)
        return self._in_air(advance[:, : self.start.nodes.shape[1]]) if forced else self._in_air_along_path

    @cached_property
    def _in_air_along_path(self) -> Floats:
        return self._in_air(self.travel)

    def _in_air(self, travel: Floats) -> Floats:
        """The displacement (w, d) of parts before they touch, in a body at rest that is carried as :attr:`taken`.

        Tools ``travel`` (k, d) and turn as prescribed. A tool turned by a moment moves together with the body: its turn
        then counts for a part that reaches it as the part's own motion does.
        """
        way = self.places, self.carried_on, self.placed, self.by(travel)
        return self.candidates.faces.in_air(~self.closed, *way)
