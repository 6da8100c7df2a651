r"""Integrals over edges: the mass of tractions, and the follower force of a pressure with its derivative.

An edge is the parabola through its three nodes (end, middle, end), x(s) = sum_a N_a x_a. Three Gauss points integrate
what follows exactly, on a ring too: N_a, x' and the radius together are of degree five.
"""

from __future__ import annotations

import numpy as np

from bipot.fem.elements import line3
from bipot.fem.reduction import Geometry
from bipot.typing import Floats, Ints

TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""Takes x' of an edge that runs anticlockwise to the outward normal n ds."""


def edge_mass(nodes: Floats, edges: Ints, geometry: Geometry) -> Floats:
    """M_ij = int N_i N_j dA (f, 3, 3) over edges (f, 3) of node numbers; the full ring when axisymmetric.

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> edge_mass(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN).sum()
    np.float64(1.0)
    """
    line = line3()
    x = nodes[edges]
    length = np.linalg.norm(np.einsum("qk,fkd->fqd", line.gradients[..., 0], x), axis=-1)
    return np.einsum("fq,qi,qj->fij", _ring(x, geometry) * line.weights * length, line.values, line.values)


def outward_area(nodes: Floats, edges: Ints, geometry: Geometry) -> Floats:
    """int N_a n dA (f, 3, 2) over edges (f, 3) that run anticlockwise, n outward: minus a unit pressure's forces."""
    line = line3()
    x = nodes[edges]
    along = np.einsum("qk,fkd->fqd", line.gradients[..., 0], x)
    return np.einsum("fq,qa,fqd->fad", _ring(x, geometry) * line.weights, line.values, along @ TURN.T)


def outward_area_by_nodes(nodes: Floats, edges: Ints, geometry: Geometry) -> Floats:
    """Derivative (f, 6, 6) of :func:`outward_area` with respect to the edges' nodes."""
    line = line3()
    x, slopes = nodes[edges], line.gradients[..., 0]
    weight = _ring(x, geometry) * line.weights
    out = np.einsum("fq,qa,qb,ij->faibj", weight, line.values, slopes, TURN)
    if geometry is Geometry.AXISYMMETRIC:
        normal = np.einsum("qk,fkd->fqd", slopes, x) @ TURN.T
        out[..., 0] += 2 * np.pi * np.einsum("q,qa,fqi,qb->faib", line.weights, line.values, normal, line.values)
    return out.reshape(len(edges), 6, 6)


def _ring(x: Floats, geometry: Geometry) -> Floats:
    """Circumference (f, q) of the ring at the points of edges with nodes x (f, 3, 2), or one."""
    values = line3().values
    if geometry is Geometry.AXISYMMETRIC:
        return 2 * np.pi * (x[..., 0] @ values.T)
    return np.ones((len(x), len(values)))
