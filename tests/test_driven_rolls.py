"""Curved tools that moments turn: rolling, spinning, balances recomputed, in every form."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.control.course import Course
from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.paths import Amplitude
from bipot.results import Recorder, history
from bipot.results.description import describe
from bipot.results.static import Lines
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.surfaces import Plane
from bipot.tools.tool import ShapedTool
from tests.courses import stored
from tests.curved import TIGHT, apart, forces
from tests.recording import COLUMNS, arrays

EXACT = replace(TIGHT, tool_equilibrium=1e-11)
RADIUS = 1.0
LATE = Amplitude(((0.0, 0.0), (0.3, 0.0), (1.0, 1.0)))
PRESSING = Amplitude(((0.0, 0.0), (0.3, 1.0), (1.0, 1.0)))
SLIDE = 0.12
TOGETHER = 1e-3
"""Forms may cut increments that others take whole: ends are then those of other steps."""


def roller(moment=0.0, mu=0.3, n=12, unit=1.0, stress=1.0, mirror=1.0, **tool) -> Scene:
    """A block that its base takes aside under a roll which is pressed onto it and turns freely, or by a moment."""
    mesh = block(2.0 * unit, 0.5 * unit, n, 3)
    centre = (mirror * 0.9 * unit, (0.5 + RADIUS) * unit)
    if mirror < 0:
        mesh = Mesh(mesh.nodes * (-1.0, 1.0), mesh.elements[:, ::-1], mesh.boundaries)
    turn = Turn(0.0, centre, driven_by=Moment(mirror * moment * stress * unit**2, LATE))
    given: dict[str, Any] = {"travel": (0.0, -0.02 * unit), "path": ((0, 0), (0.3, 1), (1, 1)), "turn": turn} | tool
    roll = ShapedTool(Circle(centre, RADIUS * unit), candidates=("top",), mu=mu, **given)
    held = Support("base", 1), Prescribed("base", 0, mirror * SLIDE * unit, LATE)
    return Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1e3 * stress, 0.3)), held, (roll,))


def rolled(scene, form=None, increments=20, **more):
    control = Control(form or Newton(), (), Limits(EXACT), integration=Integration.BACKWARD_EULER, **more)
    return list(march(scene, Schedule(increments), control))


@cache
def marches(moment=0.0):
    """That march by Newton."""
    return tuple(rolled(roller(moment)))


@pytest.mark.parametrize("moment", [0.0, 0.8, -0.8])
def test_a_roll_turns_with_the_body_and_its_moment_is_that_of_nodal_forces(moment):
    """Moments recomputed from places and from the internal forces of the elements, where they balance the roll's."""
    scene, system = roller(moment), system_of(roller(moment))
    tool, space = scene.tools[0], system_of(scene).body.space
    assert tool.turn is not None
    largest = 0.0
    for a in marches(moment):
        pulled = space.nodal(a.solved.response.element_forces)[system.candidates.node]
        centre = np.add(tool.turn.centre, tool.pose(a.state.tau)[:2])
        arm = a.state.nodes[system.candidates.node] - centre
        turned = float((arm[:, 0] * pulled[:, 1] - arm[:, 1] * pulled[:, 0]).sum())
        largest = RADIUS * np.abs(a.solved.r).sum()
        np.testing.assert_allclose(turned, moment * LATE.at(a.state.tau), atol=1e-9 * largest)
        np.testing.assert_allclose(a.tool_moment(0), turned, atol=1e-9 * largest)
    last = marches(moment)[-1]
    assert largest > 10.0
    # It rolls on the top, which the base takes along by SLIDE: the surface goes as far, but for shear and stretch.
    np.testing.assert_allclose(RADIUS * last.tool_pose(0)[2], SLIDE, rtol=0.02)
    sticks = last.solved.r[:, 0] > 1e-6 * largest
    np.testing.assert_allclose(last.solved.iterate.motion[sticks, 1], 0.0, atol=1e-3 * SLIDE / 20)


@pytest.mark.slow
@pytest.mark.parametrize("form", [Tangent(), Dissipation()], ids=lambda form: form.name.value)
def test_forms_agree_on_a_roll_that_a_moment_turns(form):
    one = marches(0.8)
    there = {round(a.state.tau, 9): a for a in rolled(roller(0.8), form)}
    other = [there[round(a.state.tau, 9)] for a in one]
    assert apart(forces(other), forces(one)) < TOGETHER
    assert apart([a.tool_pose(0) for a in other], [a.tool_pose(0) for a in one]) < TOGETHER


def test_a_roll_is_pressed_by_a_force_and_turned_by_a_moment():
    """Both balances at once; and turned by the angles found it has the moment, by steps in which no node lands."""
    down = Force((0.0, -12.0), PRESSING)
    scene = roller(0.8, travel=(0.0, 0.0), driven_by=down)
    accepted = rolled(scene, Tangent())
    for a in accepted:
        np.testing.assert_allclose(a.tool_forces[0, 1], -12.0 * PRESSING.at(a.state.tau), rtol=1e-9)
        np.testing.assert_allclose(a.tool_moment(0), 0.8 * LATE.at(a.state.tau), atol=1e-9)
    # The roll does not go aside, and what that takes is friction: less than would slip.
    last = accepted[-1]
    assert abs(last.tool_forces[0, 0]) < 0.3 * 12.0
    assert last.tool_pose(0)[1] < -0.01
    np.testing.assert_allclose(last.state.translation, -last.tool_pose(0)[1:] * (1.0, -(scene.drives.spins[1] ** -1)))


def test_the_moment_does_the_work_of_its_turn():
    """What base and roll do together is stored or rubbed, to the first order of landings."""
    errors = [abs(rolled(roller(0.8), increments=k)[-1].energies.energy_error) for k in (10, 40)]
    assert errors[1] < errors[0] / 2


@pytest.mark.slow
def test_a_moment_that_friction_cannot_hold_spins_the_roll():
    """Held up to next to mu times the normal forces times the radius, it is told why no more."""
    reached = list[float]()

    def hold():
        for a in march(roller(6.0), Schedule(20), Control(Newton(), (), cuts=4)):
            most = 0.3 * RADIUS * a.solved.r[:, 0].sum()
            assert abs(a.tool_moment(0)) <= most * (1 + 1e-7)
            reached.append(a.tool_moment(0) / (most or 1.0))

    with pytest.raises(
        IncrementFailed, match=r"tools\[0\] spins: by the normal forces .* friction holds a moment of at"
    ):
        hold()
    assert reached[-1] > 0.95


def test_a_roll_that_touches_nothing_rests_and_says_so():
    scene = roller(0.0, travel=(0.0, 0.0))
    aside = Circle((0.9, 0.6 + RADIUS), RADIUS)
    last = rolled(replace(scene, tools=(replace(scene.tools[0], surface=aside),)), increments=4)[-1]
    assert last.tool_pose(0).tolist() == [0.0, 0.0, 0.0]
    assert "position in 1 rigid motion" in last.solved.undetermined


@pytest.mark.slow
def test_a_roll_that_loses_its_contact_stays_as_it_is_turned_and_says_so():
    """Of a coarse body that has flowed: between two nodes it is off the roll, and forms leave remainders of forces."""
    held = Support("base", 1), Prescribed("base", 0, 0.3, LATE)
    flows = VonMises(Elasticity(1e3, 0.3), Perfect(3.0))
    scene = replace(roller(n=8, travel=(0.0, -0.01)), material=flows, supports=held)
    angle, touched, lost = 0.0, False, 0
    for a in march(scene, Schedule(20), Control(Dissipation(), ())):
        here, off = float(a.tool_pose(0)[2]), bool((a.state.gap > 1e-6).all())
        if off:
            np.testing.assert_allclose(here, angle, rtol=1e-9, atol=1e-15)  # radians
            assert "position in 1 rigid motion" in a.solved.undetermined
            assert not a.unique
            lost += touched
        touched, angle = touched or not off, here
    # It is met again, and goes as far as the base took it while it was touched: less than the whole way.
    assert lost > 0
    assert 0.2 < angle < 0.3


@pytest.mark.parametrize(("unit", "stress"), [(1e-3, 1e6), (1e3, 1e-9)])
@pytest.mark.slow
def test_units_do_not_matter_to_a_roll(unit, stress):
    one, other = marches(0.8), rolled(roller(0.8, unit=unit, stress=stress))
    assert [a.passes for a in other] == [a.passes for a in one]
    assert apart([a.tool_pose(0)[2] for a in other], [a.tool_pose(0)[2] for a in one]) < 1e-8
    assert apart(forces(other) / (stress * unit), forces(one)) < 1e-8


def test_a_mirrored_scene_turns_the_other_way():
    one, other = marches(0.8), rolled(roller(0.8, mirror=-1.0))
    assert apart([-a.tool_pose(0)[2] for a in other], [a.tool_pose(0)[2] for a in one]) < 1e-8
    assert apart(forces(other) * (-1.0, 1.0), forces(one)) < 1e-8


def test_a_march_with_a_driven_roll_goes_on_and_is_read_back(tmp_path):
    """From every course to the last bit, and from a file."""
    scene, schedule, control = roller(0.8), Schedule(5), Control(Newton(), (Tangent(),))
    with Recorder(tmp_path, scene, COLUMNS, {"mu": 0.3}, {"length": "mm", "force": "N"}) as out:
        whole = list(march(scene, schedule, control))
        for increment in whole:
            out.record(increment)
    for k, before in enumerate(whole[:-1]):
        after = next(march(scene, schedule, control, stored(before.course)))
        for a, b in zip(arrays(after.state), arrays(whole[k + 1].state), strict=True):
            np.testing.assert_array_equal(a, b)
    course: Course = history.open(tmp_path).course(2)
    np.testing.assert_array_equal(course.state.translation, whole[2].state.translation)
    # The roll is drawn as it was turned: by the angle that was found.
    (line,), pose = history.open(tmp_path).snapshot().tools, whole[-1].tool_pose(0)
    arm, now = Lines.of(scene).points - (0.9, 0.5 + RADIUS), line.points - pose[:2] - (0.9, 0.5 + RADIUS)
    np.testing.assert_allclose(now @ (1.0, 1j), arm @ (1.0, 1j) * np.exp(1j * pose[2]), atol=1e-12)
    assert abs(pose[2]) > 0.1
    np.testing.assert_array_equal(next(march(scene, schedule, control, course)).state.nodes, whole[3].state.nodes)
    said = describe(scene)["tools"][0]
    assert "Moment(value=0.8" in said["turn"]
    np.testing.assert_allclose(whole[2].state.translation[0] / said["lever"], whole[2].tool_pose(0)[2], rtol=1e-14)


def test_bounds_are_kept_by_every_increment():
    for accepted in marches(0.8):
        assert max(accepted.solved.certificate.ratios(Bounds()).values()) <= 1


def beneath_a_lid(hardening, mu, traction):
    """A block that a ``traction`` pulls or presses beneath a lid that is hinged beside it, and that nothing turns."""
    hinged = Turn(0.0, (-1.0, 1.0), driven_by=Moment(0.0))
    return Scene(
        mesh=block(1.0, 1.0, 2, 2),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(1000.0, 0.3), hardening),
        supports=(Support("left", 0), Support("base", 1)),
        tools=(ShapedTool(Plane((0.0, 1.0), (0.0, -1.0)), (0.0, 0.0), ("top",), mu, turn=hinged),),
        loads=(Traction("right", (traction, 0.0)),),
    )


def test_a_lid_that_nothing_turns_rides_on_a_body_that_rises_under_it():
    """The round-off of contact forces was measured by itself: the march stalled, and cut 3 of these increments."""
    steps = list(march(beneath_a_lid(Perfect(10.0), 0.3, -1.0), Schedule(20), Control(Newton(), ())))
    assert sum(step.cuts for step in steps) == 0
    assert max(step.passes for step in steps[1:]) == 1


@pytest.mark.parametrize(("mu", "traction"), [(0.3, 2.0), (0.0, -5.0)], ids=["sinks", "rises"])
def test_a_pass_without_forces_beneath_a_lid_is_not_the_last(mu, traction):
    """Beside no force what penetrates is off the law by any number of times: Newton was ended there."""
    steps = list(march(beneath_a_lid(Linear(10.0, 100.0), mu, traction), Schedule(5), Control(Newton(), ())))
    assert [step.cuts for step in steps] == [0] * 5
    assert sum(step.passes for step in steps) < 20
