"""Two-step integration of plastic flow: its coefficients, its order under friction, and where it must hold back."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Control, Newton, Schedule, march, upsetting
from bipot.errors import SceneError
from bipot.laws.flow import FARTHEST, Flow, Integration, fraction
from bipot.marching import system_of
from bipot.paper import unreturned
from bipot.results.columns import flow_gap


def end_force(integration, increments, mu=0.05, reduction=0.3):
    """Force at the end of a path whose start-up is the same for any number of increments."""
    scene = upsetting(mu=mu, reduction=reduction, elements=3)
    schedule = Schedule(increments, first=0.001 / reduction, settling=4)
    *_, last = march(scene, schedule, Control(Newton(), integration=integration))
    return -last.tool_forces[0, 1]


@pytest.mark.parametrize("ratio", [0.25, 1.0, 2.0])
def test_a_smooth_flow_is_differenced_to_second_order(ratio):
    """For y = t^2 the two-step formula dy = a dy_0 + (1 - a dt_0/dt) dt y' is exact, whatever the lengths."""
    length, last = 0.3 * ratio, 0.3
    y, rate = (lambda t: t**2), (lambda t: 2 * t)
    now, a = 1.0, fraction(ratio)
    carried = a * (y(now) - y(now - last))
    own = (length - a * last) * rate(now + length)
    assert carried + own == pytest.approx(y(now + length) - y(now), rel=1e-12)


@pytest.mark.parametrize(("ratio", "most"), [(100.0, FARTHEST), (0.0, 0.0), (-1.0, 0.0)])
def test_what_grows_is_carried_no_farther_than_is_stable_and_what_turns_back_not_at_all(ratio, most):
    assert fraction(ratio) == most


def test_a_part_of_a_flow_is_taken_point_by_point():
    flow = Flow(np.ones((1, 2, 4)), np.array([[1.0, 2.0]])).times(np.array([[0.5, 0.0]]))
    assert flow.peeq.tolist() == [[0.5, 0.0]]
    assert flow.strain.sum(axis=-1).tolist() == [[2.0, 0.0]]


@pytest.mark.parametrize("after", [1.0, 1.05, 0.9])
def test_a_tool_that_stops_slows_down_or_turns_gives_the_force_of_backward_euler(after):
    """The flow that goes on is measured by the tools' travel: pseudo-time means nothing to a rate-independent law."""
    forces = {}
    for integration in Integration:
        scene = upsetting(mu=0.1, reduction=0.1, elements=2)
        path = ((0.0, 0.0), (0.5, 1.0), (1.0, after))
        scene = replace(scene, tools=tuple(replace(tool, path=path) for tool in scene.tools))
        schedule = Schedule(16, first=0.001 / 0.1, landings=(0.5,))
        steps = march(scene, schedule, Control(Newton(), integration=integration))
        forces[integration] = np.array([-a.tool_forces[0, 1] for a in steps])
    euler, bdf = forces.values()
    assert np.abs(bdf - euler).max() < 2e-3 * euler.max()


def test_flow_carried_on_without_a_return_is_refused():
    with pytest.raises(SceneError, match="integration = 'BDF2'"):
        march(unreturned(upsetting(mu=0.1, elements=2)), Schedule(2))


@pytest.mark.slow
def test_force_is_of_second_order_under_friction_and_of_first_with_backward_euler():
    orders = {}
    for integration in Integration:
        coarse, middle, fine = (end_force(integration, n) for n in (20, 40, 80))
        orders[integration] = np.log2(abs(coarse - middle) / abs(middle - fine))
    assert orders[Integration.BDF2] == pytest.approx(2, abs=0.25)
    assert orders[Integration.BACKWARD_EULER] == pytest.approx(1, abs=0.1)


@pytest.mark.slow
def test_both_tend_to_the_same_force():
    extrapolated = 2 * end_force(Integration.BACKWARD_EULER, 40) - end_force(Integration.BACKWARD_EULER, 20)
    assert end_force(Integration.BDF2, 40) == pytest.approx(extrapolated, rel=2e-5)


def test_an_unloading_body_carries_no_flow_on():
    """Loaded, then let go a little: the flow ends with the first increment back, and so does the peeq's growth."""
    scene = upsetting(mu=0.1, reduction=0.05, elements=2)
    path = ((0.0, 0.0), (0.9, 1.0), (1.0, 0.995))
    scene = replace(scene, tools=tuple(replace(tool, path=path) for tool in scene.tools))
    schedule = Schedule(8, first=0.001 / 0.05, landings=(0.9,))
    *_, top, once, twice = march(scene, replace(schedule, landings=(0.9, 0.95)), Control(Newton()))
    assert top.state.tau == 0.9
    assert top.state.flow.peeq.max() > 0
    assert not once.state.flow.strain.any()
    np.testing.assert_array_equal(twice.state.peeq, top.state.peeq)


@pytest.mark.parametrize("integration", Integration)
def test_what_the_stored_flow_misses_falls_with_the_increment_and_is_nothing_with_backward_euler(integration):
    scene = upsetting(mu=0.05, reduction=0.2, elements=2)
    worst = []
    for increments in (10, 20):
        schedule = Schedule(increments, first=0.001 / 0.2, landings=(0.5,))
        steps = march(scene, schedule, Control(Newton(), integration=integration))
        worst.append(max(flow_gap(system_of(scene), a) for a in steps if a.start.tau >= 0.5))
    if integration is Integration.BACKWARD_EULER:
        assert max(worst) < 1e-12
    else:
        assert 1e-8 < worst[1] < worst[0] / 2
