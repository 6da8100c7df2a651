"""Curved tools in a march: the law holds between positions, limits, turned and mirrored scenes, landings, files."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.contact.overlap import overlap
from bipot.control.landing import Locate
from bipot.energy import Energies
from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.results import Recorder, history
from bipot.results.description import describe
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.profiles import flat_punch
from bipot.tools.surfaces import Plane, frames
from bipot.tools.tool import FlatTool, ShapedTool
from tests.courses import stored
from tests.curved import PUNCH, RADIUS, STEEL, TIGHT, apart, dragged, forces, marched, pressed, pushed
from tests.recording import COLUMNS, arrays
from tests.scenes import PLANES, refused


def where_touched(before, by, gap, radius=RADIUS):
    """Where slip begins for places off the centre that go ``by``, of who starts apart.

    At the circle, or after the part of that which it brings them nearer.
    """
    out = before.copy()
    for k in np.flatnonzero(gap > 1e-9):
        a, b, c = by @ by, before[k] @ by, before[k] @ before[k] - radius**2
        root = b**2 - a * c
        meets = root > 0 and 0 < (-b - np.sqrt(root)) / a < 1
        nearer = max(0.0, np.hypot(*before[k]) - np.hypot(*(before[k] + by))) / gap[k]
        out[k] += by * ((-b - np.sqrt(root)) / a if meets else nearer)
    return out


@pytest.mark.parametrize("geometry", PLANES)
def test_the_law_holds_between_positions(geometry):
    """Gaps, slips, friction and balance recomputed from where nodes and punch are, with unit normals and tangents."""
    scene, system = pressed(geometry), system_of(pressed(geometry))
    contacts, slid = system.candidates, 0
    for accepted in pushed(geometry):
        start, end, r = accepted.start, accepted.state, accepted.solved.r
        centres = [np.add(PUNCH.centre, scene.travel(0.0, state.tau)[0]) for state in (start, end)]
        before, after = (
            state.nodes[contacts.node] - centre for state, centre in zip((start, end), centres, strict=True)
        )
        gap = np.hypot(*after.T) - RADIUS
        np.testing.assert_allclose(end.gap, gap, atol=1e-13)
        assert gap.min() >= -1e-10
        # Clockwise around the centre is along the tangent.
        touched = where_touched(before, centres[0] - centres[1], start.gap)
        slip = RADIUS * (np.arctan2(*touched[:, ::-1].T) - np.arctan2(*after[:, ::-1].T))
        slip[~accepted.solved.rows.rubs] = 0.0
        np.testing.assert_allclose(accepted.solved.iterate.motion[:, 1], slip, atol=1e-13)
        largest = np.abs(r).max()
        assert np.abs(r[:, 0] * gap).max() <= 1e-9 * largest
        assert (np.abs(r[:, 1]) <= 0.2 * r[:, 0] + 1e-8 * largest).all()
        slides = np.abs(slip) > 1e-7
        np.testing.assert_allclose(r[slides, 1], -0.2 * r[slides, 0] * np.sign(slip[slides]), atol=1e-7 * largest)
        slid += int((slides & (r[:, 0] > 1e-3 * largest)).sum())
        normal = after / np.hypot(*after.T)[:, None]
        vectors = np.einsum("ci,cij->cj", r, frames(normal))
        space = system.body.space
        pulled = space.nodal(accepted.solved.iterate.response.element_forces)
        np.add.at(pulled, contacts.node, -vectors)
        assert np.abs(pulled.ravel()[space.free]).max() <= 1e-6 * largest
        np.testing.assert_allclose(accepted.tool_forces[0], vectors.sum(axis=0), atol=1e-8 * largest)
    assert slid > 10


@pytest.mark.slow
def test_energies_balance_to_order_two():
    errors = []
    for increments in (10, 20, 40):
        last = list(march(dragged(), Schedule(increments, first=0.01, settling=1, growth=4.0), Control(Newton())))[-1]
        energies: Energies = last.course.energies
        assert energies.friction > 0
        errors.append(abs(energies.energy_error))
    assert errors[2] < errors[0] / 4 < 1e-3


@pytest.mark.slow
def test_a_large_circle_tends_to_the_plane():
    flat = pressed(surface=Plane((0.0, 1.0), (0.0, -1.0)))
    plane = forces(marched(flat))
    off = [apart(forces(marched(pressed(surface=Circle((0.0, 1.0 + R), R)))), plane) for R in (1e4, 1e6)]
    assert off[1] < 0.02 * off[0] < 1e-3


def test_a_plane_as_a_surface_is_a_flat_tool_to_the_last_bit():
    shaped = pressed(surface=Plane((0.0, 1.0), (0.0, -1.0)))
    flat = replace(shaped, tools=(FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.2),))
    assert not system_of(shaped).candidates.curved
    np.testing.assert_array_equal(forces(marched(shaped)), forces(marched(flat)))


@pytest.mark.slow
def test_a_scene_turned_by_a_right_angle_has_the_same_forces():
    """(x, y) -> (-y, x): supports turn with it."""
    scene = dragged()
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    mesh = Mesh(scene.mesh.nodes @ turn.T, scene.mesh.elements, scene.mesh.boundaries)
    tool = scene.tools[0]
    assert isinstance(tool, ShapedTool)
    x, y = tool.travel
    # The path presses first, then goes aside: its components change places with those of the travel.
    path = ((0.0, 0.0), (0.5, (1.0, 0.0)), (1.0, (1.0, 1.0)))
    turned = replace(tool, surface=Circle((-(1.0 + RADIUS), 0.4), RADIUS), travel=(-y, x), path=path)
    other = Scene(mesh, scene.geometry, STEEL, scene.supports, (turned,))
    assert apart(forces(marched(other, bounds=TIGHT)) @ turn, forces(marched(scene, bounds=TIGHT))) < 1e-8


@pytest.mark.slow
def test_half_a_body_has_half_the_force_of_the_whole():
    half = pressed()
    mesh = half.mesh
    left = mesh.nodes * (-1.0, 1.0)
    kept = mesh.nodes[:, 0] > 1e-12
    number = np.where(kept, len(mesh.nodes) + np.cumsum(kept) - 1, np.arange(len(mesh.nodes)))
    order = [1, 0, 3, 2, 4, 7, 6, 5]
    elements = np.vstack([mesh.elements, number[mesh.elements][:, order]])
    edges = {name: np.vstack([mesh.boundary(name), number[mesh.boundary(name)]]) for name in ("top", "base")}
    middle = mesh.boundary("left")
    whole = Scene(
        Mesh(np.vstack([mesh.nodes, left[kept]]), elements, {**edges, "middle": middle}),
        Geometry.PLANE_STRAIN,
        STEEL,
        (Support("base", 1), Support("middle", 0)),
        half.tools,
    )
    one, other = pushed(Geometry.PLANE_STRAIN), marched(whole)
    np.testing.assert_allclose([a.tool_force(0) for a in one], forces(other), rtol=1e-5, atol=1e-6)


@pytest.mark.slow
def test_landings_are_located_by_the_true_gap():
    control = Control(Newton(), fallbacks=(), locate=Locate())
    accepted = list(march(pressed(), Schedule(6, first=0.01, settling=1, growth=4.0), control))
    landed = [a for a in accepted if a.landed is not None]
    assert len(landed) >= 3
    for a in landed:
        gap = a.state.gap[a.start.gap > 1e-6]
        assert gap.min() < 1e-4


@pytest.mark.parametrize("far", [1.1, 2.1])
def test_a_node_does_not_come_out_of_the_punch_on_its_far_side(far):
    """One increment takes the punch past a node that it touches: it is cut until the node is pushed ahead."""
    R = 0.05
    scene = dragged(material=Elastic(Elasticity(1e3, 0.3)))
    punch = replace(scene.tools[0], surface=Circle((0.5, 1.0 + R), R), travel=(0.0, -far * R), path=((0, 0), (1, 1)))
    whole = list(march(replace(scene, tools=(punch,)), Schedule(1)))
    assert len(whole) > 1
    assert whole[-1].tool_forces[0, 1] < -1.0


def test_overlap_is_what_the_certificate_of_the_nodes_does_not_see():
    scene = pressed()
    last = pushed(Geometry.PLANE_STRAIN)[-1]
    placed = scene.travel(0.0, 1.0)
    seen = overlap(scene, last.state.nodes, placed)
    assert 1e-6 < seen < 1e-2
    assert last.solved.certificate.penetration < 1e-10


def test_a_support_that_holds_a_node_against_the_punch_is_named():
    scene = pressed()
    supports = (*scene.supports, Support("left", 1))
    with pytest.raises(Exception, match=r"tools\[0\] is driven into node \d+, which a support holds"):
        marched(replace(scene, supports=supports))


def test_a_support_that_holds_a_node_only_where_the_tool_is_flat_is_named():
    """Its side comes at nodes that are held along x alone, and not at all of its normals."""
    scene = pressed()
    aside = ShapedTool(flat_punch((-1.0, 0.3), 0.5, 3.0, 0.05), (1.0, 0.0), ("left",), 0.1)
    supports = Support("left", 0), Support("base", 1)
    with pytest.raises(IncrementFailed, match=r"tools\[0\] is driven into node \d+, which a support holds, by"):
        marched(replace(scene, supports=supports, tools=(aside,)))


def test_a_punch_that_a_plane_of_symmetry_cuts_may_not_leave_it():
    refused(lambda: pressed(travel=(0.1, -0.1)), r"tools\[0\].travel")
    aside = pressed(surface=Circle((0.5, 1.0 + RADIUS), RADIUS), travel=(0.1, -0.1))
    assert not aside.planes[0].cuts(aside.tools[0])
    assert isinstance(aside.supports[1], Symmetry)


@pytest.mark.parametrize("geometry", PLANES)
def test_a_march_goes_on_from_every_course_to_the_last_bit(geometry):
    scene, schedule, control = (
        pressed(geometry, elements=2),
        Schedule(5, first=0.01, settling=1, growth=4.0),
        Control(Newton()),
    )
    whole = list(march(scene, schedule, control))
    for k, before in enumerate(whole[:-1]):
        after = next(march(scene, schedule, control, stored(before.course)))
        for a, b in zip(arrays(after.state), arrays(whole[k + 1].state), strict=True):
            np.testing.assert_array_equal(a, b)


def test_a_march_goes_on_under_a_circle_so_large_that_its_gaps_are_of_round_off():
    """Of the recomputed gaps alone: those that a march carries along are good to the round-off of motions."""
    scene = pressed(surface=Circle((0.0, 1.0 + 1e8), 1e8), elements=2)
    schedule, control = Schedule(3, first=0.01, settling=1, growth=4.0), Control(Newton())
    whole = list(march(scene, schedule, control))
    after = next(march(scene, schedule, control, stored(whole[-2].course)))
    np.testing.assert_array_equal(after.state.nodes, whole[-1].state.nodes)


def test_a_run_is_recorded_with_its_surface_and_read_back(tmp_path):
    scene = pressed(elements=2)
    with Recorder(tmp_path, scene, COLUMNS, {"mu": 0.2}, {"length": "mm", "force": "N"}) as out:
        accepted = list(march(scene, Schedule(3, first=0.01, settling=1, growth=4.0), Control(Newton())))
        for increment in accepted:
            out.record(increment)
    run = history.open(tmp_path)
    assert len(run) == len(accepted)
    tool = describe(scene)["tools"][0]
    assert tool["surface"] == "Circle(centre=(0.0, 3.0), radius=2.0, concave=False)"
    # A march goes on from what was read as from what was left.
    one, other = (
        next(march(scene, Schedule(4), Control(Newton()), start)) for start in (run.course(1), accepted[1].course)
    )
    np.testing.assert_array_equal(one.state.nodes, other.state.nodes)
    np.testing.assert_array_equal(run.nodal("contact_force")[:, :2].sum(axis=0), accepted[-1].tool_forces[0])


@pytest.mark.parametrize("gap", [0.01, 0.3, 7.0])
def test_the_way_through_the_air_is_no_slip(gap):
    """A circle comes straight down on a block, however far from it it starts: its force and friction are the same."""
    scene = dragged(material=Elastic(Elasticity(1e3, 0.3)), mu=0.3)
    ends = []
    for far in (0.0, gap):
        punch = replace(
            scene.tools[0],
            surface=Circle((0.4, 1.0 + RADIUS + far), RADIUS),
            travel=(0.0, -0.02 - far),
            path=((0, 0), (1, 1)),
        )
        ends.append(list(march(replace(scene, tools=(punch,)), Schedule(1), Control(Newton())))[-1])
    np.testing.assert_allclose(ends[1].tool_forces, ends[0].tool_forces, rtol=1e-6)
    np.testing.assert_allclose(ends[1].energies.friction, ends[0].energies.friction, rtol=1e-6)
    np.testing.assert_allclose(ends[1].energies.work, ends[0].energies.work, rtol=1e-6)
