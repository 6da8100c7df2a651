"""Contact posed in weighted means: weights against a quadrature of their definition, patch tests, law, one limit."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.contact.overlap import overlap
from bipot.contact.sampling import CREASE, points
from bipot.fem.elements import Quadrature
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Newton, Tangent
from bipot.increment import Limits
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.limit_analysis import limit_load
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, ring
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool, Sampling
from tests.scenes import PLANES, path, refused, scene, tool

WEIGHTED = Sampling.WEIGHTED
QUADRATIC = (Element.Q8, Element.Q9, Element.T6)
ELASTIC = VonMises(Elasticity(1000.0, 0.3), Perfect(1e6))
TIGHT = Limits(Bounds(equilibrium=1e-12, penetration=1e-15))


def by_quadrature(x, geometry, count=12):
    """int psi_p N_k dA (2, 3) of an edge through x (3, 2), by ``count`` Gauss points along the parabola."""
    out = np.zeros((2, 3))
    for at, weight in zip(*np.polynomial.legendre.leggauss(count), strict=True):
        s = (at + 1) / 2
        shape = np.array([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)])
        slope = np.array([4 * s - 3, 4 - 8 * s, 4 * s - 1])
        around = 2 * np.pi * (shape @ x)[0] if geometry is Geometry.AXISYMMETRIC else 1.0
        out += weight / 2 * np.hypot(*(slope @ x)) * around * np.outer([1 - s, s], shape)
    return out


def graded(element, bent=0.0):
    """A graded block half a length from the axis, its sides on no straight line where it is ``bent``."""
    mesh = block(1.0, 0.6, 3, 2, (3.0, 0.5), element)
    x, y = mesh.nodes.T
    return replace(mesh, nodes=np.column_stack([x + 0.5 + bent * y**2, y + bent * np.sin(2 * x)]))


def pressing(mesh, geometry, **changes):
    """The mesh under a tool on its top and right sides."""
    given = {"candidates": ("top", "right"), "point": (0.0, 2.0), "mu": 0.2, "sampling": WEIGHTED}
    return Scene(mesh, geometry, ELASTIC, (Support("base", 1),), (tool(**(given | changes)),))


def fanned(elements, sampling, **given):
    """The cylinder of Q8/P1 in the fanned layout."""
    return upsetting(elements=elements, volume=VolumeChange.P1, layout=Layout.FANNED, sampling=sampling, **given)


@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize(("bent", "within"), [(0.0, 1e-14), (0.15, 1e-4)])
@pytest.mark.parametrize("element", QUADRATIC)
def test_weights_are_the_means_of_their_definition(element, geometry, bent, within):
    """On curved edges up to the error of the three points by which all integrals over edges are taken."""
    mesh = graded(element, bent)
    found = points(mesh, geometry, tool(candidates=("top", "right"), sampling=WEIGHTED))
    integral = np.zeros((len(found.node), len(mesh.nodes)))
    for line, ends in zip(found.facets, found.point, strict=True):
        np.add.at(integral, np.ix_(ends, line), by_quadrature(mesh.nodes[line], geometry))
    expected = integral / integral.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(found.weights.toarray(), expected, atol=within)
    assert found.node.tolist() == np.sort(found.node).tolist()
    assert (found.node[found.point] == found.facets[:, [0, 2]]).all()


@pytest.mark.parametrize("geometry", PLANES)
def test_a_linear_pressure_gives_the_nodes_its_consistent_forces(geometry):
    """The dual of the weighted gaps: sum_p D_pk r_p = int p N_k dA with r_p = p_p int psi_p dA."""
    mesh = graded(Element.Q8)
    found = points(mesh, geometry, tool(candidates=("top",), sampling=WEIGHTED))
    pressure = np.random.default_rng(0).uniform(0.0, 2.0, len(found.node))
    area, nodal = np.zeros(len(found.node)), np.zeros(len(mesh.nodes))
    for line, ends in zip(found.facets, found.point, strict=True):
        shares = by_quadrature(mesh.nodes[line], geometry)
        area[ends] += shares.sum(axis=1)
        nodal[line] += pressure[ends] @ shares
    np.testing.assert_allclose(found.weights.T @ (pressure * area), nodal, atol=1e-14)


@pytest.mark.parametrize(("turn", "shared"), [(0.0, True), (55.0, True), (65.0, False), (90.0, False)])
def test_around_a_crease_both_sides_have_a_point_of_their_own(turn, shared):
    """Two edges that meet at a corner from which the second goes on by the angle of ``turn``."""
    a = np.radians(turn)
    way = np.array([np.cos(a), -np.sin(a)])
    top = np.array([[-1.0, 0.0], [-0.5, 0.0], [0.0, 0.0], 0.5 * way, way])
    corners = np.vstack([top[[0, 2, 4]], [[-1.0, -3.0], [0.0, -3.0], [1.0, -3.0]]])
    quads = np.array([[3, 4, 1, 0], [4, 5, 2, 1]])
    middles = {}
    nodes, elements = list(corners), []
    for quad in quads:
        new = []
        for i, j in zip(quad, np.roll(quad, -1), strict=True):
            pair = frozenset((int(i), int(j)))
            if pair not in middles:
                middles[pair] = len(nodes)
                nodes.append((corners[i] + corners[j]) / 2)
            new.append(middles[pair])
        elements.append([*quad, *new])
    edges = np.array([[1, middles[frozenset((0, 1))], 0], [2, middles[frozenset((1, 2))], 1]])
    mesh = Mesh(np.array(nodes), np.array(elements), {"top": edges})
    found = points(mesh, Geometry.PLANE_STRAIN, tool(candidates=("top",), sampling=WEIGHTED))
    assert found.node.tolist().count(1) == (1 if shared else 2)
    assert bool(np.cos(a) >= CREASE) is shared
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, rtol=1e-15)


def test_on_linear_edges_both_choices_are_one_bit_for_bit():
    seen = []
    for sampling in Sampling:
        given = upsetting(
            mu=0.3, elements=4, element=Element.Q4, volume=VolumeChange.P0, sampling=sampling, reduction=0.4
        )
        *_, last = march(given, path(0.4, 18), Control(Newton()))
        seen.append((last.state.nodes, last.solved.r, last.traction.recovered_pressure))
    for nodes, weighted in zip(*seen, strict=True):
        np.testing.assert_array_equal(nodes, weighted)


@pytest.mark.parametrize("travel", [-1e-3, -0.4])
@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("element", [Element.Q4, *QUADRATIC])
def test_the_contact_patch_test_is_passed(element, geometry, travel):
    """A graded body under a smooth tool: the multipliers are one number, and so is the stress, however far it goes."""
    make = block(1.0, 1.0, 4, 2, (4.0, 0.5), element)
    if geometry is Geometry.AXISYMMETRIC:
        make = ring(0.5, 1.5, 1.0, 4, 2, (4.0, 0.5), element)
    held = (Support("base", 1), Support("left", 0)) if geometry is Geometry.PLANE_STRAIN else (Support("base", 1),)
    given = Scene(make, geometry, ELASTIC, held, (tool(mu=0.0, travel=(0.0, travel), sampling=WEIGHTED),))
    *_, last = march(given, Schedule(4), Control(Newton(), limits=TIGHT))
    pressure = last.traction.recovered_pressure
    expected = -last.state.stress[0, 0, 1]
    np.testing.assert_allclose(pressure, expected, rtol=1e-9)
    np.testing.assert_allclose(
        last.state.stress, np.broadcast_to(last.state.stress[0, 0], last.state.stress.shape), atol=1e-9 * expected
    )
    assert not last.traction.recovered_shear.any()


@pytest.mark.parametrize("mu", [0.1, 0.3, np.inf])
def test_the_multipliers_obey_the_law_and_carry_the_force(mu):
    """On a side that rolls onto the punch; the pressure along an edge is linear and so stays above zero."""
    given = fanned(4, WEIGHTED, mu=mu, reduction=0.3)
    *_, last = march(given, path(0.3, 18), Control(Newton()))
    system, r = system_of(given), last.solved.r
    pressure, shear = last.traction.recovered_pressure, last.traction.recovered_shear
    known = np.isfinite(pressure)
    assert (pressure[known] >= 0).all()
    pressed = known & (pressure > 0)
    assert (np.abs(shear[pressed]) <= mu * pressure[pressed] * (1 + 1e-12)).all()
    sliding = known & (r[:, 0] > 0) & system.candidates.tangent_free & (last.traction.status == 2)
    if np.isfinite(mu):
        assert sliding.any()
        np.testing.assert_allclose(np.abs(r[sliding, 1]), mu * r[sliding, 0], rtol=1e-9)
    # The resultant of the linear traction on the current edges, which may be bent: by three points, as the forces.
    found, force = system.candidates.points[0], 0.0
    for line, ends in zip(found.facets, system.candidates.number[0][found.point], strict=True):
        if (ends >= 0).all() and known[ends].all():
            force += pressure[ends] @ by_quadrature(last.solved.iterate.balanced[line], given.geometry, 3).sum(axis=1)
    if np.isfinite(mu):
        # A weld may pull, which is no pressure.
        assert force == pytest.approx(-last.tool_force(0)[1], rel=1e-9)
    gap = last.solved.rows.motion(last.solved.response.x)[:, 0]
    assert gap.min() > -1e-9


@pytest.mark.parametrize("mu", [0.1, 0.3, np.inf])
@pytest.mark.parametrize("form", [Tangent(), Dissipation(), Delassus()], ids=lambda form: form.name.value)
def test_all_forms_agree(form, mu):
    given = upsetting(mu=mu, elements=2, volume=VolumeChange.P1, sampling=WEIGHTED, reduction=0.1)
    closer = Limits(Bounds(equilibrium=1e-8))
    force = [
        [a.tool_force(0)[1] for a in march(given, path(0.1, 4), Control(one, (Dissipation(),), limits=closer))]
        for one in (Newton(), form)
    ]
    np.testing.assert_allclose(*force, rtol=1e-7)


def test_what_is_in_between_may_overlap_and_is_told():
    """The law is posed on the mean: somewhere a gap may be below zero, and that is the study's ``overlap``."""
    given = upsetting(
        mu=0.3, elements=4, volume=VolumeChange.P1, layout=Layout.FANNED, sampling=WEIGHTED, reduction=0.4
    )
    *_, last = march(given, path(0.4, 18), Control(Newton()))
    placed = given.placed(last.state.tau, last.state.translation)
    assert last.solved.certificate.penetration < 1e-12
    assert 1e-4 < overlap(given, last.state.nodes, placed) < 0.02


def mirror(given):
    """The scene of a block in the mirror of the first axis."""
    mesh, (press,) = given.mesh, given.tools
    edges = {name: mesh.boundary(name)[:, ::-1] for name in mesh.boundaries}
    turned = Mesh(mesh.nodes * (-1.0, 1.0), mesh.elements[:, mesh.element.mirrored], edges)
    flipped = replace(press, travel=(-press.travel[0], press.travel[1]))
    return replace(given, mesh=turned, tools=(flipped,))


def test_mirrored_the_answer_is_the_mirror_image():
    base = scene(
        tools=(tool(sampling=WEIGHTED, travel=(0.03, -0.05), candidates=("top", "right")),),
        quadrature=Quadrature.GAUSS3,
    )
    ends = [list(march(one, Schedule(4), Control(Newton())))[-1] for one in (base, mirror(base))]
    np.testing.assert_allclose(ends[0].state.nodes * (-1.0, 1.0), ends[1].state.nodes, atol=1e-10)
    np.testing.assert_allclose(ends[0].tool_force(0) * (-1.0, 1.0), ends[1].tool_force(0), rtol=1e-8)


def test_a_force_presses_like_the_path_that_it_gives():
    along = scene(tools=(tool(sampling=WEIGHTED, travel=(0.0, -0.002)),))
    (driven,) = march(along, Schedule(1), Control(Newton()))
    force = driven.tool_force(0)[1]
    pushed = scene(tools=(tool(sampling=WEIGHTED, travel=(0.0, 0.0), driven_by=Force((0.0, float(force)))),))
    (led,) = march(pushed, Schedule(1), Control(Newton()))
    np.testing.assert_allclose(led.state.nodes, driven.state.nodes, atol=1e-9)


def test_the_limit_load_between_smooth_platens_is_exact():
    """A block in plane strain: 2/sqrt(3) sigma_Y on its width."""
    width, pushing = (
        1.0,
        FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), 0.0, driven_by=Force((0.0, -1.0)), sampling=WEIGHTED),
    )
    given = scene(tools=(pushing,), volume=VolumeChange.P1)
    assert limit_load(given).multiple == pytest.approx(2 / np.sqrt(3) * 300.0 * width, rel=1e-6)


@pytest.mark.parametrize("sampling", ["weighted", None, True, Element.Q8])
def test_what_is_no_sampling_is_refused_by_name(sampling):
    refused(lambda: tool(sampling=sampling), "sampling = .*must be a Sampling")


def test_a_coefficient_at_a_node_without_a_point_is_refused():
    mesh = block(1.0, 1.0, 2, 2, element=Element.Q8)
    top = mesh.boundary("top")
    end, middle = int(top[0, 0]), int(top[0, 1])
    assert system_of(scene(mesh=mesh, tools=(tool(sampling=WEIGHTED, mu_at={end: 0.4}),))).candidates.mu.max() == 0.4
    refused(lambda: scene(mesh=mesh, tools=(tool(sampling=WEIGHTED, mu_at={middle: 0.4}),)), f"mu_at node = {middle}")


def test_a_symmetry_on_part_of_an_edge_keeps_the_point_that_still_moves():
    """A vertex that a support holds along the normal is the mean of nodes of which one is free: a candidate."""
    mesh = block(1.0, 1.0, 2, 2, element=Element.Q8)
    corner = Support("left", 1)
    given = scene(
        mesh=mesh, supports=(Symmetry("base", 1), Symmetry("left", 0), corner), tools=(tool(sampling=WEIGHTED),)
    )
    candidates = system_of(given).candidates
    assert (candidates.number[0] >= 0).all()
