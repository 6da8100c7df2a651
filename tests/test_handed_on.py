"""A body that tools have left goes on under other ones as it would in one scene of them all."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Circle,
    Configuration,
    Control,
    Elasticity,
    Element,
    Existing,
    FlatTool,
    Force,
    Geometry,
    Integration,
    Linear,
    Newton,
    Recorder,
    ResultsError,
    Scene,
    Schedule,
    ShapedTool,
    Symmetry,
    Traction,
    VonMises,
    block,
    handed_on,
    march,
    upsetting,
)
from bipot.results import columns
from tests.scenes import refused

RAMP = (0.0, 0.0), (1.0, 1.0)
DOWN_AND_UP = (0.0, 0.0), (0.5, 1.0), (1.0, -2.0)
EULER = Control(Newton(), integration=Integration.BACKWARD_EULER)


def pressed(*tools):
    """A quarter of a bar, yielding at 0.1 % of strain."""
    return Scene(
        mesh=block(2.0, 1.0, 3, 2, element=Element.Q4),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(1e5, 0.3), Linear(100.0, 500.0)),
        supports=(Symmetry("left", 0), Symmetry("base", 1)),
        tools=tools,
    )


def lid(*path):
    return FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.03), ("top",), 0.2, path or RAMP)


def wall(*path):
    return FlatTool((2.1, 0.0), (-1.0, 0.0), (-0.15, 0.0), ("right",), 0.1, path or RAMP)


def first_state():
    *_, last = march(pressed(lid(*DOWN_AND_UP)), Schedule(6), EULER)
    return last.state


def test_two_scenes_one_after_the_other_are_one_scene_of_both_tools():
    down = (0.0, 0.0), (0.25, 1.0), (0.5, -2.0), (1.0, -2.0)
    together = list(march(pressed(lid(*down), wall((0.0, 0.0), (0.5, 0.0), (1.0, 1.0))), Schedule(12), EULER))
    second = pressed(wall())
    after = list(march(second, Schedule(6), EULER, start=handed_on(first_state(), second)))
    assert len(after) == 6
    forces = [step.tool_force(0)[0] for step in after]
    assert min(forces) < -300.0
    np.testing.assert_allclose(forces, [step.tool_force(1)[0] for step in together[6:]], rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(after[-1].state.nodes, together[-1].state.nodes, atol=1e-10)
    np.testing.assert_allclose(after[-1].state.peeq, together[-1].state.peeq, atol=1e-10)


def test_tools_that_forces_drive_begin_where_they_are_at_rest():
    """A force presses the wall that has 0.1 to go as far as the path that needs it does."""
    by_path = pressed(wall())
    *_, step = march(by_path, Schedule(6), EULER, start=handed_on(first_state(), by_path))
    driven = replace(wall(), travel=(0.0, 0.0), driven_by=Force((float(step.tool_force(0)[0]), 0.0)))
    by_force = pressed(driven)
    *_, end = march(by_force, Schedule(6), EULER, start=handed_on(first_state(), by_force))
    np.testing.assert_allclose(np.abs(end.state.translation), [0.15], rtol=0.01)


@pytest.mark.parametrize(
    ("state", "scene", "words"),
    [
        (
            lambda: next(march(pressed(lid()), Schedule(1))).state,
            pressed(wall()),
            r"state.forces = .*: must be zero: lift",
        ),
        (first_state, upsetting(mu=0.1, elements=2), r"state.nodes = 'of shape \(12, 2\)': must be of shape \(21, 2\)"),
        (
            first_state,
            pressed(replace(wall(), point=(1.9, 0.0))),
            r"tools\[0\]: must be off the body, not 0.1.* in it: let its way begin farther off",
        ),
        (
            first_state,
            pressed(ShapedTool(Circle((2.04, 0.25), 0.03), (1.0, 0.0), ("right",), 0.1)),
            r"tools\[0\] = Circle.*: must be off the body: a part of it is behind nodes 9 and 10",
        ),
        (
            first_state,
            pressed(ShapedTool(Circle((-2.3, 0.5), 0.27), (-1.0, 0.0), ("right",), 0.1)),
            r"tools\[0\] = .*: must be such that its mirror image beyond x_0 = 0 is off the body, not 0.0.* in it",
        ),
        (
            lambda: replace(first_state(), stress=np.zeros((6, 9, 4))),
            pressed(wall()),
            r"state.stress = 'of shape \(6, 9, 4\)': must be of shape \(6, 4, 4\), as in the scene",
        ),
        (
            lambda: replace(first_state(), du=np.zeros((11, 2))),
            pressed(wall()),
            r"state.du = 'of shape \(11, 2\)': must be of shape \(12, 2\), as in the scene",
        ),
        (
            lambda: replace(first_state(), peeq=np.full((6, 4), np.nan)),
            pressed(wall()),
            "state.peeq = 'NaN or infinite': must be finite",
        ),
        (lambda: None, pressed(wall()), "state = None: must be a State"),
        (first_state, None, "scene = None: must be a Scene"),
    ],
    ids=[
        "pressed",
        "another mesh",
        "in the body",
        "between nodes",
        "mirrored",
        "points",
        "motion",
        "unknown",
        "no state",
        "no scene",
    ],
)
def test_what_cannot_go_on_is_refused(state, scene, words):
    refused(lambda: handed_on(state(), scene), words)


def test_a_body_in_other_units_is_refused():
    """Nodes in metres were the start of a scene in millimetres, whose wall then never reached the body."""
    state, scene = first_state(), pressed(wall())
    small = replace(state, nodes=1e-3 * state.nodes, du=1e-3 * state.du)
    words = "start.nodes = 'positions': must be of the mesh's volume under the stress, not 1e-06 times that"
    refused(lambda: march(scene, Schedule(6), EULER, start=handed_on(small, scene)), words)


MIDPOINT, PAPER, SMALL = Configuration.MIDPOINT, Configuration.PAPER, Configuration.SMALL


@pytest.mark.parametrize("tools", [(), (wall(),)], ids=["alone", "walled"])
@pytest.mark.parametrize(
    ("left", "onto", "words"),
    [
        (MIDPOINT, SMALL, "'small': .*: the stress is in balance on the state's nodes, not on the mesh at rest"),
        (PAPER, SMALL, "'small': .*: the stress is in balance on the state's nodes, not on the mesh at rest"),
        (SMALL, MIDPOINT, "'midpoint': .*: the stress is in balance on the mesh at rest, not on the state's nodes"),
        (SMALL, PAPER, "'paper': .*: the stress is in balance on the mesh at rest, not on the state's nodes"),
        (SMALL, SMALL, ""),
        (MIDPOINT, PAPER, ""),
        (PAPER, MIDPOINT, ""),
    ],
    ids=lambda value: value.value if isinstance(value, Configuration) else "",
)
def test_balance_on_other_places_is_refused_at_once(left, onto, words, tools):
    """The march called it loads that were taken off; alone, the body sprang to a balance that it never had."""
    *_, last = march(replace(pressed(lid(*DOWN_AND_UP)), configuration=left), Schedule(6), EULER)
    scene = replace(pressed(*tools), configuration=onto)
    if words:
        refused(lambda: handed_on(last.state, scene), f"scene.configuration = {words}")
    else:
        assert len(list(march(scene, Schedule(2), EULER, start=handed_on(last.state, scene)))) == 2


def test_a_body_under_loads_springs_back_without_tools_and_then_goes_on():
    """The load left on was called contact forces of another scene."""
    loaded = replace(pressed(), loads=(Traction("top", (0.0, -100.0)),))
    *_, last = march(loaded, Schedule(6), EULER)
    far = pressed(wall((0.0, 0.0), (1.0, 1.5)))
    words = "start.forces = 'contact forces': must be in balance .*: begin with the loads and supports that"
    refused(lambda: march(far, Schedule(1), EULER, start=handed_on(last.state, far)), words)
    state = handed_on(next(march(pressed(), Schedule(1), EULER, start=handed_on(last.state, pressed()))).state, far)
    assert np.abs(state.stress).max() < 1e-3 * np.abs(last.state.stress).max()
    *_, end = march(far, Schedule(6), EULER, start=state)
    assert end.tool_force(0)[0] < -100.0


def test_a_run_that_another_body_began_is_not_gone_on_with(tmp_path):
    """Its scene, parameters and columns are the same; it would pass for the run of the body that is given."""
    second, first = pressed(wall()), first_state()
    one = handed_on(first, second)
    other = replace(one, peeq=one.peeq * (1 + 1e-6))

    def recorder(start):
        return Recorder(tmp_path, second, (columns.INCREMENT,), {}, {}, existing=Existing.RESUME, start=start)

    with recorder(one) as begun:
        begun.record(next(march(second, Schedule(6), EULER, begun.start)))
    with pytest.raises(ResultsError, match=f"{tmp_path}: holds a run that began at another state than start"):
        recorder(other)
    for same in (one, None):
        assert recorder(same).existing is Existing.RESUME
        with recorder(same) as resumed:
            assert resumed.start.number == 1
