"""Curved tools met in weighted means, in a plane: gap and slip by hand, derivatives, forms, halves, energies."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot.contact.sampling import points
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Penalty, Tangent, Uzawa
from bipot.iterate import Increment
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.scene.loads import Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from tests.curved import RADIUS, TIGHT, apart, check_differences, dragged, forces, marched, pressed
from tests.scenes import PLANES, named
from tests.test_curved_forms import SURFACES, TURNS, check_derivatives, start_of
from tests.test_driven_curved import DRIVEN
from tests.test_driven_rolls import EXACT, rolled, roller

WEIGHTED = Sampling.WEIGHTED
RUBBER = Elastic(Elasticity(1e3, 0.3))


@cache
def met(geometry):
    return tuple(marched(pressed(geometry, sampling=WEIGHTED), bounds=TIGHT))


@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("turn", TURNS, ids=["still", "turning"])
def test_rows_and_newtons_tangent_are_derivatives(geometry, surface, turn):
    if turn is not None and geometry is Geometry.AXISYMMETRIC:
        pytest.skip("a tool is all around the axis")
    scene = pressed(geometry, surface, elements=2, sampling=WEIGHTED)
    if turn is not None:
        free = dragged(elements=2)
        scene = replace(free, tools=(replace(free.tools[0], surface=surface, turn=turn, sampling=WEIGHTED),))
    rng = np.random.default_rng(7)
    increment, x, r = start_of(scene, rng)
    here = increment.at(x)
    np.testing.assert_allclose(here.rows.motion(x), here.motion, rtol=0, atol=1e-15)
    check_derivatives(increment, x, r, rng)


@pytest.mark.parametrize("name", DRIVEN)
def test_the_tangent_of_driven_tools_is_that_of_differences(name):
    scene = dragged(elements=2)
    tool = replace(scene.tools[0], travel=(0.1, 0.0), path=((0, 0), (1, 1)), sampling=WEIGHTED, **DRIVEN[name])
    system = system_of(replace(scene, tools=(tool,)))
    increment, rng = Increment(system, system.rest(), 0.3), np.random.default_rng(0)
    x, count = 1e-3 * rng.normal(size=increment.size), len(system.body.scene.drives)
    x[-count:] = 2e-2
    r = 1e3 * rng.normal(size=(len(system.candidates.node), 2))
    r[~system.candidates.tangent_free, 1] = 0.0
    check_differences(increment, x, r)


@pytest.mark.parametrize("geometry", PLANES)
def test_the_law_holds_of_means_recomputed_from_places(geometry):
    """Gaps and slips of nodes at the circle, averaged by Gauss' rule; nodal forces put together from r."""
    scene = pressed(geometry, sampling=WEIGHTED)
    last, before = met(geometry)[-1], met(geometry)[-2]
    top = np.unique(scene.mesh.boundary("top"))
    order = top[np.argsort(scene.mesh.nodes[top, 0])]
    centre = np.array([0.0, 1.0 + RADIUS - 0.1])
    places = last.state.nodes[order] - centre
    gap = np.linalg.norm(places, axis=1) - RADIUS
    start = before.state.nodes[order] - (0.0, 1.0 + RADIUS - 0.1 * before.state.tau)
    angle = np.arctan2(start[:, 0] * places[:, 1] - start[:, 1] * places[:, 0], np.vecdot(start, places))
    x = scene.mesh.nodes[order, 0]
    radius = x if geometry is Geometry.AXISYMMETRIC else np.ones_like(x)
    D, own = np.zeros((9, 5)), slice(None, None, 2)
    for e in range(4):
        edge, s = slice(2 * e, 2 * e + 3), np.polynomial.legendre.leggauss(3)
        t, w = (s[0] + 1) / 2, s[1] / 2
        N = np.array([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
        L = np.array([1 - t, t])
        D[edge, e : e + 2] += np.einsum("kq,pq,q,q->kp", N, L, w, radius[edge] @ N)
    D /= D.sum(axis=0)
    contacts, r = last.solved.iterate.increment.system.candidates, last.solved.r
    mine = np.searchsorted(x[own], scene.mesh.nodes[contacts.node, 0] - 1e-9)
    means = gap @ D
    np.testing.assert_allclose(last.state.gap, means[mine], atol=1e-12)
    slid = np.abs(last.solved.iterate.motion[:, 1]) > 0
    assert slid.any()
    touched = slid & (before.state.gap < 1e-9)
    np.testing.assert_allclose(last.solved.iterate.motion[touched, 1], -RADIUS * (angle @ D)[mine][touched], atol=1e-9)
    n = places / np.linalg.norm(places, axis=1)[:, None]
    t = np.column_stack([n[:, 1], -n[:, 0]])
    full = np.zeros((5, 2))
    full[mine] = r
    # Off the circle by a gap g a node slips by R/(R + g) of what it moves by.
    pushed = (D @ full[:, :1]) * n + (D @ full[:, 1:]) * t * (RADIUS / (RADIUS + gap))[:, None]
    found = contacts.met.nodal(contacts.vectors(r, last.solved.iterate.frames))[order]
    # Rows are exact to the first order of g/R.
    np.testing.assert_allclose(found, pushed, atol=1e-4 * np.abs(pushed).max())
    assert (r[:, 0] >= 0).all()
    assert (np.abs(r[:, 1]) <= 0.2 * r[:, 0] * (1 + 1e-7) + 1e-9).all()


FORMS = (Tangent(), Dissipation())


@pytest.mark.slow
@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("form", FORMS, ids=named)
def test_forms_of_the_exact_law_agree(geometry, form):
    """As long as the increments are those of Newton: who cuts one goes by others on."""
    one, other = met(geometry), marched(pressed(geometry, sampling=WEIGHTED), form, bounds=TIGHT)
    same = [a.state.tau == b.state.tau for a, b in zip(one, other, strict=False)]
    kept = same.index(False) if False in same else len(same)
    assert kept >= 6
    assert apart(forces(other[:kept]), forces(one[:kept])) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("form", [Delassus(), Uzawa(3e4, 3e4), Penalty(1e6, 1e6)], ids=named)
def test_other_forms_agree_on_an_elastic_body(form):
    scene = pressed(material=RUBBER, sampling=WEIGHTED)
    one, other = marched(scene, increments=4), marched(scene, form, increments=4)
    assert apart(forces(other)[-1], forces(one)[-1]) < (1e-2 if isinstance(form, Penalty) else 1e-6)


def test_linear_edges_are_met_at_their_nodes():
    mesh = block(1.0, 1.0, 4, 4, element=Element.Q4)
    one, other = (replace(pressed(sampling=sampling), mesh=mesh) for sampling in Sampling)
    np.testing.assert_array_equal(forces(marched(one, increments=3)), forces(marched(other, increments=3)))


@pytest.mark.slow
@pytest.mark.parametrize("geometry", PLANES)
def test_a_large_circle_tends_to_the_plane(geometry):
    flat = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.05), ("top",), 0.2, sampling=WEIGHTED)
    plane = forces(marched(replace(pressed(geometry), tools=(flat,)), increments=4))
    off = []
    for R in (1e4, 1e6):
        tool = pressed(geometry, Circle((0.0, 1.0 + R), R), (0.0, -0.05), sampling=WEIGHTED)
        off.append(apart(forces(marched(tool, increments=4)), plane))
    assert off[1] < 0.02 * off[0] < 1e-3


@pytest.mark.parametrize("inside", [True, False], ids=["bore", "rim"])
def test_a_body_that_lies_on_a_circle_bears_the_pressure_of_lame(inside):
    """A quarter of a tube around a bar, or in a die, its other side under pressure: p over the whole contact is one.

    All gaps are zero at rest, though the edges' means of places are off the circle.
    """
    a, b, E, nu, p = 1.0, 2.0, 1e3, 0.3, 1.0
    straight = block(1.0, 1.0, 6, 8, element=Element.Q9)
    r, angle = a + (b - a) * straight.nodes[:, 0], np.pi / 2 * straight.nodes[:, 1]
    nodes = r[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    mesh = Mesh(nodes, straight.elements, straight.boundaries)
    side, other, circle = ("left", "right", Circle((0.0, 0.0), a))
    if not inside:
        side, other, circle = "right", "left", Circle((0.0, 0.0), b, concave=True)
    tool = ShapedTool(circle, (0.0, 0.0), (side,), 0.0, sampling=WEIGHTED)
    held = Symmetry("base", 1), Symmetry("top", 0)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(E, nu)), held, (tool,), loads=(Pressure(other, p),))
    system = system_of(scene)
    np.testing.assert_allclose(system.rest().gap, 0.0, atol=1e-12)
    *_, last = march(scene, Schedule(1))
    # Lame, with u_r = 0 where the rigid tool is: sigma_r = A - B/r^2, u = (1 + nu)/E ((1 - 2 nu) A r + B/r).
    tool_at, load_at = (a, b) if inside else (b, a)
    B = -p / (-1 / load_at**2 - 1 / ((1 - 2 * nu) * tool_at**2))
    A = -B / ((1 - 2 * nu) * tool_at**2)
    assert A - B / load_at**2 == pytest.approx(-p)
    expected = -(A - B / tool_at**2)
    np.testing.assert_allclose(last.traction.recovered_pressure, expected, rtol=2e-3)


@pytest.mark.slow
def test_half_a_body_has_half_the_force_of_the_whole():
    held = Support("base", 1), Support("base", 0)
    half = pressed(material=RUBBER, mu=0.01, sampling=WEIGHTED)
    doubled = block(2.0, 1.0, 8, 4, element=Element.Q8)
    mesh = Mesh(doubled.nodes - (1.0, 0.0), doubled.elements, doubled.boundaries)
    whole = replace(half, mesh=mesh, supports=held)
    half = replace(half, supports=(*held, Symmetry("left", 0)))
    one, other = marched(half, bounds=TIGHT), marched(whole, bounds=TIGHT)
    found = [a.tool_force(0) for a in one]
    np.testing.assert_allclose(found, forces(other), atol=1e-8 * np.abs(forces(other)).max())
    friction = [a.energies.friction for a in (one[-1], other[-1])]
    assert friction[0] == pytest.approx(friction[1], rel=1e-6)
    assert friction[0] > 1e-6 * one[-1].energies.work


def test_energies_balance_to_order_two():
    scene = pressed(Geometry.PLANE_STRAIN, material=RUBBER, mu=0.3, sampling=WEIGHTED)
    errors = [abs(list(march(scene, Schedule(n)))[-1].energies.energy_error) for n in (10, 40)]
    assert errors[1] < errors[0] / 6 < 1e-3


def test_a_punch_pressed_by_a_force_goes_as_far_as_a_path_takes_it():
    path = marched(pressed(material=RUBBER, sampling=WEIGHTED), increments=5, bounds=TIGHT)[-1]
    down = 2 * path.tool_forces[0, 1]
    assert path.tool_force(0)[1] == pytest.approx(down)
    scene = pressed(material=RUBBER, travel=(0.0, 0.0), sampling=WEIGHTED, driven_by=Force((0.0, float(down))))
    last = marched(scene, increments=5, bounds=TIGHT)[-1]
    assert last.state.translation[0] == pytest.approx(0.1, rel=2e-3)


@pytest.mark.parametrize("moment", [0.0, 0.8])
def test_a_roll_that_a_moment_turns_has_the_moment_of_nodal_forces(moment):
    scene = roller(moment, sampling=WEIGHTED)
    system, tool = system_of(scene), scene.tools[0]
    top = np.unique(scene.mesh.boundary("top"))
    last = rolled(scene)[-1]
    pulled = system.body.space.nodal(last.solved.response.element_forces)[top]
    assert tool.turn is not None
    arm = last.state.nodes[top] - np.add(tool.turn.centre, tool.pose(1.0)[:2])
    turned = float((arm[:, 0] * pulled[:, 1] - arm[:, 1] * pulled[:, 0]).sum())
    np.testing.assert_allclose(turned, moment, atol=1e-8 * np.abs(last.solved.r).sum())
    np.testing.assert_allclose(last.tool_moment(0), turned, atol=1e-8 * np.abs(last.solved.r).sum())
    assert max(last.solved.certificate.ratios(EXACT).values()) <= 1


def test_who_comes_through_the_air_slips_from_where_its_mean_touches():
    """Under a punch that comes down askew from afar, or at once from where it touches, in the first increment."""
    material = VonMises(Elasticity(1e3, 0.3), Linear(5.0, 50.0))
    seen = []
    for far in (0.0, 0.3):
        way = np.array([0.02, -0.05])
        start = np.array([0.4, 1.0 + RADIUS]) - far * np.array([0.4, -1.0])
        total = way + far * np.array([0.4, -1.0])
        tool = ShapedTool(Circle(tuple(start), RADIUS), tuple(total), ("top",), 0.3, sampling=WEIGHTED)
        held = Support("base", 0), Support("base", 1)
        scene = Scene(block(1.0, 1.0, 4, 4), Geometry.PLANE_STRAIN, material, held, (tool,))
        seen.append(list(march(scene, Schedule(1)))[-1])
    near, off = (a.tool_force(0) for a in seen)
    np.testing.assert_allclose(off, near, atol=0.05 * np.abs(near).max())


def test_points_are_means_of_their_own_edges_alone():
    scene = pressed(sampling=WEIGHTED)
    found = points(scene.mesh, scene.geometry, scene.tools[0])
    assert np.diff(found.weights.indptr).tolist() == [2, 3, 3, 3, 2]
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0)


def test_flat_tools_beside_curved_ones_are_as_they_were():
    """A flat tool in a scene with a curved one bears what it bears alone."""
    scene = pressed(material=RUBBER, mu=0.2, sampling=WEIGHTED)
    far = ShapedTool(Circle((0.0, 9.0), 1.0), (0.0, 0.0), ("right",), 0.1, sampling=WEIGHTED)
    flat = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.05), ("top",), 0.2, sampling=WEIGHTED)
    alone = forces(marched(replace(scene, tools=(flat,)), increments=3, bounds=TIGHT))
    beside = forces(marched(replace(scene, tools=(flat, far)), increments=3, bounds=TIGHT))
    assert apart(beside, alone) < 1e-9
