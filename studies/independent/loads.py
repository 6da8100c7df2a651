r"""Nodal forces of loads written a second time, for the fuzz study's recomputation: nothing of the library.

An edge is sampled by eight Gauss points on the parabola through its three nodes, or the line of two. Outward is what
points away from the middle of the edge's element, whatever the numbering.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.data import Floats, Ints
from studies.independent.element import place
from studies.independent.shapes import line, rule, shape_functions

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Applied:
    """What acts at one time: body force (2,) a volume at rest, tractions and pressures on edges, forces on nodes.

    ``edges`` (f, n) list nodes in any order, ``owner`` (f,) their elements; ``traction`` (f, 2) is a force an area at
    rest, ``pressure`` (f,) one on the configuration of equilibrium. ``point`` (a, 2) are forces on nodes.
    """

    body: Floats
    edges: Ints
    owner: Ints
    traction: Floats
    pressure: Floats
    point: Floats


def nodal_loads(
    a: Applied, rest: Floats, nodes: Floats, elements: Ints, quadrature: str, axisymmetric: bool
) -> tuple[Floats, Floats]:
    """Forces (a, 2) of the loads on the configuration ``nodes``, and the sums of their parts' sizes (a,)."""
    out, size = a.point.copy(), np.linalg.norm(a.point, axis=1)
    volume = place(rest, elements, quadrature, axisymmetric).volume
    values, _ = shape_functions(rule(quadrature)[0], elements.shape[1])
    share = np.einsum("eq,qk->ek", volume, values)
    np.add.at(out, elements, share[..., None] * a.body)
    np.add.at(size, elements, np.abs(share) * np.linalg.norm(a.body))
    for k, owner in zip(range(len(a.edges)), a.owner, strict=True):
        edge = _ordered(a.edges[k], elements[owner])
        dead = _along(rest[edge], None, axisymmetric) * np.linalg.norm(a.traction[k])
        way = a.traction[k] / (np.linalg.norm(a.traction[k]) or 1.0)
        inward = -_along(nodes[edge], nodes[elements[owner]].mean(axis=0), axisymmetric) * a.pressure[k]
        part = dead[:, :1] * way + inward
        np.add.at(out, edge, part)
        np.add.at(size, edge, np.linalg.norm(part, axis=1))
    return out, size


def _ordered(edge: Ints, element: Ints) -> Ints:
    """End, middle, end: the middle, if there is one, is no corner of the element."""
    if len(edge) == 2:
        return edge
    middle = np.isin(edge, element[3 if len(element) in (3, 6) else 4 :])
    ends = edge[~middle]
    return np.array([ends[0], edge[middle][0], ends[1]])


def _along(x: Floats, inside: Floats | None, axisymmetric: bool) -> Floats:
    """int N_a dA in the first column (n, 2), or int N_a n dA with n away from ``inside``, of an edge x (n, 2)."""
    N, slopes = line(POINTS, len(x))
    along, at = slopes.T @ x, N.T @ x
    weight = WEIGHTS * (2 * np.pi * at[:, 0] if axisymmetric else 1.0)
    if inside is None:
        length = np.linalg.norm(along, axis=1)
        return np.column_stack([N @ (weight * length), np.zeros(len(x))])
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    middle = normal[len(POINTS) // 2]
    outward = 1.0 if middle @ (at[len(POINTS) // 2] - inside) > 0 else -1.0
    return outward * (N * weight) @ normal
