"""Marches into folds: no accepted increment is folded anywhere, and the end names element, place and what to do."""

import re
from dataclasses import replace

import numpy as np
import pytest

from bipot.control.landing import Locate
from bipot.errors import IncrementFailed, NotConverged, SceneError
from bipot.fem.elements import Quadrature, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.forms import FormName, Newton
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.paper import upsetting
from bipot.results.columns import MIN_JACOBIAN
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool
from studies.quality import quality
from tests.sampling import determinants, grid
from tests.scenes import DIRECT, path

NEWTON = Control(Newton(), (DIRECT,))
POINTS = grid(41)


def flattened(elements):
    """A plane block, upset to 60 %, with 2 x 2 points: its side lands on the tool until a whole edge lies on it."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.6), ("top", "right"), 0.2)
    supports = (Support("left", 0), Support("base", 1))
    mesh, material = block(1.0, 1.0, elements, elements, element=Element.Q8), upsetting(mu=0.2).material
    return Scene(mesh, Geometry.PLANE_STRAIN, material, supports, (tool,), Quadrature.GAUSS2, volume=VolumeChange.AS_IS)


def marched(scene, schedule, control):
    """The accepted increments, and how the march ended."""
    accepted, run = [], march(scene, schedule, control)
    try:
        for one in run:
            accepted.append(one)  # noqa: PERF402 what came before a failure is kept
    except IncrementFailed as failed:
        return accepted, str(failed)
    return accepted, "at the end of the path"


def sampled(scene, accepted):
    """The least det J over its element's mean at the middle and at the end of an increment, by dense sampling."""
    nodes = np.stack([(accepted.start.nodes + accepted.state.nodes) / 2, accepted.state.nodes])
    values = determinants(nodes[:, scene.mesh.elements].reshape(-1, 8, 2), POINTS)
    return (values.min(axis=1) / values.mean(axis=1)).min()


def check(scene, accepted, words, element):
    assert re.search(rf"element {element} at \([\d.]+, [\d.]+\), at the \w+ of the increment: Jacobian", words), words
    assert words.endswith("Remesh there: shorter increments fold the element too.")
    assert all(sampled(scene, a) > 0 for a in accepted)
    # The march went as far as it could: the element is nearly flat at its corner.
    assert sampled(scene, accepted[-1]) < 0.02


def test_a_block_that_folds_is_stopped_there():
    scene = flattened(4)
    accepted, words = marched(scene, Schedule(20, first=0.001 / 0.6, settling=1, growth=4.0), NEWTON)
    check(scene, accepted, words, 15)
    assert 0.55 < accepted[-1].state.tau < 0.57
    assert any("Jacobian determinant" in a.reason and a.cuts for a in accepted)
    system = system_of(scene)
    least = np.array([MIN_JACOBIAN.value(system, a) for a in accepted])
    worth = np.array([quality(a.state.nodes, scene.mesh.elements).jacobian.min() for a in accepted])
    assert (least > 0).all()
    np.testing.assert_allclose(least, worth, rtol=1e-3)
    # The integration points see nothing of it: ten times as far from zero.
    rule = tabulated(Element.Q8, Quadrature.GAUSS2)
    inside = gradients(accepted[-1].state.nodes, scene.mesh.elements, rule, scene.geometry)
    assert inside.volume[15].min() > 0.1 * inside.volume[15].mean()


def test_where_nothing_shorter_was_tried_nothing_is_said_of_it():
    """The same block in increments that may not be cut: the last of them could go a little farther."""
    accepted, words = marched(
        flattened(4), Schedule(20, first=0.001 / 0.6, settling=1, growth=4.0), replace(NEWTON, cuts=0)
    )
    assert "Jacobian determinant" in words
    assert accepted[-1].state.tau < 0.55
    assert words.endswith("Use more increments, or remesh there.")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "schedule", "element"),
    [
        (flattened(8), Schedule(60, first=0.001 / 0.6, settling=1, growth=4.0), 63),
        (upsetting(mu=0.3, quadrature=Quadrature.GAUSS2), path(0.45, 45), 99),
    ],
    ids=["block", "cylinder"],
)
def test_finer_meshes_are_stopped_too(scene, schedule, element):
    accepted, words = marched(scene, schedule, NEWTON)
    check(scene, accepted, words, element)


class Wall:
    """The tangent form, refusing every increment that ends beyond ``tau``; the tool's travel is ``travel``."""

    name = FormName.TANGENT
    init = DIRECT.init

    def __init__(self, tau, travel):
        self.tau, self.travel = tau, travel

    def step(self, iterate, r, state):
        if iterate.increment.tau > self.tau:
            raise NotConverged("no further")
        return DIRECT.step(iterate, r, state)


@pytest.mark.parametrize("locate", [None, Locate()])
def test_a_march_ends_at_a_wall_instead_of_creeping_up_to_it(locate):
    """Successes do not give new cuts: no increment is shorter than the scheduled one halved ``cuts`` times."""
    scene, tau = upsetting(mu=0.0, reduction=0.1, elements=1), 1 / 3
    control = Control(Wall(tau, 0.5), fallbacks=(), cuts=6, locate=locate)
    accepted, words = marched(scene, Schedule(2), control)
    ends = [0.0, *(a.state.tau for a in accepted)]
    assert tau - 0.5 / 2**6 < ends[-1] <= tau
    assert np.diff(ends).min() >= 0.5 / 2**6 * (1 - 1e-9)
    assert len(accepted) <= 6
    assert words.endswith("Use more increments, or a mesh that is less distorted there.")


def distorted(by):
    """A plane block whose lower edge's middle node in the second element is moved along by ``by``: det J = 1 + 4 by."""
    mesh = block(2.0, 1.0, 2, 1, element=Element.Q8)
    nodes = mesh.nodes.copy()
    nodes[(np.abs(nodes - [1.5, 0.0]) < 1e-12).all(axis=1), 0] += by
    return Mesh(nodes, mesh.elements, mesh.boundaries)


def test_a_scene_with_an_element_folded_between_its_points_is_refused():
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.0)

    def scene(by):
        material = upsetting(mu=0.2).material
        return Scene(
            distorted(by), Geometry.PLANE_STRAIN, material, (), (tool,), Quadrature.GAUSS2, volume=VolumeChange.AS_IS
        )

    scene(-0.24)
    with pytest.raises(SceneError, match=r"mesh: element 1 at \(1\.0, 0\.0\), at rest: Jacobian determinant -0\.04"):
        scene(-0.26)
