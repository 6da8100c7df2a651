"""Scenes of several parts in the fuzz study: draws, views, what is faced, and planted errors."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import DeformableTool, Element
from bipot.tools.facing import facing
from studies.fuzz import parts_judge
from studies.fuzz.judge import Ran, run
from studies.fuzz.parts import View, draw_parts, views
from studies.fuzz.row import Outcome
from studies.independent.facing import seen
from tests.deformable import pressed, stack
from tests.scenes import with_course

SLIDING, WELDED = 51, 53
"""Seeds of a scene of two parts that slide, and of one whose parts are welded."""

EACH = 0, 1, 3, 4, 8, 22
"""Seeds of all elements, two parts and three, and a ring."""


def test_scenes_are_of_two_or_three_parts_and_are_always_the_same():
    scenes = [draw_parts(seed).scene for seed in EACH]
    assert {len(scene.tools) for scene in scenes} == {1, 2}
    assert {scene.mesh.element for scene in scenes} == {Element.T3, Element.T6, Element.Q4, Element.Q8, Element.Q9}
    assert any(scene.ring for scene in scenes)
    assert scenes[2] == draw_parts(EACH[2]).scene


@pytest.mark.parametrize("element", [Element.Q4, Element.T3, Element.T6, Element.Q8, Element.Q9])
def test_what_is_faced_is_what_the_library_faces_in_any_configuration(element):
    rng = np.random.default_rng(0)
    for scene in (pressed(element=element), stack(5, 3, element=element)):
        (tool,) = scene.tools
        assert isinstance(tool, DeformableTool)
        sides = tool.sides
        nodes = scene.mesh.nodes + rng.uniform(-0.02, 0.02, scene.mesh.nodes.shape) + np.array([0.1, 0.0])
        found = seen(scene.mesh.nodes, nodes, sides.one, sides.other, scene.ring)
        library = facing(nodes, sides, scene.ring)
        np.testing.assert_array_equal(found.node, sides.node)
        np.testing.assert_allclose(found.weights, library.weights.toarray(), atol=1e-13)
        np.testing.assert_allclose(found.normal, library.normal, atol=1e-13)


def test_views_come_back_to_the_scene():
    scene = draw_parts(SLIDING).scene
    for view in (*views(scene, 1), View("all", 10.0, 1e3, mirrored=True, angle=0.3, order=4)):
        there = view.of(scene)
        np.testing.assert_allclose(view.back(there.mesh.nodes) / view.length, scene.mesh.nodes, rtol=1e-9, atol=1e-12)
        boundary, same = there.mesh.boundary_nodes("low/top"), scene.mesh.boundary_nodes("low/top")
        np.testing.assert_array_equal(np.sort(view.numbers(len(scene.mesh.nodes))[boundary]), same)


def _found(ran):
    return parts_judge.wrong_in(ran, parts_judge.measured(ran))


def test_planted_errors_are_found():
    drawn = draw_parts(SLIDING)
    ran = run(drawn, drawn.scene)
    assert not ran.reason
    assert _found(ran) == []
    last, (tool,) = ran.steps[-1], ran.scene.tools
    less = replace(ran.scene, tools=(replace(tool, mu=0.99 * tool.mu),))
    assert any("law" in what for what in _found(Ran(less, ran.steps, "")))
    pushed = with_course(last, state=replace(last.state, forces=1.001 * last.state.forces))
    found = " ".join(_found(replace(ran, steps=[*ran.steps[:-1], pushed])))
    for what in ("equilibrium", "the force of tools[0] is told", "what acts on low is off balance", "energies off"):
        assert what in found
    upper, size = ran.scene.mesh.part == 1, ran.scene.mesh.size
    nodes = last.state.nodes - 1e-6 * size * upper[:, None] * np.eye(2)[-1]
    sunk = with_course(last, state=replace(last.state, nodes=nodes))
    assert "penetration" in " ".join(_found(replace(ran, steps=[*ran.steps[:-1], sunk])))


@pytest.mark.parametrize("seed", [pytest.param(2, marks=pytest.mark.slow), 20, 51])
def test_such_scenes_are_certified(seed):
    row = parts_judge.judge_parts(seed, others=seed == 20)
    assert row.outcome is Outcome.CERTIFIED, row.reason
    assert row.kind.split()[0] == "parts"


def test_parts_that_are_welded_are_certified():
    """They lie on each other along a line."""
    row = parts_judge.judge_parts(WELDED, others=False)
    assert "welded" in row.kind
    assert row.outcome is Outcome.CERTIFIED, row.reason
