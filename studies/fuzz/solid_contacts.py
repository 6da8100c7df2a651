"""Points at tools in space in accepted increments: gaps, slips, frames and caps made by the fuzz study itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.control.accepted import Accepted
from bipot.fem.strain import Configuration
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.tools.deformable import AnyTool
from bipot.tools.surfaces import Plane
from bipot.typing import Floats, Ints, Vector, einsum
from studies.fuzz.metals import yield_stress_of
from studies.fuzz.solid_held import prescribed_at, whole_size
from studies.fuzz.solid_movable import FREE, movable
from studies.fuzz.solid_placed import solid, taken_along
from studies.fuzz.solid_points import Posed, faces_of, owners, posed
from studies.fuzz.solid_riding import ridden
from studies.fuzz.solid_surfaces import bent
from studies.fuzz.solid_touching import Touching
from studies.independent.contact import TOUCHING
from studies.independent.riding import Ridden
from studies.independent.sampling import Parts
from studies.independent.shear import mean_shear
from studies.independent.solid import place
from studies.independent.solid_shear import carried
from studies.independent.solid_tools import MetInSpace, Solid, carried_to, met
from studies.independent.tools import Going

EPS = 64 * float(np.finfo(np.float64).eps)
"""Round-off of a gap over the numbers that it is the difference of."""

SQUARE = 1e-14
"""Round-off of unit vectors at right angles."""

TOGETHER = 1e-9
"""A slip below this fraction of what tool and support move by is none."""


def framed(frames: Floats, normal: Vector | None = None) -> Floats:
    """The ``frames`` (c, 3, 3) that forces are stored in, of which the study only asks that they are such.

    Raises:
        ValueError: rows are not right-angled unit vectors that turn to the left, the first of them the ``normal``.
    """
    right = np.abs(frames @ frames.swapaxes(1, 2) - np.eye(3)).max(initial=0.0)
    left = np.abs(np.linalg.det(frames) - 1).max(initial=0.0)
    own = 0.0 if normal is None else np.abs(frames[:, 0] - normal).max(initial=0.0)
    if max(right, own) > SQUARE or left > 0.5:
        raise ValueError("frames of candidates are not those of their tool's normal")
    return frames


def touching(scene: Scene, accepted: Accepted) -> Touching:
    """The candidates of an increment: points of which a node can move along the normal, or their tool can."""
    ways = ridden(scene, accepted)
    joined = Touching.joined([_of_tool(scene, accepted, k, way) for k, way in enumerate(ways)])
    before, after = accepted.start.gap, accepted.state.gap
    if len(joined.node) != len(before):
        raise ValueError(f"{len(before)} gaps for {len(joined.node)} candidates")
    agrees = np.abs(after - joined.gap) <= joined.blur
    curved = np.array([bent(tool) for tool in scene.tools], dtype=bool)[joined.tool]
    moved = joined.at_most(np.linalg.norm(accepted.state.du[joined.part], axis=1))
    moved = np.where(curved, moved + joined.at_most(np.linalg.norm(joined.motion, axis=1)) + joined.unsure, moved)
    return replace(
        joined,
        gap=np.where(agrees, after, joined.gap),
        # A gap to a curved tool grows by what is no linear function of motions: that of places would be off by more.
        opened=np.where(curved & agrees, after - before, joined.opened),
        blur=np.where(agrees, EPS * moved, 0.0),
        tied=np.isinf(joined.mu) & np.isinf(joined.cap) & (before <= TOUCHING * whole_size(scene)),
    )


def _of_tool(scene: Scene, accepted: Accepted, k: int, way: Ridden) -> Touching:
    """Those of the k-th tool, gaps by positions; other tools take the body along a ``way``."""
    tool, every, end = scene.tools[k], posed(scene, k), accepted.state
    shape, nodal = solid(scene, k, accepted), movable(scene, k)
    free = ((every.weights != 0)[:, :, None] & nodal).any(axis=1)
    own, sliding = every.only(free[:, 0]), free[free[:, 0], 1]
    parts, candidates = Parts.of(own.weights), accepted.solved.iterate.increment.system.candidates
    stored = candidates.faces.reference[candidates.parts.first][candidates.tool == k]
    if len(stored) != len(own.node):
        raise ValueError(f"{len(stored)} candidates, not {len(own.node)}")
    reference = framed(stored, tool.face.normal if not bent(tool) and isinstance(tool.face, Plane) else None)
    before = accepted.start.gap[candidates.tool == k]
    going = _going(scene, accepted, parts, way)
    found = met(shape, going, bent(tool) & (before > TOUCHING * whole_size(scene)))
    tangents = [carried_to(reference[parts.owner], normal)[:, 1:] for normal in found.normal]
    kept = einsum("cij,cjk,clk->cil", reference[:, 1:], own.moved, reference[:, 1:])
    still = (np.abs(einsum("cij,crj->cri", own.within, reference[:, 1:])) <= FREE).all(axis=(1, 2))
    mu = np.array([tool.mu_at.get(int(a), tool.mu) for a in own.node])
    rubs = sliding & ~still & (mu > 0)
    slid = parts.sums(parts.share[:, None] * einsum("wij,wj->wi", tangents[1], found.slip))
    x = np.abs(end.nodes).max(axis=1)[parts.node] + shape.extent
    return Touching(
        node=own.node,
        tool=np.full(len(own.node), k),
        mu=np.where(rubs | ~sliding, mu, 0.0),
        cap=_caps(scene, end, tool, shape, shape.ended, every)[free[:, 0]],
        cap_before=_caps(scene, accepted.start, tool, shape, shape.begun, every)[free[:, 0]],
        tied=np.zeros(len(own.node), dtype=bool),
        gap=parts.mean(found.gap[1]),
        opened=parts.mean(np.vecdot(found.normal[1], end.du[parts.node] - found.gone)),
        blur=EPS * parts.most(x),
        places=EPS * parts.most(x),
        unsure=parts.most(found.unsure),
        slip=np.where(rubs[:, None], einsum("cij,cj->ci", kept, slid), 0.0),
        dragged=_dragged(scene, accepted, shape, own, reference) * (~sliding & (not bent(tool)))[:, None],
        kept=kept,
        follow=parts.mean(np.vecdot(found.normal[0], going.by - going.asked(np.ones((len(parts.node), 1))))),
        before=before,
        apart=found.apart,
        left=np.where(found.apart, found.left, before),
        past=parts.any(found.past),
        passing=np.zeros(len(own.node)),
        owner=parts.owner,
        part=parts.node,
        share=parts.share,
        frames=_rows(found, tangents[1], 1),
        begun=_rows(found, tangents[0], 0),
        motion=found.gone,
        inside=_inside(scene, accepted, shape, np.flatnonzero((every.weights != 0).any(axis=0) & ~nodal[:, 0])),
    )


def _going(scene: Scene, accepted: Accepted, parts: Parts, way: Ridden) -> Going:
    """How nodes go, and would in a body at rest that supports and, along a ``way``, other tools take along."""
    start, end, node = accepted.start, accepted.state, parts.node
    by_supports, x = taken_along(scene, start.tau, end.tau)[node], start.nodes[node]

    def asked(fraction: Floats) -> Floats:
        return fraction * by_supports + way.after(x, fraction)

    return Going(parts, x, end.nodes[node], end.du[node], asked)


def _rows(found: MetInSpace, tangents: Floats, when: int) -> Floats:
    """What gap and slip change by (w, 3, 3) as nodes move: n, and the tangents t - g grad n t."""
    gap, normal, gradient = found.gap[when], found.normal[when], found.gradient[when]
    along = tangents - gap[:, None, None] * tangents @ gradient
    return np.concatenate([normal[:, None], along], axis=1)


def _dragged(scene: Scene, accepted: Accepted, shape: Solid, own: Posed, frames: Floats) -> Floats:
    """What a flat tool slips by (c, 2) along points that go as supports ask.

    Between axes what is held moves by round-off: by what is asked of it, it does not.
    """
    asked = prescribed_at(scene, accepted.state.tau) - prescribed_at(scene, accepted.start.tau)
    driven, motion = einsum("cij,cj->ci", own.moved, own.weights @ asked), shape.gone[:3]
    drawn = einsum("crj,cj->cr", frames[:, 1:], driven - motion)
    together = np.linalg.norm(drawn, axis=1) <= TOGETHER * (np.linalg.norm(driven, axis=1) + np.linalg.norm(motion))
    return np.where(together[:, None], 0.0, drawn)


def _inside(scene: Scene, accepted: Accepted, shape: Solid, nodes: Ints) -> float:
    """How deep nodes that are held along the normal are in the tool, but past its open ends, beyond round-off."""
    x = accepted.state.nodes[nodes]
    seen = shape.near(shape.seen(x, shape.ended))
    deep = np.where(seen.past, 0.0, -seen.gap - EPS * (np.abs(x).max(initial=0.0) + shape.extent))
    return max(0.0, float(deep.max(initial=0.0)))


def _caps(scene: Scene, state: State, tool: AnyTool, shape: Solid, pose: Floats, every: Posed) -> Floats:
    """What the shear yield stress lets friction carry at points (p,) in a state, inf where none is asked."""
    share, mesh = np.array([tool.shear_at.get(int(a), tool.shear) for a in every.node]), scene.mesh
    if not np.isfinite(share).any():
        return share
    places = {Configuration.MIDPOINT: state.nodes, Configuration.PAPER: state.nodes - state.du}
    balanced, faces = places.get(scene.configuration, mesh.nodes), faces_of(mesh, tool)
    volume = place(balanced, mesh.elements, scene.rule.value).volume
    strength = mean_shear(yield_stress_of(scene)(state.peeq), volume)
    gap = every.weights @ shape.near(shape.seen(state.nodes, pose)).gap
    most = carried(faces, every.ends, gap, strength[owners(mesh, faces)], balanced, state.nodes)
    return np.where(np.isfinite(share), np.where(np.isfinite(share), share, 0.0) * most, np.inf)
