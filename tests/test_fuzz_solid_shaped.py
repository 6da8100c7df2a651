"""Bodies in space under shaped tools in the fuzz study: errors planted in accepted increments are found, none else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from bipot.fem.reduction import Geometry
from bipot.marching import Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.profiles import Profile, Union
from bipot.tools.revolved import Revolved, cone, roll, sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import Sampling, ShapedTool
from studies.fuzz import solid_measures as fuzz_measures
from studies.fuzz.judge import Ran
from studies.fuzz.row import Outcome, first
from studies.fuzz.solid import LIMITS, broken, disagreement, faults, judge_solid_shaped
from studies.fuzz.solid_contacts import touching
from studies.fuzz.solid_measures import SolidMeasures
from studies.fuzz.solid_shaped import draw_solid_shaped
from studies.fuzz.solid_surfaces import cut, faces
from studies.fuzz.solid_turned import Turned
from studies.fuzz.solid_unfolded import unfolded
from studies.fuzz.solid_variants import turned
from studies.independent.revolved import nearest
from studies.independent.solid_tools import about, arc, carried_to
from tests.curved import STEEL
from tests.scenes import with_course
from tests.solids import turned as rotation

CERTIFIED = (22,)
"""Seeds of bodies that take little time: a brick under a roll that turns, its friction capped."""

AXIS = (0.0, 1.0, 0.0)
PRESSED, SLID = 300.0, 60.0
GOES = ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (1.0, 1.0))
SURFACES = {
    "ball": sphere((0.4, 0.55, 1.9), 0.9),
    "hollow": sphere((0.5, 0.5, -1.5), 2.6, concave=True),
    "roll": roll((0.4, 0.0, 1.8), AXIS, 0.8),
    "cone": cone((0.45, 0.55, 0.95), (0.0, 0.0, 1.0), 70.0, 4.0, 0.5),
    "ring": Revolved(Circle((1.0, 0.0), 0.6), (0.4, 0.5, 1.6), (0.0, 0.0, 1.0)),
    "barrel": Revolved(Profile(((0.9, 2.0), (0.8, 0.3), (0.7, -0.4), (1.0, -2.0)), 0.2), (0.4, 0.5, 1.8), AXIS),
    "two": Union((sphere((0.1, 0.5, 1.8), 0.8), roll((0.9, 0.0, 1.8), AXIS, 0.8))),
    "lid": Plane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)),
}


def under(surface: Any, element: Element = Element.H8, **given: Any) -> Scene:
    """A brick that stands on its base, under a tool that presses and then goes aside."""
    defaults: dict[str, Any] = {"travel": (0.03, 0.02, -0.06), "candidates": ("top",), "mu": 0.3, "path": GOES}
    return Scene(
        brick(1.0, 1.0, 1.0, 2, 2, 1, element=element),
        Geometry.SOLID,
        STEEL,
        tuple(Support("base", axis) for axis in range(3)),
        (ShapedTool(surface, **(defaults | given)),),
    )


def ran(scene: Scene, increments: int) -> Ran:
    return Ran(scene, list(march(scene, Schedule(increments))), "")


@cache
def rolled() -> Ran:
    """Under a roll that turns as it goes, its friction capped."""
    return ran(under(SURFACES["roll"], shear=0.6, turn=Turn(0.05, (0.4, 0.0, 1.8), axis=AXIS)), 3)


@cache
def led() -> Ran:
    """Weighted contact with a bowl that a force presses and a moment rolls."""
    turn = Turn(0.0, (0.5, 0.5, -1.5), driven_by=Moment(SLID), axis=AXIS)
    tool: dict[str, Any] = {"travel": (0.0, 0.02, 0.0), "driven_by": Force((0.0, 0.0, -PRESSED)), "turn": turn}
    return ran(under(SURFACES["hollow"], Element.H20, sampling=Sampling.WEIGHTED, shear=0.9, **tool), 2)


RUNS = {"rolled": rolled, "led": led}


def planted(run: Ran, **changes: Any) -> Ran:
    """The run with another state at its end."""
    last = run.steps[-1]
    return replace(run, steps=[*run.steps[:-1], with_course(last, state=replace(last.state, **changes))])


def seen_otherwise(run: Ran, **changes: Any) -> Ran:
    """The run as if its tool had been another."""
    return replace(run, scene=replace(run.scene, tools=(replace(run.scene.tools[0], **changes),)))


def said(run: Ran) -> str:
    """What is said of the last increment."""
    return " ".join(broken(last_measured(run), exact=True))


def last_measured(run: Ran) -> SolidMeasures:
    """The measures of the last increment."""
    before, last = run.steps[-2:]
    stated = before.energies
    energies = np.array([stated.work, stated.elastic, stated.plastic, stated.friction])
    largest = max(float(np.abs(step.state.forces).max()) for step in run.steps)
    return fuzz_measures.measure(run.scene, last, largest, float(np.abs(energies).max()), energies)


@pytest.mark.parametrize("seed", CERTIFIED)
def test_a_drawn_body_is_judged(seed):
    row = judge_solid_shaped(seed, others=False)
    assert row.outcome is Outcome.CERTIFIED
    assert row.increments >= 2
    assert first(row.kind) == "solid shaped"
    assert draw_solid_shaped(seed).scene.tools == draw_solid_shaped(seed).scene.tools


@pytest.mark.parametrize("name", SURFACES)
def test_gaps_normals_and_their_gradients_are_those_of_the_tool(name):
    surface, x = SURFACES[name], np.random.default_rng(2).uniform(-0.5, 1.5, (200, 3))
    own, known = nearest(faces(surface), x), surface.distance(x)
    np.testing.assert_allclose(own.gap, known.gap, atol=1e-13)
    np.testing.assert_allclose(own.normal, known.normal, atol=1e-12)
    np.testing.assert_allclose(own.gradient, known.curvature, atol=1e-10)


def test_slips_are_the_shortest_ways_on_balls_and_rolls_however_long():
    rng = np.random.default_rng(5)
    begun, by = rng.normal(size=(2, 50, 3)) * (3.0, 1.0, 3.0)
    for surface, rises in ((sphere((0.0, 0.0, 0.0), 2.0), 0.0), (roll((0.0, 0.0, 0.0), AXIS, 2.0), 1.0)):
        one, other = nearest(faces(surface), begun), nearest(faces(surface), begun + by)
        slip, alpha = arc(one, other, by)
        np.testing.assert_allclose(np.linalg.norm(slip, axis=1), np.hypot(2.0 * alpha, rises * by[:, 1]), rtol=1e-11)
        np.testing.assert_allclose(np.vecdot(slip, other.normal), 0.0, atol=1e-12)


def test_frames_are_carried_by_the_shortest_rotation():
    frames, normal = np.eye(3)[None], np.array([[0.8, 0.0, 0.6]])
    Q = about(np.array([0.0, -1.0, 0.0]), np.arccos(0.8))
    np.testing.assert_allclose(carried_to(frames, normal)[0], frames[0] @ Q.T, atol=1e-15)


@pytest.mark.parametrize("run", RUNS)
def test_what_is_right_passes_and_energies_and_slips_are_the_library_s(run):
    right = RUNS[run]()
    wrong, found = faults(right, exact=True)
    assert wrong == []
    assert max(m.energies for m in found) < 1e-10
    last = right.steps[-1]
    iterate, own = last.solved.iterate, touching(right.scene, last)
    np.testing.assert_allclose(own.slip, iterate.motion[:, 1:], atol=1e-13)
    candidates, nodes = iterate.increment.system.candidates, right.scene.mesh.nodes
    nodal = candidates.met.nodal(candidates.vectors(last.state.forces, iterate.frames))
    np.testing.assert_allclose(own.on_nodes(own.vectors(last.state.forces), len(nodes)), nodal, atol=1e-10)
    np.testing.assert_allclose(own.cap, iterate.rows.cap, rtol=1e-12)
    assert (np.linalg.norm(own.slip, axis=1) > 1e-4)[last.state.forces[:, 0] > 0].any()


def lower(run: Ran, by: float) -> Ran:
    """The run as if its tool were lower by so much."""
    return seen_otherwise(run, surface=Turned(np.eye(3), np.array([0.0, 0.0, -by])).surface(run.scene.tools[0].face))


ERRORS: dict[str, Callable[[Ran], Ran]] = {
    "equilibrium": lambda run: planted(run, forces=run.steps[-1].state.forces * (1 + 1e-4)),
    "disc": lambda run: planted(run, forces=run.steps[-1].state.forces * (1.0, 1.01, 1.0)),
    "penetration": lambda run: lower(run, 1e-5),
    "placed": lambda run: planted(run, nodes=run.steps[-1].state.nodes + 1e-9),
}


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize("name", ERRORS)
def test_planted_errors_are_found(name, run):
    assert getattr(last_measured(ERRORS[name](RUNS[run]())), name) > LIMITS[name]


def test_a_tool_between_nodes_is_found():
    assert "between" in said(seen_otherwise(rolled(), travel=(0.03, 0.02, -0.4)))


def test_a_tool_that_turns_otherwise_than_stated_is_found():
    turn = rolled().scene.tools[0].turn
    assert turn is not None
    assert "disc" in said(seen_otherwise(rolled(), turn=None))
    for other in (replace(turn, angle=turn.angle * (1 + 1e-4)), replace(turn, centre=(0.4, 0.0, 1.8 + 1e-4))):
        assert "energies" in said(seen_otherwise(rolled(), turn=other))
    assert "stated" in said(seen_otherwise(rolled(), turn=replace(turn, centre=(0.4, 0.0, 1.8 + 1e-6))))


def test_forces_and_moments_that_are_not_those_that_drive_a_tool_are_found():
    tool = led().scene.tools[0]
    assert tool.turn is not None
    assert tool.driven_by is not None
    assert tool.turn.driven_by is not None
    pushed, moment = (
        replace(tool.driven_by, vector=(0.0, 0.0, -1.001 * PRESSED)),
        replace(tool.turn.driven_by, value=1.001 * SLID),
    )
    assert "stated" in said(seen_otherwise(led(), driven_by=pushed))
    assert "stated" in said(seen_otherwise(led(), turn=replace(tool.turn, driven_by=moment)))
    state = led().steps[-1].state
    assert {"penetration", "placed", "stated"} <= set(
        said(planted(led(), translation=state.translation * 1.0001)).split()
    )


@pytest.mark.parametrize("run", RUNS)
def test_frames_and_slips_that_are_those_of_another_place_are_found(run, monkeypatch):
    right, whole = RUNS[run](), fuzz_measures.touching

    def off(**changed):
        def touching(scene, accepted):
            c = whole(scene, accepted)
            return replace(c, **{name: getattr(c, name) + by for name, by in changed.items()})

        monkeypatch.setattr(fuzz_measures, "touching", touching)
        return said(right)

    assert "equilibrium" in off(frames=1e-4 * np.eye(3)[[1, 2, 0]])
    assert "energies" in off(slip=np.array([1e-7, 0.0]))
    assert "energies" in off(motion=np.array([0.0, 0.0, 1e-7]))


def test_forces_past_an_open_end_are_found(monkeypatch):
    whole = fuzz_measures.touching

    def past(scene, accepted):
        return replace(c := whole(scene, accepted), past=np.ones(len(c.node), dtype=bool))

    monkeypatch.setattr(fuzz_measures, "touching", past)
    assert "past" in said(rolled())


def test_tools_turned_mirrored_and_in_other_units_are_the_same_to_who_is_turned_likewise():
    rng = np.random.default_rng(3)
    x, Q = rng.uniform(-0.5, 1.5, (50, 3)), rotation((1.0, -2.0, 3.0), 0.8)
    turn = Turn(0.3, (0.2, 0.4, 1.1), axis=(0.6, 0.0, 0.8))
    for surface in SURFACES.values():
        for matrix in (Q, -Q):
            seen = Turned(matrix, np.array([0.3, -0.2, 0.1]), 7.0)
            tool = under(surface, turn=turn).tools[0]
            other, at = seen.tool(tool), (x @ matrix.T + seen.shift) * 7.0
            pose = np.append(np.zeros(3), 0.3 * np.array(turn.axis))
            assert other.turn is not None
            assert other.turn.axis is not None
            angles = np.append(np.zeros(3), other.turn.angle * np.array(other.turn.axis))
            np.testing.assert_allclose(other.distance(at, angles), 7 * tool.distance(x, pose), atol=1e-12)


def test_what_is_cut_is_its_own_mirror_image():
    x, y = np.eye(3)[:2]
    assert cut(under(SURFACES["ball"]).tools[0], x, 0.4)
    assert not cut(under(SURFACES["ball"]).tools[0], x, 0.41)
    assert cut(under(SURFACES["roll"]).tools[0], y, 0.3)
    assert not cut(under(SURFACES["two"]).tools[0], x, 0.5)
    assert cut(under(SURFACES["barrel"]).tools[0], x, 0.4)
    assert not cut(under(SURFACES["barrel"]).tools[0], y, 0.5)


@pytest.mark.slow
def test_a_ball_in_two_planes_of_symmetry_is_that_of_the_whole_body_and_of_the_body_turned():
    symmetric = Symmetry("left", 0), Symmetry("front", 1), Support("base", 2)
    scene = replace(under(sphere((0.0, 0.0, 1.9), 0.9), travel=(0.0, 0.0, -0.06)), supports=symmetric)
    base = ran(scene, 1)
    assert faults(base, exact=True)[0] == []
    for seen in (unfolded(scene, symmetric[0]), turned(scene, rotation((1.0, -2.0, 3.0), 0.8))):
        other = ran(seen.scene, 1)
        assert faults(other, exact=True)[0] == []
        assert disagreement(base, other, seen, 0.0) < 1e-5
        assert disagreement(planted(base, forces=1.001 * base.steps[-1].state.forces), other, seen, 0.0) > 1e-4
