"""A first increment by accuracy carries on the flow of its own first half: its error, its loads, a body that turns."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.control.attempting import attempt_increment
from bipot.control.carried import CarriedFlow, Flowed
from bipot.control.reason import ReasonKind
from bipot.fem.reduction import Geometry
from bipot.forms import Cache
from bipot.increment import Near
from bipot.iterate import Increment
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule, march, system_of
from bipot.meshes.sections import block, ring
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.loads import Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.tool import FlatTool
from bipot.yielding import is_past_yield, yielded_strain
from studies.accuracy.paced import CONTROL
from studies.accuracy.paced_scenes import BACK, cylinder, pressed_block, pressed_ring

MATERIAL = VonMises(Elasticity(2e5, 0.3), Linear(300.0, 300.0))


def first(scene, accuracy=None, landings=()):
    """The first increment of a march, by accuracy or to the first landing."""
    schedule = Schedule(1, landings=landings) if accuracy is None else Schedule(accuracy=accuracy)
    return next(march(scene, schedule, CONTROL))


def end(scene, parts, tau):
    """The increment that ends at ``tau`` of a march in so many equal ones."""
    taus = tuple(float(x) for x in np.linspace(0.0, tau, parts + 1)[1:])
    return next(a for a in march(scene, Schedule(1, landings=taus), CONTROL) if a.state.tau == tau)


@pytest.mark.parametrize("scene", [pressed_ring(), pressed_block()], ids=["ring", "block"])
def test_the_first_increment_errs_by_a_third_of_backward_euler_at_most(scene):
    own = first(scene, 1e-4)
    tau = own.state.tau
    exact = end(scene, 100, tau).tool_forces[0, 1]
    one, halved = (abs(step.tool_forces[0, 1] / exact - 1) for step in (first(scene, landings=(tau,)), own))
    assert one > 1e-4
    assert halved < one / 3
    assert (own.number, own.start.tau) == (1, 0.0)


def test_a_first_increment_that_strains_a_body_evenly_is_not_halved():
    """Beneath little friction backward Euler errs by a tenth of the accuracy; halves take twice the passes and more."""
    accuracy, scene = 1e-4, cylinder(0.1, elements=5)
    own = first(scene, accuracy)
    tau = own.state.tau
    assert not own.solved.iterate.increment.in_halves
    assert own.passes <= 6
    assert abs(own.tool_forces[0, 1] / end(scene, 50, tau).tool_forces[0, 1] - 1) < accuracy / 5
    halved = first(cylinder(0.3, elements=5), accuracy)
    assert halved.solved.iterate.increment.in_halves
    assert halved.passes > 2 * own.passes


def beside_a_wall():
    """A brick that is pressed beside a wall with little friction, the force on which is not stationary in the flow."""
    press = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.1), ("top",), 0.02)
    wall = FlatTool((0.5, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), ("right",), 0.02)
    held = Symmetry("base", 2), Symmetry("left", 0), Symmetry("front", 1)
    material = VonMises(Elasticity(210_000.0, 0.0), Linear(134.0, 400.0))
    return Scene(brick(0.5, 1.0, 1.0, 2, 2, 2), Geometry.SOLID, material, held, (press, wall))


def opened_ring():
    """A ring that a tool upsets while its bore is driven open."""
    press = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.2), ("top",), 0.1)
    held = Symmetry("base", 1), Prescribed("bore", 0, 0.1)
    material = VonMises(Elasticity(210_000.0, 0.0), Linear(420.0, 420.0))
    return Scene(ring(1.0, 2.0, 1.0, 3, 3), Geometry.AXISYMMETRIC, material, held, (press,))


@pytest.mark.parametrize(("scene", "axis"), [(beside_a_wall(), 2), (opened_ring(), 1)], ids=["wall", "bore"])
def test_one_that_is_strained_along_two_lines_is_halved_however_even_it_is(scene, axis):
    """The force of one tool is not stationary there: in one piece it was off by 14 and by 107 times the accuracy."""
    accuracy, own = 1e-4, first(scene, 1e-4)
    tau = own.state.tau
    assert own.solved.iterate.increment.in_halves
    exact = end(scene, 40, tau).tool_forces[0, axis]
    one, halved = (abs(step.tool_forces[0, axis] / exact - 1) for step in (first(scene, landings=(tau,)), own))
    assert one > 8 * accuracy
    assert halved < one / 3


def to_and_fro(hardening):
    """A block between clamped ends that come together by thirty yield strains, go apart by twice as much, and back."""
    down = Prescribed("top", 1, -0.045, Amplitude(((0.0, 0.0), (1 / 3, 1.0), (2 / 3, -1.0), (1.0, 1.0))))
    held = (Support("base", 0), Support("base", 1), Support("top", 0))
    return Scene(block(1.5, 1.0, 3, 2), Geometry.PLANE_STRAIN, VonMises(Elasticity(2e5, 0.3), hardening), (*held, down))


def pulled(step):
    """The force of the upper end."""
    forces = step.solved.iterate.reactions(step.solved.r)
    return forces[step.scene.mesh.boundary_nodes("top"), 1].sum()


def test_where_a_path_turns_the_first_increment_carries_on_its_own_half_at_any_accuracy():
    """Backward Euler in one piece left three times as much, and more in bodies that harden."""
    scene, turn = to_and_fro(Perfect(300.0)), 2 / 3
    steps = list(march(scene, Schedule(accuracy=1e-3), CONTROL))
    k, own = next((k, step) for k, step in enumerate(steps) if step.start.tau == turn)
    assert own.solved.iterate.increment.in_halves

    def refined(parts):
        ends = tuple(np.linspace(turn, own.state.tau, parts + 1)[1:].tolist())
        course = steps[k - 1].course
        return next(
            pulled(step)
            for step in march(scene, Schedule(1, landings=ends), CONTROL, course)
            if step.state.tau == own.state.tau
        )

    exact, euler = refined(32), refined(1)
    assert abs(pulled(own) - exact) < abs(euler - exact) / 3


def test_where_a_body_springs_back_from_a_turn_there_is_no_half():
    steps = list(march(cylinder(0.1, elements=2, path=BACK), Schedule(accuracy=1e-3), CONTROL))
    back = [step for step in steps if step.start.tau >= 0.5]
    assert [step.solved.iterate.increment.in_halves for step in back] == [False]
    assert is_past_yield(back[0].solved.iterate.increment)


def test_a_body_that_has_hardened_yields_later_after_a_turn_whatever_is_carried_on():
    """What the first half flowed is no hardening at the start: the estimate took the increment for one before yield."""
    steps = march(to_and_fro(Linear(300.0, 500.0)), Schedule(accuracy=2e-3), CONTROL)
    own = next(step for step in steps if step.start.tau == 1 / 3)
    increment = own.solved.iterate.increment
    assert increment.in_halves
    far = yielded_strain(increment.system, own.start.peeq)
    assert far > 1.02 * yielded_strain(increment.system, np.zeros_like(own.start.peeq))
    assert is_past_yield(increment)
    assert not any(reason.kind is ReasonKind.ACCURACY for reason in own.reasons)


def test_points_whose_flow_stopped_keep_what_flowed_within_the_increment():
    half = first(pressed_block(), landings=(0.05,)).solved
    carried = CarriedFlow.of_half(half)
    assert carried is not None
    np.testing.assert_array_equal(carried.fraction[carried.on], 1 + 1 / 3)
    np.testing.assert_array_equal(replace(carried, on=np.zeros_like(carried.on)).fraction, 1.0)


def test_points_whose_flow_stopped_do_not_hide_how_much_the_others_flow():
    """What they flowed in the first half counted as flow that was taken back in the second."""
    half = first(pressed_block(), landings=(0.05,)).solved
    increment, carried = half.iterate.increment, CarriedFlow.of_half(half)
    assert carried is not None
    body, start, x = increment.system.body, increment.start, half.response.x

    def measured(times):
        stops = np.arange(len(start.peeq))[:, None] % 2 * np.ones_like(start.peeq)
        begun = body.carried_on(start, carried.last.times(np.where(stops > 0, times, carried.fraction)))
        return Flowed.of(increment.system, carried, Near(replace(increment, start=begun).at(2 * x), half.r))

    none, some = measured(carried.fraction), measured(20.0)
    assert not none.stopped.any()
    assert some.stopped.any()
    assert 0.2 * none.overall < some.overall < none.overall


def test_what_is_carried_on_is_no_load_of_another_path():
    own = first(pressed_block(), 1e-4)
    assert own.solved.response.state is not own.start, "flow is carried on"
    assert own.solved.iterate.increment.loads.others is None
    assert not own.solved.iterate.increment.loads.changes


def test_where_loads_change_there_is_no_half():
    """A load that is on from the beginning comes in no time, in the first half as in the whole."""
    load = Pressure("right", 50.0, Amplitude(((0.0, 1.0), (1.0, 1.0))))
    for loads, halved in (((), True), ((load,), False)):
        system = system_of(replace(pressed_block(), loads=loads))
        increment = Increment(system, system.rest(), 0.1)
        solved = attempt_increment(increment, CONTROL, Cache(), 0.0, staged=lambda near: False).solved
        assert solved is not None
        assert (solved.response.state is not increment.start) == halved


@pytest.mark.parametrize("geometry", [Geometry.PLANE_STRAIN, Geometry.SOLID], ids=["plane", "space"])
def test_what_is_turned_back_is_as_before(geometry):
    mesh = block(1.0, 1.0, 2, 2) if geometry is Geometry.PLANE_STRAIN else brick(1.0, 1.0, 1.0, 2, 2, 2)
    held = tuple(Support("base", d) for d in range(mesh.dimension))
    driven = tuple(Prescribed("top", d, way) for d, way in zip(range(mesh.dimension), (0.4, -0.1, 0.05), strict=False))
    scene = Scene(mesh, geometry, MATERIAL, (*held, *driven))
    kin = first(scene, landings=(0.5,)).solved.response.kinematics
    tensor = np.random.default_rng(1).normal(size=kin.strain.shape)
    assert np.abs(kin.turned(tensor) - tensor).max() > 0.05
    np.testing.assert_allclose(kin.turned_back(kin.turned(tensor)), tensor, atol=1e-13)
