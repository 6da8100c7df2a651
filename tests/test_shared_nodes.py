"""Fields of a node that two tools share: those of the tool with the larger normal force, or of the nearer one."""

import numpy as np
import pytest

from bipot import Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Support, VonMises, block, march
from bipot.laws.coulomb import Status
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT

STEEL = VonMises(Elasticity(1e4, 0.3), Perfect(1e3))
HELD = (Support("base", 0), Support("base", 1))
AT = {"mesh": block(2.0, 1.0, 4, 2), "geometry": Geometry.PLANE_STRAIN, "material": STEEL, "supports": HELD}


def above(height, travel, **own):
    """A flat tool at this height over the base."""
    return FlatTool((0.0, height), (0.0, -1.0), (0.0, travel), ("top",), **own)


def last_step(folder, tools):
    """The last step of their run."""
    scene = Scene(**AT, tools=tools)
    with Recorder(folder, scene, (INCREMENT,), {}, {}) as recorder:
        for accepted in march(scene, Schedule(2)):
            recorder.record(accepted)
    return scene.mesh.boundary_nodes("top"), open_results(folder).snapshot()


@pytest.mark.parametrize("turned", [1, -1], ids=["the nearer first", "the nearer last"])
def test_the_gap_of_a_node_that_neither_touches_is_that_to_the_nearer_tool(tmp_path, turned):
    tools = (above(1.3, -0.1, mu=0.1), above(1.5, -0.1, mu=0.1))[::turned]
    top, step = last_step(tmp_path, tools)
    np.testing.assert_allclose(step.nodal("gap")[top], 0.2, rtol=1e-12)


@pytest.mark.parametrize("turned", [1, -1], ids=["the weld first", "the weld last"])
def test_a_weld_that_pulls_is_not_hidden_by_a_tool_that_is_open(tmp_path, turned):
    weld, beside = above(1.0, 0.02, mu=np.inf), above(1.3, 0.0, mu=0.1)
    top, step = last_step(tmp_path, (weld, beside)[::turned])
    assert step.nodal("contact_force_y")[top].min() > 1.0
    assert set(step.nodal("status")[top]) == {Status.STICK}
    np.testing.assert_allclose(step.nodal("gap")[top], 0.0, atol=1e-12)
