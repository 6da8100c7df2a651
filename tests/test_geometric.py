"""The consistent tangent of the configuration against differences of the internal force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration, Stresses
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, ring
from bipot.response import Body, TangentKind, body_space
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.state import State, rest
from bipot.tools.tool import FlatTool
from tests.scenes import PLANES

MATERIAL = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 500.0))
MODULI = {"shear": np.array([MATERIAL.elasticity.shear]), "bulk": np.array([MATERIAL.elasticity.bulk])}


def body_of(geometry: Geometry, configuration: Configuration) -> Body:
    mesh = (
        ring(1.0, 3.0, 2.0, 2, 2, element=Element.Q8)
        if geometry is Geometry.AXISYMMETRIC
        else block(2.0, 2.0, 2, 2, element=Element.Q8)
    )
    distorted = mesh.nodes + 0.08 * np.random.default_rng(3).uniform(-1, 1, mesh.nodes.shape)
    mesh = Mesh(distorted, mesh.elements, mesh.boundaries)
    tool = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -1.0), ("top",), 0.1)
    scene = Scene(
        mesh, geometry, MATERIAL, (Support("base", 1),), (tool,), configuration=configuration, volume=VolumeChange.AS_IS
    )
    return Body(scene, body_space(scene))


def stressed(body: Body) -> State:
    """A state with stress and history at every point, some of them yielding on the next increment."""
    state = rest(body.scene, np.zeros(0))
    rng = np.random.default_rng(1)
    stress = 150 * rng.normal(size=state.stress.shape)
    return replace(state, stress=stress, peeq=0.01 * rng.uniform(size=state.peeq.shape))


@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("configuration", Configuration)
@pytest.mark.parametrize("size", [1e-3, 0.1])
def test_tangent_is_the_derivative_of_the_internal_force(
    geometry: Geometry, configuration: Configuration, size: float
) -> None:
    body = body_of(geometry, configuration)
    state = stressed(body)
    rng = np.random.default_rng(5)
    x = size * rng.uniform(-1, 1, body.space.size)
    response = body.respond(state, x)
    assert 0 < response.returned.plastic.mean() <= 1
    K = body.space.matrix(body.tangent(response))
    for _ in range(4):
        v = rng.uniform(-1, 1, len(x))
        # Richardson on central differences: error h^4, below round-off of the smaller step.
        h = 1e-6
        d1, d2 = (
            (body.respond(state, x + k * h * v).internal - body.respond(state, x - k * h * v).internal) / (2 * k * h)
            for k in (1, 2)
        )
        expected = (4 * d1 - d2) / 3
        np.testing.assert_allclose(K @ v, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("geometry", PLANES)
def test_paper_tangent_is_the_symmetric_stiffness(geometry: Geometry) -> None:
    body = body_of(geometry, Configuration.PAPER)
    response = body.respond(stressed(body), np.full(body.space.size, 1e-3))
    K = body.space.matrix(body.tangent(response))
    reference = body.stiffness(response, TangentKind.CONSISTENT)
    assert abs(K - reference).max() <= 1e-12 * abs(reference).max()


def test_at_rest_without_stress_the_two_configurations_agree() -> None:
    midpoint, paper = (body_of(Geometry.AXISYMMETRIC, c) for c in (Configuration.MIDPOINT, Configuration.PAPER))
    K, reference = (b.tangent(b.respond(rest(b.scene, np.zeros(0)), np.zeros(b.space.size))) for b in (midpoint, paper))
    np.testing.assert_allclose(K, reference, rtol=0, atol=1e-12 * np.abs(reference).max())


def test_rigid_rotation_turns_the_internal_force() -> None:
    """Plane strain: K_T times the spin field is the force turned by the rate, whatever the stress (objectivity)."""
    body = body_of(Geometry.PLANE_STRAIN, Configuration.MIDPOINT)
    state = stressed(body)
    response = body.respond(state, np.zeros(body.space.size))
    nodes, elements = state.nodes, body.scene.mesh.elements
    spin = np.stack([-nodes[:, 1], nodes[:, 0]], axis=-1)[elements].reshape(len(elements), -1)
    s = response.returned
    C = np.broadcast_to(MATERIAL.elasticity.stiffness(4), (*s.stress.shape, 4))
    stresses = Stresses(rotated=s.stress, returned=s.stress, moduli=C, **MODULI)
    K = Configuration.MIDPOINT.measure.tangent(response.kinematics, stresses, body.scratch())
    f = response.element_forces.reshape(len(elements), -1, 2)
    turned = np.stack([-f[..., 1], f[..., 0]], axis=-1).reshape(len(elements), -1)
    np.testing.assert_allclose((K @ spin[:, :, None])[..., 0], turned, rtol=0, atol=1e-10 * np.abs(f).max())


def test_gradient_operator_gives_strain_back() -> None:
    body = body_of(Geometry.AXISYMMETRIC, Configuration.MIDPOINT)
    kin = body.respond(stressed(body), np.zeros(body.space.size)).kinematics
    B, D = kin.B, np.zeros((*kin.B.shape[:2], 5, kin.B.shape[-1]))
    kin.gradient_operator(D)
    np.testing.assert_allclose((D[:, :, 1] + D[:, :, 2]) / np.sqrt(2), B[:, :, 3])
    np.testing.assert_allclose(D[:, :, [0, 3, 4]], B[:, :, :3])
