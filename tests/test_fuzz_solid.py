"""Bodies in space in the fuzz study: its own mechanics finds planted errors, and its variants are the scene."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import (
    Control,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Newton,
    Perfect,
    Prescribed,
    Scene,
    Schedule,
    Symmetry,
    VonMises,
    march,
)
from bipot.certificate import Bounds
from bipot.increment import Limits
from bipot.meshes.solids import brick
from bipot.state import State
from studies.fuzz.judge import Ran, run
from studies.fuzz.row import Outcome
from studies.fuzz.scenes import Drawn
from studies.fuzz.solid import LIMITS, disagreement, faults, judge_solid, measured
from studies.fuzz.solid_contacts import framed
from studies.fuzz.solid_scenes import draw_solid
from studies.fuzz.solid_touching import projected
from studies.fuzz.solid_unfolded import unfolded
from studies.fuzz.solid_variants import symmetries, turned, variants
from studies.independent.solid import face_forces, orientation, places, rotation
from tests.scenes import with_course
from tests.solids import curved

SEED = 227
"""A brick of which friction slides and whose answer is unique."""


@cache
def drawn() -> tuple[Drawn, Ran]:
    """The scene and its run."""
    found = draw_solid(SEED)
    return found, run(found, found.scene)


def planted(**changes) -> Ran:
    """The run with another state at its end."""
    _, ran = drawn()
    last = ran.steps[-1]
    return replace(ran, steps=[*ran.steps[:-1], with_course(last, state=replace(last.state, **changes))])


def end() -> State:
    """That of the run."""
    return drawn()[1].steps[-1].state


def size() -> float:
    """Of the body."""
    return float(np.ptp(end().nodes))


def test_a_body_in_space_is_judged_with_its_variants():
    row = judge_solid(8)
    assert row.outcome is Outcome.CERTIFIED
    assert row.increments >= 2
    assert row.worst_disagreement < 1e-5


def test_forces_of_round_off_beside_a_stress_are_not_judged_by_the_law():
    """A pressure on a side strains the body; its contacts carry 1e-15, which the library says is below resolution."""
    assert judge_solid(950035, others=False).outcome is Outcome.CERTIFIED


def test_what_is_right_is_passed_and_round_off_is_all_that_energies_miss():
    wrong, found = faults(drawn()[1], exact=True)
    assert wrong == []
    assert max(m.energies for m in found) < 1e-10


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("equilibrium", lambda: {"stress": end().stress * (1 + 1e-4)}),
        ("elastic", lambda: {"stress": end().stress * (1 + 1e-4)}),
        ("disc", lambda: {"forces": end().forces * (1, 1.001, 1)}),
        (
            "penetration",
            lambda: {"nodes": end().nodes * (1, 1, 1 + 1e-6), "gap": end().gap - 1e-6 * np.ptp(end().nodes)},
        ),
        ("placed", lambda: {"nodes": end().nodes + 1e-9 * size()}),
    ],
)
def test_planted_errors_are_found(name, change):
    assert getattr(measured(planted(**change()))[-1], name) > 2 * LIMITS[name]


def test_forces_that_differ_between_variants_are_found():
    found, ran = drawn()
    (seen,) = (v for v in variants(found.scene, SEED) if v.name == "exchanged")
    other = run(found, seen.scene)
    assert disagreement(ran, other, seen, 0.0) < 1e-5
    assert disagreement(planted(forces=1.001 * end().forces), other, seen, 0.0) == pytest.approx(1e-3, rel=0.05)


def test_friction_of_nodes_that_supports_and_a_plane_hold_is_that_of_the_whole_body():
    """A node held along both tangents states no friction of its own; the whole body's has one free."""
    supports = Prescribed("left", 0, 0.01), Symmetry("front", 1)
    lid = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.05), ("top",), 0.2)
    rest = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), 0.0)
    mesh, material = brick(1.0, 1.0, 1.0, 1, 1, 2), VonMises(Elasticity(1e3, 0.3), Perfect(1e3))
    half = Scene(mesh, Geometry.SOLID, material, supports, (lid, rest))
    whole = unfolded(half, supports[1])
    control = Control(Newton(), limits=Limits(Bounds(equilibrium=1e-13, law=1e-13)))
    ran = [Ran(one, list(march(one, Schedule(1), control)), "") for one in (half, whole.scene)]
    assert disagreement(*ran, whole, 0.0) < 1e-12


def test_axes_exchanged_twice_are_the_scene():
    scene: Scene = draw_solid(3).scene
    turn = np.eye(3)[[2, 0, 1]] * (1.0, -1.0, 1.0)
    back = turned(turned(scene, turn).scene, turn.T).scene
    np.testing.assert_array_equal(back.mesh.nodes, scene.mesh.nodes)
    np.testing.assert_array_equal(back.mesh.elements, scene.mesh.elements)
    assert back.tools == scene.tools
    assert back.supports == scene.supports


def test_every_kind_of_element_and_number_of_tools_is_drawn():
    scenes = [draw_solid(seed) for seed in (0, 1, 5, 6, 12)]
    assert {found.body for found in scenes} == {"h8", "h20", "t10", "t4"}
    assert {len(found.scene.tools) for found in scenes} == {1, 2}


@pytest.mark.parametrize("count", [4, 8, 10, 20])
def test_orders_of_an_element_turned_in_itself_keep_what_it_is(count):
    x = places(count) + 0.03 * np.random.default_rng(count).normal(size=(count, 3))
    worst = [orientation(x[order], np.arange(count)[None]) for order in symmetries(count)]
    np.testing.assert_allclose(worst, worst[0], rtol=1e-12)
    assert len(worst) == (12 if count in (4, 10) else 24)


def test_forces_on_the_faces_of_a_closed_body_have_no_resultant():
    for element in (Element.H8, Element.H20, Element.T10):
        mesh = curved(element)
        total = np.zeros(3)
        for face in mesh.outline:
            owner = mesh.elements[np.isin(mesh.elements, face).sum(axis=1) == len(face)][0]
            total += face_forces(mesh.nodes[face], mesh.nodes[owner].mean(axis=0))[1].sum(axis=0)
        np.testing.assert_allclose(total, 0.0, atol=1e-13)


def test_rotations_frames_and_projections_are_what_they_are():
    w = np.array([0.3, -0.2, 0.5])
    W = np.cross(np.eye(3), -w).T
    np.testing.assert_allclose(rotation(w, 1.0), np.linalg.solve(np.eye(3) - W / 2, np.eye(3) + W / 2), atol=1e-14)
    np.testing.assert_allclose(rotation(w, 0.5) @ rotation(w, 0.5), rotation(w, 1.0), atol=1e-14)
    n, own = (0.6, 0.0, 0.8), np.array([[[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]])
    np.testing.assert_array_equal(framed(own, n), own)
    for wrong in (own[:, [1, 0, 2]], own * (1.0, 1.0 + 1e-12, 1.0)):
        with pytest.raises(ValueError, match="frames of candidates"):
            framed(wrong, n)
    p, mu = np.random.default_rng(1).normal(size=(50, 3)), np.full(50, 0.4)
    nearest = projected(p, mu)
    assert (np.linalg.norm(nearest[:, 1:], axis=1) <= mu * nearest[:, 0] + 1e-15).all()
    others = projected(np.random.default_rng(2).normal(size=(50, 3)), mu)
    assert (np.linalg.norm(p - nearest, axis=1) <= np.linalg.norm(p - others, axis=1) + 1e-15).all()
