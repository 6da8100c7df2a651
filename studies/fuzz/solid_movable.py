"""Which nodes, or tools in space against them, can move along a tool's normal and its tangents, by the study itself."""

from __future__ import annotations

import numpy as np

from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed
from bipot.typing import Bools, Floats, einsum
from studies.fuzz.points import ROUND, TURNS
from studies.fuzz.solid_held import direction_of, freed, nodes_of
from studies.fuzz.solid_placed import axis_of
from studies.fuzz.solid_surfaces import bent, faces
from studies.independent.revolved import nearest
from studies.independent.solid_tools import about

FREE = 1e-12
"""A direction of which supports leave no more than this cannot move."""


def movable(scene: Scene, number: int) -> Bools:
    """Whether nodes (a, 2), or the tool by what drives it, can move along its normal, and along any tangent.

    A normal that turns is any direction. Along the tangents of a bent tool a node goes that supports leave any, but
    where they hold all of these and neither it nor the tool ever goes along what they hold.
    """
    tool, left = scene.tools[number], freed(scene)
    seen = nearest(faces(tool.face), scene.mesh.nodes)
    led = _led(scene, number)
    n = seen.normal
    along, beside = np.linalg.norm(einsum("aij,aj->ai", left, n), axis=-1), _beside(left, n)
    by_tool = np.abs(einsum("maj,aj->ma", led, n)), np.array([_off(way, n) for way in led]).reshape(len(led), len(n))
    moves = np.column_stack([along, beside]) > FREE
    moves |= np.stack([(by > FREE).any(axis=0) for by in by_tool], axis=1)
    if not bent(tool):
        return moves
    free, comes = np.abs(left).max(axis=(1, 2)) > FREE, _comes(scene, number)
    turns = _turns(scene, number, np.eye(3) - left, led)
    return np.column_stack([free | comes, (free & (moves[:, 1] | turns)) | comes])


def _beside(left: Floats, n: Floats) -> Floats:
    """How much (a,) of all tangents is left (a, 3, 3)."""
    across = np.eye(3) - n[:, :, None] * n[:, None]
    return np.linalg.norm(left @ across, axis=(1, 2))


def _off(way: Floats, n: Floats) -> Floats:
    """How long (a,) vectors (a, 3) are across the normals (a, 3)."""
    return np.linalg.norm(way - np.vecdot(way, n)[:, None] * n, axis=1)


def _led(scene: Scene, number: int) -> Floats:
    """Directions (m, a, 3) in which what drives the tool takes its points at nodes at rest."""
    tool, x, out = scene.tools[number], scene.mesh.nodes, list[Floats]()
    if tool.driven_by is not None:
        way = np.array(tool.driven_by.vector)
        out.append(np.tile(way / np.linalg.norm(way), (len(x), 1)))
    if tool.turn is not None and tool.turn.driven_by is not None:
        # A point goes by its arm, of which what is round-off of places is none.
        out.append(np.cross(axis_of(tool), (x - tool.turn.centre) / scene.mesh.size))
    return np.array(out).reshape(-1, *x.shape)


def _turns(scene: Scene, number: int, held: Floats, led: Floats) -> Bools:
    """Whether (a,) tool or support ever go along what supports hold, (a, 3, 3), or the tool turns."""
    tool = scene.tools[number]
    if tool.turn is not None:
        return np.abs(held).max(axis=(1, 2)) > FREE
    steps = np.diff([np.broadcast_to(multiple, 3) for _, multiple in tool.path], axis=0)
    ways = [np.tile(way, (len(held), 1)) for way in steps * np.array(tool.travel)]
    goes = np.zeros(len(held), dtype=bool)
    for way in [*ways, *led]:
        goes |= _along(held, way)
    for support in scene.supports:
        if isinstance(support, Prescribed) and support.displacement != 0:
            own = np.zeros_like(scene.mesh.nodes)
            own[nodes_of(scene, support)] = direction_of(support)
            goes |= _along(held, own)
    return goes


def _along(held: Floats, way: Floats) -> Bools:
    """Whether vectors (a, 3) have a part in what is held (a, 3, 3)."""
    sizes = np.linalg.norm(einsum("aij,aj->ai", held, way), axis=1)
    return (sizes > FREE * np.linalg.norm(way, axis=1)) & (sizes > 0)


def _comes(scene: Scene, number: int) -> Bools:
    """Whether (a,) the force or moment that drives a bent tool ever changes its gap to a node."""
    tool, x = scene.tools[number], scene.mesh.nodes
    if tool.driven_by is not None or tool.turn is None or tool.turn.driven_by is None:
        return np.full(len(x), tool.driven_by is not None)
    own, centre = faces(tool.face), np.array(tool.turn.centre)
    gaps = [nearest(own, (x - centre) @ about(axis_of(tool), angle) + centre).gap for angle in TURNS.tolist()]
    far = max(face.extent for face in own) + float(np.abs(centre).max() + np.abs(x).max())
    return np.ptp(gaps, axis=0) > ROUND * far
