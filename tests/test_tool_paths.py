"""Tools that go along their travel's components one after the other: press, then slide."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from bipot.forms import Newton, Tangent
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT, OVERLAP, energies
from bipot.results.description import describe
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from tests.scenes import refused, scene, tool

MU = 0.2
SLIDE = ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))


def pressed_then_slid(**changes):
    """A wide block on a rough floor (held all over), pressed by a tenth of a percent, then rubbed by a thirtieth."""
    own = {"travel": (0.1, -0.002), "mu": MU, "path": SLIDE}
    return scene(
        mesh=block(3.0, 1.0, 6, 2, element=Element.Q8),
        supports=(Support("base", 0), Support("base", 1)),
        tools=(tool(**(own | changes)),),
    )


@pytest.mark.parametrize("form", [Newton(), Tangent()])
def test_a_tool_that_presses_and_then_slides_is_held_by_mu_times_its_force(form):
    steps = list(march(pressed_then_slid(), Schedule(10, landings=(0.5,)), Control(form)))
    sliding = [a for a in steps if a.state.tau > 0.8]
    assert len(sliding) >= 2
    for accepted in steps:
        assert accepted.solved.certificate.relative_gap < 1e-7
    for accepted in sliding:
        along, normal = accepted.tool_forces[0]
        assert normal < 0
        assert along == pytest.approx(MU * -normal, rel=1e-9)


def test_the_other_way_round_the_force_turns():
    there, back = (
        list(march(pressed_then_slid(travel=(way, -0.002)), Schedule(10, landings=(0.5,))))[-1].tool_forces[0]
        for way in (0.1, -0.1)
    )
    np.testing.assert_allclose(there, [-back[0], back[1]], rtol=1e-9)


def test_every_component_goes_its_own_way():
    made = tool(travel=(3.0, -2.0), path=((0, 0), (0.25, [0, 1]), (0.5, np.array([1, 1])), (1.0, 0.5)))
    assert made.path == ((0.0, 0.0), (0.25, (0.0, 1.0)), (0.5, (1.0, 1.0)), (1.0, 0.5))
    np.testing.assert_allclose(made.moved(0.0, 0.25), [0.0, -2.0])
    np.testing.assert_allclose(made.moved(0.25, 0.375), [1.5, 0.0])
    np.testing.assert_allclose(made.moved(0.5, 1.0), [-1.5, 1.0])
    np.testing.assert_allclose(made.face.offset(made.moved(0.0, 0.25)), -1.0 + 2.0)
    assert pickle.loads(pickle.dumps(made)) == made
    assert hash(made.path) == hash(replace(made).path)


def test_one_multiple_is_a_pair_of_equal_ones():
    one, pair = (tool(travel=(0.3, -0.7), path=((0, 0), (0.3, m), (1, 1))) for m in (0.9, (0.9, 0.9)))
    for begin, end in ((0.0, 0.17), (0.17, 0.61), (0.3, 1.0)):
        np.testing.assert_array_equal(one.moved(begin, end), pair.moved(begin, end))


@pytest.mark.parametrize(
    "path",
    [
        ((0.0, (0.0, 1.0)), (1.0, 1.0)),
        ((0.0, 0.0), (1.0, (1.0,))),
        ((0.0, 0.0), (1.0, (1.0, 1.0, 1.0))),
        ((0.0, 0.0), (1.0, (1.0, np.nan))),
        ((0.0, 0.0), (1.0, (1.0, "1"))),
        ((0.0, 0.0), (1.0, (1.0, True))),
        ((0.0, 0.0), (1.0, None)),
        ((0.0, 0.0), (1.0, ((0.0, 1.0), 1.0))),
        ((0.0, 0.0), ("1", (1.0, 1.0))),
        ((0.0, 0.0), ((1.0, 1.0), (1.0, 1.0))),
        ((0.0, 0.0), (0.5, (1.0, 0.0))),
        (((0.0, 0.0), 0.0), (1.0, 1.0)),
    ],
)
def test_a_path_of_other_points_is_refused(path):
    refused(lambda: tool(path=path), "tool.path")


def test_a_stretch_of_no_number_of_a_computer_is_refused():
    refused(lambda: tool(travel=(1e35, -0.1), path=((0, 0), (1, (1e30, 1)))), "a stretch of its path")


def test_a_run_is_recorded_described_and_read_back(tmp_path):
    asked = pressed_then_slid()
    schedule = Schedule(6, landings=(0.5,))
    with Recorder(tmp_path, asked, (INCREMENT, *energies("J", 1.0), OVERLAP), {"mu": MU}, {"length": "mm"}) as out:
        for accepted in march(asked, schedule, Control(Newton())):
            out.record(accepted)
    history = open_results(tmp_path)
    path = [[0.0, 0.0], [0.5, [0.0, 1.0]], [1.0, [1.0, 1.0]]]
    assert history.scene == json.loads(json.dumps(describe(asked)))
    assert history.scene["tools"][0]["path"] == path
    assert history.complete
    assert history.columns["friction_J"][-1] > history.columns["friction_J"][2] >= 0
    assert np.abs(history.columns["energy_error"]).max() < 0.1
    assert open_results(tmp_path).end.state.tau == 1.0
