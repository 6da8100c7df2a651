"""A first increment by accuracy carries on the flow of its own first half: its error, its loads, a body that turns."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.control.attempting import attempt_increment
from bipot.fem.reduction import Geometry
from bipot.forms import Cache
from bipot.iterate import Increment
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule, march, system_of
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.loads import Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from studies.accuracy.paced import CONTROL
from studies.accuracy.paced_scenes import pressed_block, pressed_ring

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
    exact = end(scene, 200, tau).tool_forces[0, 1]
    one, halved = (abs(step.tool_forces[0, 1] / exact - 1) for step in (first(scene, landings=(tau,)), own))
    assert one > 1e-4
    assert halved < one / 3
    assert (own.number, own.start.tau) == (1, 0.0)


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
        solved = attempt_increment(increment, CONTROL, Cache(), 0.0, staged=True).solved
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
