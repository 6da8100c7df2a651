"""Scenes with constant shear and with Coulomb's law capped: closed forms, curved and driven tools, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    Dissipation,
    Elastic,
    Elasticity,
    FlatTool,
    Force,
    Geometry,
    Linear,
    Newton,
    Perfect,
    Sampling,
    Scene,
    Schedule,
    ShapedTool,
    Symmetry,
    VonMises,
    block,
    march,
)
from bipot.errors import SceneError
from bipot.laws.coulomb import Status
from bipot.marching import system_of
from bipot.meshes.elements import Element
from bipot.results.description import describe
from bipot.scene.supports import Support
from bipot.tools.circle import Circle
from tests.scenes import refused
from tests.sheared import CONSTANT, INF, OROWAN, SHEAR, SHORT, SIGMA_Y, slab


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


@pytest.mark.slow
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


@pytest.mark.slow
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
