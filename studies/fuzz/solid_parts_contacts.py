"""Points between parts in space in accepted increments: gaps, slips and forces on both sides, by the study's own means.

Frames are those that forces are stored in, of which the study asks that they are such and along its own normals. What
rules of integration on squares that are no parallelograms may be off by is no error of the answer: of what is measured
:data:`FACTOR` times the most is taken off by which any of the rough rules differs from the fine one
(:mod:`studies.independent.solid_facing`). On triangles and parallelograms that is nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bipot.control.accepted import Accepted
from bipot.meshes.elements import Element
from bipot.scene.scene import Scene
from bipot.tools.deformable import DeformableTool
from bipot.typing import Floats, Ints, einsum
from studies.fuzz.parts_held import carried
from studies.fuzz.solid_contacts import EPS, framed
from studies.fuzz.solid_points import owners
from studies.fuzz.solid_touching import Touching
from studies.independent.contact import TOUCHING
from studies.independent.solid_facing import ROUGH, SeenInSpace, seen

FACTOR = 4.0
"""The library's rule is of the same degree, on triangles that are cut otherwise."""

SQUARES = Element.H8, Element.H20
"""Elements on whose faces integrands may be rational."""

FAR = 1e3
"""Gap, over the body's size, of what faces nothing."""


@dataclass(frozen=True)
class Between:
    """The points of an increment, ``contact``, and what rules of integration leave open.

    That are forces on nodes, ``forces`` (a,), and their work. ``normal`` is how far frames are from the study's own
    normals, beyond that; ``overlap`` the largest depth of a side in what it faces, over the size.
    """

    contact: Touching
    forces: Floats
    work: float
    normal: float
    overlap: float


def between_parts(scene: Scene, accepted: Accepted) -> Between:
    """The points of all tools."""
    start, end, size = accepted.start, accepted.state, scene.mesh.size
    each = _each(scene, end.nodes)
    fine, early, frames = _joined(each), _joined(_each(scene, start.nodes)), framed(accepted.solved.iterate.frames)
    if len(frames) != len(fine.node):
        raise ValueError(f"{len(frames)} candidates, not {len(fine.node)}")
    rough = [_joined(_each(scene, end.nodes, k)) for k in ROUGH] if scene.mesh.element in SQUARES else []
    off = _off(fine, rough, lambda of: (_gap(of, end.nodes) + of.farther)[:, None])
    off += _off(fine, rough, lambda of: of.weights @ end.du)
    contact = _touching(scene, accepted, (fine, early), [len(of.node) for of in each], frames, off)
    pushed = np.linalg.norm(end.forces, axis=1)
    slanted = np.linalg.norm(frames[:, 0] - fine.normal, axis=1) - _off(fine, rough, lambda of: of.normal)
    weights = np.max([np.zeros(fine.weights.shape), *(np.abs(of.weights - fine.weights) for of in rough)], axis=0)
    return Between(
        contact=contact,
        forces=FACTOR * pushed @ weights,
        work=float((np.linalg.norm(start.forces, axis=1) + pushed) @ (off + 2 * contact.places)),
        normal=float(slanted[fine.part > 0].max(initial=0.0)),
        overlap=-min(_lowest(scene, end.nodes), 0.0) / size,
    )


def _touching(
    scene: Scene,
    accepted: Accepted,
    points: tuple[SeenInSpace, SeenInSpace],
    counts: list[int],
    frames: Floats,
    off: Floats,
) -> Touching:
    """The ``points`` of the end and the start of an increment, so many of each tool, with gaps that may be ``off``."""
    (end, begun), start, state = points, accepted.start, accepted.state
    size, count, reach = scene.mesh.size, len(end.node), np.abs(end.weights)
    owner, node = np.nonzero(end.weights)
    tool = np.repeat(np.arange(len(counts)), counts)
    faces, faced = end.part > 0, begun.part > 0
    away = np.where(faces, end.farther, FAR * size - np.vecdot(end.normal, state.nodes[end.node]))
    gap, here = _gap(end, state.nodes) + away, _gap(end, start.nodes) + away
    # What bears forces at both ends stays in touch; where the other side ends, gaps open from those in the end's means.
    held = start.forces.any(axis=1) & state.forces.any(axis=1) & faces & faced
    meets, met = faces & (end.farther == 0), faced & (begun.farther == 0)
    before = np.where(held | meets & met, _gap(begun, start.nodes) + begun.farther, here)
    places = EPS * (reach @ np.abs(state.nodes)).max(axis=1)
    agrees = np.abs(state.gap - gap) <= 2 * places + off
    moved = end.weights @ state.du
    # What carries touches, though the gap that it closes may be off by what is left of how much it faces.
    touched = (before <= TOUCHING * size + off) | (start.forces[:, 0] > 0)
    slip = einsum("cij,cj->ci", frames[:, 1:], moved)
    come = faces & ~met & ~held
    if (gone := faced & ~meets & ~held & ~come).any():
        earlier = framed(accepted.solved.iterate.increment.system.facing(start.nodes).candidates.frames)
        slip[gone] = einsum("cij,cj->ci", earlier[gone, 1:], begun.weights[gone] @ state.du)
    length = np.linalg.norm(slip, axis=1)
    way = np.divide(length, length + np.maximum(here, 0.0), out=np.zeros(count), where=length > 0)
    return Touching(
        node=end.node,
        tool=tool,
        mu=np.array([scene.tools[k].mu_at.get(int(a), scene.tools[k].mu) for a, k in zip(end.node, tool, strict=True)]),
        cap=np.full(count, np.inf),
        cap_before=np.full(count, np.inf),
        tied=np.zeros(count, dtype=bool),
        gap=np.where(agrees, state.gap, gap),
        opened=np.where(touched, gap - before, np.vecdot(end.normal, moved)),
        blur=np.where(agrees, EPS * (reach @ np.abs(state.du)).max(axis=1), 0.0) + off,
        places=places,
        unsure=reach @ np.linalg.norm(state.du, axis=1) + off / EPS,
        slip=slip,
        dragged=np.zeros((count, 2)),
        kept=np.tile(np.eye(2), (count, 1, 1)),
        follow=np.vecdot(end.normal, moved - end.weights @ carried(scene, start.tau, state.tau)),
        before=before,
        apart=np.zeros(count, dtype=bool),
        left=before,
        past=np.zeros(count, dtype=bool),
        passing=np.where(gone, 1.0, np.where(come, way, 0.0)),
        owner=owner,
        part=node,
        share=end.weights[owner, node],
        frames=frames[owner],
        begun=frames[owner],
        motion=np.zeros((len(owner), 3)),
        inside=0.0,
    )


def sides(scene: Scene, number: int) -> tuple[Ints, Ints]:
    """Faces (f, k) of the candidates of a tool and of its surface, anticlockwise seen from outside."""
    tool = scene.tools[number]
    assert isinstance(tool, DeformableTool)
    return _faces(scene, tool.candidates), _faces(scene, tool.surface)


def _faces(scene: Scene, names: tuple[str, ...]) -> Ints:
    faces = np.concatenate([scene.mesh.boundaries[name] for name in names])
    x, inside = scene.mesh.nodes[faces], scene.mesh.nodes[scene.mesh.elements[owners(scene.mesh, faces)]].mean(axis=1)
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    out = np.vecdot(normal, x.mean(axis=1) - inside) > 0
    # Corners, and after them the middles of edges.
    back = [0, 2, 1, 5, 4, 3] if faces.shape[1] == 6 else [*range(faces.shape[1])][::-1]
    return np.where(out[:, None], faces, faces[:, back])


def _gap(of: SeenInSpace, nodes: Floats) -> Floats:
    """Gaps (p,) with nodes at ``nodes`` (a, 3)."""
    return np.vecdot(of.normal, of.weights @ nodes)


def _off(fine: SeenInSpace, rough: list[SeenInSpace], value: Callable[[SeenInSpace], Floats]) -> Floats:
    """How far (p,) rules may be off a ``value`` (p, n) of points."""
    apart = [np.linalg.norm(value(of) - value(fine), axis=1) for of in rough]
    return FACTOR * np.max([np.zeros(len(fine.node)), *apart], axis=0)


def _each(scene: Scene, nodes: Floats, rough: int | None = None) -> list[SeenInSpace]:
    """The points of each tool with nodes at ``nodes`` (a, 3)."""
    every = enumerate(scene.tools)
    return [seen(scene.mesh.nodes, nodes, *sides(scene, k), rough, welded=tool.welded) for k, tool in every]


def _joined(found: list[SeenInSpace]) -> SeenInSpace:
    """Those of all tools."""
    every = (np.concatenate(of) for of in zip(*(_arrays(of) for of in found), strict=True))
    return SeenInSpace(*every, lowest=min(of.lowest for of in found))


def _arrays(of: SeenInSpace) -> tuple[Ints, Floats, Floats, Floats, Floats]:
    return of.node, of.weights, of.normal, of.part, of.farther


def _lowest(scene: Scene, nodes: Floats) -> float:
    """The least gap along normals of either side."""
    out = 0.0
    for k in range(len(scene.tools)):
        one, other = sides(scene, k)
        out = min(out, *(seen(scene.mesh.nodes, nodes, *both, 0).lowest for both in ((one, other), (other, one))))
    return out
