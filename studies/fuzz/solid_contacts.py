"""Points at flat tools in space, and the law of friction on discs of two tangents, made by the fuzz study itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.control.accepted import Accepted
from bipot.fem.strain import Configuration
from bipot.response import State
from bipot.scene.scene import Scene
from bipot.tools.tool import FlatTool
from bipot.typing import Bools, Floats, Ints
from studies.flat import flat_tools
from studies.fuzz.solid_held import freed, prescribed_at
from studies.fuzz.solid_points import faces_of, owners, posed
from studies.independent.data import CARRIES
from studies.independent.shear import mean_shear
from studies.independent.solid import place
from studies.independent.solid_shear import carried

EPS = 64 * float(np.finfo(np.float64).eps)
"""Round-off of a gap over the numbers that it is the difference of."""

TOUCHING = 1e-9
"""A welded node is tied below this gap over the size."""

FREE = 1e-12
"""A direction of which supports leave no more than this cannot move."""

SQUARE = 1e-14
"""Round-off of unit vectors at right angles."""

TOGETHER = 1e-9
"""A slip below this fraction of what tool and support move by is none."""


@dataclass(frozen=True)
class Touching:
    """Candidates (c,) of an increment: ``node``, ``tool``, ``frames`` (c, 3, 3) by rows n, t, n x t, and coefficients.

    Each is the mean of nodes by its ``weights`` (c, a), of whose motion planes of symmetry leave ``within`` (c, 3, 3).
    ``gap`` (c,) is that of the end and ``blur`` (c,) its round-off, ``places`` (c,) that of positions; ``slip`` (c, 2)
    is zero where friction is of no unknown, ``cap`` (c,) what the shear yield stress lets it carry, inf where none is.
    Where supports hold both tangents ``dragged`` (c, 2) is what the tool slips by along them. ``motion`` (c, 3) is the
    tool's, ``inside`` how deep nodes held along the normal are in tools.
    """

    node: Ints
    weights: Floats
    within: Floats
    tool: Ints
    frames: Floats
    mu: Floats
    cap: Floats
    tied: Bools
    gap: Floats
    blur: Floats
    places: Floats
    slip: Floats
    dragged: Floats
    motion: Floats
    opened: Floats
    inside: float

    def vectors(self, r: Floats) -> Floats:
        """Forces r (c, 3) as vectors (c, 3)."""
        return np.einsum("ci,cij->cj", r, self.frames)

    def on_nodes(self, vectors: Floats) -> Floats:
        """What nodes (a, 3) take of vectors (c, 3), as much of each as they have in its mean."""
        return self.weights.T @ np.einsum("cij,cj->ci", self.within, vectors)

    def on_nodes_at_most(self, vectors: Floats) -> Floats:
        """Sizes (a,) of what nodes take of vectors (c, 3)."""
        return np.abs(self.weights).T @ np.linalg.norm(vectors, axis=1)

    def moved_at_most(self, nodal: Floats) -> Floats:
        """Sizes (c,) of what the mean of a nodal field (a, 3) is summed of."""
        return np.abs(self.weights) @ np.linalg.norm(nodal, axis=1)

    def rubbed(self, r: Floats) -> Floats:
        """Forces r (c, 3) with the friction of tools on what supports hold."""
        out, size = r.copy(), np.linalg.norm(self.dragged, axis=1, keepdims=True)
        out[:, 1:] -= self.most(r)[:, None] * self.dragged / np.where(size > 0, size, 1.0)
        return out

    def most(self, r: Floats) -> Floats:
        """Largest friction (c,) under forces r (c, 3); without a coefficient the cap where a point carries at all."""
        carries = r[:, 0] > CARRIES * float(np.linalg.norm(r, axis=1).max(initial=0.0))
        constant, finite = np.isinf(self.mu) & np.isfinite(self.cap), np.isfinite(self.mu)
        by_pressure = np.where(finite, np.where(finite, self.mu, 0.0) * r[:, 0], 0.0)
        return np.where(constant, np.where(carries, self.cap, 0.0), np.minimum(by_pressure, self.cap))

    def off(self, r: Floats, rho: Floats) -> Floats:
        """How far (c,) forces r (c, 3) are from the law, lengths made forces by rho (c,)."""
        mu = np.where(np.isinf(self.mu) | (self.dragged != 0).any(axis=1), 0.0, self.mu)
        u = np.column_stack([self.gap + mu * np.linalg.norm(self.slip, axis=1), self.slip])
        cut = self._cut(r, rho)
        off = np.where(np.isinf(self.cap), np.linalg.norm(r - projected(r - rho[:, None] * u, mu), axis=1), cut)
        rests = rho * np.linalg.norm(np.column_stack([self.gap, self.slip]), axis=1)
        return np.where(self.tied, rests, off)

    def _cut(self, r: Floats, rho: Floats) -> Floats:
        """How far (c,) forces are from the law with a cap: r_n = (r_n - rho gap)+, r_t in the disc of that radius."""
        free = (self.dragged == 0).all(axis=1)
        most = np.where(free, np.maximum(self.most(r), 0.0), 0.0)
        pull = r[:, 1:] - rho[:, None] * self.slip
        length = np.linalg.norm(pull, axis=1)
        shrink = np.minimum(most / np.where(length > 0, length, 1.0), 1.0)
        normal = r[:, 0] - np.maximum(r[:, 0] - rho * self.gap, 0.0)
        return np.hypot(normal, np.linalg.norm(r[:, 1:] - shrink[:, None] * pull, axis=1))


def projected(p: Floats, mu: Floats) -> Floats:
    """Nearest point of the cones |p_t| <= mu p_n, by their three cases.

    >>> projected(np.array([[1.0, 0.0, 3.0]]), np.array([1.0])).tolist()
    [[2.0, 0.0, 2.0]]
    """
    length = np.linalg.norm(p[:, 1:], axis=1)
    edge = np.maximum((p[:, 0] + mu * length) / (1 + mu**2), 0.0)
    way = p[:, 1:] / np.where(length > 0, length, 1.0)[:, None]
    inside = (length <= mu * p[:, 0]) & (p[:, 0] >= 0)
    return np.where(inside[:, None], p, np.column_stack([edge, (mu * edge)[:, None] * way]))


def framed(normal: Floats, frames: Floats) -> Floats:
    """The ``frames`` (c, 3, 3) that forces are stored in, of which the study only asks that they are such of a normal.

    Raises:
        ValueError: rows are not the normal and two tangents, right-angled unit vectors.
    """
    right = np.abs(frames @ frames.swapaxes(1, 2) - np.eye(3)).max(initial=0.0)
    if max(right, np.abs(frames[:, 0] - normal).max(initial=0.0)) > SQUARE:
        raise ValueError("frames of candidates are not those of their tool's normal")
    return frames


class Gone(NamedTuple):
    """How far (3,) a tool has gone since rest at the start of an increment, and at its end."""

    start: Floats
    end: Floats

    @staticmethod
    def of(scene: Scene, accepted: Accepted, k: int) -> Gone:
        """The k-th tool's: on its path, and along the force that drives it."""
        return Gone(gone_at(scene, k, accepted.start), gone_at(scene, k, accepted.state))


def gone_at(scene: Scene, k: int, state: State) -> Floats:
    """How far (3,) the k-th tool has gone since rest at a state."""
    tool = flat_tools(scene)[k]
    driven = [i for i, other in enumerate(scene.tools) if other.driven_by is not None]
    taus = [tau for tau, _ in tool.path]
    values = np.array([np.broadcast_to(multiple, 3) for _, multiple in tool.path], dtype=np.float64)
    out = np.array([np.interp(state.tau, taus, own) for own in values.T]) * np.array(tool.travel)
    if tool.driven_by is not None:
        out = out + state.translation[driven.index(k)] * tool.driven_by.direction
    return out


def touching(scene: Scene, accepted: Accepted) -> Touching:
    """The candidates of an increment: points of which a node can move along the normal, or their tool can."""
    found = [_of_tool(scene, accepted, k) for k in range(len(scene.tools))]
    inside = max((f.inside for f in found), default=0.0)
    names = [name for name in Touching.__annotations__ if name != "inside"]
    joined = {name: np.concatenate([getattr(f, name) for f in found]) for name in names}
    before = accepted.start.gap
    if len(joined["node"]) != len(before):
        raise ValueError(f"{len(before)} gaps for {len(joined['node'])} candidates")
    agrees = np.abs(accepted.state.gap - joined["gap"]) <= joined["blur"]
    moved = np.abs(joined["weights"]) @ np.linalg.norm(accepted.state.du, axis=1)
    joined["blur"] = np.where(agrees, EPS * moved, 0.0)
    joined["gap"] = np.where(agrees, accepted.state.gap, joined["gap"])
    joined["tied"] = np.isinf(joined["mu"]) & np.isinf(joined["cap"]) & (before <= TOUCHING * scene.mesh.size)
    return Touching(**joined, inside=inside)


def movable(scene: Scene, tool: FlatTool) -> Bools:
    """Whether nodes (a, 2), or the tool by a force, can move along its normal, and along any tangent."""
    n, left = np.array(tool.normal), freed(scene)
    across = np.eye(3) - np.outer(n, n)
    led = np.zeros(3) if tool.driven_by is None else tool.driven_by.direction
    along, beside = np.linalg.norm(left @ n, axis=-1), np.linalg.norm(left @ across, axis=(1, 2))
    moved = abs(float(led @ n)), float(np.linalg.norm(across @ led))
    return (np.column_stack([along, beside]) > FREE) | (np.array(moved) > FREE)


def _of_tool(scene: Scene, accepted: Accepted, k: int) -> Touching:
    """Those of the k-th tool, gaps by positions."""
    tool, every, end = flat_tools(scene)[k], posed(scene, k), accepted.state
    normal, gone = np.array(tool.normal), Gone.of(scene, accepted, k)
    motion = gone.end - gone.start
    if tool.driven_by is not None:
        motion = _exactly(scene, accepted, tool, k)
    nodal = movable(scene, tool)
    free = ((every.weights != 0)[:, :, None] & nodal).any(axis=1)
    nodes = np.flatnonzero((every.weights != 0).any(axis=0) & ~nodal[:, 0])
    inside = (end.nodes[nodes] - np.array(tool.point) - gone.end) @ normal
    own, sliding = every.only(free[:, 0]), free[free[:, 0], 1]
    candidates = accepted.solved.iterate.increment.system.candidates
    rows = framed(normal, candidates.frames[candidates.tool == k])
    gap = (own.weights @ end.nodes - np.array(tool.point) - gone.end) @ normal
    still = (np.abs(np.einsum("cij,crj->cri", own.within, rows[:, 1:])) <= FREE).all(axis=(1, 2))
    asked = prescribed_at(scene, end.tau) - prescribed_at(scene, accepted.start.tau)
    du, driven = (np.einsum("cij,cj->ci", own.moved, own.weights @ way) for way in (end.du, asked))
    mu = np.array([tool.mu_at.get(int(a), tool.mu) for a in own.node])
    rubs = sliding & ~still & (mu > 0)
    slip = np.einsum("crj,cj->cr", rows[:, 1:], du - motion)
    # Between axes what is held moves by round-off: by what is asked of it, it does not.
    drawn = np.einsum("crj,cj->cr", rows[:, 1:], driven - motion)
    together = np.linalg.norm(drawn, axis=1) <= TOGETHER * (np.linalg.norm(driven, axis=1) + np.linalg.norm(motion))
    size = np.abs(own.weights) @ np.abs(end.nodes).max(axis=1) + np.abs(np.array(tool.point) + gone.end).max()
    return Touching(
        node=own.node,
        weights=own.weights,
        within=own.moved,
        tool=np.full(len(own.node), k),
        frames=rows,
        mu=np.where(rubs | ~sliding, mu, 0.0),
        cap=_caps(scene, accepted, tool, gone.end)[own.node],
        tied=np.zeros(len(own.node), dtype=bool),
        gap=gap,
        blur=EPS * size,
        places=EPS * size,
        slip=np.where(rubs[:, None], slip, 0.0),
        dragged=np.where((~sliding & ~together)[:, None], drawn, 0.0),
        motion=np.broadcast_to(motion, (len(own.node), 3)),
        opened=(du - motion) @ normal,
        inside=max(0.0, -float(inside.min(initial=0.0))),
    )


def _caps(scene: Scene, accepted: Accepted, tool: FlatTool, gone: Floats) -> Floats:
    """What the shear yield stress lets friction carry by node (a,), inf where none is; the tool has ``gone`` (3,)."""
    share, mesh, end = np.full(len(scene.mesh.nodes), tool.shear), scene.mesh, accepted.state
    for node, own in tool.shear_at.items():
        share[node] = own
    if not np.isfinite(share).any():
        return share
    places = {Configuration.MIDPOINT: end.nodes, Configuration.PAPER: accepted.start.nodes}
    balanced, faces = places.get(scene.configuration, mesh.nodes), faces_of(mesh, tool)
    volume = place(balanced, mesh.elements, scene.rule.value).volume
    strength = mean_shear(scene.material.yield_stress(end.peeq), volume)
    gap = (end.nodes - np.array(tool.point) - gone) @ np.array(tool.normal)
    most = carried(faces, gap, strength[owners(mesh, faces)], balanced, end.nodes)
    return np.where(np.isfinite(share), np.where(np.isfinite(share), share, 0.0) * most, np.inf)


def _exactly(scene: Scene, accepted: Accepted, tool: FlatTool, k: int) -> Floats:
    """Motion of a driven tool by its own advance, not by a difference of places."""
    driven = [i for i, other in enumerate(scene.tools) if other.driven_by is not None]
    assert tool.driven_by is not None
    return accepted.state.translated[driven.index(k)] * tool.driven_by.direction
