r"""Integrals over facets: the mass of tractions, and the follower force of a pressure with its derivative.

A facet is x = sum_a N_a x_a: in a plane a parabola through three nodes (end, middle, end), or straight between two; in
space a two-dimensional element. Its area vector per unit of reference area is

    n dA = (x_2,1, -x_1,1) in a plane,    x,1 x x,2 in space,

outward where the facet runs anticlockwise. Rules integrate polynomials of degree five exactly: the force, N_a n r on a
ring, and its derivative on every facet; the mass, N_a N_b |n| r, only on flat facets with centred middle nodes, because
on curved ones |n| is no polynomial.
"""

from __future__ import annotations

import numpy as np

from bipot.fem.elements import Reference, facet
from bipot.fem.reduction import Geometry
from bipot.tensors import norm
from bipot.typing import Floats, Ints, einsum

TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""Turns x' of an edge that runs anticlockwise to the outward normal n ds."""


def facet_mass(nodes: Floats, facets: Ints, geometry: Geometry) -> Floats:
    """M_ij = int N_i N_j dA (f, n, n) over facets (f, n) of node numbers; the full ring when axisymmetric.

    It is not exact on curved facets (module docstring).

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> facet_mass(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN).sum()
    np.float64(1.0)
    """
    table = _table(nodes, facets)
    return einsum("fq,qi,qj->fij", facet_weights(nodes, facets, geometry), table.values, table.values)


def facet_weights(nodes: Floats, facets: Ints, geometry: Geometry) -> Floats:
    """dA (f, q) of facets (f, n) at the points of :func:`bipot.fem.elements.facet`; of the full ring on a meridian."""
    table, x = _table(nodes, facets), nodes[facets]
    return _ring(x, geometry, table) * table.weights * norm(_normals(x, table))


def outward_area(nodes: Floats, facets: Ints, geometry: Geometry) -> Floats:
    """int N_a n dA (f, n, d) over facets (f, n) that run anticlockwise, n outward: minus a unit pressure's forces."""
    table, x = _table(nodes, facets), nodes[facets]
    return einsum("fq,qa,fqd->fad", _ring(x, geometry, table) * table.weights, table.values, _normals(x, table))


def outward_area_by_nodes(nodes: Floats, facets: Ints, geometry: Geometry) -> Floats:
    """Derivative (f, d n, d n) of :func:`outward_area` with respect to the facets' nodes."""
    table, x = _table(nodes, facets), nodes[facets]
    weight = _ring(x, geometry, table) * table.weights
    out = einsum("fq,qa,fqibj->faibj", weight, table.values, _normals_by_nodes(x, table))
    if geometry is Geometry.AXISYMMETRIC:
        around, normal = 2 * np.pi * table.weights, _normals(x, table)
        out[..., 0] += einsum("q,qa,fqi,qb->faib", around, table.values, normal, table.values)
    return out.reshape(len(facets), x[0].size, -1)


def _table(nodes: Floats, facets: Ints) -> Reference:
    return facet(facets.shape[1], nodes.shape[1])


def _slopes(x: Floats, table: Reference) -> Floats:
    """x,j (j, f, q, d) along the coordinates of facets with nodes x (f, n, d)."""
    return einsum("qkj,fkd->jfqd", table.gradients, x)


def _normals(x: Floats, table: Reference) -> Floats:
    """The area vectors n dA (f, q, d)."""
    along = _slopes(x, table)
    return along[0] @ TURN.T if len(along) == 1 else np.cross(along[0], along[1])


def _normals_by_nodes(x: Floats, table: Reference) -> Floats:
    """The derivatives (f, q, d, n, d) of the area vectors by the nodes."""
    if x.shape[2] == 2:
        slopes = einsum("qb,ij->qibj", table.gradients[..., 0], TURN)
        return np.broadcast_to(slopes, (len(x), *slopes.shape))
    first, second = _slopes(x, table)
    # Row j of np.cross(v, 1) is v x e_j, the change of v x u as u changes along e_j.
    by_second, by_first = (np.cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2) for v in (first, second))
    changes = einsum("fqij,qb->fqibj", by_second, table.gradients[..., 1])
    return changes - einsum("fqij,qb->fqibj", by_first, table.gradients[..., 0])


def _ring(x: Floats, geometry: Geometry, table: Reference) -> Floats:
    """Circumference (f, q) of the ring at the points of facets with nodes x (f, n, d), or one."""
    if geometry is Geometry.AXISYMMETRIC:
        return 2 * np.pi * (x[..., 0] @ table.values.T)
    return np.ones((len(x), len(table.values)))
