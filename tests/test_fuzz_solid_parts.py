"""Scenes of several parts in space in the fuzz study: draws, what is faced, views, and planted errors."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import DeformableTool, Element
from bipot.tools.facing import facing, lowest
from studies.fuzz.judge import Ran, run
from studies.fuzz.row import Outcome
from studies.fuzz.solid_parts import draw_solid_parts
from studies.fuzz.solid_parts_judge import faults, judge_solid_parts
from studies.independent.solid_facing import seen
from tests.scenes import with_course
from tests.test_deformable_space import TURNS, pressed, stack

SLIDING = 19
"""Seed of a scene with friction, of two parts that slide."""

EACH = 0, 2, 3, 16
"""Seeds of all elements, and of two parts and three."""


def test_scenes_are_of_two_or_three_parts_and_are_always_the_same():
    scenes = [draw_solid_parts(seed).scene for seed in EACH]
    assert {len(scene.tools) for scene in scenes} == {1, 2}
    assert {scene.mesh.element for scene in scenes} == {Element.T4, Element.T10, Element.H8, Element.H20}
    assert scenes[2] == draw_solid_parts(EACH[2]).scene


@pytest.mark.parametrize(
    ("scene", "off"),
    [
        (stack(TURNS["turned"]), 1e-6),
        (stack(TURNS["turned"], element=Element.T4), 1e-14),
        (stack(TURNS["turned"], element=Element.T10), 1e-13),
        (stack(TURNS["turned"], element=Element.H20), 1e-5),
        (pressed(), 1e-8),
    ],
    ids=["bricks", "tetrahedra", "quadratic", "quadratic bricks", "folding"],
)
def test_what_is_faced_is_what_the_library_faces_in_any_configuration(scene, off):
    """To round-off where faces are triangles or parallelograms; else rules differ."""
    (tool,) = scene.tools
    assert isinstance(tool, DeformableTool)
    sides, rng = tool.sides, np.random.default_rng(0)
    for by, apart in ((0.0, 1e-14), (0.02, off)):
        nodes = scene.mesh.nodes + rng.uniform(-by, by, scene.mesh.nodes.shape)
        found, library = seen(scene.mesh.nodes, nodes, sides.one, sides.other), facing(nodes, sides, False)
        np.testing.assert_array_equal(found.node, sides.node)
        np.testing.assert_allclose(found.weights, library.weights.toarray(), atol=apart)
        np.testing.assert_allclose(found.normal, library.normal, atol=apart)
        np.testing.assert_allclose(found.lowest, lowest(nodes, sides.one, sides.other, False), atol=1e-14)


def test_planted_errors_are_found():
    drawn = draw_solid_parts(SLIDING)
    ran = run(drawn, drawn.scene)
    assert not ran.reason
    assert faults(ran)[0] == []
    last, (tool,) = ran.steps[-1], ran.scene.tools
    less = replace(ran.scene, tools=(replace(tool, mu=0.99 * tool.mu),))
    assert any("disc" in what for what in faults(Ran(less, ran.steps, ""))[0])
    pushed = with_course(last, state=replace(last.state, forces=1.001 * last.state.forces))
    found = " ".join(faults(replace(ran, steps=[*ran.steps[:-1], pushed]))[0])
    for what in ("equilibrium", "stated", "what acts on low is off balance", "energies"):
        assert what in found
    upper, size = ran.scene.mesh.part == 1, ran.scene.mesh.size
    nodes = last.state.nodes - 1e-6 * size * upper[:, None] * np.eye(3)[-1]
    sunk = with_course(last, state=replace(last.state, nodes=nodes))
    assert "penetration" in " ".join(faults(replace(ran, steps=[*ran.steps[:-1], sunk]))[0])


@pytest.mark.parametrize("seed", [1, pytest.param(20, marks=pytest.mark.slow)])
def test_such_scenes_are_certified(seed):
    row = judge_solid_parts(seed, others=seed == 20)
    assert row.outcome is Outcome.CERTIFIED, row.reason
    assert row.kind.startswith("solid parts")
