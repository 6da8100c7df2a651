"""What supports of a body in space hold and drive along any directions, made by the fuzz study itself."""

from __future__ import annotations

import numpy as np

from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.typing import Bools, Floats, Ints

ONE = 1e-9
"""Directions nearer to each other than this are one."""

SAME = 1e-9
"""Of planes of symmetry: the sine up to which two normals are one's."""


def multiple(amplitude: Amplitude, tau: float) -> float:
    """That of an amplitude at a time."""
    taus, multiples = np.transpose(amplitude.points)
    return float(np.interp(tau, taus, multiples))


def direction_of(support: Support) -> Floats:
    """The unit vector (3,) that a support is along."""
    if isinstance(support.direction, int):
        return np.eye(3)[support.direction]
    return np.array(support.direction) / np.linalg.norm(support.direction)


def nodes_of(scene: Scene, support: Support) -> Ints:
    """Those (n,) of its boundary."""
    return np.unique(scene.mesh.boundaries[support.boundary])


def holders(scene: Scene) -> dict[int, list[Support]]:
    """The supports of each node that has any."""
    out = dict[int, list[Support]]()
    for support in scene.supports:
        for node in nodes_of(scene, support).tolist():
            out.setdefault(node, []).append(support)
    return out


def freed(scene: Scene) -> Floats:
    """What supports leave of nodes' vectors: projections (a, 3, 3)."""
    out = np.tile(np.eye(3), (len(scene.mesh.nodes), 1, 1))
    for node, own in holders(scene).items():
        _, sizes, ways = np.linalg.svd(np.array([direction_of(support) for support in own]))
        held = ways[: len(sizes)][sizes > ONE]
        out[node] -= held.T @ held
        # What is held wholly has no round-off left.
        out[node] *= len(held) < 3
    return out


def asked(support: Support, tau: float) -> float:
    """How far since rest a support wants its nodes to be along its direction at a time."""
    return support.displacement * multiple(support.amplitude, tau) if isinstance(support, Prescribed) else 0.0


def prescribed_at(scene: Scene, tau: float) -> Floats:
    """The least displacement (a, 3) since rest with which nodes are where supports ask for them at a time."""
    out = np.zeros(scene.mesh.nodes.shape)
    if any(isinstance(support, Prescribed) for support in scene.supports):
        for node, own in holders(scene).items():
            ways, values = np.array([direction_of(s) for s in own]), [asked(s, tau) for s in own]
            out[node] = np.linalg.lstsq(ways, values, rcond=ONE)[0]
    return out


def misplaced(scene: Scene, moved: Floats, tau: float) -> float:
    """How far at most nodes that ``moved`` (a, 3) since rest are along supports from where these ask for them."""
    off = [
        np.abs(moved[nodes_of(scene, support)] @ direction_of(support) - asked(support, tau)).max()
        for support in scene.supports
    ]
    return float(max(off, default=0.0))


def planes_of(scene: Scene) -> list[tuple[Floats, Bools]]:
    """Planes of symmetry, by their unit normals (3,), and which nodes (a,) are on their boundaries."""
    out = list[tuple[Floats, Bools]]()
    for support in scene.supports:
        if isinstance(support, Symmetry):
            way, inside = direction_of(support), np.zeros(len(scene.mesh.nodes), dtype=bool)
            inside[nodes_of(scene, support)] = True
            alike = [known for known in out if np.linalg.norm(np.cross(known[0], way)) <= SAME]
            if alike:
                alike[0][1][inside] = True
            else:
                out.append((way, inside))
    return out


def whole_size(scene: Scene) -> float:
    """The larger side of the whole body, with its images beyond planes of symmetry."""
    corners = scene.mesh.nodes
    for way, inside in planes_of(scene):
        off = (corners - scene.mesh.nodes[inside].mean(axis=0)) @ way
        corners = np.concatenate([corners, corners - 2 * np.outer(off, way)])
    return float(np.ptp(corners, axis=0).max())
