"""Tools in space that moments turn: derivatives, the plane, recomputed balances, halves, turned scenes, refusals."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.errors import IncrementFailed
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.iterate import Increment
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.results import Recorder, history
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.revolved import roll, sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import Sampling, ShapedTool
from bipot.typing import times
from tests.courses import stored
from tests.curved import apart, check_differences, forces
from tests.recording import COLUMNS, arrays
from tests.scenes import named, refused
from tests.solids import turned
from tests.space import BALL, dented, rubbed, turned_scene
from tests.test_driven_rolls import LATE, RADIUS, SLIDE, rolled, roller
from tests.test_space_turning import HEIGHT, twisted

AXIS = (0.6, 0.0, 0.8)
UP = (0.0, 0.0, 1.0)
Y = (0.0, 1.0, 0.0)

DRIVEN = {
    "a sphere by a moment": (sphere((0.1, 0.3, 1.5), 0.5), {"turn": Turn(0.0, (0.1, 0.3, 1.5), axis=AXIS)}),
    "a sphere about another centre": (sphere((0.1, 0.3, 1.5), 0.5), {"turn": Turn(0.0, (0.4, 0.2, 2.2), axis=AXIS)}),
    "a roll by both": (
        roll((0.3, 0.1, 1.4), (0.6, 0.8, 0.0), 0.4),
        {"turn": Turn(0.0, (0.2, 0.2, 1.6), axis=AXIS), "driven_by": Force((3.0, -2.0, -9.0))},
    ),
    "a plane by a moment": (Plane((0.4, 0.2, 1.0), (0.0, 0.0, -1.0)), {"turn": Turn(0.0, (0.4, 0.2, 1.0), axis=AXIS)}),
}


@pytest.mark.parametrize("name", DRIVEN)
@pytest.mark.parametrize("weighted", [False, True], ids=["nodes", "weighted"])
def test_the_tangent_is_that_of_differences(name, weighted):
    """The balance of nodes and tool at frozen forces, and gaps, by every unknown."""
    surface, more = DRIVEN[name]
    turn = replace(more["turn"], driven_by=Moment(5.0))
    scene = rubbed(surface, travel=(0.0, 0.0, 0.0), path=((0, 0), (1, 1)), **more | {"turn": turn})
    if weighted:
        mesh = brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.H20)
        tools = (replace(scene.tools[0], sampling=Sampling.WEIGHTED),)
        scene = replace(scene, mesh=mesh, tools=tools, quadrature=Quadrature.GAUSS3)
    system = system_of(scene)
    increment, rng = Increment(system, system.rest(), 0.3), np.random.default_rng(0)
    x, count = 1e-3 * rng.normal(size=increment.size), len(scene.drives)
    x[-count:] = 2e-2
    r = 1e3 * rng.normal(size=(len(system.candidates.node), 3))
    r[~system.candidates.tangent_free, 1:] = 0.0
    check_differences(increment, x, r)
    if not weighted:
        check_slips(increment, x)


def check_slips(increment, x):
    """Slips change by the tool's turn, the last of the unknowns x (n,), as Newton's matrix has it."""
    here, h, way = increment.at(x), 1e-6, np.zeros(len(x))
    way[-1] = 1.0
    found = (increment.at(x + h * way).motion - increment.at(x - h * way).motion) / (2 * h)
    as_rows = times(here.measured.rows, here.rows.motion(x + way) - here.rows.motion(x))
    assert (here.measured.turn == len(x) - 1).all()
    np.testing.assert_allclose(as_rows + here.measured.turned, found, atol=1e-8 * np.abs(found).max())
    assert np.abs(as_rows - found).max() > 1e-3 * np.abs(found).max()


def slab(moment, element=Element.H8, **tool) -> Scene:
    """The scene of `roller` in space, one element deep: the third axis of a plane is minus the second of space."""
    centre, down = (0.9, 0.0, 0.5 + RADIUS), {"travel": (0.0, 0.0, -0.02), "path": ((0, 0), (0.3, 1), (1, 1))}
    turn = Turn(0.0, centre, driven_by=Moment(moment, LATE), axis=(0.0, -1.0, 0.0))
    given = down | {"turn": turn} | tool
    surface = ShapedTool(roll((0.9, -3.0, 0.5 + RADIUS), Y, RADIUS), candidates=("top",), mu=0.3, **given)
    held = Support("base", 2), Prescribed("base", 0, SLIDE, LATE), Support("front", 1), Support("back", 1)
    mesh = brick(2.0, 0.25, 0.5, 12, 1, 3, element=element)
    return Scene(mesh, Geometry.SOLID, Elastic(Elasticity(1e3, 0.3)), held, (surface,))


@cache
def marches(moment):
    return tuple(rolled(slab(moment)))


@pytest.mark.parametrize("moment", [0.0, 0.8])
def test_a_roll_across_a_slab_is_the_circle_in_plane_strain(moment):
    """Angle, forces and energies: of a quarter of the thickness, a quarter of the moment."""
    linear = block(2.0, 0.5, 12, 3, element=Element.Q4)
    plane = rolled(replace(roller(4 * moment), mesh=linear))
    space = marches(moment)
    assert [a.state.tau for a in plane] == [a.state.tau for a in space]
    assert apart(4 * forces(space)[:, [0, 2]], forces(plane)) < 1e-7
    angles = [-a.tool_pose(0)[4] for a in space]
    assert apart(angles, [a.tool_pose(0)[2] for a in plane]) < 1e-7
    assert 4 * space[-1].tool_moment(0) == pytest.approx(plane[-1].tool_moment(0), abs=1e-8)
    assert 4 * space[-1].energies.work == pytest.approx(plane[-1].energies.work, rel=1e-7)


@pytest.mark.parametrize("moment", [0.0, 0.8])
def test_its_moment_is_that_of_nodal_forces(moment):
    """From places, and the internal forces of the elements."""
    scene = slab(moment)
    system = system_of(scene)
    for a in marches(moment):
        pulled = system.body.space.nodal(a.solved.response.element_forces)[system.candidates.node]
        arm = a.state.nodes[system.candidates.node] - (0.9, 0.0, 0.5 + RADIUS) - a.tool_pose(0)[:3]
        turned_by = float(-np.cross(arm, pulled)[:, 1].sum())
        largest = RADIUS * np.abs(a.solved.r).sum()
        np.testing.assert_allclose(turned_by, moment * LATE.at(a.state.tau), atol=1e-9 * largest)
        np.testing.assert_allclose(a.tool_moment(0), turned_by, atol=1e-9 * largest)


@pytest.mark.slow
def test_means_roll_as_nodes_do():
    """Of quadratic faces in weighted means: the free roll goes with the surface."""
    last = rolled(slab(0.0, element=Element.H20, sampling=Sampling.WEIGHTED), increments=8)[-1]
    np.testing.assert_allclose(RADIUS * -last.tool_pose(0)[4], SLIDE, rtol=0.03)
    np.testing.assert_allclose(last.tool_moment(0), 0.0, atol=1e-9 * np.abs(last.solved.r).sum())


@pytest.mark.parametrize("form", [Tangent(), pytest.param(Dissipation(), marks=pytest.mark.slow)], ids=named)
def test_forms_agree_on_a_roll_that_a_moment_turns(form):
    there = {round(a.state.tau, 9): a for a in rolled(slab(0.2), form, 10)}
    one = rolled(slab(0.2), increments=10)
    other = [there[round(a.state.tau, 9)] for a in one]
    assert apart(forces(other), forces(one)) < 1e-3


def aslant(moment):
    """A sphere that presses a block off its middle and is turned about an axis along nothing."""
    turn = Turn(0.0, (0.45, 0.55, 3.0), driven_by=Moment(moment, Amplitude(((0, 0), (0.5, 0), (1, 1)))), axis=AXIS)
    down = {"travel": (0.0, 0.0, -0.05), "path": ((0, 0), (0.5, 1), (1, 1))}
    return rubbed(sphere((0.45, 0.55, 3.0), 2.0), 3, mu=0.3, turn=turn, **down)


@pytest.mark.slow
def test_a_scene_turned_as_a_whole_has_the_same_forces_and_angles():
    Q, scene = turned((1.0, 2.0, -0.5), 0.8), aslant(1.0)
    tool = scene.tools[0]
    assert tool.turn is not None
    spun = replace(tool.turn, centre=tuple(Q @ tool.turn.centre), axis=tuple(Q @ AXIS))
    about = replace(turned_scene(replace(scene, tools=(replace(tool, turn=None),)), Q).tools[0], turn=spun)
    other = replace(turned_scene(replace(scene, tools=()), Q), tools=(about,))
    one, two = (rolled(s, increments=6) for s in (scene, other))
    assert apart(forces(two) @ Q, forces(one)) < 1e-7
    assert apart([a.tool_pose(0)[3:] @ Q for a in two], [a.tool_pose(0)[3:] for a in one]) < 1e-7
    assert np.linalg.norm(one[-1].tool_pose(0)[3:]) > 1e-3
    assert one[-1].tool_moment(0) == pytest.approx(1.0, rel=1e-8)


def test_a_lid_turned_by_a_moment_goes_as_far_as_the_angle_that_has_it():
    """Below what friction holds: torsion of the disc, by angle and by moment."""
    angle = 0.004
    by_angle = rolled(twisted(angle=angle), increments=5)[-1]
    moment = by_angle.tool_moment(0)
    later = Amplitude(((0.0, 0.0), (0.1, 0.0), (1.0, 1.0)))
    scene = twisted()
    turn = Turn(0.0, (0.0, 0.0, HEIGHT), driven_by=Moment(moment, later), axis=UP)
    last = rolled(replace(scene, tools=(replace(scene.tools[0], turn=turn),)), increments=5)[-1]
    assert moment > 0.2 * (2 / 3) * 0.2 * abs(by_angle.tool_forces[0, 2])
    assert last.tool_pose(0)[5] == pytest.approx(angle, rel=1e-3)


@pytest.mark.slow
def test_half_of_a_roll_has_half_the_moment_of_the_whole():
    """A plane of symmetry across the axis: the roll is its own mirror image as it turns."""
    seen = []
    for half in (False, True):
        centre, depth = (0.9, 0.0, 0.5 + RADIUS), 0.3 if half else 0.6
        turn = Turn(0.0, centre, driven_by=Moment(0.3, LATE), axis=(0.0, -1.0, 0.0))
        path = ((0, 0), (0.3, 1), (1, 1))
        tool = ShapedTool(roll(centre, Y, RADIUS), (0.0, 0.0, -0.02), ("top",), 0.3, path, turn=turn)
        mesh = brick(2.0, depth, 0.5, 8, 1 if half else 2, 2)
        mesh = replace(mesh, nodes=mesh.nodes if half else mesh.nodes - (0.0, 0.3, 0.0))
        held = (Support("base", 2), Support("base", 1), Prescribed("base", 0, SLIDE, LATE))
        supports = (*held, Symmetry("front", 1)) if half else held
        scene = Scene(mesh, Geometry.SOLID, Elastic(Elasticity(1e3, 0.3)), supports, (tool,))
        seen.append(rolled(scene, increments=8)[-1])
    whole, half = seen
    np.testing.assert_allclose(half.tool_force(0), whole.tool_force(0), atol=1e-8 * np.abs(whole.tool_force(0)).max())
    np.testing.assert_allclose(half.tool_pose(0), whole.tool_pose(0), atol=1e-9)
    assert half.tool_moment(0) == pytest.approx(0.3, rel=1e-8)
    assert half.energies.work == pytest.approx(whole.energies.work, rel=1e-8)


def test_a_turn_that_a_plane_of_symmetry_does_not_mirror_is_refused():
    for turn in (Turn(0.1, (0.0, 0.0, 3.0), axis=UP), Turn(0.0, (0.0, 0.0, 3.0), driven_by=Moment(1.0), axis=AXIS)):
        refused(lambda turn=turn: dented(BALL, turn=turn), r"tools\[0\].turn = .*about the normal of the plane")


@pytest.mark.slow
def test_a_moment_that_friction_cannot_hold_spins_the_sphere():
    scene = aslant(1e3)

    def hold():
        for a in march(scene, Schedule(10), Control(Newton(), (), cuts=3)):
            assert abs(a.tool_moment(0)) <= 0.3 * 2.0 * a.solved.r[:, 0].sum() * (1 + 1e-7)

    with pytest.raises(IncrementFailed, match=r"tools\[0\] spins: by the normal forces .* friction holds a moment of"):
        hold()


def test_a_march_goes_on_and_is_read_back(tmp_path):
    scene, schedule, control = aslant(1.0), Schedule(5), Control(Newton(), (Tangent(),))
    with Recorder(tmp_path, scene, COLUMNS, {"mu": 0.3}, {"length": "mm", "force": "N"}) as out:
        whole = list(march(scene, schedule, control))
        for increment in whole:
            out.record(increment)
    for k, before in enumerate(whole[:-1]):
        after = next(march(scene, schedule, control, stored(before.course)))
        for a, b in zip(arrays(after.state), arrays(whole[k + 1].state), strict=True):
            np.testing.assert_array_equal(a, b)
    course = history.open(tmp_path).course(2)
    np.testing.assert_array_equal(course.state.translation, whole[2].state.translation)
    assert max(whole[-1].solved.certificate.ratios(Bounds()).values()) <= 1
