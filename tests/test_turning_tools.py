"""Tools that turn: poses, slips against the points touched, drag, rolling, moments, energy; what none may do."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.laws.flow import Integration
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn, rotation
from bipot.tools.profiles import Profile
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool
from tests.curved import STEEL, TIGHT, apart, dragged, forces, marched, pressed
from tests.scenes import refused
from tests.test_curved_tools import where_touched

RUBBER = Elastic(Elasticity(1e3, 0.3))

PRESS_THEN = Amplitude(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))


def spun(angle=0.3, centre=None, material=STEEL, **changes) -> Scene:
    """The block held at its base under a punch that presses and then turns, about its own centre or another."""
    scene = dragged(material=material)
    tool = scene.tools[0]
    assert isinstance(tool, ShapedTool)
    assert isinstance(tool.surface, Circle)
    turn = Turn(angle, centre or tool.surface.centre, PRESS_THEN)
    tool = replace(tool, travel=(0.0, -0.05), path=((0, 0), (0.5, 1), (1, 1)), **{"turn": turn, **changes})
    return replace(scene, tools=(tool,))


@pytest.mark.parametrize("centre", [(3.0, -2.0), (0.4, 3.0)])
def test_what_the_tool_sees_is_the_difference_of_places(centre):
    rng = np.random.default_rng(1)
    x, by = rng.uniform(-1, 1, (2, 50, 2))
    pose, advance = np.array([0.3, -0.2, 0.7]), np.array([0.1, 0.05, -0.4])
    turn = Turn(1.0, centre)
    there, after = turn.own(x, pose), turn.own(x + by, pose + advance)
    np.testing.assert_allclose(turn.going(x, by, pose, advance), after - there, atol=1e-14)
    # A point of the tool is seen where it is at rest, and goes nowhere.
    X = rng.uniform(-1, 1, (50, 2))
    at = [np.add(centre, p[:2]) + (X - centre) @ rotation(p[2:]).T for p in (pose, pose + advance)]
    np.testing.assert_allclose(turn.own(at[0], pose), X, atol=1e-14)
    np.testing.assert_allclose(turn.going(at[0], at[1] - at[0], pose, advance), 0.0, atol=1e-14)


def test_small_motions_keep_their_digits():
    """Far from where they are: what is lost is of the square of the angle."""
    turn, small = Turn(1.0, (1e3, -2e3)), 1e-9
    seen = turn.going(np.array([[1e3, 1e3]]), np.zeros((1, 2)), np.zeros(3), np.array([0.0, 0.0, small]))
    np.testing.assert_allclose(seen, [[3e3 * small, -1.5e3 * small**2]], rtol=1e-9)


@pytest.mark.slow
def test_a_turn_about_a_far_centre_is_a_translation():
    far = 1e5
    there = dragged()
    tool = there.tools[0]
    turn = Turn(0.1 / far, (0.4, 1.0 - far), PRESS_THEN)
    turned = replace(tool, travel=(0.0, -0.05), path=((0, 0), (0.5, 1), (1, 1)), turn=turn)
    # Anticlockwise about a centre below takes it to the left.
    left = replace(there.tools[0], travel=(-0.1, -0.05))
    one, other = marched(replace(there, tools=(turned,))), marched(replace(there, tools=(left,)))
    assert abs(forces(other)[-1, 0]) > 1.0
    assert apart(forces(one), forces(other)) < 1e-4


def test_a_punch_that_turns_in_its_place_drags_all_that_it_touches():
    """Slips recomputed from places; each against its force, which is all that friction can; moment R times shear."""
    scene, slid = spun(), 0
    tool = scene.tools[0]
    assert isinstance(tool, ShapedTool)
    assert isinstance(tool.surface, Circle)
    assert tool.turn is not None
    R = tool.surface.radius
    accepted = marched(scene)
    for a in accepted:
        nodes, r = a.solved.iterate.increment.system.candidates.node, a.solved.r
        centres = [np.add(tool.surface.centre, tool.pose(s.tau)[:2]) for s in (a.start, a.state)]
        before, after = (s.nodes[nodes] - c for s, c in zip((a.start, a.state), centres, strict=True))
        touched = where_touched(before, centres[0] - centres[1], a.start.gap, R)
        turned = tool.pose(a.state.tau)[2] - tool.pose(a.start.tau)[2]
        # Below its centre the surface goes to the right, against the tangent there: who rests slips along that.
        slip = R * (np.arctan2(*after.T) - np.arctan2(*touched.T)) + R * turned
        touching = r[:, 0] > 1e-6 * np.abs(r).max()
        np.testing.assert_allclose(a.solved.iterate.motion[touching, 1], slip[touching], atol=1e-12)
        slides = touching & (np.abs(slip) > 1e-7)
        np.testing.assert_allclose(r[slides, 1], -0.2 * r[slides, 0] * np.sign(slip[slides]), rtol=1e-6)
        slid += int(slides.sum())
        np.testing.assert_allclose(a.tool_moment(0), R * -r[:, 1].sum(), rtol=1e-6, atol=1e-9 * np.abs(r).max())
    assert slid > 10
    last = accepted[-1]
    # Below, a surface that turns anticlockwise goes to the right, and takes the block along.
    assert last.tool_forces[0, 0] > 0.15 * abs(last.tool_forces[0, 1])


@pytest.mark.parametrize("form", [Tangent(), Dissipation()], ids=["tangent", "dissipation"])
def test_forms_agree_under_a_punch_that_turns(form):
    one, other = marched(spun(), bounds=TIGHT), marched(spun(), form, bounds=TIGHT)
    assert apart(forces(other), forces(one)) < 1e-8


def test_a_punch_that_turns_shears_by_no_more_than_the_body_carries():
    """Where edges lie on it on both sides the shear of who slides is m k, whatever the pressure there."""
    m, k = 0.1, 300.0 / np.sqrt(3.0)
    last = marched(spun(material=VonMises(Elasticity(210e3, 0.3), Perfect(300.0)), mu=np.inf, shear=m))[-1]
    shear = np.abs(np.nan_to_num(last.traction.recovered_shear))
    assert (np.abs(shear / (m * k) - 1) < 1e-6).sum() >= 3
    assert np.ptp(last.traction.recovered_pressure[np.abs(shear / (m * k) - 1) < 1e-6]) > k / 10
    np.testing.assert_allclose(last.tool_moment(0), 2.0 * np.abs(last.solved.r[:, 1]).sum(), rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("centre", [None, (0.0, 2.0)])
def test_energies_balance_in_the_limit(centre):
    """After the first increments, whose lengths the schedule does not refine and which err by 4e-6 at any number.

    The rest errs with both signs, most where the punch lets the body go: about the centre the sum is -1.3e-5, -4.7e-5,
    -3.2e-5, -1.7e-5, -4.1e-6 and -9.4e-7 of the work in 10, 20, 40, 80, 160 and 320 increments.
    """
    errors = []
    for increments in (20, 160):
        scene = spun(centre=centre, angle=0.1)
        found = [
            a.course for a in march(scene, Schedule(increments, first=0.01, settling=1, growth=4.0), Control(Newton()))
        ]
        begun = max((c for c in found if c.state.tau <= 0.1 + 1e-9), key=lambda c: c.state.tau)
        last = found[-1].energies
        assert last.friction > 0
        errors.append(abs(last.imbalance - begun.energies.imbalance) / last.work)
    assert errors[1] < errors[0] / 8 < 1e-4


@pytest.mark.parametrize("mu", [0.2, np.inf])
def test_turning_a_pressed_body_with_its_platens_takes_no_work(mu):
    """All turn about one centre as one: no force does work, whatever is the length of increments."""
    parts, angle, centre = 4, 0.5, (4.0, 1.5)
    late = Amplitude(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))
    turn = Turn(angle, centre, late)
    # Pressed down by 0.1 seen from the centre, to which the tool's own goes.
    ways = [(0.5 + 0.5 * k / parts, rotation(np.array([angle * k / parts])) @ (0.0, -0.1)) for k in range(parts + 1)]
    path = ((0.0, (0.0, 0.0)), *((tau, (float(x), float(y))) for tau, (x, y) in ways))
    upper = ShapedTool(Plane((0.0, 3.0), (0.0, -1.0)), (1.0, 1.0), ("top",), mu, turn=turn, path=path)
    lower = ShapedTool(Plane((0.0, 0.0), (0.0, 1.0)), (0.0, 0.0), ("base",), mu, turn=turn)
    scene = Scene(block(8.0, 3.0, 6, 3), Geometry.PLANE_STRAIN, STEEL, (), (upper, lower))
    found = list(march(scene, Schedule(2 * parts), Control(Newton(), (Tangent(),))))
    pressed, last = found[parts - 1], found[-1]
    assert pressed.state.tau == pytest.approx(0.5)
    assert pressed.energies.work > 0
    np.testing.assert_allclose(np.linalg.norm(last.tool_force(0)), np.linalg.norm(pressed.tool_force(0)), rtol=1e-6)
    assert abs(last.energies.work - pressed.energies.work) < 1e-6 * pressed.energies.work
    assert abs(last.energies.energy_error) < 0.01


@pytest.mark.slow
def test_a_strip_between_rolls_comes_along_as_fast_as_they_turn():
    """The upper half of an elastic strip, on its plane of symmetry; a roll that grips it takes it through."""
    R, angle = 1.0, 0.4
    strip = block(3.0, 0.2, 30, 2)
    roll = ShapedTool(
        Circle((0.5, 0.2 + R), R),
        (0.0, -0.01),
        ("top",),
        0.4,
        path=((0, 0), (0.2, 1), (1, 1)),
        turn=Turn(angle, (0.5, 0.2 + R), Amplitude(((0, 0), (0.2, 0), (1, 1)))),
    )
    scene = Scene(strip, Geometry.PLANE_STRAIN, RUBBER, (Symmetry("base", 1),), (roll,))
    wall = FlatTool((0.0, 0.0), (1.0, 0.0), (0.0, 0.0), ("left",), 0.0)
    held = replace(scene, tools=(*scene.tools, wall))
    *_, last = march(held, Schedule(60), Control(Newton(), integration=Integration.BACKWARD_EULER))
    gone = float((last.state.nodes - strip.nodes)[:, 0].mean())
    # Pressed by a twentieth of its height, it is pulled by a surface that is a little longer than before.
    np.testing.assert_allclose(gone, R * angle, rtol=0.01)
    np.testing.assert_allclose(last.tool_forces[:, 0], 0.0, atol=1e-6 * abs(last.tool_forces[0, 1]))


def test_a_plane_turned_onto_the_block_is_where_it_was_turned_to():
    """From the corner it touches: gaps by hand."""
    lid = ShapedTool(Plane((1.0, 1.0), (0.0, -1.0)), (0.0, 0.0), ("top",), 0.1, turn=Turn(0.05, (1.0, 1.0)))
    last = marched(replace(dragged(material=RUBBER), tools=(lid,)))[-1]
    nodes = last.state.nodes[last.solved.iterate.increment.system.candidates.node]
    normal = np.array([np.sin(0.05), -np.cos(0.05)])
    gap = (nodes - (1.0, 1.0)) @ normal
    np.testing.assert_allclose(last.state.gap, gap, atol=1e-13)
    assert gap.min() > -1e-9
    assert last.tool_moment(0) > 0
    assert last.tool_forces[0, 1] < 0


def test_what_no_turn_may_do_is_refused():
    turn: Any = Turn(0.1, (0.0, 3.0))
    refused(lambda: pressed(turn=turn), r"tools\[0\].turn")
    mirrored = replace(dragged(), supports=(Symmetry("left", 0),), tools=())
    lid = ShapedTool(Plane((0.0, 1.0), (0.0, -1.0)), (0.0, 0.0), ("right",), 0.1, turn=turn)
    refused(lambda: replace(mirrored, tools=(lid,)), r"tools\[0\].turn")
    refused(lambda: pressed(Geometry.AXISYMMETRIC, turn=turn), r"tools\[0\].turn")
    refused(lambda: Turn(np.nan, (0.0, 0.0)), "turn.angle")
    refused(lambda: Turn(1e5, (0.0, 0.0), Amplitude(((0, 0), (1, 20)))), "turn.angle, its amplitude with it = 2000000")
    refused(lambda: Turn(0.1, (0.0, np.inf)), "turn.centre")
    refused(lambda: Turn(0.1, (0.0, 0.0), Amplitude(((0, 1), (1, 1)))), "turn.amplitude")
    wrong: Any = 0.1
    refused(lambda: spun(turn=wrong), "tool.turn")


@pytest.mark.slow
def test_a_turn_that_comes_back_is_not_taken_for_none():
    """Once around in a single increment: it is cut, and rubs as in many."""
    ends = []
    for increments in (2, 40):
        scene = spun(angle=-2 * np.pi, material=RUBBER)
        whole = list(march(scene, Schedule(increments), Control(Newton())))
        assert len(whole) > 6
        ends.append(whole[-1])
        assert ends[-1].tool_forces[0, 0] < 0
    np.testing.assert_allclose(ends[0].tool_forces, ends[1].tool_forces, rtol=0.02)


def test_a_tool_may_turn_where_a_symmetry_holds_the_end_of_its_candidates():
    """The side of a strip whose base is a plane of symmetry: a roll beside it draws it up."""
    strip = block(1.0, 1.0, 4, 4)
    roll = ShapedTool(Circle((1.5, 0.5), 0.5), (-0.02, 0.0), ("right",), 0.2, turn=Turn(0.3, (1.5, 0.5)))
    scene = Scene(strip, Geometry.PLANE_STRAIN, RUBBER, (Symmetry("base", 1), Support("left", 0)), (roll,))
    last = marched(scene)[-1]
    # To the left of its centre a surface that turns anticlockwise goes down.
    assert last.tool_forces[0, 1] < 0 < -last.tool_forces[0, 0]
    np.testing.assert_allclose(last.tool_moment(0), -0.5 * last.tool_forces[0, 1], rtol=0.2)


@pytest.mark.parametrize("form", [Newton(), Tangent(), Dissipation()], ids=["newton", "tangent", "dissipation"])
def test_a_tool_that_turns_rubs_a_node_which_a_support_holds_along_it(form):
    """It touches one node, at the height of its centre: no unknown knows of the slip, but force and moment do."""
    mu, R = 0.2, 0.5
    strip = block(1.0, 1.0, 4, 4)
    roll = ShapedTool(Circle((1.0 + R, 0.0), R), (-0.01, 0.0), ("right",), mu, turn=Turn(0.3, (1.0 + R, 0.0)))
    scene = Scene(strip, Geometry.PLANE_STRAIN, RUBBER, (Support("base", 1), Support("left", 0)), (roll,))
    last = marched(scene, form)[-1]
    N = -last.tool_forces[0, 0]
    assert N > 1.0
    assert (last.solved.r[:, 0] > 1e-9 * N).sum() == 1
    np.testing.assert_allclose(last.tool_forces[0], [-N, -mu * N], rtol=1e-9)
    np.testing.assert_allclose(last.tool_moment(0), R * mu * N, rtol=1e-9)


@pytest.mark.slow
def test_a_turning_tool_beside_its_mirror_image_rubs_in_the_plane_between_them():
    """Of a half what the whole body under both has: at rest the tool's tangent in the plane is across it."""
    soft, n = VonMises(Elasticity(1e3, 0.3), Linear(5.0, 50.0)), 3
    right = Profile(((6.0, 1.0), (-2.0, 1.0), (-3.0, 2.0)), 0.3)
    turns = Turn(-0.2, (-0.5, 1.0)), Turn(0.2, (0.5, 1.0))
    tools = [
        ShapedTool(surface, (0.0, 0.0), ("top",), 0.3, turn=turn)
        for surface, turn in zip((right, right.image((1.0, 0.0), 0.0)), turns, strict=True)
    ]
    held = Symmetry("left", 0), Support("base", 1)
    half = Scene(block(1.0, 1.0, n, n), Geometry.PLANE_STRAIN, soft, held, (tools[0],))
    both = block(2.0, 1.0, 2 * n, n)
    x = both.nodes - (1.0, 0.0)
    top = both.boundary("top")
    sides = {name: top[(sign * x[top, 0] >= -1e-9).all(axis=1)] for name, sign in (("top", 1.0), ("other", -1.0))}
    upright = np.flatnonzero(np.abs(x[:, 0]) < 1e-9)[:2]
    mesh = Mesh(x, both.elements, {**both.boundaries, **sides, "middle": upright[None]})
    images = (tools[0], replace(tools[1], candidates=("other",)))
    whole = Scene(mesh, Geometry.PLANE_STRAIN, soft, (Support("middle", 0), Support("base", 1)), images)
    one, other = (marched(scene, increments=4) for scene in (half, whole))
    assert abs(one[-1].tool_forces[0, 0]) > 5.0
    assert apart(forces(one), forces(other)) < 1e-7
    assert apart([a.tool_moment(0) for a in one], [a.tool_moment(0) for a in other]) < 1e-7
