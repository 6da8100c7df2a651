r"""Where contact is posed in means on faces, written a second time for the fuzz study: nothing of the library.

Around a corner of quadratic faces a point is the mean of their nodes by

    sum_f int_f psi N_k dA / sum_f int_f psi dA,

psi from 1 at this corner to 0 at the others, linear on triangles, bilinear on squares, with the shape functions N_k and
the area dA of rest, by the rules of :func:`studies.independent.solid.on_face`. The sum is over a fan: faces with this
corner, each of which has an edge that ends there in common with another one, from which it turns by no more than 60
degrees. Beyond a plane of symmetry a fan goes on where a face does in its mirror image: it has an edge in the plane,
and turns by no more from its image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.data import Bools, Floats, Ints
from studies.independent.sampling import TURN, Means
from studies.independent.solid import face_rule, on_face

STRAIGHT_TO = 1e-12
"""A cosine less than this below that of 60 degrees is that: what is drawn has no such angles but by chance."""


@dataclass(frozen=True)
class Fans(Means):
    """Means around the corners of ``faces`` (f, n), with the faces' unit normals there (f, k, 3)."""

    faces: Ints
    normal: Floats

    def beyond(self, inside: Bools, way: Floats) -> Bools:
        """Which fans (p,) go on beyond a plane of symmetry with the unit normal ``way`` and the nodes ``inside``."""
        out = np.zeros(len(self.node), dtype=bool)
        corners = self.faces[:, : self.ends.shape[1]]
        for f, face in enumerate(corners):
            for k, node in enumerate(face):
                besides = inside[face[k - 1]] or inside[face[(k + 1) % len(face)]]
                image = self.normal[f, k] - 2 * (self.normal[f, k] @ way) * way
                if inside[node] and besides and _goes_on(self.normal[f, k], image):
                    out[self.ends[f, k]] = True
        return out


def around_corners(rest: Floats, faces: Ints, insides: Floats) -> Fans:
    """Those of quadratic ``faces`` (f, n), corners first, of nodes at ``rest`` (a, 3), which look off ``insides``.

    Fans are in the order of their nodes, and at a node in that of their first faces.
    """
    count = faces.shape[1] // 2
    normal = np.array([_corner_normals(rest[face], inside) for face, inside in zip(faces, insides, strict=True)])
    every = [(int(node), f, k) for f, face in enumerate(faces) for k, node in enumerate(face[:count])]
    fan, node, weights = np.full((len(faces), count), -1, dtype=np.intp), list[int](), list[Floats]()
    held = [shares(rest[face]) for face in faces]
    for at, f, k in sorted(every):
        if fan[f, k] < 0:
            share = np.zeros(len(rest))
            for g, j in spread(faces[:, :count], normal, f, k):
                fan[g, j] = len(node)
                np.add.at(share, faces[g], held[g][j])
            node.append(at)
            weights.append(share / share.sum())
    return Fans(np.array(node, dtype=np.intp), np.array(weights).reshape(-1, len(rest)), fan, faces, normal)


def spread(corners: Ints, normal: Floats, face: int, corner: int) -> list[tuple[int, int]]:
    """The corners of faces, by numbers of both, that are in the fan of one."""
    node, found, left = corners[face, corner], [(face, corner)], [(face, corner)]
    around = [(int(f), int(k)) for f, k in np.argwhere(corners == node)]
    while left:
        f, k = left.pop()
        for g, j in around:
            edges = _edges(corners[f], k) & _edges(corners[g], j)
            if (g, j) not in found and edges and _goes_on(normal[f, k], normal[g, j]):
                found.append((g, j))
                left.append((g, j))
    return found


def _edges(face: Ints, corner: int) -> set[int]:
    """Where the two edges that leave a corner of a face end."""
    return {int(face[corner - 1]), int(face[(corner + 1) % len(face)])}


def _goes_on(one: Floats, other: Floats) -> bool:
    return float(one @ other) >= np.cos(TURN) - STRAIGHT_TO


def _corner_normals(x: Floats, inside: Floats) -> Floats:
    """Unit normals (k, 3) of a face with nodes x (n, 3) at its corners, away from ``inside`` (3,)."""
    ends = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] if len(x) == 6 else [(0, 0), (1, 0), (1, 1), (0, 1)])
    _, slopes = on_face(len(x), ends)
    along, across = (slopes[..., d] @ x for d in (0, 1))
    normal = np.asarray(np.cross(along, across), dtype=np.float64)
    way = np.sign(normal.sum(axis=0) @ (x.mean(axis=0) - inside))
    return way * normal / np.linalg.norm(normal, axis=1, keepdims=True)


def shares(x: Floats) -> Floats:
    """int psi N_k dA (corners, n) of a face with nodes x (n, 3)."""
    points, weights = face_rule(len(x))
    values, slopes = on_face(len(x), points)
    area = weights * np.linalg.norm(np.cross(slopes[..., 0] @ x, slopes[..., 1] @ x), axis=1)
    psi, _ = on_face(len(x) // 2, points)
    return np.einsum("q,qp,qk->pk", area, psi, values)
