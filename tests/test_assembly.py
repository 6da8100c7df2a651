"""Stiffness and internal force against scikit-fem's own assembly on distorted, curved-sided meshes."""

import numpy as np
import pytest
import skfem
from skfem.helpers import sym_grad

from bipot.fem.assembly import element_force, element_stiffness, space
from bipot.fem.elements import RULES, Quadrature, Reference
from bipot.fem.kinematics import gradients
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.von_mises import Elasticity
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import cylinder
from tests.scenes import PLANES

ELASTIC = Elasticity(210.0, 0.3)
NO_SUPPORT = np.empty(0, dtype=np.intp)


def distorted(seed=1):
    """A 3 x 3 mesh away from the axis, nodes moved at random: sides become curved."""
    mesh = cylinder(3.0, 2.0, 3, 3, element=Element.Q8)
    noise = np.random.default_rng(seed).uniform(-0.06, 0.06, mesh.nodes.shape)
    return Mesh(mesh.nodes + noise + np.array([1.0, 0.0]), mesh.elements, mesh.boundaries)


def oracle_basis(mesh):
    """scikit-fem's basis: ElementQuad2 geometry with the ninth node where serendipity puts it, S2 displacements."""
    corners = mesh.elements[:, :4].max() + 1
    x = mesh.nodes[mesh.elements]
    centre = -0.25 * x[:, :4].sum(axis=1) + 0.5 * x[:, 4:].sum(axis=1)
    straight = skfem.MeshQuad(mesh.nodes[:corners].T, mesh.elements[:, :4].T)
    # MeshQuad2 numbers corners, then facets, then centres; facets follow scikit-fem's own order.
    middle = np.empty((straight.nfacets, 2))
    middle[straight.t2f.T] = x[:, 4:]
    curved = skfem.MeshQuad2(
        np.vstack([mesh.nodes[:corners], middle, centre]).T,
        straight.t,
    )
    basis = skfem.Basis(curved, skfem.ElementVector(skfem.ElementQuadS2()), intorder=23)
    # Their dof of (node, direction): vertices first, then facets.
    order = np.empty((len(mesh.nodes), 2), dtype=int)
    order[:corners] = basis.nodal_dofs.T
    order[mesh.elements[:, 4:]] = basis.facet_dofs.T[straight.t2f.T]
    return basis, order.ravel()


def forms(geometry):
    lame, shear = ELASTIC.bulk - 2 / 3 * ELASTIC.shear, ELASTIC.shear
    ring = geometry is Geometry.AXISYMMETRIC

    @skfem.BilinearForm
    def stiffness(u, v, w):
        r = w.x[0]
        eu, ev = sym_grad(u), sym_grad(v)
        hu, hv = (u[0] / r, v[0] / r) if ring else (0 * r, 0 * r)
        trace = (eu[0, 0] + eu[1, 1] + hu) * (ev[0, 0] + ev[1, 1] + hv)
        double = (eu * ev).sum(axis=(0, 1)) + hu * hv
        return (lame * trace + 2 * shear * double) * (2 * np.pi * r if ring else 1.0)

    @skfem.LinearForm
    def force(v, w):
        r = w.x[0]
        ev = sym_grad(v)
        hoop = 3.0 * v[0] / r if ring else 0.0
        return (ev[0, 0] - 2 * ev[1, 1] + hoop + 2 * 0.5 * ev[0, 1]) * (2 * np.pi * r if ring else 1.0)

    return stiffness, force


@pytest.mark.parametrize("geometry", PLANES)
def test_stiffness_and_force_equal_scikit_fem(geometry):
    """Both with twelve Gauss points a side: the integrands are rational on curved elements, the points the same."""
    mesh = distorted()
    basis, order = oracle_basis(mesh)
    stiffness, force = forms(geometry)
    K = skfem.asm(stiffness, basis).toarray()[np.ix_(order, order)]
    f = skfem.asm(force, basis)[order]
    space_ = space(mesh, geometry, Quadrature.GAUSS3, NO_SUPPORT)
    fine = fine_rule()
    grad = gradients(mesh.nodes, mesh.elements, fine, geometry)
    ours = space_.matrix(element_stiffness(grad, ELASTIC.stiffness(4))).toarray()
    np.testing.assert_allclose(ours, K, atol=1e-13 * np.abs(K).max())
    stress = np.broadcast_to([1.0, -2.0, 3.0, 0.5 * np.sqrt(2)], (*grad.B.shape[:2], 4))
    np.testing.assert_allclose(space_.vector(element_force(grad, stress)), f, atol=1e-13 * np.abs(f).max())


def fine_rule():
    x, w = np.polynomial.legendre.leggauss(12)
    points = np.array([(a, b) for a in (x + 1) / 2 for b in (x + 1) / 2])
    return Reference.of(skfem.ElementQuadS2(), points, np.outer(w, w).ravel() / 4)


@pytest.mark.parametrize("rule", RULES[Element.Q8])
def test_quadrature_rules_approach_the_exact_stiffness_on_straight_elements(rule):
    """Radon (degree 5) and 3 x 3 integrate plane-strain Q8 on parallelograms exactly, 2 x 2 does not."""
    mesh = cylinder(3.0, 2.0, 2, 2, element=Element.Q8)
    fine = strain_stiffness(mesh, fine_rule())
    mine = strain_stiffness(mesh, space(mesh, Geometry.PLANE_STRAIN, rule, NO_SUPPORT).reference)
    error = np.abs(mine - fine).max() / np.abs(fine).max()
    assert error < 1e-13 if rule is not Quadrature.GAUSS2 else error > 1e-3


def strain_stiffness(mesh, reference):
    grad = gradients(mesh.nodes, mesh.elements, reference, Geometry.PLANE_STRAIN)
    return element_stiffness(grad, ELASTIC.stiffness(4))


@pytest.mark.parametrize("geometry", PLANES)
def test_patch_a_linear_field_gives_constant_stress_and_no_inner_force(geometry):
    mesh = distorted(4)
    space_, fine = space(mesh, geometry, Quadrature.GAUSS2, NO_SUPPORT), fine_rule()
    du = mesh.nodes @ np.array([[1e-3, 2e-4], [-3e-4, 5e-4]]).T
    if geometry is Geometry.AXISYMMETRIC:
        du = np.column_stack([1e-3 * mesh.nodes[:, 0], 2e-3 * mesh.nodes[:, 1]])
    kin = Configuration.PAPER.measure.increment(mesh.nodes, du, mesh.elements, fine, geometry)
    stress = kin.strain @ ELASTIC.stiffness(4)
    np.testing.assert_allclose(stress, np.broadcast_to(stress[0, 0], stress.shape), atol=1e-12)
    f = space_.vector(element_force(kin, stress)).reshape(-1, 2)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.boundary_nodes(*mesh.boundaries))
    np.testing.assert_allclose(f[inner], 0.0, atol=1e-12 * np.abs(f).max())


def test_held_unknowns_leave_the_matrix_and_the_operator():
    mesh = cylinder(1.0, 1.0, 2, 2, element=Element.Q8)
    held = np.array([0, 5, 7])
    full = space(mesh, Geometry.PLANE_STRAIN, Quadrature.GAUSS2, NO_SUPPORT)
    part = space(mesh, Geometry.PLANE_STRAIN, Quadrature.GAUSS2, held)
    element = np.random.default_rng(0).normal(size=(4, 16, 16))
    expected = full.matrix(element).toarray()[np.ix_(part.free, part.free)]
    np.testing.assert_allclose(part.matrix(element).toarray(), expected, atol=1e-14)
    rows = np.random.default_rng(1).normal(size=(4 * 3, 2, 16))
    np.testing.assert_allclose(part.operator(rows).toarray(), full.operator(rows).toarray()[:, part.free])
