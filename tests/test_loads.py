"""Loads and prescribed displacements against closed forms, in every exact form; their work; their refusals."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from bipot.errors import IncrementFailed, LimitPassed, SceneError
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton
from bipot.iterate import Increment
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, ring
from bipot.paths import Amplitude
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.tools.tool import FlatTool
from tests.scenes import FORMS, PLANES, bar, last, named


@pytest.mark.parametrize("form", FORMS, ids=named)
def test_a_bar_under_its_own_weight_lengthens_by_half_of_what_its_end_would(form):
    """rho g L^2 / (2 E) in small strain; the midpoint rule's strain differs by its square."""
    scene = bar((BodyForce((0.0, 1e-6)),))
    end = last(replace(scene, configuration=Configuration.PAPER), Schedule(1), form)
    top = scene.mesh.boundary_nodes("top")
    np.testing.assert_allclose(end.state.du[top, 1], 1e-6 * 16 / 2e6, rtol=1e-10)
    stress = end.state.stress[..., 1]
    points = np.einsum(
        "qk,ekd->eqd", system_of(scene).body.space.reference.values, scene.mesh.nodes[scene.mesh.elements]
    )
    np.testing.assert_allclose(stress, 1e-6 * (4.0 - points[..., 1]), atol=1e-15)


@pytest.mark.parametrize("form", FORMS, ids=named)
@pytest.mark.parametrize("load", [Traction("top", (0.0, 300.0)), Pressure("top", -300.0)], ids=["traction", "pressure"])
def test_a_pulled_bar_has_the_stress_of_its_load(form, load):
    end = last(bar((load,)), Schedule(1), form)
    np.testing.assert_allclose(end.state.stress[..., 1], 300.0, rtol=1e-6)
    assert end.solved.certificate.equilibrium < 1e-7


def test_a_point_force_and_the_reaction_balance():
    scene = bar((PointForce(int(np.argmax(block(1.0, 4.0, 2, 8, element=Element.Q8).nodes.sum(axis=1))), (0.0, -7.0)),))
    end = last(scene, Schedule(1), Newton())
    reactions = end.solved.iterate.reactions(end.solved.r)
    np.testing.assert_allclose(reactions.sum(axis=0), [0.0, 7.0], atol=1e-7)
    held = np.zeros(reactions.size, dtype=bool)
    held[scene.holding.numbers] = True
    assert not reactions.ravel()[~held].any()


@pytest.mark.parametrize("geometry", PLANES)
def test_follower_stiffness_is_the_derivative_of_its_force(geometry):
    """Against Richardson's rule on central differences, on distorted edges."""
    mesh = ring(1.0, 2.0, 1.0, 2, 2, element=Element.Q8)
    mesh = Mesh(
        mesh.nodes + 0.03 * np.random.default_rng(0).uniform(-1, 1, mesh.nodes.shape), mesh.elements, mesh.boundaries
    )
    loads = (Pressure("bore", 3e4), Pressure("top", -2e4, Amplitude(((0.0, 1.0), (1.0, 0.0)))))
    material = VonMises(Elasticity(2e5, 0.3), Linear(300.0, 100.0))
    scene = Scene(mesh, geometry, material, (Support("base", 1),), loads=loads)
    system = system_of(scene)
    increment, rng = Increment(system, system.rest(), 0.5), np.random.default_rng(1)
    x = 0.01 * rng.uniform(-1, 1, system.body.space.size)
    K = system.body.space.matrix(increment.at(x).tangent(increment.start.forces))
    for _ in range(3):
        v, h = rng.uniform(-1, 1, len(x)), 1e-6
        d1, d2 = (
            (increment.at(x + k * h * v).residual - increment.at(x - k * h * v).residual) / (2 * k * h) for k in (1, 2)
        )
        expected = (4 * d1 - d2) / 3
        np.testing.assert_allclose(K @ v, expected, atol=1e-7 * np.abs(expected).max())


def test_a_pressure_all_around_is_in_balance_and_its_resultant_follows_gauss():
    """int n dA of a closed surface is zero; on a ring the radial part is that of the hoop, 2 pi A."""
    scene = Scene(
        ring(1.0, 3.0, 2.0, 2, 2, element=Element.Q8),
        Geometry.AXISYMMETRIC,
        Elastic(Elasticity(1.0, 0.3)),
        (Support("base", 1),),
    )
    loads = tuple(Pressure(name, 2.0) for name in ("bore", "side", "base", "top"))
    for geometry, radial in ((Geometry.PLANE_STRAIN, 0.0), (Geometry.AXISYMMETRIC, -2.0 * 2 * np.pi * 4.0)):
        system = system_of(replace(scene, geometry=geometry, loads=loads))
        total = system.loading.forces(scene.mesh.nodes, 1.0).sum(axis=0)
        np.testing.assert_allclose(total, [radial, 0.0], atol=1e-12)


def tube(material, loads=(), bore: float | None = None, configuration=Configuration.MIDPOINT) -> Scene:
    driven = () if bore is None else (Prescribed("bore", 0, bore),)
    supports = (Support("base", 1), Support("top", 1), *driven)
    mesh = ring(100.0, 200.0, 10.0, 10, 1, element=Element.Q8)
    return Scene(mesh, Geometry.AXISYMMETRIC, material, supports, loads=loads, configuration=configuration)


STEEL = VonMises(Elasticity(210_000.0, 0.3), Perfect(240.0))


@pytest.mark.parametrize("form", FORMS, ids=named)
def test_a_thick_tube_under_pressure_is_lame_before_it_yields(form):
    end = last(tube(STEEL, (Pressure("bore", 100.0),), configuration=Configuration.PAPER), Schedule(2), form)
    side = end.state.nodes[tube(STEEL).mesh.boundary_nodes("side"), 0] - 200.0
    # Plane strain: u = p a^2 / (E (b^2 - a^2)) ((1 + nu)(1 - 2 nu) r + (1 + nu) b^2 / r).
    exact = 100.0 * 1e4 / (210_000.0 * 3e4) * (1.3 * 0.4 * 200.0 + 1.3 * 4e4 / 200.0)
    np.testing.assert_allclose(side, exact, rtol=2e-3)


def test_a_bar_whose_end_is_prescribed_carries_what_it_strains():
    scene = bar(supports=(Prescribed("top", 1, 0.004),))
    for form in FORMS:
        end = last(replace(scene, configuration=Configuration.PAPER), Schedule(1), form)
        np.testing.assert_allclose(end.state.stress[..., 1], 1000.0, rtol=1e-9)
        top = scene.mesh.boundary_nodes("top")
        pull = end.solved.iterate.reactions(end.solved.r)[top].sum(axis=0)
        np.testing.assert_allclose(pull, [0.0, 1000.0], atol=1e-6)


def plastic_bar(loads: tuple[Load, ...], supports: tuple[Support, ...]) -> Scene:
    scene = bar(loads, supports)
    return replace(scene, material=VonMises(Elasticity(1000.0, 0.3), Linear(1.0, 50.0)))


@pytest.mark.parametrize(
    "scene",
    [
        plastic_bar((), (Prescribed("top", 1, 0.2),)),
        plastic_bar((Traction("top", (0.3, 1.4)),), (Support("base", 0),)),
        plastic_bar((Pressure("right", 0.4), Traction("top", (0.0, 1.2))), ()),
    ],
    ids=["prescribed", "traction", "pressure"],
)
def test_external_work_is_in_the_energy_balance_with_order_two(scene):
    errors = []
    for count in (8, 16, 32):
        end = last(scene, Schedule(count), Newton())
        assert end.energies.work > 0
        errors.append(abs(end.energies.imbalance) / end.energies.work)
    assert errors[-1] < 2e-3
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() > 1.7


def test_a_load_that_goes_back_leaves_an_elastic_body_as_it_was():
    there_and_back = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)))
    end = last(bar((Traction("top", (0.0, 500.0), there_and_back),)), Schedule(4), Newton())
    np.testing.assert_allclose(end.state.nodes, bar().mesh.nodes, atol=1e-9)
    assert abs(end.energies.work) < 1e-6


def test_units_do_not_matter():
    """Lengths times a scale, stresses as they are: displacements follow."""
    found = []
    for scale in (1e-3, 1.0, 1e3):
        mesh = ring(1.0 * scale, 2.0 * scale, 1.0 * scale, 3, 2, element=Element.Q8)
        material = VonMises(Elasticity(1000.0, 0.3), Linear(1.0, 50.0))
        loads = (Pressure("bore", 0.9), BodyForce((0.0, -0.1 / scale)))
        scene = Scene(mesh, Geometry.AXISYMMETRIC, material, (Support("base", 1),), loads=loads)
        found.append((last(scene, Schedule(4), Newton()).state.nodes - mesh.nodes) / scale)
    assert np.abs(found[1]).max() > 5e-3
    for other in (found[0], found[2]):
        np.testing.assert_allclose(other, found[1], rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Traction("nowhere", (0.0, 1.0)), "boundary"),
        (lambda: Pressure("nowhere", 1.0), "boundary"),
        (lambda: PointForce(10_000, (0.0, 1.0)), "point force.node"),
        (lambda: BodyForce((0.0, np.nan)), "body force.vector"),
        (lambda: BodyForce((0.0, 1.0, 2.0)), "body force.vector"),
        (lambda: Traction("top", "up"), "traction.vector"),
        (lambda: Pressure("top", "high"), "pressure.pressure"),
        (lambda: Pressure("top", float("nan")), "pressure.pressure = nan: must be finite"),
        (lambda: Pressure("top", 1.0, 2.0), "pressure.amplitude"),
        (lambda: Amplitude(((0.0, 0.0), (0.5, 1.0))), "amplitude.points"),
        (lambda: Amplitude(((0.0, 0.0), (1.0, np.inf))), "amplitude.points"),
        (lambda: Amplitude("ramp"), "amplitude.points"),
        (lambda: Amplitude().at("x"), "tau = 'x': must be a number"),
        (lambda: Amplitude().at(()), r"tau = \(\): must be a number"),
    ],
)
def test_bad_loads_are_refused_by_name(make, field):
    with pytest.raises(SceneError, match=field):
        bar((make(),))


def test_bad_prescriptions_are_refused_by_name():
    with pytest.raises(SceneError, match=r"prescribed\.displacement"):
        Prescribed("top", 1, np.nan)
    with pytest.raises(SceneError, match=r"prescribed\.amplitude"):
        Prescribed("top", 1, 1.0, Amplitude(((0.0, 1.0), (1.0, 1.0))))
    with pytest.raises(SceneError, match=r"one displacement along 1"):
        bar(supports=(Prescribed("base", 1, 1.0),))
    with pytest.raises(SceneError, match=r"scene\.loads"):
        bar(loads=("weight",))


def test_magnitudes_are_plain_numbers_whatever_they_came_as():
    for value in (np.float16(2.0), np.float32(2.0), Fraction(2), 2):
        assert type(Pressure("top", value).pressure) is float
        assert type(Prescribed("top", 1, value).displacement) is float
    with pytest.raises(SceneError, match=r"amplitude\.points"):
        Amplitude(((0.0, 0.0), (1.0, 1e300)))


def test_a_load_without_forces_is_refused():
    class Nothing:
        amplitude = Amplitude()

        def check(self, mesh: Mesh) -> None:
            pass

    with pytest.raises(SceneError, match=r"scene\.loads\[0\].*gives its forces"):
        bar(loads=(Nothing(),))


@pytest.mark.parametrize("early", [5e-324, 1e-300, 1e-12])
def test_a_load_that_rises_in_no_time_is_one_of_the_first_increment(early):
    at_once = Amplitude(((0.0, 0.0), (early, 1.0), (1.0, 1.0)))
    steps = list(march(bar((Traction("top", (0.0, 300.0), at_once),)), Schedule(2), Control(Newton())))
    assert [a.state.tau for a in steps] == [0.5, 1.0]
    with pytest.raises(SceneError, match="first"):
        Schedule(2, first=1e-300)


def test_numbers_that_no_float_holds_are_refused_by_name():
    for path in (((0.0, 0.0), (1.0, 10**400)), ((0.0, 0.0), (0.5, 1e308), (1.0, -1e308))):
        with pytest.raises(SceneError, match=r"tool\.path"):
            FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -1.0), ("top",), 0.3, path)
    assert FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -1.0), ("top",), Fraction(1, 2)).mu == 0.5


@pytest.mark.slow
def test_a_pressure_that_passes_its_maximum_in_large_deformation_says_so():
    """The bore grows and the wall thins: the most that is carried is what a driven bore's reaction comes to."""
    tube = Scene(
        mesh=ring(100.0, 200.0, 20.0, 4, 1, element=Element.Q8),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(210_000.0, 0.3), Perfect(240.0)),
        supports=(Support("base", 1), Support("top", 1)),
        quadrature=Quadrature.GAUSS2,
    )
    bore = tube.mesh.boundary_nodes("bore")
    driven = replace(tube, supports=(*tube.supports, Prescribed("bore", 0, 1.0)))
    pressures = []
    for step in march(driven, Schedule(40), Control(Newton())):
        force = float(step.solved.iterate.reactions(step.solved.r)[bore, 0].sum())
        pressures.append(force / (2 * np.pi * 20.0 * float(step.state.nodes[bore, 0].mean())))
    assert 0 < int(np.argmax(pressures)) < 39
    with pytest.raises(IncrementFailed, match="the load passes its maximum at about tau = ") as caught:
        list(march(replace(tube, loads=(Pressure("bore", 300.0),)), Schedule(20)))
    assert 300.0 * caught.value.state.tau == pytest.approx(max(pressures), rel=1e-3)
    assert 300.0 * float(str(caught.value).split("tau = ")[-1].rstrip(".")) == pytest.approx(max(pressures), rel=1e-3)


@pytest.mark.parametrize(
    "configuration", [pytest.param(Configuration.MIDPOINT, marks=pytest.mark.slow), Configuration.SMALL]
)
def test_a_bar_that_thins_passes_its_maximum_without_a_proof(configuration):
    """Where strain is small the shape stays, and it is proven. The load is 2/sqrt3 of the yield stress and more."""
    scene = Scene(
        mesh=block(3.0, 2.0, 3, 2),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(young=70_000.0, poisson=0.33), Perfect(100.0)),
        supports=(Support("base", 0), Support("base", 1)),
        loads=(Traction("top", (0.0, 500.0)),),
        configuration=configuration,
    )
    words = "passes its maximum at about tau = " if configuration is Configuration.MIDPOINT else "passes the limit load"
    with pytest.raises(IncrementFailed, match=words) as caught:
        list(march(scene, Schedule(4)))
    assert isinstance(caught.value, LimitPassed) == (configuration is Configuration.SMALL)
    assert 100 * 2 / np.sqrt(3) < 500 * caught.value.state.tau < 1.05 * 100 * 2 / np.sqrt(3)


def test_what_is_prescribed_to_stay_is_not_shifted():
    """It is held, as by a support, also where another one of the same node moves."""
    holding = bar(supports=(Prescribed("top", 1, 0.0), Prescribed("right", 0, 0.1))).holding
    top, right = (bar().mesh.boundary_nodes(name) for name in ("top", "right"))
    assert np.isin(top, right).any()
    assert holding.held[top, 1].all()
    assert not holding.shifted[:, 1].any()
    assert (np.flatnonzero(holding.shifted[:, 0]) == np.sort(right)).all()
