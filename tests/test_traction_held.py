"""Traction and status where a support holds the body along a tool that rubs it: no unknown knows, but results do."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Perfect,
    Recorder,
    Sampling,
    Scene,
    Schedule,
    Support,
    VonMises,
    block,
    brick,
    march,
    results,
)
from bipot.laws.coulomb import Status
from bipot.results.columns import INCREMENT

MU, SINKS, WAY = 0.2, 0.01, 0.05
STEEL = VonMises(Elasticity(1e4, 0.3), Perfect(400.0))


def held(sampling=Sampling.NODES, element=Element.Q4, way=WAY):
    """A block in whose top face no node may go along the tool, which presses and then goes ``way``."""
    tool = FlatTool(
        (0.0, 1.0), (0.0, -1.0), (way, -SINKS), ("top",), MU, ((0, 0), (0.5, (0, 1)), (1, (1, 1))), sampling=sampling
    )
    supports = (Support("base", 0), Support("base", 1), Support("top", 0))
    return Scene(block(2.0, 1.0, 4, 2, element=element), Geometry.PLANE_STRAIN, STEEL, supports, (tool,))


@pytest.mark.parametrize(
    ("sampling", "element"),
    [(Sampling.NODES, Element.Q4), (Sampling.NODES, Element.T6), (Sampling.WEIGHTED, Element.Q9)],
)
@pytest.mark.parametrize("way", [WAY, -WAY])
def test_a_node_that_a_support_holds_slips_and_has_the_shear_of_its_force(sampling, element, way):
    pressed, *_, last = march(held(sampling, element, way), Schedule(4))
    assert np.nanmax(np.abs(pressed.traction.recovered_shear)) == 0
    assert set(pressed.traction.status) == {Status.STICK}
    found = last.traction
    # The tangent (n_y, -n_x) is to the left below a tool, which takes the body along.
    np.testing.assert_allclose(found.recovered_shear, -np.sign(way) * MU * found.recovered_pressure, rtol=1e-12)
    assert set(found.status) == {Status.SLIP}
    np.testing.assert_allclose(last.tool_force(0)[0], np.sign(way) * MU * -last.tool_force(0)[1], rtol=1e-12)


def test_the_cap_of_constant_shear_acts_there_too():
    scene = held()
    capped = replace(scene, tools=(replace(scene.tools[0], mu=np.inf, shear=0.1),))
    *_, last = march(capped, Schedule(4))
    k = 400.0 / np.sqrt(3)
    np.testing.assert_allclose(last.traction.recovered_shear, -0.1 * k, rtol=0.02)
    assert set(last.traction.status) == {Status.SLIP}


def test_in_space_the_length_of_the_shear_is_that_of_both_tangents():
    tool = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.03, 0.04, -SINKS), ("top",), MU)
    sideways = (Support(face, axis) for face in ("base", "top") for axis in (0, 1))
    supports = (*sideways, Support("base", 2))
    *_, last = march(Scene(brick(2.0, 2.0, 1.0, 2, 2, 1), Geometry.SOLID, STEEL, supports, (tool,)), Schedule(2))
    found = last.traction
    np.testing.assert_allclose(found.recovered_shear, MU * found.recovered_pressure, rtol=1e-12)
    assert set(found.status) == {Status.SLIP}


def test_a_run_that_goes_on_elsewhere_begins_with_the_forces_that_it_had(tmp_path):
    """The friction between tool and support is no part of a state: step 0 has that of the increment that led there."""
    scene = held()
    with Recorder(tmp_path / "whole", scene, (INCREMENT,), {}, {}) as recorder:
        for accepted in march(scene, Schedule(4)):
            recorder.record(accepted)
    whole = results.open(tmp_path / "whole")
    with Recorder(tmp_path / "rest", scene, (INCREMENT,), {}, {}, start=whole.course(2)) as recorder:
        for accepted in march(scene, Schedule(4), start=recorder.start):
            recorder.record(accepted)
    rest = results.open(tmp_path / "rest")
    begun, there = rest.at(rest.times[0], by="tau"), whole.snapshot(2)
    assert np.abs(there.nodal("contact_force_x")).max() > 1.0
    np.testing.assert_array_equal(begun.nodal("contact_force"), there.nodal("contact_force"))
