"""Limit loads of elements that lock nearly, by the program in another writing; of bodies that carry nothing."""

import cvxpy as cp
import numpy as np
import pytest

from bipot import (
    BodyForce,
    Elasticity,
    Element,
    FlatTool,
    Force,
    Geometry,
    Mesh,
    Perfect,
    Quadrature,
    Scene,
    Support,
    Symmetry,
    Traction,
    VolumeChange,
    VonMises,
    block,
    brick,
    limit_load,
    ring,
)
from bipot.fem.elements import tabulated, tabulated_line

PERFECT = VonMises(Elasticity(200_000.0, 0.3), Perfect(100.0))
PUSH = np.array([0.5, -1.0])


def sheared(bore, shear, counts):
    """A ring of nine-node elements that hold their volume at every point, fixed at its base, pushed at its top."""
    straight = ring(bore, bore + 1.0, 1.2, *counts, element=Element.Q9)
    mesh = Mesh(straight.nodes @ np.array([[1.0, 0.0], [shear, 1.0]]), straight.elements, straight.boundaries)
    fixed = Support("base", 0), Support("base", 1)
    load = (Traction("top", tuple(PUSH)),)
    return Scene(mesh, Geometry.AXISYMMETRIC, PERFECT, fixed, loads=load, volume=VolumeChange.AS_IS)


def test_a_welded_ring_of_unprojected_elements_carries_a_third_more():
    """With 2 x 2 points it does not: those of the paper are the constraints too many."""
    mesh = ring(3.0, 6.0, 2.0, 6, 4, element=Element.Q8)
    weld = FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, 0.0), ("top",), np.inf, driven_by=Force((0.0, -1.0)))
    choices = (Quadrature.RADON7, VolumeChange.P1), (Quadrature.RADON7, VolumeChange.AS_IS), (Quadrature.GAUSS2, None)
    projected, seven, four = (
        limit_load(
            Scene(
                mesh,
                Geometry.AXISYMMETRIC,
                PERFECT,
                (Symmetry("base", 1),),
                (weld,),
                quadrature=rule,
                volume=volume or VolumeChange.AS_IS,
            )
        ).multiple
        for rule, volume in choices
    )
    assert seven == pytest.approx(1.3 * projected, rel=0.02)
    assert four == pytest.approx(projected, rel=0.01)


def points(mesh):
    """Weight (g,) and strain components r, z, hoop and shear over the root of two (g, 4, n) of all points."""
    rule, x, weight, strain = tabulated(mesh.element, Quadrature.GAUSS3), mesh.nodes, [], []
    for cell in mesh.elements:
        for w, N, slope in zip(rule.weights, rule.values, rule.gradients, strict=True):
            jacobian = x[cell].T @ slope
            g, r = slope @ np.linalg.inv(jacobian), N @ x[cell, 0]
            B = np.zeros((4, *x.shape))
            B[0, cell, 0], B[1, cell, 1], B[2, cell, 0] = g[:, 0], g[:, 1], N / r
            B[3, cell] = g[:, ::-1] / np.sqrt(2)
            weight.append(2 * np.pi * r * w * np.linalg.det(jacobian))
            strain.append(B.reshape(4, -1))
    return np.array(weight), np.array(strain)


def pushes(mesh):
    """Nodal forces (a, 2) of the traction."""
    line, forces = tabulated_line(3), np.zeros_like(mesh.nodes)
    for edge in mesh.boundary("top"):
        x = mesh.nodes[edge]
        length = np.linalg.norm(x[-1] - x[0])
        forces[edge] += np.outer(2 * np.pi * length * (line.weights * (line.values @ x[:, 0])) @ line.values, PUSH)
    return forces


@pytest.mark.parametrize(("bore", "shear", "counts"), [(0.3, -0.2, (2, 3)), (1.0, 0.1, (3, 2)), (1.0, 0.1, (2, 3))])
def test_a_ring_that_locks_nearly_has_the_limit_load_of_motions_that_keep_its_volume_exactly(bore, shear, counts):
    """Of 4e-9 and more, over the largest, are the singular values of rows that do not depend on others."""
    scene = sheared(bore, shear, counts)
    weight, strain = points(scene.mesh)
    held = scene.mesh.boundary_nodes("base")
    free = np.delete(np.arange(scene.mesh.nodes.size), (2 * held[:, None] + [0, 1]).ravel())
    volume = strain[:, :3].sum(axis=1)[:, free]
    _, sizes, V = np.linalg.svd(volume / np.linalg.norm(volume, axis=1)[:, None])
    keeping = V[int((sizes > 1e-12 * sizes[0]).sum()) :].T
    y = cp.Variable(keeping.shape[1])
    flow = cp.reshape((strain[:, :, free] @ keeping).reshape(-1, keeping.shape[1]) @ y, (len(weight), 4), order="C")
    cost = np.sqrt(2 / 3) * 100.0 * weight @ cp.norm(flow, 2, axis=1)
    least = cp.Problem(cp.Minimize(cost), [pushes(scene.mesh).ravel()[free] @ keeping @ y == 1])
    least.solve(solver=cp.CLARABEL)
    assert limit_load(scene).multiple == pytest.approx(least.value, rel=1e-5)


@pytest.mark.parametrize("element", [Element.T6, Element.T10, Element.Q8, Element.H8])
def test_a_body_that_slides_without_strain_carries_exactly_nothing(element):
    """On a smooth base, pushed along it; interior points on the flow alone leave 1e-5 of the load."""
    d = element.dimension
    mesh = block(1.0, 1.3, 2, 2, element=element) if d == 2 else brick(1.0, 1.1, 1.3, 2, 2, 2, element=element)
    up, along = np.eye(d)[-1], 300.0 * np.ones(d)
    smooth = FlatTool((0.0,) * d, tuple(up), (0.0,) * d, ("base",), 0.0)
    geometry = Geometry.PLANE_STRAIN if d == 2 else Geometry.SOLID
    scene = Scene(mesh, geometry, PERFECT, (), (smooth,), loads=(BodyForce(tuple(along - 600.0 * up)),))
    found = limit_load(scene)
    assert found.multiple == 0
    np.testing.assert_allclose(found.motion, np.broadcast_to(found.motion[0], found.motion.shape), atol=1e-6)
