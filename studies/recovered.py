"""Recoveries of contact tractions beside that of :mod:`bipot.traction`, in its notation.

    edge means   t_e = sum_i (A_ei/A_i) r_i / A_e,          :func:`edge_tractions`, what figures draw,
    consistent   M t = r,  M_ij = sum_e int_e N_i N_j dA,   :func:`consistent_tractions`.

Edge means preserve the resultant and smooth: of a jump between two edges they show five sixths. The consistent recovery
is exact for quadratic tractions, but its inverse has negative entries: where forces alternate from corner to mid-side
its nodal values change sign and leave the cone. It serves where that oscillation, or an error in the mass norm, is
measured.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from bipot.contact.candidates import Candidates
from bipot.fem.reduction import Geometry
from bipot.fem.surface import facet_mass
from bipot.traction import component, contact_edges, multipliers, shared
from bipot.typing import Bools, Floats, Ints


def edge_tractions(nodes: Floats, edges: Ints, geometry: Geometry, forces: Floats) -> Floats:
    """Mean traction t_e (f, k) of nodal ``forces`` (a, k), which the edges (f, n) share in proportion A_ei."""
    own = facet_mass(nodes, edges, geometry).sum(axis=2)
    return shared(own, len(nodes), edges, forces) / own.sum(axis=1)[:, None]


def consistent_tractions(candidates: Candidates, nodes: Floats, r: Floats, closed: Bools) -> tuple[Floats, Floats]:
    """Pressure and shear (c,) by the consistent mass, as :func:`bipot.traction.tractions` but not within sign and cone.

    For weighted points they are the :func:`bipot.traction.multipliers`. At the axis of a quadratic mesh the row of M
    sums to zero, but M is regular, so nothing is lumped. Where a support holds the tangent the row of the shear is
    omitted. In space the shear is the length of its vector.
    """
    pressure, shear = np.full(len(r), np.nan), np.full(len(r), np.nan)
    for number in range(len(candidates.scene.tools)):
        edges = contact_edges(candidates, number, closed)
        line, local = np.unique(edges, return_inverse=True)
        if not line.size:
            continue
        if candidates.points[number].weighted:
            found = multipliers(candidates, number, nodes, r)[line]
            pressure[line], shear[line] = found[:, 0], component(found[:, 1:])
            continue
        mass = facet_mass(nodes, candidates.node[edges], candidates.scene.geometry)
        M = _assemble(mass, local.reshape(edges.shape), len(line))
        free = candidates.tangent_free[line]
        pressure[line] = splu(M).solve(r[line, 0])
        shear[line] = 0.0
        if free.any():
            along = splu(M[free][:, free].tocsc()).solve(r[line[free], 1:])
            shear[line[free]] = component(along)
    return pressure, shear


def _assemble(mass: Floats, local: Ints, size: int) -> sp.csc_matrix:
    rows, columns = np.broadcast_arrays(local[:, :, None], local[:, None, :])
    return sp.csc_matrix((mass.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
