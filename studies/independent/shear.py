r"""What the shear yield stress lets friction carry, written a second time for the fuzz study: nothing of the library.

Of a node with the share m it is m sum_e w_e k_e A_e over the edges e of the tool's boundaries that it is on: k_e the
mean of sigma_Y(p) / sqrt 3 over the volume of the element behind the edge, A_e what belongs to the node of the edge's
area where equilibrium is asked, and w_e = 1 - 4 g / h between 0 and 1, h the edge's chord and g the largest gap of its
nodes. A_e is the integral of the node's shape function by Gauss' rule of three points; where one is negative it is
none, and the others are less by one factor, so that the edge has its area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.data import Floats, Ints
from studies.independent.shapes import line

OFF = 0.25
"""An edge is off the tool where a node of it is farther from that than this over its chord."""


@dataclass(frozen=True)
class Edges:
    """Edges (f, n) of a tool's boundaries, end, middle, end, with the numbers of the elements behind them (f,)."""

    nodes: Ints
    owner: Ints


def carried(edges: Edges, gap: Floats, strength: Floats, balanced: Floats, end: Floats, axisymmetric: bool) -> Floats:
    """Forces (a,) of m = 1 by node: gaps (a,) to the tool, k (e,), where nodes (a, 2) balance and where they end."""
    chord = np.linalg.norm(end[edges.nodes[:, -1]] - end[edges.nodes[:, 0]], axis=1)
    lies = np.clip(1 - gap[edges.nodes].max(axis=1) / (OFF * chord), 0.0, 1.0)
    out = np.zeros(len(end))
    area = shares(balanced[edges.nodes], axisymmetric)
    np.add.at(out, edges.nodes, (lies * strength[edges.owner])[:, None] * area)
    return out


def shares(x: Floats, axisymmetric: bool) -> Floats:
    """Areas (f, n) of the nodes of edges at x (f, n, 2), none negative."""
    s, weight = np.polynomial.legendre.leggauss(3)
    N, slopes = line(s, x.shape[1])
    length = np.linalg.norm(np.einsum("kq,fkd->fqd", slopes, x), axis=-1)
    around = 2 * np.pi * np.einsum("kq,fk->fq", N, x[..., 0]) if axisymmetric else np.ones_like(length)
    own = np.einsum("kq,fq->fk", N, weight * length * around)
    kept = np.maximum(own, 0.0)
    return kept * (own.sum(axis=1) / kept.sum(axis=1))[:, None]


def mean_shear(yield_stress: Floats, volume: Floats) -> Floats:
    """k (e,) of yield stresses and volumes (e, q)."""
    return (yield_stress * volume).sum(axis=1) / volume.sum(axis=1) / np.sqrt(3)
