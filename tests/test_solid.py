"""Kinematics in space: the formulas by 3 x 3 tensors against the plane's closed forms, and elements of scikit-fem."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.helpers import sym_grad

from bipot.errors import InvertedElement, SceneError
from bipot.fem import plane, solid
from bipot.fem.assembly import element_force, element_stiffness, rigid_motions
from bipot.fem.elements import Reference
from bipot.fem.kinematics import gradients
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration, Scratch, Stresses
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, TangentKind, VonMises
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from tests.scenes import PLANES

MATERIAL = VonMises(Elasticity(210.0, 0.3), Linear(0.3, 0.5))
MODULI = {"shear": np.array([MATERIAL.elasticity.shear]), "bulk": np.array([MATERIAL.elasticity.bulk])}
ELEMENTS = [skfem.ElementHex1(), skfem.ElementHexS2(), skfem.ElementHex2(), skfem.ElementTetP2()]


def reference_of(element):
    points, weights = skfem.quadrature.get_quadrature(element.refdom, 5)
    return Reference.of(element, points.T, weights)


def distorted(element, seed=0):
    """One element with curved edges (a, 3), and its nodes' numbers (1, a)."""
    x = np.asarray(element.doflocs, dtype=float)
    return x + np.random.default_rng(seed).uniform(-0.04, 0.04, x.shape), np.arange(len(x))[None]


@pytest.mark.parametrize("geometry", PLANES)
def test_tensors_of_space_give_the_closed_forms_of_the_plane(geometry):
    rng, reduction = np.random.default_rng(1), geometry.reduction
    g = 0.6 * rng.uniform(-1, 1, (50, len(reduction.entries)))
    (ours, _), (theirs, _) = (forms.middle(g, reduction) for forms in (solid, plane))
    np.testing.assert_allclose(ours, theirs, atol=2e-15)
    tensor, stress = rng.normal(size=(2, 50, 4))
    halves = [forms.half_rotation(ours, reduction) for forms in (solid, plane)]
    for rotations in (halves, [solid.twice(halves[0]), plane.twice(halves[1])]):
        turned = [forms.turn(tensor, rotation) for forms, rotation in zip((solid, plane), rotations, strict=True)]
        np.testing.assert_allclose(turned[0], turned[1], atol=5e-15)
    slopes = [
        forms.strain_by_gradient(reduction, ours, half, tensor, stress, 2.0)
        for forms, half in zip((solid, plane), halves, strict=True)
    ]
    np.testing.assert_allclose(slopes[0], slopes[1], atol=1e-14)


def test_the_whole_rotation_is_that_of_hughes_and_winget():
    g = 0.8 * np.random.default_rng(2).uniform(-1, 1, (20, 9))
    half = np.moveaxis(solid.half_rotation(g, Geometry.SOLID.reduction), -1, 0)
    H = (g @ Geometry.SOLID.reduction.embedding).reshape(-1, 3, 3)
    W = (H - H.swapaxes(-1, -2)) / 2
    np.testing.assert_allclose(half @ half, np.linalg.solve(np.eye(3) - W / 2, np.eye(3) + W / 2), atol=1e-14)
    np.testing.assert_allclose(half @ half.swapaxes(-1, -2), np.broadcast_to(np.eye(3), half.shape), atol=1e-14)


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: type(e).__name__)
def test_a_rigid_rotation_strains_nothing_and_turns_the_stress(element):
    x, cells = distorted(element)
    Q = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    Q = Q * np.sign(np.linalg.det(Q))
    kin = Configuration.MIDPOINT.measure.increment(x, x @ Q.T - x, cells, reference_of(element), Geometry.SOLID)
    np.testing.assert_allclose(kin.strain, 0.0, atol=1e-12)
    T = np.random.default_rng(5).normal(size=(3, 3))
    T = T + T.T
    mandel = np.sqrt(2)
    pick = lambda t: np.array(  # noqa: E731
        [t[0, 0], t[1, 1], t[2, 2], mandel * t[0, 1], mandel * t[1, 2], mandel * t[2, 0]]
    )
    stress = np.broadcast_to(pick(T), kin.strain.shape)
    np.testing.assert_allclose(kin.turned(stress), np.broadcast_to(pick(Q @ T @ Q.T), kin.strain.shape), atol=1e-12)


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: type(e).__name__)
def test_a_homogeneous_motion_has_its_own_strain(element):
    x, cells = distorted(element)
    F = np.array([[0.1, 0.03, 0.0], [0.03, -0.08, 0.02], [0.0, 0.02, 0.05]])
    kin = Configuration.MIDPOINT.measure.increment(x, x @ F.T, cells, reference_of(element), Geometry.SOLID)
    middle = F @ np.linalg.inv(np.eye(3) + F / 2)
    expected = [*np.diag(middle), *(np.sqrt(2) * np.array([middle[0, 1], middle[1, 2], middle[2, 0]]))]
    np.testing.assert_allclose(kin.strain, np.broadcast_to(expected, kin.strain.shape), atol=1e-13)


@pytest.mark.parametrize("element", ELEMENTS[:2], ids=lambda e: type(e).__name__)
def test_stiffness_and_force_equal_scikit_fem(element):
    # Mirrored: scikit-fem's own cube is numbered the other way round.
    cube = skfem.MeshHex().refined(1)
    mesh = skfem.MeshHex(cube.p * [[-1.0], [1.0], [1.0]], cube.t)
    basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=5)
    lame, shear = MATERIAL.elasticity.bulk - 2 / 3 * MATERIAL.elasticity.shear, MATERIAL.elasticity.shear

    @skfem.BilinearForm
    def stiffness(u, v, w):
        eu, ev = sym_grad(u), sym_grad(v)
        return lame * np.trace(eu) * np.trace(ev) + 2 * shear * (eu * ev).sum(axis=(0, 1))

    @skfem.LinearForm
    def force(v, w):
        ev = sym_grad(v)
        return 2 * ev[0, 0] - ev[1, 1] + 6 * ev[0, 1] + 8 * ev[1, 2] - 3 * ev[2, 0]

    dofs, nodes = basis.element_dofs.T, basis.doflocs.T[basis.element_dofs.T[:, ::3]]
    X, W = basis.X, basis.W
    reference = Reference.of(element, X.T, W)
    count, k, _ = nodes.shape
    grad = gradients(nodes.reshape(-1, 3), np.arange(count * k).reshape(count, k), reference, Geometry.SOLID)
    K = np.zeros((basis.N, basis.N))
    np.add.at(K, (dofs[:, :, None], dofs[:, None, :]), element_stiffness(grad, MATERIAL.elasticity.stiffness(6)))
    exact = skfem.asm(stiffness, basis).toarray()
    np.testing.assert_allclose(K, exact, atol=1e-12 * np.abs(exact).max())
    stress = np.broadcast_to([2.0, -1.0, 0.0, 3 * np.sqrt(2), 4 * np.sqrt(2), -1.5 * np.sqrt(2)], (count, len(W), 6))
    f = np.zeros(basis.N)
    np.add.at(f, dofs, element_force(grad, stress))
    exact = skfem.asm(force, basis)
    np.testing.assert_allclose(f, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("configuration", Configuration)
@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: type(e).__name__)
@pytest.mark.parametrize("size", [1e-3, 0.1])
def test_the_tangent_is_the_derivative_of_the_force(element, configuration, size):
    """Of an elastoplastic element with stress at its start, by Richardson's rule on central differences."""
    x, cells = distorted(element)
    reference, measure, rng = reference_of(element), configuration.measure, np.random.default_rng(3)
    start = 0.2 * rng.normal(size=(1, len(reference.weights), 6))
    peeq = 0.01 * rng.uniform(size=start.shape[:-1])

    def respond(du):
        kin = measure.increment(x, du, cells, reference, Geometry.SOLID)
        rotated = kin.turned(start)
        return kin, rotated, MATERIAL.update(rotated, kin.strain, peeq)

    du = size * rng.uniform(-0.5, 0.5, x.shape)
    kin, rotated, returned = respond(du)
    assert 0 < returned.plastic.mean() <= 1
    moduli = MATERIAL.tangent(rotated, returned, peeq, TangentKind.CONSISTENT)
    stresses = Stresses(
        rotated=rotated,
        returned=returned.stress,
        moduli=moduli,
        **MODULI,
    )
    K = measure.tangent(kin, stresses, Scratch.of(1, len(reference.weights), x.size, kin.reduction, False))[0]

    def force(step):
        kin, _, returned = respond(du + step)
        return element_force(kin, returned.stress)[0]

    for _ in range(3):
        v, h = rng.uniform(-1, 1, x.shape), 1e-6
        d1, d2 = ((force(k * h * v) - force(-k * h * v)) / (2 * k * h) for k in (1, 2))
        expected = (4 * d1 - d2) / 3
        np.testing.assert_allclose(K @ v.ravel(), expected, atol=1e-6 * np.abs(expected).max())


def test_rigid_motions_of_space_are_six_and_strain_nothing():
    x, cells = distorted(ELEMENTS[1])
    motions = rigid_motions(x, np.arange(x.size), Geometry.SOLID)
    assert motions.shape == (x.size, 6)
    grad = gradients(x, cells, reference_of(ELEMENTS[1]), Geometry.SOLID)
    np.testing.assert_allclose(grad.B @ motions, 0.0, atol=1e-13)


def test_a_folded_element_of_space_is_named():
    x, cells = distorted(ELEMENTS[0])
    with pytest.raises(InvertedElement, match=r"element 0 .* Jacobian determinant"):
        gradients(x * [1, 1, -1], cells, reference_of(ELEMENTS[0]), Geometry.SOLID)
    # Half a turn with a stretch: neither end is folded.
    turned = x * [-3.0, -0.5, 1.0]
    with pytest.raises(InvertedElement, match="at the middle over that at the end"):
        Configuration.MIDPOINT.measure.increment(x, turned - x, cells, reference_of(ELEMENTS[0]), Geometry.SOLID)


def test_a_scene_in_space_is_refused_by_name():
    plane_scene = upsetting(mu=0.1, elements=2)
    with pytest.raises(SceneError, match=r"scene\.geometry.*SOLID.*plane"):
        Scene(plane_scene.mesh, Geometry.SOLID, plane_scene.material, (), plane_scene.tools)
