r"""What the shear yield stress lets friction carry on faces, written a second time for the fuzz study.

Of a node with the share m it is m sum_f w_f k_f A_f over the faces f of the tool's boundaries that it is on, as of
edges in :mod:`studies.independent.shear`: A_f is the integral of the node's shape function over the face, none where
that is negative and the others then less by one factor, and w_f = 1 - 4 s between 0 and 1, s how steeply it leaves the
tool: the least gap of its nodes over the longest distance of its corners, and what the gap grows by from one node to
another over their distance, the most of all pairs, of those with a middle node by half. Of a mean around a corner A_f
is the integral of its psi (:mod:`studies.independent.fans`), and gaps are those of means.
"""

from __future__ import annotations

import numpy as np

from studies.independent.data import Floats, Ints
from studies.independent.fans import shares
from studies.independent.shear import OFF
from studies.independent.solid import face_forces

CORNERS = {3: 3, 4: 4, 6: 3, 8: 4}
"""Of faces by their nodes; corners come first."""


def carried(faces: Ints, points: Ints, gap: Floats, strength: Floats, balanced: Floats, end: Floats) -> Floats:
    """Forces (p,) of m = 1 by point: gaps (p,) to the tool, k (f,) behind the ``faces`` (f, n).

    Of each face ``points`` (f, m) are at its nodes, or around its corners. Areas are those of the nodes where they are
    ``balanced`` (a, 3), lengths those of the ``end``.
    """
    out = np.zeros(len(gap))
    for face, at, k in zip(faces, points, strength.tolist(), strict=True):
        lies = min(max(1 - _slope(end[face[: len(at)]], gap[at]) / OFF, 0.0), 1.0)
        areas = _at_nodes(balanced[face]) if len(at) == len(face) else shares(balanced[face]).sum(axis=1)
        np.add.at(out, at, lies * k * areas)
    return out


def _at_nodes(x: Floats) -> Floats:
    """Areas (n,) of the nodes of a face at x (n, 3), none negative."""
    own, _ = face_forces(x, np.zeros(3))
    kept = np.maximum(own, 0.0)
    return kept * own.sum() / kept.sum()


def _slope(x: Floats, gap: Floats) -> float:
    """s of nodes at x (n, 3) with gaps (n,)."""
    corners, longest, steepest = CORNERS[len(x)], 0.0, 0.0
    for a, (place, own) in enumerate(zip(x, gap.tolist(), strict=True)):
        for b in range(a):
            far = float(np.linalg.norm(place - x[b]))
            longest = max(longest, far if a < corners else 0.0)
            steepest = max(steepest, abs(own - float(gap[b])) / far / (1 if a < corners else 2))
    return float(gap.min()) / longest + steepest
