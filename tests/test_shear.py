"""Scenes with constant shear and with Coulomb's law capped: closed forms, forms against each other, units, mirrors."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from bipot import (
    Control,
    Delassus,
    Dissipation,
    Elastic,
    Elasticity,
    FlatTool,
    Force,
    Geometry,
    Linear,
    Newton,
    Penalty,
    Perfect,
    Sampling,
    Scene,
    Schedule,
    ShapedTool,
    Symmetry,
    Tangent,
    Uzawa,
    VonMises,
    block,
    limit_load,
    march,
)
from bipot.certificate import Bounds
from bipot.elements import Element
from bipot.errors import SceneError, UnsuitedForm
from bipot.examined import Examined
from bipot.exchange import contact_problem
from bipot.forms import contact_penalty
from bipot.laws.coulomb import Status
from bipot.marching import system_of
from bipot.results.description import describe
from bipot.supports import Support
from bipot.surfaces import Circle
from tests.scenes import refused

INF = float("inf")
SIGMA_Y = 300.0
SHEAR = SIGMA_Y / np.sqrt(3)
CONSTANT, OROWAN = (INF, 0.3), (0.3, 0.4)
SHORT = Schedule(10, first=0.005)


def slab(
    mu, shear, hardening=None, *, elements=(8, 4), reduction=0.2, scale=1.0, stress=1.0, element=Element.Q4, **tool
):
    """A quarter of a slab 16 x 8 (times ``scale``) pressed flat in plane strain."""
    return Scene(
        mesh=block(8.0 * scale, 4.0 * scale, *elements, element=element),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(210_000.0 * stress, 0.3), hardening or Perfect(SIGMA_Y * stress)),
        supports=(Symmetry("left", 0), Symmetry("base", 1)),
        tools=(
            FlatTool(
                (0.0, 4.0 * scale),
                (0.0, -1.0),
                (0.0, -reduction * 4.0 * scale),
                ("top", "right"),
                mu,
                shear=shear,
                **tool,
            ),
        ),
    )


@cache
def pressed(mu, shear, form=None):
    """The increments of a slab, all by one form."""
    control = Control() if form is None else Control(form, fallbacks=())
    return tuple(march(slab(mu, shear), SHORT, control))


def lengths_on_top(accepted):
    """Tributary lengths of the nodes (c,) that carry, from the edges of which both ends do.

    The numbers are this test's own: straight linear edges, halved.
    """
    contacts = accepted.solved.iterate.increment.system.candidates
    nodes = accepted.state.nodes
    carries = np.zeros(len(nodes), bool)
    carries[contacts.node[accepted.solved.r[:, 0] > 1e-6 * accepted.solved.r[:, 0].max()]] = True
    own = np.zeros(len(nodes))
    for name in ("top", "right"):
        edges = contacts.scene.mesh.boundary(name)
        for a, b in edges[carries[edges].all(axis=1)].tolist():
            own[[a, b]] += np.linalg.norm(nodes[b] - nodes[a]) / 2
    return own[contacts.node]


def test_a_block_that_slides_is_sheared_by_m_times_its_yield_stress_and_area():
    """Pressed, then slid along: the force is m k A, whatever the pressure; one tool of two has no shear."""
    path = ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    for m in (0.05, 0.3):
        scene = Scene(
            mesh=block(8.0, 4.0, 8, 4),
            geometry=Geometry.PLANE_STRAIN,
            material=VonMises(Elasticity(210_000.0, 0.3), Perfect(SIGMA_Y)),
            supports=(Support("base", 0), Support("base", 1)),
            tools=(FlatTool((0.0, 4.0), (0.0, -1.0), (0.4, -0.02), ("top",), INF, path, shear=m),),
        )
        *_, last = march(scene, Schedule(10))
        width = np.ptp(last.state.nodes[scene.mesh.boundary_nodes("top"), 0])
        assert last.tool_force(0)[0] == pytest.approx(m * SHEAR * width, rel=1e-6)
        assert (last.traction.status == Status.SLIP).all()
        np.testing.assert_allclose(last.traction.recovered_shear, last.traction.recovered_shear[0], rtol=1e-6)
        assert abs(last.traction.recovered_shear[0]) == pytest.approx(m * SHEAR, rel=1e-6)


def test_a_slab_is_at_the_cap_in_part_and_on_the_cone_in_part():
    last = pressed(0.1, 0.23)[-1]
    r, cap = last.solved.r, last.solved.rows.cap
    slides = last.traction.status == Status.SLIP
    capped = slides & (0.1 * r[:, 0] > 1.01 * cap)
    on_cone = slides & (0.1 * r[:, 0] < 0.99 * cap)
    assert capped.sum() >= 2
    assert on_cone.sum() >= 2
    np.testing.assert_allclose(np.abs(r[capped, 1]), cap[capped], rtol=1e-7)
    np.testing.assert_allclose(np.abs(r[on_cone, 1]), 0.1 * r[on_cone, 0], rtol=1e-7)
    # The caps by hand: m k times half the lengths of the edges beside; to the outermost the side may add a part.
    outermost = np.argmax(last.state.nodes[last.solved.iterate.increment.system.candidates.node, 0] * (r[:, 0] > 0))
    inner = (r[:, 0] > 0) & (np.arange(len(r)) != outermost)
    np.testing.assert_allclose(cap[inner], 0.23 * SHEAR * lengths_on_top(last)[inner], rtol=1e-9)


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_the_measures_are_those_of_a_recomputation(law):
    """Cone, law and gap by plain formulas from forces, motion and caps of the last iterate, and of planted errors."""
    last = pressed(*law, Tangent())[-1]
    iterate = last.solved.iterate
    rho = iterate.increment.system.rigidity.contact
    for planted in (0.0, 1e-3, -1e-2):
        r = last.solved.r.copy()
        worst = int(np.argmax(np.abs(r[:, 1])))
        r[worst, 1] *= 1 + planted
        cone, law_, gap, largest = 0.0, 0.0, 0.0, np.abs(r).max()
        for (r_n, r_t), (g, slip), cap, k in zip(r, iterate.motion, iterate.rows.cap, rho, strict=True):
            s = (cap if r_n > 1e-7 * largest else 0.0) if np.isinf(law[0]) else min(law[0] * r_n, cap)
            cone = max(cone, abs(r_t) - s, -r_n)
            y = r_t - k * slip
            off = r_n - max(r_n - k * g, 0.0), r_t - np.clip(y, -max(s, 0.0), max(s, 0.0))
            law_ = max(law_, float(np.hypot(*off)))
            gap += abs(r_n * g) + abs(s * abs(slip) + r_t * slip)
        found = Examined(iterate, r, largest, Bounds()).certificate
        assert found.cone_violation == pytest.approx(cone / largest, abs=1e-15)
        assert found.law == pytest.approx(law_ / largest, rel=1e-9, abs=1e-14)
        assert found.contact_gap == pytest.approx(gap, rel=1e-9, abs=1e-13)
        assert (found.law > 1e-6) == (planted != 0)


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_the_forms_agree(law):
    K = 200 * contact_penalty(system_of(slab(*law)).candidates)
    force = {}
    for form in (Newton(), Tangent(), Tangent(coupled=False), Dissipation(), Uzawa(K, K)):
        force[form] = -pressed(*law, form)[-1].tool_force(0)[1]
    newton = force[Newton()]
    assert not any(step.cuts for form in force for step in pressed(*law, form))
    np.testing.assert_allclose(list(force.values()), newton, rtol=1e-6)
    off = [abs(-pressed(*law, Penalty(k * K, k * K))[-1].tool_force(0)[1] / newton - 1) for k in (1, 10)]
    assert off[1] < 1e-5
    assert off[1] < 0.2 * off[0]


def test_the_discrete_coulomb_problem_does_not_take_a_cap():
    with pytest.raises(UnsuitedForm, match=r"tool\.shear"):
        contact_problem(pressed(*OROWAN)[-1])
    first = next(march(slab(*OROWAN), SHORT, Control(Delassus(), fallbacks=(Newton(),))))
    assert first.form is Newton.name
    assert any("tool.shear" in str(reason) for reason in first.reasons)
    driven = replace(
        slab(*OROWAN), tools=(replace(slab(*OROWAN).tools[0], travel=(0.0, 0.0), driven_by=Force((0.0, -1.0))),)
    )
    refused(lambda: limit_load(driven), r"tools\[0\].shear = 0.4")


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_units_do_not_matter(law):
    """mm and MPa, m and Pa: forces per thickness."""
    force = [
        -list(march(slab(*law, scale=scale, stress=stress), SHORT))[-1].tool_force(0)[1] / (scale * stress)
        for scale, stress in ((1.0, 1.0), (1e-3, 1e6))
    ]
    assert force[1] == pytest.approx(force[0], rel=1e-9)


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_a_mirror_image_does_the_mirrored_thing(law):
    """A block slid to the right, and one slid to the left."""
    found = []
    for way in (1.0, -1.0):
        mesh = block(4.0, 2.0, 4, 2)
        tool = FlatTool((0.0, 2.0), (0.0, -1.0), (way * 0.3, -0.2), ("top",), law[0], shear=law[1])
        scene = Scene(
            mesh=replace(mesh, nodes=mesh.nodes - np.array([2.0, 0.0])),
            geometry=Geometry.PLANE_STRAIN,
            material=VonMises(Elasticity(210_000.0, 0.3), Linear(SIGMA_Y, 500.0)),
            supports=(Support("base", 0), Support("base", 1)),
            tools=(tool,),
        )
        *_, last = march(scene, SHORT)
        found.append(last.tool_force(0) * np.array([way, 1.0]))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-7)


def test_the_cap_follows_the_hardened_yield_stress():
    """One element, pressed without other friction than at one node: the cap is that of its own equivalent strain."""
    m, hardening = 0.25, Linear(SIGMA_Y, 2000.0)
    *_, last = march(slab(INF, m, hardening, elements=(1, 1)), SHORT)
    peeq, volume = last.state.peeq, last.solved.response.kinematics.volume
    k = float(np.average(SIGMA_Y + 2000.0 * peeq, weights=volume)) / np.sqrt(3)
    assert k > 1.5 * SHEAR
    nodes = last.state.nodes
    top = last.solved.iterate.increment.system.body.scene.mesh.boundary("top")
    width = np.ptp(nodes[top, 0])
    outer = last.solved.iterate.increment.system.candidates.node == top[0, np.argmax(nodes[top[0], 0])]
    np.testing.assert_allclose(last.solved.rows.cap[outer], m * k * width / 2, rtol=1e-9)
    sliding = last.traction.status == Status.SLIP
    np.testing.assert_allclose(np.abs(last.solved.r[sliding, 1]), last.solved.rows.cap[sliding], rtol=1e-7)
    assert sliding.any()


def test_limits_of_the_laws():
    """m = 0 is no friction; a cap that is never reached is Coulomb's law; a large coefficient is constant shear."""
    force = {law: -pressed(*law)[-1].tool_force(0)[1] for law in ((0.0, INF), (INF, 0.0), (0.05, INF), (0.05, 1.0))}
    assert force[INF, 0.0] == pytest.approx(force[0.0, INF], rel=1e-12)
    assert force[0.05, 1.0] == pytest.approx(force[0.05, INF], rel=1e-9)
    steep, constant = (-pressed(mu, 0.3)[-1].tool_force(0)[1] for mu in (50.0, INF))
    assert steep == pytest.approx(constant, rel=1e-6)
    assert force[0.0, INF] < constant < -pressed(INF, 0.6)[-1].tool_force(0)[1]


def test_friction_by_node():
    """Coulomb's law at one node of a tool with constant shear, constant shear at one of a Coulomb tool."""
    whole = system_of(slab(0.1, INF)).candidates.node.tolist()
    a = whole[2]
    by_shear = next(march(slab(INF, 0.3, mu_at={a: 0.1}, shear_at={a: INF}), SHORT)).solved
    by_mu = next(march(slab(0.1, INF, shear_at={a: 0.2}), SHORT)).solved
    for solved, own in ((by_shear, [k == a for k in whole]), (by_mu, [k != a for k in whole])):
        np.testing.assert_array_equal(np.isinf(solved.rows.cap), own)
    assert by_shear.rows.mu[2] == 0.1
    said = describe(slab(INF, 0.3, shear_at={a: 0.2}))["tools"][0]
    assert (said["shear"], said["shear_at"]) == (0.3, {str(a): 0.2})


@pytest.mark.parametrize("law", [(INF, 0.1), (INF, 0.3), (0.3, 0.4)])
@pytest.mark.parametrize("hardening", [None, Linear(SIGMA_Y, 1000.0)])
def test_newton_takes_at_most_a_pass_more_than_with_coulombs_law(law, hardening):
    """The caps are frozen in a pass, and what that leaves falls by more than a factor of ten from pass to pass."""
    counts, falls = [], list[float]()
    # Where p is about sigma_Y, m k is m p / sqrt 3.
    for mu, shear in ((min(law[0], law[1] / np.sqrt(3)), INF), law):
        off = dict[float, list[float]]()

        def watch(trial, off=off):
            seen = trial.certificate
            off.setdefault(trial.iterate.increment.tau, []).append(max(seen.equilibrium, seen.law))

        steps = tuple(march(slab(mu, shear, hardening), SHORT, Control(Newton(), fallbacks=()), observe=watch))
        counts.append(sum(step.passes for step in steps))
        falls = [b / a for each in off.values() for a, b in pairwise(each) if 1e-13 < b and a < 1e-4]
    assert counts[1] <= counts[0] + len(steps)
    assert np.median(falls) < 0.1


@pytest.mark.parametrize("element", [Element.Q8, Element.T6])
@pytest.mark.parametrize("sampling", Sampling)
def test_quadratic_elements(element, sampling):
    """Caps sum up to m k times the area of what lies on the tool, at nodes and in the mean; forces are near Q4's."""
    *_, last = march(slab(INF, 0.3, elements=(4, 2), reduction=0.1, element=element, sampling=sampling), SHORT)
    mesh = last.solved.iterate.increment.system.body.scene.mesh
    nodes = last.state.nodes
    width, cap = float(np.ptp(nodes[mesh.boundary_nodes("top"), 0])), last.solved.rows.cap
    assert cap.min() >= 0
    assert cap.sum() == pytest.approx(0.3 * SHEAR * width, rel=5e-3)
    *_, linear = march(slab(INF, 0.3, elements=(16, 8), reduction=0.1), SHORT)
    assert last.tool_force(0)[1] == pytest.approx(linear.tool_force(0)[1], rel=0.02)


@pytest.mark.parametrize("law", [CONSTANT, OROWAN])
def test_a_circle(law):
    scene = Scene(
        mesh=block(6.0, 4.0, 9, 6),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(21_000.0, 0.3), Linear(100.0, 200.0)),
        supports=(Symmetry("left", 0), Support("base", 1)),
        tools=(ShapedTool(Circle((0.0, 7.0), 3.0), (0.0, -0.6), ("top",), law[0], shear=law[1]),),
    )
    force = []
    for form in (Newton(), Dissipation()):
        *_, last = march(scene, SHORT, Control(form))
        r, s = last.solved.r, last.solved.rows.limit(last.solved.r)
        assert (r[:, 0] > 0).sum() >= 3
        assert (np.abs(r[:, 1]) <= s + 1e-8 * np.abs(r).max()).all()
        force.append(last.tool_force(0)[1])
    assert force[0] == pytest.approx(force[1], rel=1e-6)


def test_a_tool_driven_by_a_force():
    for law in (CONSTANT, OROWAN):
        scene = slab(*law, Linear(SIGMA_Y, 1000.0))
        tool = replace(scene.tools[0], travel=(0.0, 0.0), driven_by=Force((0.0, -4000.0)))
        *_, last = march(replace(scene, tools=(tool,)), SHORT)
        assert last.tool_force(0)[1] == pytest.approx(-4000.0, rel=1e-7)
        r = last.solved.r
        assert (np.abs(r[:, 1]) <= last.solved.rows.limit(r) + 1e-7 * r[:, 0].max()).all()


def test_tool_and_support_rub_by_the_cap():
    """Supports hold the nodes along the tool: no unknown knows of the friction, but the tool's force does."""
    scene = Scene(
        mesh=block(4.0, 2.0, 4, 2),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(210_000.0, 0.3), Perfect(SIGMA_Y)),
        supports=(Support("base", 1), Support("base", 0), Support("top", 0)),
        tools=(FlatTool((0.0, 2.0), (0.0, -1.0), (0.1, -0.001), ("top",), INF, shear=0.2),),
    )
    *_, last = march(scene, Schedule(3))
    assert last.tool_force(0)[0] == pytest.approx(0.2 * SHEAR * 4.0, rel=1e-9)


def test_what_is_refused():
    edge, inner = 8, 0
    cases = [
        ({"shear": 1.01}, r"shear = 1.01: must be >= 0, to 1"),
        ({"shear": -0.1}, r"shear = -0.1"),
        ({"shear": float("nan")}, r"shear = nan"),
        ({"shear": "0.3"}, r"shear = '0.3': must be a number"),
        ({"shear": True}, r"shear = True"),
        ({"shear": -INF}, r"shear = -inf"),
        ({"shear": 0.3, "shear_at": [(edge, 0.1)]}, r"shear_at = .*must be a Mapping"),
        ({"shear": 0.3, "shear_at": {edge: 2.0}}, rf"shear_at\[{edge}\] = 2.0"),
        ({"shear": 0.3, "shear_at": {edge: float("nan")}}, rf"shear_at\[{edge}\] = nan"),
        ({"shear": 0.3, "shear_at": {"8": 0.2}}, r"shear_at node = '8'"),
        ({"shear": 0.3, "shear_at": {inner: 0.2}}, r"shear_at node = 0: must be one of the tool's candidates"),
        ({"shear": 0.3, "shear_at": {edge: INF}}, rf"shear_at\[{edge}\] = inf: must be finite where mu = inf"),
        ({"shear": INF, "shear_at": {edge: 0.3}}, r"shear_at = .*must be empty where mu = inf and shear = inf"),
    ]
    for fields, message in cases:
        shear = fields.pop("shear")
        refused(lambda shear=shear, fields=fields: slab(INF, shear, **fields), message)
    elastic = slab(0.1, INF)
    with pytest.raises(SceneError, match=r"tools\[0\].shear = 0.3: must be inf where the material does not flow"):
        replace(elastic, material=Elastic(Elasticity(1.0, 0.3)), tools=(replace(elastic.tools[0], shear=0.3),))
