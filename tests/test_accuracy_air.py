"""Increments by accuracy of a tool that begins off the body: what it goes through the air strains nothing."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from bipot import handed_on
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule, march
from bipot.meshes.sections import block, cylinder
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.tool import FlatTool
from bipot.yielding import is_past_yield, through_air
from studies.accuracy.paced import CONTROL

ACCURACY, PRESSED = 1e-4, 0.1
MATERIAL = VonMises(Elasticity(210_000.0, 0.3), Linear(300.0, 300.0))


def pressed(gap: float, mu: float = 0.3) -> Scene:
    """A cylinder beneath a tool that begins by the ``gap`` above it."""
    tool = FlatTool((0.0, 1.0 + gap), (0.0, -1.0), (0.0, -PRESSED - gap), ("top",), mu)
    held = Symmetry("base", 1), Support("axis", 0)
    return Scene(cylinder(1.0, 1.0, 4, 4), Geometry.AXISYMMETRIC, MATERIAL, held, (tool,))


def sinks(gap: float, count: int = 3) -> np.ndarray:
    """How far the tool is in the body at the ends of increments."""
    steps = islice(march(pressed(gap), Schedule(accuracy=ACCURACY), CONTROL), count)
    return np.array([step.state.tau * (PRESSED + gap) - gap for step in steps])


def test_a_tool_that_comes_through_the_air_presses_in_the_increments_of_one_that_touches():
    """The way was counted as strain: yielding began in an increment judged as past it, off by 9 times the accuracy."""
    np.testing.assert_allclose(sinks(0.05), sinks(0.0), rtol=1e-3)


def test_the_half_of_a_first_increment_is_that_of_what_strains_the_body():
    gap = 0.013
    step = next(march(pressed(gap), Schedule(accuracy=ACCURACY), CONTROL))
    increment = step.solved.iterate.increment
    assert increment.in_halves
    touched = through_air(increment)
    assert touched == pytest.approx(gap / (PRESSED + gap))
    parts = (*np.linspace(0.0, touched, 2)[1:], *np.linspace(touched, step.state.tau, 33)[1:])
    fine = list(islice(march(pressed(gap), Schedule(1, landings=tuple(map(float, parts))), CONTROL), len(parts)))
    assert step.tool_force(0)[1] == pytest.approx(fine[-1].tool_force(0)[1], rel=ACCURACY)


def test_a_body_that_another_march_has_left_is_not_where_its_mesh_is():
    """It bulges beyond the mesh, up to the next tool, which has gone through no air."""
    held = Symmetry("base", 1), Symmetry("left", 0)
    path = (0.0, 0.0), (0.9, 1.0), (1.0, 0.8)
    down = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.2), ("top",), 0.0, path)
    scene = Scene(block(1.0, 1.0, 2, 2), Geometry.PLANE_STRAIN, MATERIAL, held, (down,))
    *_, last = march(scene, Schedule(10), CONTROL)
    aside = FlatTool((float(last.state.nodes[:, 0].max()), 0.0), (-1.0, 0.0), (-0.2, 0.0), ("right",), 0.0)
    scene = replace(scene, tools=(aside,))
    steps = list(march(scene, Schedule(5), CONTROL, handed_on(last.state, scene)))
    assert all(is_past_yield(step.solved.iterate.increment) for step in steps)
