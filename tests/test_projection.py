"""Projected volume changes: the fit they are, the strain, force and tangent that follow, what they cost and refuse."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import InfeasibleProgram, InvertedElement, SceneError
from bipot.fem.assembly import element_force
from bipot.fem.elements import RULES, Quadrature, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VOLUMES, Projection, VolumeChange
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Delassus, Dissipation, Newton, Tangent
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.limit_analysis import limit_load
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, ring
from bipot.meshes.solids import brick
from bipot.paper import upsetting
from bipot.response import Body, body_space
from bipot.scene.loads import Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.state import rest
from bipot.tensors import trace
from studies.fuzz.record import setting_of
from studies.independent.volume import fitted
from tests.scenes import PLANES

MATERIAL = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 500.0))
PROJECTED = [(element, volume) for element in elements_of(2) for volume in VOLUMES[element] if volume.value != "as_is"]


def body_of(element, volume, geometry=Geometry.AXISYMMETRIC, configuration=Configuration.MIDPOINT):
    """Two by two cells with moved nodes."""
    made = ring(1.0, 3.0, 2.0, 2, 2, element=element)
    mesh = made if geometry is Geometry.AXISYMMETRIC else block(2.0, 2.0, 2, 2, element=element)
    moved = mesh.nodes + 0.08 * np.random.default_rng(3).uniform(-1, 1, mesh.nodes.shape)
    mesh = Mesh(moved, mesh.elements, mesh.boundaries)
    scene = Scene(mesh, geometry, MATERIAL, (Support("base", 1),), configuration=configuration, volume=volume)
    return Body(scene, body_space(scene))


def stressed(body):
    """Any stress, its pressure one that the elements hold."""
    state, rng = rest(body.scene, np.zeros(0)), np.random.default_rng(1)
    stress = 150 * rng.normal(size=state.stress.shape)
    weight = np.ones(stress.shape[:2])
    stress[..., :3] += (body.projection.at(weight).left(stress[..., :3].sum(axis=-1)[..., None])) / 3
    return replace(state, stress=stress, peeq=0.01 * rng.uniform(size=state.peeq.shape))


@pytest.mark.parametrize(("element", "volume"), PROJECTED)
def test_the_projection_is_the_weighted_fit_of_another_routine(element, volume):
    body, rng = body_of(element, volume), np.random.default_rng(7)
    values, weight = rng.normal(size=(2, *rest(body.scene, np.zeros(0)).peeq.shape))
    weight = np.exp(weight)
    found = body.projection.at(weight).of(values)
    np.testing.assert_allclose(found, fitted(setting_of(body.scene), values, weight), atol=1e-12)
    np.testing.assert_allclose(body.projection.at(weight).of(found), found, atol=1e-12)
    assert np.abs(found - values).max() > 0.1


@pytest.mark.parametrize(("element", "volume"), PROJECTED)
@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("configuration", Configuration)
def test_the_tangent_is_the_derivative_of_the_force(element, volume, geometry, configuration):
    body = body_of(element, volume, geometry, configuration)
    state, rng = stressed(body), np.random.default_rng(5)
    x = 0.02 * rng.uniform(-1, 1, body.space.size)
    response = body.respond(state, x)
    assert response.returned.plastic.any()
    v, h = rng.uniform(-1, 1, len(x)), 1e-6
    once, twice = (
        (body.respond(state, x + k * h * v).internal - body.respond(state, x - k * h * v).internal) / (2 * k * h)
        for k in (1, 2)
    )
    expected = (4 * once - twice) / 3
    K = body.space.matrix(body.tangent(response))
    np.testing.assert_allclose(K @ v, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize(("element", "volume"), PROJECTED)
@pytest.mark.parametrize("geometry", PLANES)
def test_the_force_of_a_pressure_that_is_held_is_the_transposed_of_the_strain(element, volume, geometry):
    body = body_of(element, volume, geometry, Configuration.PAPER)
    state, x = stressed(body), 1e-3 * np.random.default_rng(2).uniform(-1, 1, body.space.size)
    kin = body.respond(state, x).kinematics
    moved = body.space.spread(x)[body.scene.mesh.elements].reshape(len(kin.B), 1, -1, 1)
    np.testing.assert_allclose((kin.B @ moved)[..., 0], kin.strain, atol=1e-17)
    for stress, same in ((state.stress, True), (state.stress * np.arange(1.0, 5.0), False)):
        transposed = np.einsum("eq,eqsi,eqs->ei", kin.volume, kin.B, stress)
        assert np.allclose(element_force(kin, stress), transposed, atol=1e-10) == same


@pytest.mark.parametrize(("element", "volume"), PROJECTED)
def test_a_rigid_turn_strains_nothing_and_a_linear_field_evenly(element, volume):
    body = body_of(element, volume, Geometry.PLANE_STRAIN)
    mesh, table, (c, s) = body.scene.mesh, body.space.reference, (np.cos(0.7), np.sin(0.7))
    for matrix, even in ((np.array([[c - 1, -s], [s, c - 1]]), 0.0), (np.array([[2e-3, 1e-3], [0.0, -5e-3]]), None)):
        du = mesh.nodes @ matrix.T
        measure = Configuration.MIDPOINT.measure
        kin = measure.increment(mesh.nodes, du, mesh.elements, table, Geometry.PLANE_STRAIN, body.projection)
        expected = kin.strain[0, 0] if even is None else even
        np.testing.assert_allclose(kin.strain, np.broadcast_to(expected, kin.strain.shape), atol=1e-14)


@pytest.mark.parametrize(("element", "volume"), [(e, v) for e in VOLUMES for v in VOLUMES[e] if v.value != "as_is"])
def test_changes_of_volume_add_up_to_order_two_in_the_increment(element, volume):
    """Of a constant to the logarithm of the element's volume. By the weights of the end the order is one."""
    solid = element.dimension == 3
    mesh = brick(1.0, 1.0, 1.0, 1, 1, 1, element=element) if solid else block(1.0, 1.0, 1, 1, element=element)
    geometry = Geometry.SOLID if solid else Geometry.PLANE_STRAIN
    table = tabulated(element, RULES[element][0])
    projection = Projection.of(volume, mesh.nodes, mesh.elements, table)
    way = 0.1 * np.random.default_rng(4).uniform(-1, 1, mesh.nodes.shape)

    def changed(parts):
        each = [
            Configuration.MIDPOINT.measure.increment(
                mesh.nodes + k / parts * way, way / parts, mesh.elements, table, geometry, projection
            )
            for k in range(parts)
        ]
        return sum(trace(kin.strain) for kin in each)

    once, twice, fine = (changed(parts) for parts in (4, 8, 16))
    assert np.abs(once - twice).max() == pytest.approx(4 * np.abs(twice - fine).max(), rel=0.2)
    if volume is VolumeChange.P0:
        ends = [gradients(x, mesh.elements, table, geometry).volume.sum(axis=1) for x in (mesh.nodes, mesh.nodes + way)]
        expected = np.log(ends[1] / ends[0])
        np.testing.assert_allclose((4 * fine - twice)[:, 0] / 3, expected, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize(("element", "volume"), PROJECTED)
@pytest.mark.parametrize("form", [Tangent(), Newton(), Dissipation(), Delassus()])
def test_every_form_finds_the_same_certified_increment(element, volume, form):
    scene = upsetting(mu=0.2, reduction=0.01, elements=2, element=element, volume=volume)
    control = Control(form, (Dissipation(),))
    forces = [-a.tool_forces[0, 1] for a in march(scene, Schedule(3, 0.1, settling=1, growth=4.0), control)]
    exact = [
        -a.tool_forces[0, 1]
        for a in march(scene, Schedule(3, 0.1, settling=1, growth=4.0), Control(Newton(), (Tangent(),)))
    ]
    np.testing.assert_allclose(forces, exact, rtol=1e-7)


@pytest.mark.parametrize("element", [element for element in elements_of(2) if element is not Element.T3])
def test_a_tube_has_its_limit_load_where_elements_that_lock_have_none(element):
    """2/sqrt(3) sigma_Y ln(b/a) (exact): without projection, motions that keep the volume at every point lack."""
    tube = Scene(
        mesh=ring(100.0, 200.0, 10.0, 10, 1, element=element),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(MATERIAL.elasticity, Perfect(240.0)),
        supports=(Support("base", 1), Support("top", 1)),
        loads=(Pressure("bore", 1.0),),
        configuration=Configuration.SMALL,
    )
    assert limit_load(tube).multiple == pytest.approx(240.0 * 2 / np.sqrt(3.0) * np.log(2.0), rel=1.2e-3)
    if element.corners == 4:
        with pytest.raises(InfeasibleProgram):
            limit_load(replace(tube, volume=VolumeChange.AS_IS))


def test_pressures_stay_where_elements_hold_them_and_locking_goes():
    ends = {}
    for volume in VOLUMES[Element.Q8]:
        scene = upsetting(mu=0.1, reduction=0.2, elements=4, volume=volume)
        *_, end = march(scene, Schedule(10, 0.005, settling=1, growth=4.0), Control(Newton(), (Tangent(),)))
        ends[volume] = -float(end.tool_forces[0, 1])
        projection = Projection.of(volume, scene.mesh.nodes, scene.mesh.elements, body_space(scene).reference)
        if projection is not None:
            p = end.state.pressure
            np.testing.assert_allclose(projection.at(np.ones(p.shape)).of(p), p, atol=1e-10 * np.abs(p).max())
    assert ends[VolumeChange.P1] < 0.998 * ends[VolumeChange.AS_IS]
    assert ends[VolumeChange.P0] <= ends[VolumeChange.P1]


def test_a_start_whose_pressure_is_not_held_is_refused():
    bare = upsetting(mu=0.1, reduction=0.02, elements=2)
    *_, end = march(bare, Schedule(2, 0.1, settling=1, growth=4.0))
    scene = replace(bare, volume=VolumeChange.P0)
    with pytest.raises(SceneError, match=r"start\.stress = '\S+ off': must be of a pressure of P0 in each element: is"):
        next(march(scene, Schedule(2), start=end.state))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"volume": "p1"}, r"scene\.volume = 'p1'"),
        ({"element": Element.Q4, "volume": VolumeChange.P1}, r"scene\.volume = .*one of Q4, of \['P0', 'AS_IS'\]"),
        ({"element": Element.T3, "volume": VolumeChange.P0}, r"scene\.volume = .*one of T3, of \['AS_IS'\]"),
        ({"element": "q4"}, "element = 'q4'"),
    ],
)
def test_what_an_element_may_not_be_asked_is_refused(change, said):
    with pytest.raises(SceneError, match=said):
        upsetting(mu=0.1, **change)


def test_every_element_has_a_volume_change_of_its_own():
    assert set(VOLUMES) == set(Element) == set(RULES)
    scene = Scene(block(1.0, 1.0, 1, 1, element=Element.Q4), Geometry.PLANE_STRAIN, MATERIAL, (Support("base", 1),))
    assert scene.volume_change is VolumeChange.P0
    assert upsetting(mu=0.1).volume_change is VolumeChange.AS_IS


def test_an_element_of_which_a_trial_leaves_the_volume_of_one_point_is_told():
    """A march ended with an exception of linear algebra there instead of a shorter step or increment."""
    mesh = brick(1.0, 1.0, 1.0, 2, 1, 1, element=Element.H20)
    projection = Projection.of(
        VolumeChange.P1, mesh.nodes, mesh.elements, tabulated(Element.H20, RULES[Element.H20][0])
    )
    assert projection is not None
    weight = np.ones((2, 8))
    weight[1, 0] = 2e31
    with pytest.raises(InvertedElement, match=r"element 1: a point's volume is 2e\+31 of another's"):
        projection.at(weight)


@pytest.mark.parametrize(("scale", "place", "off"), [(1e-8, 0.0, 1e-10), (1e8, 0.0, 1e-10), (1.0, 1e5, 1e-8)])
def test_the_projection_depends_on_neither_units_nor_place(scale, place, off):
    mesh = block(2.0, 1.0, 2, 1, element=Element.Q8)
    table, values = tabulated(Element.Q8, Quadrature.GAUSS3), np.random.default_rng(0).normal(size=(2, 9))
    found = [
        Projection.of(VolumeChange.P1, nodes, mesh.elements, table).at(np.ones((2, 9))).of(values)
        for nodes in (mesh.nodes, scale * mesh.nodes + place)
    ]
    np.testing.assert_allclose(found[1], found[0], atol=off)
