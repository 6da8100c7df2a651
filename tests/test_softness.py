"""How soft coarse bricks are for tractions that are linear on their faces, against fine ones: what is refused."""

import numpy as np
import pytest
import scipy.sparse.linalg as sla

from bipot.errors import SceneError
from bipot.fem.assembly import element_stiffness, space
from bipot.fem.elements import Quadrature, facet, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.projection import Projection, VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.surface import facet_weights
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick
from bipot.scene.holding import Holding
from bipot.scene.scene import Scene
from bipot.scene.supports import Support

SOLID, POISSON = Geometry.SOLID, 0.25
CLAMPED = tuple(Support("base", d) for d in range(3))
OWN = {Element.T10: Quadrature.TETRAHEDRON4, Element.H20: Quadrature.GAUSS2}


def tractions(mesh: Mesh) -> np.ndarray:
    """Nodal forces (3 a, 60) by all tractions that are linear on a free face, and zero on the others."""
    out = []
    for name in ("left", "right", "front", "back", "top"):
        faces = mesh.boundary(name)
        values = facet(faces.shape[1], 3).values
        x = values @ mesh.nodes[faces] - mesh.nodes.mean(axis=0)
        flat = int(np.argmin(np.ptp(x, axis=(0, 1))))
        for factor in (np.ones(x.shape[:2]), *(x[..., k] for k in range(3) if k != flat)):
            forces = (facet_weights(mesh.nodes, faces, SOLID) * factor) @ values
            nodal = np.bincount(faces.ravel(), forces.ravel(), len(mesh.nodes))
            out += [np.kron(nodal, unit) for unit in np.eye(3)]
    return np.array(out).T


def compliance(mesh: Mesh, rule: Quadrature, volume: VolumeChange) -> np.ndarray:
    """The work of each of the tractions in the displacement by each."""
    held, table = Holding.of(CLAMPED, mesh).numbers, tabulated(mesh.element, rule)
    free = space(mesh, SOLID, rule, held)
    placed = gradients(mesh.nodes, mesh.elements, table, SOLID, Projection.of(volume, mesh.nodes, mesh.elements, table))
    K = free.matrix(element_stiffness(placed, Elasticity(1.0, POISSON).stiffness(6)))
    forces = tractions(mesh)[free.free]
    return forces.T @ sla.splu(K).solve(forces)


def softness(counts: tuple[int, int, int], element: Element, volume: VolumeChange) -> float:
    """How many times farther than by a fine mesh the brick goes along the traction for which it is the worst."""
    sides = tuple(float(count) for count in counts)
    fine = brick(*sides, *(3 * count for count in counts), element=Element.H20)
    exact = compliance(fine, Quadrature.GAUSS3, VolumeChange.AS_IS)
    found = compliance(brick(*sides, *counts, element=element), OWN[element], volume)
    size, way = np.linalg.eigh(exact)
    kept = way[:, size > 1e-9 * size[-1]] / np.sqrt(size[size > 1e-9 * size[-1]])
    return float(np.linalg.eigvalsh(kept.T @ found @ kept)[-1])


@pytest.mark.parametrize(
    ("counts", "element", "volume", "least", "most"),
    [
        ((1, 1, 2), Element.T10, VolumeChange.P0, 7.0, 15.0),
        ((1, 1, 3), Element.T10, VolumeChange.P0, 7.0, 15.0),
        ((2, 1, 2), Element.T10, VolumeChange.P0, 3.5, 6.0),
        ((2, 2, 2), Element.T10, VolumeChange.P0, 0.0, 2.0),
        ((1, 1, 2), Element.T10, VolumeChange.AS_IS, 0.0, 1.05),
        ((3, 1, 3), Element.H20, VolumeChange.P0, 15.0, 25.0),
        ((2, 2, 2), Element.H20, VolumeChange.P0, 9.0, 25.0),
        ((2, 2, 2), Element.H20, VolumeChange.P1, 0.0, 1.1),
    ],
)
def test_bricks_that_are_more_than_three_times_too_soft_are_refused(counts, element, volume, least, most):
    assert least < softness(counts, element, volume) < most
    mesh = brick(*(float(count) for count in counts), *counts, element=element)

    def made() -> Scene:
        return Scene(mesh, SOLID, Elastic(Elasticity(1.0, POISSON)), CLAMPED, volume=volume)

    if least > 3.0:
        with pytest.raises(SceneError, match="motions without strain"):
            made()
    else:
        made()
