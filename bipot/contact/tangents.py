r"""Tangents of candidates in space: the first is along a held tangential direction, where there is one.

Tangents may be rotated about the normal arbitrarily. Where supports or planes of symmetry hold a single direction z of
a point's motion in the tangent plane, friction along z acts on no unknown, and its distribution between tool and
support is not determined. With one tangent along z and the other across it, the first has no row, whatever the axes of
the supports are, and carries nothing.

This applies to flat tools. Slips on curved tools follow the motion of points relative to them, and along z are zero up
to round-off.

With P_a the projections on the free motions of the nodes, and S the projection of their mean by planes of symmetry, z
is the direction of the tangent plane in which S (sum_a P_a) S is zero.
"""

from __future__ import annotations

import numpy as np

from bipot.contact.means import Means
from bipot.scene.holding import Holding
from bipot.typing import Floats, einsum

HELD = 1e-12
"""Over the largest: what is left along a direction that is held, but for round-off; a turn of tangents does no harm."""


def along_what_is_held(frames: Floats, means: Means, holding: Holding) -> Floats:
    """The ``frames`` (c, 3, 3), turned about their normals where they are not along what is held, and something is."""
    tangents = frames[:, 1:]
    left = einsum("cij,cjk,clk->cil", tangents, _left(means, holding), tangents)
    size, ways = np.linalg.eigh(left)
    largest = np.abs(left).max(axis=(1, 2))
    turns = (size[:, 0] <= HELD * largest) & (size[:, 1] > HELD * largest) & (np.abs(left[:, 0, 1]) > HELD * largest)
    out, held = frames.copy(), ways[turns, :, 0]
    held = held * np.where(held[:, :1] < 0, -1.0, 1.0)
    out[turns, 1] = einsum("ci,cij->cj", held, tangents[turns])
    out[turns, 2] = np.cross(frames[turns, 0], out[turns, 1])
    return out


def _left(means: Means, holding: Holding) -> Floats:
    """S (sum_a P_a) S (c, 3, 3) of the candidates."""
    axes = np.tile(np.eye(3), (len(holding.held), 1, 1))
    axes[holding.axes.nodes] = holding.axes.rows
    nodal = einsum("aij,ai,aik->ajk", axes, ~holding.held, axes)
    pattern = means.weights.copy()
    pattern.data[:] = 1.0
    every = np.asarray(pattern @ nodal.reshape(-1, 9)).reshape(-1, 3, 3)
    S = means.within
    return every if S is None else S @ every @ S
