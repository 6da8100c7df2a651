"""Nodes at flat tools in space, and the law of friction on discs of two tangents, made by the fuzz study itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bipot.control.accepted import Accepted
from bipot.response import State
from bipot.scene.scene import Scene
from bipot.scene.supports import Symmetry
from bipot.tools.tool import FlatTool
from bipot.typing import Bools, Floats, Ints
from studies.flat import axis_of, flat_tools
from studies.fuzz.solid_loads import held, prescribed_at

EPS = 64 * float(np.finfo(np.float64).eps)
"""Round-off of a gap over the numbers that it is the difference of."""

TOUCHING = 1e-9
"""A welded node is tied below this gap over the size."""

FREE = 1e-12
"""A direction with less than this on free components cannot move."""

TOGETHER = 1e-9
"""A slip below this fraction of what tool and support move by is none."""


@dataclass(frozen=True)
class Touching:
    """Candidates (c,) of an increment: ``node``, ``tool``, ``frames`` (c, 3, 3) by rows n, t, n x t, and coefficients.

    ``gap`` (c,) is that of the end and ``blur`` (c,) its round-off; ``slip`` (c, 2) is zero where friction is of no
    unknown. Where supports hold both tangents ``dragged`` (c, 2) is what the tool slips by along them. ``motion``
    (c, 3) is the tool's, ``inside`` how deep nodes held along the normal are in tools.
    """

    node: Ints
    tool: Ints
    frames: Floats
    mu: Floats
    tied: Bools
    gap: Floats
    blur: Floats
    slip: Floats
    dragged: Floats
    motion: Floats
    opened: Floats
    inside: float

    def vectors(self, r: Floats) -> Floats:
        """Forces r (c, 3) as vectors (c, 3)."""
        return np.einsum("ci,cij->cj", r, self.frames)

    def on_nodes(self, vectors: Floats, count: int) -> Floats:
        """Sums (count, 3) of vectors (c, 3) at nodes."""
        out = np.zeros((count, 3))
        np.add.at(out, self.node, vectors)
        return out

    def rubbed(self, r: Floats) -> Floats:
        """Forces r (c, 3) with the friction of tools on what supports hold."""
        out, size = r.copy(), np.linalg.norm(self.dragged, axis=1, keepdims=True)
        mu = np.where(np.isinf(self.mu), 0.0, self.mu)[:, None]
        out[:, 1:] -= mu * r[:, :1] * self.dragged / np.where(size > 0, size, 1.0)
        return out

    def off(self, r: Floats, rho: Floats) -> Floats:
        """How far (c,) forces r (c, 3) are from the law, lengths made forces by rho (c,)."""
        mu = np.where(np.isinf(self.mu) | (self.dragged != 0).any(axis=1), 0.0, self.mu)
        u = np.column_stack([self.gap + mu * np.linalg.norm(self.slip, axis=1), self.slip])
        rests = rho * np.linalg.norm(np.column_stack([self.gap, self.slip]), axis=1)
        return np.where(self.tied, rests, np.linalg.norm(r - projected(r - rho[:, None] * u, mu), axis=1))


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


def frame(normal: Floats) -> Floats:
    """Rows n, t, n x t: t is the axis that is least along n, made to be across it."""
    first = np.eye(3)[np.argmin(np.abs(normal))]
    t = first - (first @ normal) * normal
    t /= np.linalg.norm(t)
    return np.stack([normal, t, np.asarray(np.cross(normal, t), dtype=np.float64)])


class Gone(NamedTuple):
    """How far (3,) a tool has gone since rest at the start of an increment, and at its end."""

    start: Floats
    end: Floats

    @staticmethod
    def of(scene: Scene, accepted: Accepted, k: int) -> Gone:
        """The k-th tool's: on its path, and along the force that drives it."""
        tool = flat_tools(scene)[k]
        driven = [i for i, other in enumerate(scene.tools) if other.driven_by is not None]
        taus = [tau for tau, _ in tool.path]
        values = np.array([np.broadcast_to(multiple, 3) for _, multiple in tool.path], dtype=np.float64)

        def at(state: State) -> Floats:
            out = np.array([np.interp(state.tau, taus, own) for own in values.T]) * np.array(tool.travel)
            if tool.driven_by is not None:
                out = out + state.translation[driven.index(k)] * tool.driven_by.direction
            return out

        return Gone(at(accepted.start), at(accepted.state))


def touching(scene: Scene, accepted: Accepted) -> Touching:
    """The candidates of an increment: nodes of tools' boundaries that can move along the normal, or their tool can."""
    found = [_of_tool(scene, accepted, k) for k in range(len(scene.tools))]
    inside = max((f.inside for f in found), default=0.0)
    names = [name for name in Touching.__annotations__ if name != "inside"]
    joined = {name: np.concatenate([getattr(f, name) for f in found]) for name in names}
    before = accepted.start.gap
    if len(joined["node"]) != len(before):
        raise ValueError(f"{len(before)} gaps for {len(joined['node'])} candidates")
    agrees = np.abs(accepted.state.gap - joined["gap"]) <= joined["blur"]
    joined["blur"] = np.where(agrees, EPS * np.linalg.norm(accepted.state.du[joined["node"]], axis=1), 0.0)
    joined["gap"] = np.where(agrees, accepted.state.gap, joined["gap"])
    joined["tied"] = np.isinf(joined["mu"]) & (before <= TOUCHING * scene.mesh.size)
    return Touching(**joined, inside=inside)


def _of_tool(scene: Scene, accepted: Accepted, k: int) -> Touching:
    """Those of the k-th tool, gaps by positions."""
    tool, fixed, end = flat_tools(scene)[k], held(scene), accepted.state
    rows, gone = frame(np.array(tool.normal)), Gone.of(scene, accepted, k)
    motion = gone.end - gone.start
    if tool.driven_by is not None:
        motion = _exactly(scene, accepted, tool, k)
    nodes = np.unique(np.concatenate([scene.mesh.boundaries[b].ravel() for b in tool.candidates]))
    led = np.zeros(3) if tool.driven_by is None else rows @ tool.driven_by.direction
    free = (~fixed[nodes, None] & (np.abs(rows) > FREE)).any(axis=2) | (np.abs(led) > FREE)
    gap = (end.nodes[nodes] - np.array(tool.point) - gone.end) @ rows[0]
    own, sliding = nodes[free[:, 0]], free[free[:, 0], 1:].any(axis=1)
    still, du = _still(scene, rows, own), end.du[own] - motion
    mu = np.array([tool.mu_at.get(int(a), tool.mu) for a in own])
    rubs = sliding & ~still & (mu > 0)
    slip = du @ rows[1:].T
    asked = prescribed_at(scene, end.tau) - prescribed_at(scene, accepted.start.tau)
    together = np.linalg.norm(slip, axis=1) <= TOGETHER * (np.linalg.norm(asked[own], axis=1) + np.linalg.norm(motion))
    size = np.abs(end.nodes[own]).max(axis=1, initial=0.0) + np.abs(np.array(tool.point) + gone.end).max()
    return Touching(
        node=own,
        tool=np.full(len(own), k),
        frames=np.broadcast_to(rows, (len(own), 3, 3)),
        mu=np.where(rubs | ~sliding, mu, 0.0),
        tied=np.zeros(len(own), dtype=bool),
        gap=gap[free[:, 0]],
        blur=EPS * size,
        slip=np.where(rubs[:, None], slip, 0.0),
        dragged=np.where((~sliding & ~together)[:, None], slip, 0.0),
        motion=np.broadcast_to(motion, (len(own), 3)),
        opened=du @ rows[0],
        inside=max(0.0, -float((gap[~free[:, 0]]).min(initial=0.0))),
    )


def _exactly(scene: Scene, accepted: Accepted, tool: FlatTool, k: int) -> Floats:
    """Motion of a driven tool by its own advance, not by a difference of places."""
    driven = [i for i, other in enumerate(scene.tools) if other.driven_by is not None]
    assert tool.driven_by is not None
    return accepted.state.translated[driven.index(k)] * tool.driven_by.direction


def _still(scene: Scene, rows: Floats, own: Ints) -> Bools:
    """Nodes of which planes of symmetry leave no tangent: slip and shear are zero there."""
    left = np.broadcast_to(rows[1:], (len(own), 2, 3)).copy()
    for support in scene.supports:
        if isinstance(support, Symmetry):
            left[np.isin(own, np.unique(scene.mesh.boundaries[support.boundary])), :, axis_of(support)] = 0.0
    return np.asarray((np.abs(left) <= FREE).all(axis=(1, 2)))
