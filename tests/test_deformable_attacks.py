"""What a run of two parts tells of their contact, beside equilibrium and integrals recomputed by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from bipot import (
    Accepted,
    Amplitude,
    Circle,
    Control,
    DeformableTool,
    Geometry,
    Newton,
    Prescribed,
    Recorder,
    Refused,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    block,
    march,
    results,
    together,
)
from bipot.checks import refusals
from bipot.iterate import Iterate
from bipot.results import columns
from bipot.system import system_of
from bipot.traction import tractions
from bipot.typing import Floats
from tests.deformable import ELASTIC, shifted, stack
from tests.scenes import refused


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


@pytest.mark.parametrize("geometry", [Geometry.PLANE_STRAIN, Geometry.AXISYMMETRIC])
def test_a_uniform_pressure_is_told_as_such_where_it_ends_within_edges(geometry: Geometry) -> None:
    """Forces int psi_p dA over what faces the other part, summed up over fine pieces of it."""
    flat, tool = _slid(0.0), DeformableTool(("up/base",), ("low/top",), 0.1)
    scene = replace(flat, geometry=geometry, tools=(tool,), supports=(*flat.supports, Support("low/left", 0)))
    candidates = system_of(scene).candidates
    x = scene.mesh.nodes[candidates.node]
    size = 100_000
    place = 0.3 + (np.arange(size) + 0.5) / size
    around = 2 * np.pi * place if scene.ring else np.ones(size)
    area = np.array([np.maximum(1 - np.abs(place - at) * 3.0, 0.0) @ around for at in x[:, 0]]) / size
    r = np.stack([area, 0.1 * area], axis=1)
    pressure, shear = tractions(candidates, scene.mesh.nodes, r, area > 0)
    np.testing.assert_allclose(pressure[area > 0], 1.0, rtol=1e-4)
    # Nothing slips on the axis.
    np.testing.assert_allclose(shear[area > 0], np.where(scene.ring & (x[area > 0, 0] == 0), 0.0, 0.1), rtol=1e-4)
    assert np.isnan(pressure[x[:, 0] > 1.7]).all()


def test_a_pressure_at_a_single_point_is_told() -> None:
    candidates = system_of(_slid(0.0)).candidates
    r = np.zeros((len(candidates.node), 2))
    r[2, 0] = 0.25
    pressure, _ = tractions(candidates, candidates.scene.mesh.nodes, r, r[:, 0] > 0)
    np.testing.assert_allclose(pressure[1:4], [0.0, 1.0, 0.0], atol=1e-12)


def _on_a_held_side(fine: int, coarse: int) -> Scene:
    """A block that is pressed onto candidates that supports hold."""
    mesh = together({"low": block(1.0, 1.0, fine, 1), "up": shifted(block(1.0, 1.0, coarse, 1), 0.0, 1.0)})
    held = *(Support(f"low/{side}", axis) for side in ("base", "top") for axis in range(2)), Support("up/top", 0)
    pressed, tool = Prescribed("up/top", 1, -0.01), DeformableTool(("up/base",), ("low/top",), 0.3)
    return Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, (*held, pressed), (tool,))


@pytest.mark.parametrize(("fine", "coarse", "named"), [(6, 2, 7), (2, 6, 0), (40, 10, 41), (40, 60, 0)])
def test_forces_on_more_held_points_than_the_other_side_has_nodes_are_not_determined(
    fine: int, coarse: int, named: int
) -> None:
    *_, last = march(_on_a_held_side(fine, coarse), Schedule(1), Control(Newton()))
    assert len(last.solved.undetermined) == named


def test_forces_on_sides_that_are_in_touch_twice_are_not_determined() -> None:
    scene = stack(mu=0.2)
    (tool,) = scene.tools
    assert isinstance(tool, DeformableTool)
    assert next(march(scene, Schedule(1), Control(Newton()))).unique
    twice = replace(scene, tools=(tool, DeformableTool(tool.candidates, tool.surface, tool.mu)))
    assert len(next(march(twice, Schedule(1), Control(Newton()))).solved.undetermined) == 10


@pytest.mark.parametrize(
    ("sides", "said", "advice"),
    [
        (
            ("low/top", "up/base"),
            r"sides of tools\[0\] overlap much beside their edges: node \d+ is in el",
            "finer side",
        ),
        (
            ("up/base", "low/top"),
            r"sides of tools\[0\] overlap much beside their edges: node \d+ is in el",
            "finer side",
        ),
        (("low/left", "up/right"), r"body goes through itself: node \d+ is in element", "surface and candidates"),
    ],
)
def test_a_corner_that_sinks_into_the_other_part_is_told_by_what_may_be_done(
    sides: tuple[str, str], said: str, advice: str
) -> None:
    scene = replace(_slid(0.0), tools=(DeformableTool(sides[:1], sides[1:], 0.1),))
    nodes = scene.mesh.nodes.copy()
    nodes[np.intersect1d(scene.mesh.boundary_nodes("up/base"), scene.mesh.boundary_nodes("up/left")), 1] -= 0.1
    iterate = SimpleNamespace(increment=SimpleNamespace(system=system_of(scene)), nodes=nodes)
    with pytest.raises(Refused, match=said) as refused:
        refusals._refuse_itself(cast(Iterate, iterate))
    assert advice in refused.value.advice


def test_names_that_two_parts_would_share_are_refused() -> None:
    """Of two boundaries of one name only the last was kept."""
    one = block(1.0, 1.0, 1, 1)
    named = replace(one, boundaries={"b/base": one.boundaries["base"]})
    refused(lambda: together({"a/b": one, "a": named}), "boundaries and regions of names")
    inside = replace(one, regions={"b": np.array([0])})
    refused(lambda: together({"a": inside, "a/b": one}), "boundaries and regions of names")


@pytest.mark.parametrize("away", [0.0, 100.0])
@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_parts_that_are_pressed_and_then_held_stay_as_they_are(mu: float, away: float) -> None:
    """Gaps at the start are those of places: in an increment without motion their round-off was work."""
    scene = stack(mu=mu)
    held = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)))
    supports = tuple(replace(s, amplitude=held) if isinstance(s, Prescribed) else s for s in scene.supports)
    scene = replace(scene, supports=supports, mesh=shifted(scene.mesh, away, away))
    _, pressed, *_, last = march(scene, Schedule(4), Control(Newton()))
    np.testing.assert_allclose(last.tool_forces, pressed.tool_forces, rtol=1e-6, atol=1e-4)
    assert last.passes <= 2
