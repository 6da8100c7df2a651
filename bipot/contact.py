r"""From geometry to affine contact operators: the only place that knows what touches what.

For the increment dU (free displacements, and translations of tools that a force drives) of one step, per candidate c,
a point of the boundary (:mod:`bipot.sampling`),

    gap at the end        g + G_n dU         (n,)      with g = gap at the start against the end of the tool's path,
    relative slip         w_t + G_t dU       (d - 1,)  with w_t = minus the tool's tangential motion along it,

both relative to the tool, in its frame (:func:`frames`): n from the tool into the body, t = (n_y, -n_x). Dual to them
are the contact *forces* (r_n, r_t). Friction rows exist only where the tangent is free and the tool has friction.

A candidate is *closed* where it carries a force (:func:`carries`) or has no gap (:func:`touches`). Which of them is
asked depends on what is known and what for:

* by force alone: tractions and landings, for what touches without a force has no traction and has not landed;
* by gap alone: the start of an increment, where a weld takes hold, for forces there are those of the last increment;
* by either: what keeps the body where it is, for what touches without a force still stops a motion one way.

The pieces of Newton (:mod:`bipot.programs.pieces`) are guesses on the way to a solution, not statements about one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.fem.assembly import Space
from bipot.programs.data import ContactRows, rows_of
from bipot.sampling import Points, creased, points
from bipot.scene import Scene
from bipot.supports import free_along
from bipot.tensors import norm
from bipot.tools import ACROSS
from bipot.typing import Bools, Floats, Ints

CARRIES = 1e-8
"""A contact force below this fraction of the increment's largest is none: what a solver leaves at open candidates."""

TOUCHES = 1e-9
"""A gap below this fraction of the body's size is none: round-off of the geometry, not physics."""

NEAR = 4.0
"""A candidate within this many lengths of the increment is near its tool: it may close where the prediction is off."""

REACH = 10.0
"""A tool farther from the body than this many sizes of it does not matter to it."""

LEAST_MOTION = 1e-6
"""Of the body's size: the length of an increment in which tools and body rest."""


@dataclass(frozen=True)
class Candidates:
    """Points that may touch a tool, tool by tool: ``node``, ``tool`` and coefficient ``mu`` (c,).

    ``weights`` (c, a) say which mean of the nodes each is. Of the tools' ``points`` those are candidates that may move;
    ``number`` holds, tool by tool, the candidate (p,) that a point is, -1 where it is none. ``tangent_free`` (c,) are
    those with friction: a node of theirs may move along the tangent, and no symmetry makes slip and shear zero.
    ``tangent_held`` (c,) are those of which supports hold all nodes.
    """

    scene: Scene
    space: Space
    points: tuple[Points, ...]
    number: tuple[Ints, ...]
    weights: sp.csr_matrix
    node: Ints
    tool: Ints
    tangent_free: Bools
    tangent_held: Bools
    mu: Floats

    @cached_property
    def frames(self) -> Floats:
        """Normal and tangent (c, d, d) of each candidate: those of the tools, which do not turn."""
        return frames(_normals(self.scene))[self.tool]

    def mean(self, nodal: Floats) -> Floats:
        """A nodal field (a, d) at the candidates (c, d)."""
        return np.asarray(self.weights @ nodal)

    def nodal(self, vectors: Floats) -> Floats:
        """What nodes (a, d) take of forces (c, d) on the candidates."""
        return np.asarray(self.weights.T @ vectors)

    def distance(self, nodes: Floats, placed: Floats) -> Floats:
        """Gap (c,) of ``nodes`` (a, 2) to the tools displaced by ``placed`` (k, d), good to its round-off."""
        gap, at = np.empty(len(self.node)), self.mean(nodes)
        for mine, tool, moved in zip(self._owned, self.scene.tools, placed, strict=True):
            gap[mine] = tool.distance(at[mine], moved)
        return gap

    def reach(self, gap: Floats, travel: Floats) -> float:
        """The longest ``travel`` (k, d) of a tool that may matter to the body: one out of :data:`REACH` is no scale.

        ``gap`` (c,) is that at the end if the body rests.
        """
        near = (self._owned & (gap <= REACH * self.scene.mesh.size)).any(axis=1)
        return float(norm(travel)[near].max(initial=0.0))

    def vectors(self, r: Floats) -> Floats:
        """Contact forces r (c, d) on the body as vectors (c, d)."""
        return np.einsum("ci,cij->cj", r, self.frames)

    def resultant(self, r: Floats) -> Floats:
        """Force (k, d) of each tool on the modelled body from contact forces r (c, d)."""
        return self._owned @ self.vectors(r)

    def load(self, r: Floats) -> Floats:
        """What contact forces r (c, d) do on the free unknowns (n,), whatever the friction."""
        normal, tangent = self._operators
        return normal.T @ r[:, 0] + tangent.T @ r[:, 1]

    def driven_sums(self, values: Floats) -> Floats:
        """Sums (m,) of values (c,) over the candidates of each tool that a force drives."""
        return self._owned[self.scene.by_force] @ values

    @cached_property
    def held(self) -> tuple[Ints, ...]:
        """Tool by tool, the nodes (h,) of its boundaries that cannot move along its normal, nor it against them.

        Supports hold them, and no force moves the tool along that.
        """
        nodes = [self.scene.mesh.boundary_nodes(*tool.candidates) for tool in self.scene.tools]
        moving = [_movable(self.scene, self.space, k, own)[:, 0] for k, own in enumerate(nodes)]
        return tuple(own[~moves] for own, moves in zip(nodes, moving, strict=True))

    def approach(self, travel: Floats, driven: Floats) -> Floats:
        """Motion (c, d) of tools along their paths, in their frames, against that ``driven`` (c, d) of candidates."""
        return np.vecdot(self.frames, (travel[self.tool] - driven)[:, None])

    def rows(self, gap: Floats, travel: Floats, driven: Floats) -> ContactRows:
        """Operators of an increment that starts with the gaps (c,).

        In it the tools ``travel`` (k, d) along their paths, and ``driven`` (a, d) of the displacement is prescribed.
        """
        normal_rows, tangent_rows = self._operators
        moved, mu = self.approach(travel, self.mean(driven)), self.mu
        tied = self.welded & touches(gap, self.scene.mesh.size)
        rubs = self.tangent_free & (mu > 0) & (tied | np.isfinite(mu))
        return ContactRows(
            normal_rows,
            gap - moved[:, 0],
            rows_of(tangent_rows, rubs),
            -moved[rubs, 1:],
            np.flatnonzero(rubs),
            np.where(np.isfinite(mu), mu, np.where(tied, np.inf, 0.0)),
            tied,
        )

    @cached_property
    def weighted(self) -> bool:
        """Whether any is a mean of several nodes."""
        return any(points.weighted for points in self.points)

    @cached_property
    def welded(self) -> Bools:
        """Whether the candidate's tool welds (c,)."""
        return np.array([tool.welded for tool in self.scene.tools], dtype=bool)[self.tool]

    @cached_property
    def _owned(self) -> Bools:
        """Whether the candidate is the tool's (k, c)."""
        return np.asarray(self.tool == np.arange(len(self.scene.tools))[:, None])

    @cached_property
    def _operators(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal and tangential rows of every candidate."""
        return self._operator(self.frames[:, 0]), self._operator(self.frames[:, 1])

    def _operator(self, direction: Floats) -> sp.csr_matrix:
        """Rows ``direction . (dU_point - dU_tool)``, held nodes and tools along their paths apart."""
        W = self.weights
        count, owner = len(self.node), np.repeat(np.arange(len(self.node)), np.diff(W.indptr))
        row = np.concatenate([np.repeat(owner, 2), np.arange(count)])
        column = np.concatenate([self.space.position[2 * W.indices[:, None] + np.arange(2)].ravel(), self._translation])
        by_tool = -np.vecdot(direction, _directions(self.scene)[self.tool])
        by_tool[np.abs(by_tool) <= ACROSS] = 0.0
        entries = np.concatenate([(W.data[:, None] * direction[owner]).ravel(), by_tool])
        kept = (column >= 0) & (entries != 0)
        return sp.csr_matrix((entries[kept], (row[kept], column[kept])), shape=(count, self.space.size))

    @cached_property
    def _translation(self) -> Ints:
        """The unknown (c,) that is the translation of the candidate's tool, -1 where that goes its path."""
        by_force = self.scene.by_force
        number = np.where(by_force, len(self.space.free) + np.cumsum(by_force) - 1, -1)
        return number.astype(np.intp)[self.tool]


def frames(normal: Floats) -> Floats:
    """Frames (…, 2, 2) of normals (…, 2), as rows the normal and the tangent (n_y, -n_x).

    >>> frames(np.array([0.6, 0.8])).tolist()
    [[0.6, 0.8], [0.8, -0.6]]
    """
    return np.stack([normal, normal[..., ::-1] * (1.0, -1.0)], axis=-2)


def force_threshold(r: Floats) -> float:
    """The force up to which a contact force of r (c, d) is none, see :data:`CARRIES`."""
    return CARRIES * float(np.linalg.norm(r, axis=1).max(initial=0.0))


def carries(r: Floats, noise: float = 0.0) -> Bools:
    """Which candidates (c,) push by contact forces r (c, d), of which those up to ``noise`` are none."""
    return r[:, 0] > max(force_threshold(r), noise)


def touches(gap: Floats, size: float) -> Bools:
    """Which gaps (c,) are none in a body of ``size``."""
    return gap <= TOUCHES * size


def near_tools(rows: ContactRows, x: Floats, length: float) -> Bools:
    """Candidates (c,) near their tool, by the ``length`` of the increment, at its displacement x (n,), and those tied.

    At least one where there is any, so that programs have contact rows: an open one changes nothing.
    """
    gap = rows.gap + rows.G_n @ x
    return (gap <= max(NEAR * length, float(gap.min(initial=np.inf)))) | rows.tied


def candidates(scene: Scene, space: Space) -> Candidates:
    """Points of every tool that can move along its normal, or it against them; none where there is no tool."""
    found = tuple(points(scene.mesh, scene.geometry, tool) for tool in scene.tools)
    moving = [_moving(scene, space, k, own) for k, own in enumerate(found)]
    chosen = [moves[:, 0] for moves in moving]
    rests = [_mirrored(scene, k, own) for k, own in enumerate(found)]
    none, mu = np.empty(0, dtype=bool), [np.empty(0)]
    for tool, own, moves in zip(scene.tools, found, chosen, strict=True):
        mu.append(np.array([tool.mu_at.get(a, tool.mu) for a in own.node[moves].tolist()], dtype=np.float64))
    counts = np.array([moves.sum() for moves in chosen], np.intp)
    first = np.cumsum(counts) - counts
    weights = [rows_of(own.weights, moves) for own, moves in zip(found, chosen, strict=True)]
    slides = np.concatenate([none, *(moves[:, 1][own] for moves, own in zip(moving, chosen, strict=True))])
    mirrored = np.concatenate([none, *(rest[own] for rest, own in zip(rests, chosen, strict=True))])
    return Candidates(
        scene=scene,
        space=space,
        points=found,
        number=tuple(np.where(m, np.cumsum(m) - 1 + at, -1) for m, at in zip(chosen, first.tolist(), strict=True)),
        weights=sp.csr_matrix(sp.vstack([sp.csr_matrix((0, len(scene.mesh.nodes))), *weights])),
        node=np.concatenate([np.empty(0, np.intp), *(own.node[m] for own, m in zip(found, chosen, strict=True))]),
        tool=np.repeat(np.arange(len(found)), counts),
        tangent_free=slides & ~mirrored,
        tangent_held=~slides,
        mu=np.concatenate(mu),
    )


def _moving(scene: Scene, space: Space, number: int, own: Points) -> Bools:
    """Whether of the means that points are a node, or the tool of that ``number``, can move as in :func:`_movable`."""
    owner = np.repeat(np.arange(len(own.node)), np.diff(own.weights.indptr))
    out = np.zeros((len(own.node), 2), dtype=bool)
    np.logical_or.at(out, owner, _movable(scene, space, number, np.asarray(own.weights.indices, np.intp)))
    return out


def _mirrored(scene: Scene, number: int, own: Points) -> Bools:
    """Whether slip and shear are zero at points (p,), of whose mean a half is beyond a plane of symmetry, or an axis.

    There the body slips the other way. A point whose mean stops at the plane has a mirror image of its own.
    """
    tangent = frames(np.array(scene.tools[number].normal))[1]
    rests = scene.mirrored[own.node]
    for plane in scene.planes:
        rests[:, plane.direction] &= ~creased(scene.mesh, own, plane.direction)
    return ~free_along(~rests, tangent)


def _movable(scene: Scene, space: Space, number: int, nodes: Ints) -> Bools:
    """Whether nodes (a,) or the tool of that ``number`` can move along its normal and its tangent (a, 2)."""
    free = space.position[2 * nodes[:, None] + np.arange(2)] >= 0
    led, along = _directions(scene)[number], frames(np.array(scene.tools[number].normal))
    return np.column_stack(
        [free_along(free, direction) | (abs(float(led @ direction)) > ACROSS) for direction in along]
    )


def _directions(scene: Scene) -> Floats:
    """Directions (k, d) along which forces drive the tools; zero where none does."""
    return scene.led(np.ones(len(scene.pushed)))


def _normals(scene: Scene) -> Floats:
    """Normals (k, d) of the tools."""
    return np.array([tool.normal for tool in scene.tools]).reshape(-1, 2)
