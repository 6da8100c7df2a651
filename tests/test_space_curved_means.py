"""Curved tools met in weighted means, in space: gap and slip by hand, derivatives, forms, turned scenes, halves."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot.contact.sampling import points
from bipot.fem.elements import RULES
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Tangent, Uzawa
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.system import system_of
from bipot.tools.revolved import sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from tests.curved import TIGHT, apart, forces, marched
from tests.scenes import named
from tests.solids import turned
from tests.space import RUBBER, dented, mirrored_scene, rubbed, turned_scene
from tests.test_curved_forms import check_derivatives, derivative
from tests.test_space_tools import SURFACES, TURN, check_balance, pushed_by_a_force, start_of

WEIGHTED = Sampling.WEIGHTED
QUADRATIC = (Element.H20, Element.T10)
BLUNT = sphere((0.45, 0.55, 3.0), 2.0)


def quadratic(scene, element=Element.H20, elements=2):
    """The scene of a block of these elements, met in the mean; of a single one by a rule that sees all its motions."""
    mesh = brick(1.0, 1.0, 1.0, elements, elements, elements, element=element)
    tools = tuple(replace(tool, sampling=WEIGHTED) for tool in scene.tools)
    return replace(scene, mesh=mesh, tools=tools, quadrature=RULES[element][-1] if elements == 1 else None)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("turn", [None, TURN], ids=["still", "turning"])
def test_rows_and_newtons_tangent_are_derivatives(name, turn):
    """What slips change by beside their rows is the mean over the nodes: to the square of angles between them."""
    if name == "plane" and turn is None:
        pytest.skip("a flat tool has the same rows all along")
    rng = np.random.default_rng(7)
    increment, x, r = start_of(quadratic(rubbed(SURFACES[name], turn=turn), elements=1), rng)
    here, K = increment.at(x), None
    K = increment.system.body.space.matrix(here.tangent(r))

    def gaps(y):
        return increment.at(y).motion[:, 0]

    def unbalanced(y):
        there = increment.at(y)
        return there.residual - there.rows.forces(r)

    for _ in range(3):
        v = rng.uniform(-1, 1, len(x))
        np.testing.assert_allclose(derivative(gaps, x, v), here.rows.G_n @ v, atol=1e-9)
        np.testing.assert_allclose(derivative(unbalanced, x, v), K @ v, atol=1e-9 * np.abs(K @ v).max())


def test_slips_change_as_measured_where_the_surface_is_even():
    """Of a plane that turns all nodes of a mean slip alike: nothing is left out."""
    rng = np.random.default_rng(7)
    increment, x, r = start_of(quadratic(rubbed(SURFACES["plane"], turn=TURN), elements=1), rng)
    check_derivatives(increment, x, r, rng, turning=False)


def test_newtons_tangent_of_a_sphere_that_a_force_drives_is_a_derivative():
    check_balance(quadratic(pushed_by_a_force(), elements=1))


@pytest.mark.parametrize("element", QUADRATIC)
def test_gaps_and_forces_are_those_of_means_by_hand(element):
    """Of nodes at the sphere, averaged; what nodes take is the internal force of their elements."""
    scene = quadratic(rubbed(BLUNT, mu=0.3, travel=(0.06, 0.04, -0.2)), element)
    last = marched(scene, increments=6, bounds=TIGHT)[-1]
    system, tool = last.solved.iterate.increment.system, scene.tools[0]
    found = points(scene.mesh, scene.geometry, tool)
    centre = np.add(tool.face.point, scene.travel(0.0, 1.0)[0])
    D, candidates = found.weights.toarray(), system.candidates
    gap = np.linalg.norm(last.state.nodes - centre, axis=1) - 2.0
    number = candidates.number[0]
    np.testing.assert_allclose(last.state.gap[number[number >= 0]], (D @ gap)[number >= 0], atol=1e-12)
    r = last.solved.r
    assert (r[:, 0] > 0).sum() >= 2
    pulled = system.body.space.nodal(last.solved.response.element_forces)
    free = ~scene.holding.held.any(axis=1)
    pushed = candidates.met.nodal(candidates.vectors(r, last.solved.iterate.frames))
    np.testing.assert_allclose(pushed[free], pulled[free], atol=1e-8 * np.abs(pulled).max())
    # Normal parts point from the centre: the resultant of D r n, node by node, is the force of the tool.
    normal = (last.state.nodes - centre) / (gap + 2.0)[:, None]
    alone = (D.T @ np.where(number >= 0, r[np.maximum(number, 0), 0], 0.0))[:, None] * normal
    rubbing = last.tool_force(0) - alone.sum(axis=0)
    assert np.linalg.norm(rubbing) <= 0.3 * r[:, 0].sum() * (1 + 1e-9)


@cache
def pushed():
    return marched(quadratic(dented(material=RUBBER)), increments=5, bounds=TIGHT)


@pytest.mark.parametrize("form", [Tangent(), Dissipation(), Delassus(), Uzawa(3e4, 3e4)], ids=named)
def test_every_form_finds_the_same_forces_under_a_sphere(form):
    other = marched(quadratic(dented(material=RUBBER)), form, increments=5, bounds=TIGHT)
    same = [a.state.tau == b.state.tau for a, b in zip(pushed(), other, strict=False)]
    kept = same.index(False) if False in same else len(same)
    assert kept >= 8
    assert apart(forces(other)[:kept], forces(pushed())[:kept]) < 1e-6


@pytest.mark.slow
def test_forms_agree_on_a_body_that_flows():
    soft = VonMises(Elasticity(1e3, 0.3), Linear(20.0, 50.0))
    scene = quadratic(dented(material=soft))
    one, other = (marched(scene, form, increments=6, bounds=TIGHT) for form in (None, Tangent()))
    assert [a.state.tau for a in one] == [a.state.tau for a in other]
    assert one[-1].peeq.max() > 1e-2
    assert apart(forces(other), forces(one)) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("element", QUADRATIC)
def test_a_scene_turned_or_mirrored_as_a_whole_has_the_same_forces(element):
    down = {"travel": (0.05, 0.02, -0.15), "path": ((0, 0), (1, 1))}
    scene = quadratic(rubbed(BLUNT, mu=0.3, **down), element)
    base = ShapedTool(Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0), ("base",), np.inf, sampling=WEIGHTED)
    scene, Q = replace(scene, supports=(), tools=(*scene.tools, base)), turned((1.0, 2.0, -0.5), 0.8)
    one = forces(marched(scene, increments=3, bounds=TIGHT))
    assert np.abs(one[:, 0]).max() > 0.01 * np.abs(one[:, 2]).max() > 0
    assert apart(forces(marched(turned_scene(scene, Q), increments=3, bounds=TIGHT)) @ Q, one) < 1e-8
    mirrored = forces(marched(mirrored_scene(scene), increments=3, bounds=TIGHT))
    assert apart(mirrored * (-1.0, 1.0, 1.0), one) < (1e-8 if element is Element.H20 else 0.1)


@pytest.mark.slow
def test_half_of_a_body_bears_half_the_force_of_the_whole():
    """Under a sphere in the plane between that presses and goes along it: means there slip along the plane alone."""
    seen = []
    for whole in (True, False):
        straight = brick(2.0 if whole else 1.0, 1.0, 1.0, 4 if whole else 2, 2, 2, element=Element.H20)
        mesh = Mesh(
            straight.nodes - ((1.0, 0.0, 0.0) if whole else (0.0, 0.0, 0.0)), straight.elements, straight.boundaries
        )
        held = tuple(Support("base", d) for d in range(3))
        path = ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (1.0, (0.0, 1.0, 1.0)))
        tool = ShapedTool(sphere((0.0, 0.5, 2.0), 1.0), (0.0, 0.1, -0.08), ("top",), 0.3, path, sampling=WEIGHTED)
        supports = held if whole else (*held, Symmetry("left", 0))
        seen.append(marched(Scene(mesh, Geometry.SOLID, RUBBER, supports, (tool,)), increments=6, bounds=TIGHT)[-1])
    whole, half = seen
    force = whole.tool_force(0)
    np.testing.assert_allclose(half.tool_force(0), force, atol=1e-8 * np.abs(force).max())
    assert abs(force[1]) > 0.05 * abs(force[2])
    assert half.energies.friction == pytest.approx(whole.energies.friction, rel=1e-6)
    assert half.energies.friction > 0


@pytest.mark.slow
def test_a_large_sphere_tends_to_the_plane():
    flat = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.05), ("top",), 0.2, sampling=WEIGHTED)
    scene = quadratic(dented())
    plane = forces(marched(replace(scene, tools=(flat,)), increments=3))
    off = []
    for R in (1e4, 1e6):
        ball = quadratic(dented(sphere((0.0, 0.0, 1.0 + R), R), (0.0, 0.0, -0.05)))
        off.append(apart(forces(marched(ball, increments=3)), plane))
    assert off[1] < 0.02 * off[0] < 1e-3


def test_linear_faces_are_met_at_their_nodes():
    one, other = (dented(material=RUBBER, elements=2, sampling=sampling) for sampling in Sampling)
    np.testing.assert_array_equal(forces(marched(one, increments=3)), forces(marched(other, increments=3)))


def test_means_touch_as_their_gap_closes_though_nodes_are_apart():
    """At rest the mean of nodes under a sphere is off it where a node touches: by the mean of their gaps."""
    scene = quadratic(dented(sphere((0.0, 0.0, 3.0), 2.0)))
    found, at = points(scene.mesh, scene.geometry, scene.tools[0]), scene.mesh.nodes
    gap = np.linalg.norm(at - (0.0, 0.0, 3.0), axis=1) - 2.0
    contacts = system_of(scene).candidates
    rest = contacts.distance(at, scene.at_rest)
    np.testing.assert_allclose(rest, (found.weights @ gap)[contacts.number[0] >= 0], atol=1e-15)
    assert rest.min() > 1e-3
