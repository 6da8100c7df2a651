"""What a run of two parts tells of their contact, beside equilibrium and integrals recomputed by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Accepted,
    Circle,
    Control,
    DeformableTool,
    Geometry,
    Newton,
    Prescribed,
    Recorder,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    block,
    march,
    results,
    together,
)
from bipot.results import columns
from bipot.typing import Floats
from tests.deformable import ELASTIC, shifted


def _slid(by: float, mu: float = 0.3) -> Scene:
    """A block that is pressed onto a longer one and slides along it."""
    mesh = together({"low": block(3.0, 1.0, 9, 3), "up": shifted(block(1.0, 1.0, 4, 3), 0.3, 1.0)})
    held = Support("low/base", 0), Support("low/base", 1), Prescribed("up/top", 0, by), Prescribed("up/top", 1, -0.02)
    return Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, held, (DeformableTool(("low/top",), ("up/base",), mu),))


def _unbalanced(accepted: Accepted) -> Floats:
    """Forces (a, d) of the stress on nodes, less those of supports: what contact is to bear."""
    iterate = accepted.solved.iterate
    return iterate.increment.system.body.space.nodal(iterate.response.element_forces) - accepted.reactions


@pytest.mark.parametrize("rolled", [False, True], ids=["flat", "roll"])
def test_recorded_contact_forces_are_those_on_both_sides_where_they_are_now(tmp_path, rolled: bool) -> None:
    scene = _slid(0.8)
    if rolled:
        # At curved tools the nodes of each mean count one by one, and how many these are changes with the sliding.
        roll = ShapedTool(Circle((0.5, -1.0), 0.5), (0.0, 0.0), ("low/left",), 0.1)
        scene = replace(scene, tools=(*scene.tools, roll))
    resting = []
    with Recorder(tmp_path / "run", scene, (columns.INCREMENT,), {}, {}) as recorder:
        for accepted in march(scene, Schedule(4), Control(Newton())):
            recorder.record(accepted)
            resting.append(_unbalanced(accepted))
    run = results.open(tmp_path / "run")
    for number, forces in enumerate(resting):
        told = run.snapshot(number).nodal("contact_force")[:, :2]
        np.testing.assert_allclose(told, forces, atol=1e-5 * np.abs(forces).max())
