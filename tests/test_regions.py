"""Bodies of several materials: beside closed forms, one material in two regions, and in every form."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Configuration,
    Control,
    Dissipation,
    Elastic,
    Elasticity,
    FlatTool,
    Geometry,
    Linear,
    Newton,
    Perfect,
    Scene,
    Schedule,
    Support,
    Tangent,
    VonMises,
    block,
)
from bipot.system import system_of
from bipot.tensors import equivalent_stress
from tests.regional import COPPER, HARD, SCENES, STEEL, billet, last, lined, plane, solid, split


@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES)
def test_one_material_in_two_regions_is_one_material(make):
    two, one = make(STEEL), replace(make(STEEL), regions={})
    for control in (Control(Newton(), ()), Control(Dissipation(), ())):
        a, b = last(two, control), last(one, control)
        np.testing.assert_allclose(a.state.nodes, b.state.nodes, rtol=1e-12)
        np.testing.assert_allclose(a.tool_force(0), b.tool_force(0), rtol=1e-11)


@pytest.mark.parametrize("core", [COPPER, HARD], ids=["soft", "hard"])
@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES)
def test_all_forms_give_one_answer(make, core):
    scene = make(core)
    first = last(scene, Control(Newton(), ()))
    assert first.solved.certificate.relative_gap < 1e-7
    for form in (Tangent(), Dissipation()):
        other = last(scene, Control(form, ()))
        assert other.solved.certificate.relative_gap < 1e-7
        np.testing.assert_allclose(
            other.tool_force(0), first.tool_force(0), rtol=1e-5, atol=1e-6 * first.tool_force(0)[-1]
        )


def test_every_point_obeys_its_own_law():
    """By hand: within the yield stress of its region, on it where it flows, and elastic stress by its own moduli."""
    scene = billet(HARD, configuration=Configuration.SMALL)
    core = scene.mesh.region("core")
    state = last(scene, schedule=Schedule(20)).state
    assert state.peeq[core].max() == 0 < state.peeq.max()
    others = np.setdiff1d(np.arange(len(scene.mesh.elements)), core)
    q, limit = equivalent_stress(state.stress[others]), 300.0 + 1000.0 * state.peeq[others]
    assert (q <= limit * (1 + 1e-12)).all()
    np.testing.assert_allclose(q[state.peeq[others] > 0.01], limit[state.peeq[others] > 0.01], rtol=1e-9)
    # Small strains of a linear material: the stress is that of the final strain, of which the core has no plastic part.
    kin = scene.configuration.measure.increment(
        scene.mesh.nodes,
        state.nodes - scene.mesh.nodes,
        scene.mesh.elements,
        system_of(scene).body.space.reference,
        scene.geometry,
        system_of(scene).body.projection,
    )
    e, (E, nu) = kin.strain[core], (600e3, 0.22)
    identity = np.array([1.0, 1.0, 1.0, 0.0])
    by_hand = E / (1 + nu) * (e + nu / (1 - 2 * nu) * e[..., :3].sum(axis=-1, keepdims=True) * identity)
    np.testing.assert_allclose(state.stress[core], by_hand, rtol=1e-9, atol=1e-9 * np.abs(by_hand).max())


def test_an_elastic_liner_in_a_jacket_follows_lame():
    """u = A r + B / r in both parts, by four conditions: pressure, interface, free outside."""
    p, liner, jacket = 10.0, Elasticity(70e3, 0.33), Elasticity(210e3, 0.28)

    def row(elastic, r):
        K2 = elastic.bulk + elastic.shear / 3
        return np.array([2 * K2, -2 * elastic.shear / r**2]), np.array([r, 1 / r])

    A, b = np.zeros((4, 4)), np.array([-p, 0.0, 0.0, 0.0])
    A[0, :2] = row(liner, 1.0)[0]
    A[1, :2], A[1, 2:] = row(liner, 2.0)[0], -row(jacket, 2.0)[0]
    A[2, :2], A[2, 2:] = row(liner, 2.0)[1], -row(jacket, 2.0)[1]
    A[3, 2:] = row(jacket, 3.0)[0]
    c = np.linalg.solve(A, b)
    exact = {1.0: c[0] + c[1], 2.0: 2 * c[0] + c[1] / 2, 3.0: 3 * c[2] + c[3] / 3}
    errors = []
    for elements in (8, 16):
        scene = lined(elements, Elastic(liner), Elastic(jacket), p)
        nodes = last(scene, schedule=Schedule(1)).state.nodes
        u = nodes[:, 0] - scene.mesh.nodes[:, 0]
        errors.append(max(abs(u[np.isclose(scene.mesh.nodes[:, 0], r)] / of - 1).max() for r, of in exact.items()))
    assert errors[1] < 2e-3
    assert errors[1] < errors[0] / 3


def test_a_plastic_liner_in_an_elastic_jacket_carries_what_yield_and_jacket_do():
    """Incompressible, u = C/r: p = (2 sigma_Y/sqrt 3) ln 2 + 2 G C (1/4 - 1/9) once the liner has yielded."""
    nu, pressure = 0.4999, 500.0
    liner, jacket = VonMises(Elasticity(210e3, nu), Perfect(200.0)), Elastic(Elasticity(210e3, nu))
    scene = lined(24, liner, jacket, pressure)
    accepted = last(scene, schedule=Schedule(10))
    assert (accepted.state.peeq[scene.mesh.region("liner")] > 0).all()
    C = (accepted.state.nodes - scene.mesh.nodes)[scene.mesh.boundary_nodes("bore"), 0].mean()
    carried = 200.0 * 2 / math.sqrt(3) * math.log(2) + 2 * 210e3 / (2 * (1 + nu)) * C * (1 / 4 - 1 / 9)
    assert carried == pytest.approx(pressure, rel=3e-3)


@pytest.mark.parametrize("make", [billet, plane, solid], ids=["meridian", "plane strain", "space"])
def test_newtons_matrix_is_the_derivative_of_the_forces(make):
    scene = make(COPPER)
    accepted = last(scene)
    iterate = accepted.solved.iterate
    increment, x = iterate.increment, iterate.x
    K = increment.system.body.space.matrix(iterate.tangent(np.zeros_like(accepted.solved.r)))
    way = np.random.default_rng(1).normal(size=len(x))
    h = 1e-6 * np.abs(x).max()
    by_difference = (increment.at(x + h * way).residual - increment.at(x - h * way).residual) / (2 * h)
    np.testing.assert_allclose(K @ way, by_difference, atol=2e-6 * np.abs(by_difference).max())


def test_friction_is_capped_by_the_strength_of_the_part_that_rubs():
    """Constant shear on a stiff punch: the shear stress is m k of each column."""
    lid = FlatTool(
        (0.0, 1.0),
        (0.0, -1.0),
        (0.3, -0.02),
        ("top",),
        math.inf,
        ((0.0, 0.0), (0.4, (0.0, 1.0)), (1.0, 1.0)),
        shear=0.4,
    )
    soft, strong = VonMises(STEEL.elasticity, Perfect(100.0)), VonMises(STEEL.elasticity, Perfect(300.0))
    mesh = split(block(1.0, 1.0, 4, 4))
    scene = Scene(
        mesh, Geometry.PLANE_STRAIN, strong, (Support("base", 0), Support("base", 1)), (lid,), regions={"core": soft}
    )
    accepted = last(scene, schedule=Schedule(12))
    shear, node = accepted.state.forces[:, 1], accepted.solved.iterate.increment.system.candidates.node
    x = scene.mesh.nodes[node, 0]
    k = 0.4 / math.sqrt(3)
    width = np.diff(np.sort(accepted.state.nodes[node, 0]))
    np.testing.assert_allclose(abs(shear[x < 0.3][1:]), 100.0 * k * 0.25, rtol=0.1)
    np.testing.assert_allclose(abs(shear[(x > 0.6) & (x < 0.9)]), 300.0 * k * 0.25, rtol=0.1)
    total = 100.0 * k * width[:2].sum() + 300.0 * k * width[2:].sum()
    assert abs(shear.sum()) == pytest.approx(total, rel=1e-6)


def test_a_stiff_part_in_other_units_changes_nothing():
    """Stresses in pascals, lengths in metres."""
    scene = plane(HARD)
    here = last(scene)
    lid = replace(scene.tools[0], point=(0.0, 4e-3), travel=(0.0, -0.6e-3))
    mesh = replace(scene.mesh, nodes=scene.mesh.nodes * 1e-3)
    steel = VonMises(Elasticity(210e9, 0.3), Linear(300e6, 1000e6))
    there = last(
        replace(scene, mesh=mesh, material=steel, tools=(lid,), regions={"core": Elastic(Elasticity(600e9, 0.22))})
    )
    np.testing.assert_allclose(there.state.nodes * 1e3, here.state.nodes, rtol=1e-9)
    np.testing.assert_allclose(
        there.state.stress * 1e-6, here.state.stress, atol=1e-6 * np.abs(here.state.stress).max()
    )


def test_a_cap_of_one_tool_leaves_others_on_what_never_yields_alone():
    """Their caps once were zero times infinity, and a warning."""
    scene = solid(HARD)
    lid = replace(scene.tools[0], candidates=("top",), shear=0.5)
    beneath = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), 0.1)
    mesh, supports = split(scene.mesh, axis=2), scene.supports[:2]
    accepted = last(replace(scene, mesh=mesh, supports=supports, tools=(lid, beneath)))
    assert -accepted.tool_force(0)[2] == pytest.approx(accepted.tool_force(1)[2], rel=1e-6)
