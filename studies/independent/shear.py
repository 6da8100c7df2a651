r"""What the shear yield stress lets friction carry, written a second time for the fuzz study: nothing of the library.

Of a point with the share m it is m sum_e w_e k_e A_e over the edges e of the tool's boundaries that it is of: k_e the
mean of sigma_Y(p) / sqrt 3 over the volume of the element behind the edge, A_e what belongs to it of the edge's
area where equilibrium is asked, and w_e = 1 - 4 g / h between 0 and 1, h the edge's chord and g the largest gap of its
points. A_e is the integral of the node's shape function by Gauss' rule of three points; where one is negative it is
none, and the others are less by one factor, so that the edge has its area. Of a mean around the end of an edge it is
that of psi (:mod:`studies.independent.sampling`), which is the end's shape function and half of the middle's.
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
    """Edges of a tool's boundaries by ``nodes`` (f, n), as end, middle, end, with the elements behind them (f,).

    ``points`` (f, m) are those where contact is posed, at the nodes or around the two ends.
    """

    nodes: Ints
    owner: Ints
    points: Ints


def carried(edges: Edges, gap: Floats, strength: Floats, balanced: Floats, end: Floats, axisymmetric: bool) -> Floats:
    """Forces (p,) of m = 1 by point: gaps (p,) to the tool, k (e,), where nodes (a, 2) balance and where they end."""
    chord = np.linalg.norm(end[edges.nodes[:, -1]] - end[edges.nodes[:, 0]], axis=1)
    lies = np.clip(1 - gap[edges.points].max(axis=1) / (OFF * chord), 0.0, 1.0)
    out = np.zeros(len(gap))
    area = (shares if edges.points.shape == edges.nodes.shape else around)(balanced[edges.nodes], axisymmetric)
    np.add.at(out, edges.points, (lies * strength[edges.owner])[:, None] * area)
    return out


def shares(x: Floats, axisymmetric: bool) -> Floats:
    """Areas (f, n) of the nodes of edges at x (f, n, 2), none negative."""
    own = _integrals(x, axisymmetric)
    kept = np.maximum(own, 0.0)
    return kept * (own.sum(axis=1) / kept.sum(axis=1))[:, None]


def around(x: Floats, axisymmetric: bool) -> Floats:
    """Areas (f, 2) of the means around the ends of edges at x (f, 3, 2)."""
    own = _integrals(x, axisymmetric)
    return own[:, [0, 2]] + own[:, [1]] / 2


def _integrals(x: Floats, axisymmetric: bool) -> Floats:
    """int N dA (f, n) of edges at x (f, n, 2)."""
    s, weight = np.polynomial.legendre.leggauss(3)
    N, slopes = line(s, x.shape[1])
    length = np.linalg.norm(np.einsum("kq,fkd->fqd", slopes, x), axis=-1)
    hoop = 2 * np.pi * np.einsum("kq,fk->fq", N, x[..., 0]) if axisymmetric else np.ones_like(length)
    return np.einsum("kq,fq->fk", N, weight * length * hoop)


def mean_shear(yield_stress: Floats, volume: Floats) -> Floats:
    """k (e,) of yield stresses and volumes (e, q)."""
    return (yield_stress * volume).sum(axis=1) / volume.sum(axis=1) / np.sqrt(3)
