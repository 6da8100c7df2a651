"""How deep faces of bodies in space are in tools between their nodes, looked at by the fuzz study itself."""

from __future__ import annotations

import numpy as np

from bipot.control.accepted import Accepted
from bipot.scene.scene import Scene
from bipot.typing import Floats, Ints, einsum
from studies.fuzz.solid_placed import solid
from studies.fuzz.solid_points import faces_of
from studies.fuzz.solid_surfaces import bent, faces
from studies.independent.between import ALLOWED

PARTS = 16
"""Into how many the sides of a face's triangles are cut."""


def between(scene: Scene, accepted: Accepted) -> float:
    """The largest depth in bent tools over the one allowed: a quarter of a face's longest edge, or of the tool's size.

    Of faces that the tool may touch, as triangles between their outlines and their middles, at the end.
    """
    worst = 0.0
    for k, tool in enumerate(scene.tools):
        if bent(tool):
            shape, rings = solid(scene, k, accepted), accepted.state.nodes[_around(faces_of(scene.mesh, tool))]
            after = np.roll(rings, -1, axis=1)
            middle = np.broadcast_to(rings.mean(axis=1, keepdims=True), rings.shape)
            x = einsum("pk,kfmd->fmpd", _places(), np.array([rings, after, middle]))
            gap = shape.near(shape.seen(x.reshape(-1, 3), shape.ended)).gap.reshape(len(rings), -1).min(axis=1)
            longest = np.linalg.norm(after - rings, axis=2).max(axis=1)
            allowed = ALLOWED * np.minimum(longest, min(face.thick for face in faces(tool.face)))
            worst = max(worst, float((-gap / allowed).max()))
    return worst


def _around(faces: Ints) -> Ints:
    """The nodes (f, n) of faces (f, n), corners first, all around."""
    count = faces.shape[1] // 2
    if faces.shape[1] < 6:
        return faces
    return np.stack([faces[:, :count], faces[:, count:]], axis=2).reshape(len(faces), -1)


def _places() -> Floats:
    """Barycentric coordinates (p, 3) on a triangle."""
    every = np.array([(i, j, PARTS - i - j) for i in range(PARTS + 1) for j in range(PARTS + 1 - i)])
    return every / PARTS
