"""Which faces in space go through each other in an increment, and how deep they are in each other at its end."""

from __future__ import annotations

import numpy as np

from bipot.tensors import norm
from bipot.tools.plane import area_of
from bipot.tools.polygons import flats, inside, outward, parts, polygons, seen, within_reach
from bipot.typing import Floats, Ints

DEPTH = 0.25
"""Depth behind a face, over its size, that places may have at which means of gaps vanish."""

THROUGH = 0.75
"""The same over the thickness of the element behind a face: beyond its middle the other side is nearer."""


def crossed(
    nodes: Floats, moved: Floats, points: Ints, faces: Ints, volume: Floats | None = None
) -> tuple[int, list[int]] | None:
    """A node of ``points`` (p,) that goes through one of the ``faces`` (f, n), and which, by the nodes of a flat of it.

    All ``nodes`` (a, 3) go straight to where they have ``moved`` (a, 3). What goes from the outer side of a face's mean
    plane to the inner, and is deeper in the end than :data:`DEPTH` of its size, went through it where it was in it. So
    did what is deeper than :data:`THROUGH` of the element behind it, where its ``volume`` (f,) is given.
    """
    share, faces = parts(faces), flats(faces)
    before, after = nodes[faces], moved[faces]
    area = area_of(seen(after, after))
    deepest = DEPTH * np.sqrt(area)
    if volume is not None:
        deepest = np.minimum(deepest, THROUGH * np.repeat(volume / share, share) / area)
    f, p = _boxes_meet(np.stack([nodes[points], moved[points]], axis=1), np.concatenate([before, after], axis=1))
    p = points[p]
    h, ended = (_height(of[f], x[p]) for of, x in ((before, nodes), (after, moved)))
    through = (h > 0) & (ended < -deepest[f])
    f, p, h, ended = f[through], p[through], h[through], ended[through]
    t = (h / (h - ended))[:, None]
    there = (1 - t[..., None]) * before[f] + t[..., None] * after[f]
    place = seen(there, ((1 - t) * nodes[p] + t * moved[p])[:, None])
    wrong = np.flatnonzero(inside(place, seen(there, there))[:, 0])
    return (int(p[wrong[0]]), faces[f[wrong[0]]].tolist()) if wrong.size else None


def faces_crossed(
    nodes: Floats, moved: Floats, one: Ints, other: Ints, volume: Floats
) -> tuple[list[int], list[int]] | None:
    """A flat of faces ``one`` (f, n) whose middle goes through one of the ``other`` (g, n), and which, as does a node.

    Bars across each other may pass without a node in the other's way. Elements at the latter have the ``volume`` (g,).
    """
    one = flats(one)
    middles = np.vstack([nodes, nodes[one].mean(axis=1)]), np.vstack([moved, moved[one].mean(axis=1)])
    found = crossed(*middles, len(nodes) + np.arange(len(one)), other, volume)
    return None if found is None else (one[found[0] - len(nodes)].tolist(), found[1])


def _boxes_meet(ways: Floats, around: Floats) -> tuple[Ints, Ints]:
    """The faces and the ways (m,) of which boxes around ``around`` (f, n, 3) and ``ways`` (p, 2, 3) meet."""
    middle, centre = ((of.max(axis=1) + of.min(axis=1)) / 2 for of in (ways, around))
    p, f = within_reach(centre, middle, (norm(np.ptp(ways, axis=1)) + norm(np.ptp(around, axis=1)).max()) / 2)
    low, high = around[f].min(axis=1) - ways[p].max(axis=1), ways[p].min(axis=1) - around[f].max(axis=1)
    meet = np.flatnonzero((low <= 0).all(axis=1) & (high <= 0).all(axis=1))
    meet = meet[np.lexsort((p[meet], f[meet]))]
    return f[meet], p[meet]


def _height(faces: Floats, x: Floats) -> Floats:
    """Heights (s,) of x (s, 3) over the mean planes of faces (s, k, 3)."""
    return np.vecdot(x - faces.mean(axis=1), outward(faces))


def deep(nodes: Floats, one: Ints, other: Ints) -> float:
    """How deep faces ``one`` (f, n) and ``other`` (g, n) of ``nodes`` (a, 3) are in each other; 0 up to :data:`DEPTH`.

    That is over the size of the smaller of two of their flats, the root of its area.
    """
    one, other = flats(one), flats(other)
    found = polygons(nodes[one], nodes[other])
    mine, its = (np.sqrt(area_of(seen(of, of))) for of in (nodes[one], nodes[other]))
    depth, smaller = -found.lowest, np.minimum(mine[found.one], its[found.other])
    return float(depth[depth > DEPTH * smaller].max(initial=0.0))
