"""Flat parts of the facets of a boundary, between all nodes: straights of edges, triangles or squares of faces.

An edge with a node in the middle has two, a triangle with three such nodes four triangles, a square with four such
nodes triangles around its corners and a square between the middles, and any other facet is one itself. All run
anticlockwise around their elements, in space as seen from outside. The hat functions of a flat part are linear along
straights and on triangles, bilinear on squares. Triangles beside squares are squares with two corners that are one, of
which the hat function is the sum of both.
"""

from __future__ import annotations

import numpy as np

from bipot.tensors import norm, unit
from bipot.typing import Floats, Ints

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])

FLATS = {
    6: np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]),
    8: np.array([[0, 4, 7, 7], [4, 1, 5, 5], [5, 2, 6, 6], [6, 3, 7, 7], [4, 5, 6, 7]]),
}
"""The nodes (m, k) of the flat parts of faces by their number of nodes, all in the sense of the whole."""

CORNERS = {6: np.eye(3), 8: SQUARE}
THERE = {n: np.vstack([of, (of + np.roll(of, -1, axis=0)) / 2])[FLATS[n]] for n, of in CORNERS.items()}
"""Places (m, 3, 3) or (m, 4, 2) of these in the whole, barycentric or on a square from -1 to 1."""


def flats(facets: Ints, dimension: int) -> Ints:
    """The flat parts (l, k) of edges (f, n) in a plane, or of faces in space with n = 3, 4, 6 or 8, facet by facet.

    >>> flats(np.array([[3, 4, 5]]), 2).tolist()
    [[3, 4], [4, 5]]
    >>> flats(np.array([[7, 8, 9, 10, 11, 12]]), 3).tolist()
    [[7, 10, 12], [10, 8, 11], [12, 11, 9], [10, 11, 12]]
    """
    if dimension == 2:
        return np.stack([facets[:, :-1], facets[:, 1:]], axis=-1).reshape(-1, 2)
    nodes = FLATS.get(facets.shape[1])
    return facets if nodes is None else facets[:, nodes].reshape(-1, nodes.shape[1])


def outward(corners: Floats) -> Floats:
    """Outward unit normals (l, d) of straights (l, 2, 2), or of the mean planes of triangles and squares (l, k, 3)."""
    if corners.shape[2] == 2:
        along = unit(corners[:, 1] - corners[:, 0])
        return np.stack([along[:, 1], -along[:, 0]], axis=1)
    if corners.shape[1] == 3:
        return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    return unit(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))


def shapes(hats: Floats, flat: Ints, count: int) -> Floats:
    """Shape functions (s, g, n) of facets with n = ``count`` nodes, by the ``hats`` (s, g, k) on their flats (s,)."""
    if hats.shape[-1] == 2:
        parts = count - 1
        return edge_shapes((flat[:, None] % parts + hats[..., 1]) / parts, count)
    if count not in FLATS:
        return hats
    place = hats @ THERE[count][flat % len(FLATS[count])]
    if count == 6:
        return np.concatenate([place * (2 * place - 1), 4 * place * np.roll(place, -1, axis=-1)], axis=-1)
    x, middle = place[..., None, :], (SQUARE + np.roll(SQUARE, -1, axis=0)) / 2
    ends = bilinear(place)[0] * ((x * SQUARE).sum(axis=-1) - 1)
    return np.concatenate([ends, np.where(middle == 0, 1 - x**2, 1 + x * middle).prod(axis=-1) / 2], axis=-1)


def edge_shapes(s: Floats, count: int) -> Floats:
    """Shape functions (…, n) at s (…) in [0, 1] of an edge of n = ``count`` nodes, from end to end.

    >>> edge_shapes(np.array([0.5, 0.25]), 3).tolist()
    [[0.0, 1.0, 0.0], [0.375, 0.75, -0.125]]
    """
    shapes = [1 - s, s] if count == 2 else [(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)]
    return np.stack(shapes, axis=-1)


def edge_slopes(s: Floats, count: int) -> Floats:
    """Derivatives (…, n) by s of :func:`edge_shapes`.

    >>> edge_slopes(np.array([0.5]), 3).tolist()
    [[-1.0, 0.0, 1.0]]
    """
    one = np.ones_like(s)
    slopes = [-one, one] if count == 2 else [4 * s - 3, 4 - 8 * s, 4 * s - 1]
    return np.stack(slopes, axis=-1)


def bilinear(places: Floats) -> tuple[Floats, Floats]:
    """Shape functions (…, 4) of a square at ``places`` (…, 2), and their derivatives (…, 4, 2)."""
    factors = (1 + SQUARE * places[..., None, :]) / 2
    slopes = SQUARE / 2 * factors[..., ::-1]
    return factors[..., 0] * factors[..., 1], slopes


def hat_integrals(corners: Floats, ring: bool) -> Floats:
    """int psi dA (l, k) of hat functions psi, on straights (l, 2, 2), of a ``ring`` per radian, or faces (l, k, 3)."""
    if corners.shape[2] == 2:
        length = norm(corners[:, 1] - corners[:, 0])[:, None] / 2
        if ring:
            return length * (corners[..., 0] * 2 / 3 + corners[:, ::-1, 0] / 3)
        return np.repeat(length, 2, axis=1)
    if corners.shape[1] == 3:
        size = norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        return np.repeat(size[:, None] / 6, 3, axis=1)
    shapes, slopes = bilinear(SQUARE / np.sqrt(3.0))
    first, second = (slopes[..., k] @ corners for k in range(2))
    return norm(np.cross(first, second)) @ shapes


def parabolic(facets: Floats) -> Floats:
    """Facets (f, n, d), linear ones with nodes in the middles of edges: (f, 3, 2) in a plane, else (f, 2 k, 3)."""
    if facets.shape[2] == 2:
        return facets if facets.shape[1] == 3 else np.insert(facets, 1, facets.mean(axis=1), axis=1)
    if facets.shape[1] in FLATS:
        return facets
    return np.concatenate([facets, (facets + np.roll(facets, -1, axis=1)) / 2], axis=1)


def away(lines: Floats) -> Floats:
    """Unit vectors (f, 2, d) along which quadratic edges (f, 3, d), parabolas, go from their ends."""
    start, middle, end = np.moveaxis(lines, 1, 0)
    return unit(np.stack([_leaving(start, middle, end), _leaving(end, middle, start)], axis=1))


def normals(faces: Floats) -> Floats:
    """Unit normals (f, k, 3) of quadratic faces (f, 2 k, 3) at their corners, by the edges that leave these."""
    corner, middle = np.split(faces, 2, axis=1)
    ahead = _leaving(corner, middle, np.roll(corner, -1, axis=1))
    back = _leaving(corner, np.roll(middle, 1, axis=1), np.roll(corner, 1, axis=1))
    return unit(np.cross(ahead, back))


def _leaving(x: Floats, middle: Floats, end: Floats) -> Floats:
    """Derivatives (..., d) at ``x`` of parabolas through their ``middle`` to their ``end``."""
    return 4 * middle - 3 * x - end
