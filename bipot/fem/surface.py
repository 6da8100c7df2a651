r"""Integrals over edges: the mass of tractions, and the follower force of a pressure with its derivative.

An edge is the parabola through its three nodes (end, middle, end), or straight between two, x(s) = sum_a N_a x_a.
Three Gauss points integrate polynomials of degree five exactly: the force, N_a x' r on a ring, and its derivative on
every edge; the mass, N_a N_b |x'| r, on straight ones with the middle node in the middle, for on curved ones |x'| is no
polynomial.
"""

from __future__ import annotations

import numpy as np

from bipot.fem.elements import line
from bipot.fem.reduction import Geometry
from bipot.typing import Floats, Ints

TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""Takes x' of an edge that runs anticlockwise to the outward normal n ds."""


def edge_mass(nodes: Floats, edges: Ints, geometry: Geometry) -> Floats:
    """M_ij = int N_i N_j dA (f, n, n) over edges (f, n) of node numbers; the full ring when axisymmetric.

    By Gauss' rule of three points: on curved edges not exact (module docstring).

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> edge_mass(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN).sum()
    np.float64(1.0)
    """
    table = line(edges.shape[1])
    x = nodes[edges]
    length = np.linalg.norm(np.einsum("qk,fkd->fqd", table.gradients[..., 0], x), axis=-1)
    return np.einsum("fq,qi,qj->fij", _ring(x, geometry) * table.weights * length, table.values, table.values)


def outward_area(nodes: Floats, edges: Ints, geometry: Geometry) -> Floats:
    """int N_a n dA (f, n, 2) over edges (f, n) that run anticlockwise, n outward: minus a unit pressure's forces."""
    table = line(edges.shape[1])
    x = nodes[edges]
    along = np.einsum("qk,fkd->fqd", table.gradients[..., 0], x)
    return np.einsum("fq,qa,fqd->fad", _ring(x, geometry) * table.weights, table.values, along @ TURN.T)


def outward_area_by_nodes(nodes: Floats, edges: Ints, geometry: Geometry) -> Floats:
    """Derivative (f, 2n, 2n) of :func:`outward_area` with respect to the edges' nodes."""
    table = line(edges.shape[1])
    x, slopes = nodes[edges], table.gradients[..., 0]
    weight = _ring(x, geometry) * table.weights
    out = np.einsum("fq,qa,qb,ij->faibj", weight, table.values, slopes, TURN)
    if geometry is Geometry.AXISYMMETRIC:
        normal = np.einsum("qk,fkd->fqd", slopes, x) @ TURN.T
        out[..., 0] += 2 * np.pi * np.einsum("q,qa,fqi,qb->faib", table.weights, table.values, normal, table.values)
    return out.reshape(len(edges), 2 * edges.shape[1], -1)


def _ring(x: Floats, geometry: Geometry) -> Floats:
    """Circumference (f, q) of the ring at the points of edges with nodes x (f, n, 2), or one."""
    values = line(x.shape[1]).values
    if geometry is Geometry.AXISYMMETRIC:
        return 2 * np.pi * (x[..., 0] @ values.T)
    return np.ones((len(x), len(values)))
