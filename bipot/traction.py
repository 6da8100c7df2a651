r"""Traction and status on the contact line, from nodal contact forces.

With the consistent mass matrix of the line, assembled on the current three-node edges of a tool's candidate
boundaries of which at least two nodes are closed,

    M_ij = int N_i N_j dA,   M p = r_n,   M tau = r_t,   dA = 2 pi r ds (axisymmetric) or ds (plane strain).

At the axis of an eight-node mesh the row of M sums to zero but M is regular, so nothing is lumped. Where a
support holds the tangent, tau = 0 by symmetry and its row is left out: the support carries that force, not
the tool.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from bipot.contact import Candidates
from bipot.fem.elements import line3
from bipot.fem.kinematics import Geometry
from bipot.laws.coulomb import status
from bipot.programs.data import ContactRows
from bipot.scene import FlatTool

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

FORCE_TOLERANCE = 1e-8
"""A candidate is closed when r_n exceeds this fraction of the increment's largest contact force."""

SLIP_TOLERANCE = 1e-6
"""Slip and gap count as zero below this fraction of the tools' largest travel in the increment."""


@dataclass(frozen=True)
class Traction:
    """What each candidate carries and does: pressure (c,), shear (c,) along t, status (c,), and thresholds.

    Pressure and shear (force per area) are NaN off the contact line. ``status`` holds
    :class:`bipot.laws.coulomb.Status` values, decided with ``force_tol`` (force) and ``slip_tol`` (length).
    """

    pressure: Floats
    shear: Floats
    status: NDArray[np.int8]
    force_tol: float
    slip_tol: float


def traction(candidates: Candidates, rows: ContactRows, x: Floats, nodes: Floats, r: Floats, dtau: float) -> Traction:
    """Traction and status of an increment of length ``dtau`` that moved the free unknowns by x (n,).

    ``nodes`` (a, 2) is the configuration of equilibrium, r (c, d) the forces of all candidates on ``rows``.
    """
    travel = max(float(np.hypot(*tool.travel)) for tool in candidates.scene.tools) * dtau
    force_tol = FORCE_TOLERANCE * float(np.linalg.norm(r, axis=1).max(initial=0.0))
    slip_tol = SLIP_TOLERANCE * travel
    pressure, shear = line_tractions(candidates, nodes, r, r[:, 0] > force_tol)
    state = status(r, rows.motion(x), 0.0, rows.mu, force_tol, slip_tol)
    return Traction(pressure, shear, state, force_tol, slip_tol)


def line_tractions(candidates: Candidates, nodes: Floats, r: Floats, closed: Bools) -> tuple[Floats, Floats]:
    """Pressure and shear (c,) of forces r (c, 2) on the line through ``closed`` candidates, NaN elsewhere."""
    pressure, shear = np.full(len(r), np.nan), np.full(len(r), np.nan)
    for number, tool in enumerate(candidates.scene.tools):
        edges = contact_edges(candidates, number, tool, closed)
        line, local = np.unique(edges, return_inverse=True)
        if not line.size:
            continue
        mass = edge_mass(nodes, candidates.node[edges], candidates.scene.geometry)
        M = _assemble(mass, local.reshape(edges.shape), len(line))
        free = candidates.tangent_free[line]
        pressure[line] = splu(M).solve(r[line, 0])
        shear[line] = 0.0
        if free.any():
            shear[line[free]] = splu(M[free][:, free].tocsc()).solve(r[line[free], 1])
    return pressure, shear


def contact_edges(candidates: Candidates, number: int, tool: FlatTool, closed: Bools) -> Ints:
    """Edges (f, 3) of the tool's boundaries, as candidate numbers, of which at least two nodes are closed.

    An edge with a node that is no candidate is left out: a support carries part of its force.
    """
    place = np.full(len(candidates.scene.mesh.nodes), -1, dtype=np.intp)
    mine = np.flatnonzero(candidates.tool == number)
    place[candidates.node[mine]] = mine
    mesh = candidates.scene.mesh
    edges = place[np.concatenate([mesh.boundary(name) for name in tool.candidates])]
    edges = edges[(edges >= 0).all(axis=1)]
    return edges[closed[edges].sum(axis=1) >= 2]


def edge_mass(nodes: Floats, edges: Ints, geometry: Geometry) -> Floats:
    """M_ij = int N_i N_j dA (f, 3, 3) over edges (f, 3) of node numbers; the full ring when axisymmetric.

    >>> x = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> edge_mass(x, np.array([[0, 1, 2]]), Geometry.PLANE_STRAIN).sum()
    np.float64(1.0)
    """
    line = line3()
    x = nodes[edges]
    length = np.linalg.norm(np.einsum("qk,fkd->fqd", line.gradients[..., 0], x), axis=-1)
    weight = line.weights * length
    if geometry is Geometry.AXISYMMETRIC:
        weight = 2 * np.pi * weight * (x[..., 0] @ line.values.T)
    return np.einsum("fq,qi,qj->fij", weight, line.values, line.values)


def edge_means(nodes: Floats, edges: Ints, geometry: Geometry, values: Floats) -> Floats:
    """Means (f,) of the nodal ``values`` (a,) over the edges' areas; what alternates inside is gone."""
    area = edge_mass(nodes, edges, geometry).sum(axis=1)
    return np.sum(area * values[edges], axis=1) / area.sum(axis=1)


def _assemble(mass: Floats, local: Ints, size: int) -> sp.csc_matrix:
    rows, columns = np.broadcast_arrays(local[:, :, None], local[:, None, :])
    return sp.csc_matrix((mass.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
