"""The rounded punch without friction by a second route: scikit-fem's elements on meshes that match at the contact.

Small strain, bilinear elements with 2 x 2 points as they are. Nodes of both bodies are at the same r, so that the
contact is that of pairs: u_z of the punch plus its gap at rest is at least u_z of the foundation, and both are equal in
a set of pairs that is found step by step, until forces in it push and gaps elsewhere are open.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl
from skfem import Basis, BilinearForm, ElementQuad1, ElementVector, FacetBasis, LinearForm, MeshQuad

from bipot import Elasticity, Mesh
from bipot.typing import Bools, Floats, Ints

STEPS = 20
"""Most steps to find which pairs touch."""


def stiffness(basis: Basis, elasticity: Elasticity) -> sp.csr_matrix:
    """Of a ring, 2 pi int (lambda tr e tr f + 2 G e : f) r."""
    shear, lame = elasticity.shear, elasticity.bulk - 2 * elasticity.shear / 3

    def energy(u: Any, v: Any, w: Any) -> Any:
        e, f = ((g.grad[0, 0], g.grad[1, 1], g[0] / w.x[0], g.grad[0, 1] + g.grad[1, 0]) for g in (u, v))
        inner = sum(one * other for one, other in zip(e[:3], f[:3], strict=True)) + e[3] * f[3] / 2
        return 2 * np.pi * w.x[0] * (lame * sum(e[:3]) * sum(f[:3]) + 2 * shear * inner)

    return sp.csr_matrix(BilinearForm(energy).assemble(basis))


def basis_of(mesh: Mesh) -> Basis:
    """Displacements of two components, 2 k and 2 k + 1 of node k."""
    return Basis(MeshQuad(mesh.nodes.T.copy(), mesh.elements.T.copy()), ElementVector(ElementQuad1()), intorder=3)


def pressed(basis: Basis, height: float, pressure: float) -> Floats:
    """Nodal forces of a pressure on the top at this height."""

    def work(v: Any, w: Any) -> Any:
        return -2 * np.pi * w.x[0] * pressure * v[1]

    top = basis.mesh.facets_satisfying(lambda x: np.isclose(x[1], height))
    return np.asarray(
        LinearForm(work).assemble(FacetBasis(basis.mesh, ElementVector(ElementQuad1()), facets=top, intorder=3))
    )


def touching(
    stiff: sp.csr_matrix, load: Floats, held: Ints, upper: Ints, lower: Ints, gap: Floats, sure: Bools
) -> Floats:
    """Displacements (n,) where gap + u_upper - u_lower >= 0 of pairs (p,), of which ``sure`` ones (p,) touch."""
    closed = sure.copy()
    for _ in range(STEPS):
        same = np.arange(len(load))
        same[upper[closed]] = lower[closed]
        _, column = np.unique(same, return_inverse=True)
        merge = sp.csr_matrix((np.ones(len(load)), (np.arange(len(load)), column)))
        offset = np.zeros(len(load))
        offset[upper[closed]] = -gap[closed]
        free = np.setdiff1d(np.arange(merge.shape[1]), column[held])
        whole = np.zeros(merge.shape[1])
        reduced = (merge.T @ stiff @ merge).tocsr()[free][:, free]
        whole[free] = sl.spsolve(reduced.tocsc(), (merge.T @ (load - stiff @ offset))[free])
        u = merge @ whole + offset
        pushed = (stiff @ u)[lower] < 0
        now = np.where(closed, pushed | sure, gap + u[upper] - u[lower] < -1e-12)
        if (now == closed).all():
            return u
        closed = now
    raise RuntimeError("pairs that touch are not found")


def below(basis: Basis, elasticity: Elasticity, u: Floats) -> float:
    """The mean sigma_zz at the points of the element on the axis below the contact at z = 0."""
    at = basis.interpolate(u)
    strain = at.grad[0, 0], at.grad[1, 1], at[0] / basis.global_coordinates()[0]
    stress = (elasticity.bulk - 2 * elasticity.shear / 3) * sum(strain) + 2 * elasticity.shear * strain[1]
    corners = basis.mesh.p[:, basis.mesh.t]
    (element,) = np.flatnonzero((corners[0].min(axis=0) == 0) & (corners[1].max(axis=0) == 0))
    return float(stress[element].mean())


def matched(
    punch: Mesh, foundation: Mesh, elastic: tuple[Elasticity, Elasticity], pressure: float, reach: tuple[float, float]
) -> tuple[float, float]:
    """u_z of the foundation on the axis, and sigma_zz of the element there; contact is sure and possible to ``reach``.

    The base of the foundation is held, and the ``pressure`` acts on the top of the punch.
    """
    both = [basis_of(mesh) for mesh in (punch, foundation)]
    stiff = sp.block_diag([stiffness(*each) for each in zip(both, elastic, strict=True)]).tocsr()
    load = np.append(pressed(both[0], float(punch.nodes[:, 1].max()), pressure), np.zeros(both[1].N))
    faces = punch.boundary_nodes("base"), foundation.boundary_nodes("top")
    faces = [
        each[np.argsort(mesh.nodes[each, 0])][: int((mesh.nodes[each, 0] <= reach[1]).sum())]
        for mesh, each in zip((punch, foundation), faces, strict=True)
    ]
    upper, lower = 2 * faces[0] + 1, both[0].N + 2 * faces[1] + 1
    axes = [2 * mesh.boundary_nodes("left") for mesh in (punch, foundation)]
    base = both[0].N + 2 * foundation.boundary_nodes("base")
    held = np.unique(np.concatenate([axes[0], both[0].N + axes[1], base, base + 1]))
    r, z = punch.nodes[faces[0]].T
    u = touching(stiff, load, held, upper, lower, z, r <= reach[0])
    return float(u[lower[0]]), below(both[1], elastic[1], u[both[0].N :])
