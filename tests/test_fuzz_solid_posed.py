"""Bodies in space in the fuzz study, weighted contact and slants: made a second time, judged, and turned."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import Element, FlatTool, Mesh, Sampling, Scene, SceneError, Support, Symmetry, brick
from bipot.fem.reduction import Geometry
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule, system_of
from bipot.scene.loads import PointForce, Traction
from bipot.scene.supports import Prescribed
from studies.fuzz.judge import Ran, run
from studies.fuzz.scenes import Drawn
from studies.fuzz.solid import LIMITS, disagreement, faults, measured
from studies.fuzz.solid_contacts import touching
from studies.fuzz.solid_held import freed, prescribed_at
from studies.fuzz.solid_points import posed
from studies.fuzz.solid_scenes import draw_solid
from studies.fuzz.solid_unfolded import unfolded
from studies.fuzz.solid_variants import turned
from tests.scenes import with_course
from tests.solids import curved
from tests.solids import turned as rotation

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))
PLANES = Symmetry("left", 0), Symmetry("front", 1), Support("base", 2)
Q = rotation((1.0, -2.0, 3.0), 0.8)


def punch(normal=(0.0, 0.0, -1.0), names=("top", "right"), travel=(0.0, 0.0, -0.02), **given):
    n = np.array(normal) / np.linalg.norm(normal)
    return FlatTool((0.0, 0.0, 2.0), tuple(n.tolist()), travel, names, 0.2, sampling=Sampling.WEIGHTED, **given)


def ridge(element):
    """A block whose top turns by 50 degrees in the middle, and leans there towards the plane on its left."""
    mesh = brick(1.0, 2.0, 1.0, 1, 2, 1, element=element)
    x, y, z = mesh.nodes.T
    return Mesh(np.column_stack([x, y - x, z - 0.9 * np.maximum(y - 1.0, 0.0)]), mesh.elements, mesh.boundaries)


BODIES = {
    f"{name} {element.value}": mesh
    for element in (Element.H20, Element.T10)
    for name, mesh in {
        "straight": brick(2.0, 2.0, 2.0, 2, 1, 2, element=element),
        "curved": curved(element),
        "ridge": ridge(element),
    }.items()
}


@pytest.mark.parametrize("normal", [(0.0, 0.0, -1.0), (-0.2, 0.0, -1.0)], ids=["cut", "askew"])
@pytest.mark.parametrize("name", BODIES)
def test_points_weights_and_what_planes_leave_of_them_are_those_of_the_library(name, normal):
    mesh = BODIES[name]
    planes = (Support("left", 0),) if name.startswith("curved") else (Symmetry("left", 0),)
    tool = replace(punch(normal, ("top", "right", "back")), point=(0.0, 0.0, 9.0))
    scene = Scene(mesh, Geometry.SOLID, STEEL, (*planes, Support("base", 2)), (tool,))
    candidates, own = system_of(scene).candidates, posed(scene, 0)
    assert own.node.tolist() == candidates.node.tolist()
    np.testing.assert_allclose(own.weights, candidates.means.weights.toarray(), atol=1e-14)
    within = candidates.means.within
    left = np.tile(np.eye(3), (len(own.node), 1, 1)) if within is None else within
    np.testing.assert_allclose(own.moved, left, atol=1e-15)


def test_what_supports_leave_and_where_they_take_nodes_is_what_the_library_makes_of_them():
    walls = Support("right", (0.8, 0.36, 0.48)), Prescribed("top", (0.48, 0.6, -0.64), 0.05)
    held = Support("base", 2), Support("left", (1.0, 0.0, 0.0)), Support("front", (0.6, 0.8, 0.0)), *walls
    scene = Scene(brick(1.0, 1.0, 1.0, 2, 2, 2), Geometry.SOLID, STEEL, held)
    left = np.einsum("aij,aj->ai", freed(scene), u := np.random.default_rng(0).normal(size=scene.mesh.nodes.shape))
    axes, holding = scene.holding.axes, scene.holding
    np.testing.assert_allclose(left, axes.field(np.where(holding.held, 0.0, axes.components(u))), atol=1e-14)
    np.testing.assert_allclose(prescribed_at(scene, 0.7), holding.at(0.7), atol=1e-16)


@cache
def drawn(name: str) -> tuple[Drawn, Ran]:
    """A scene and its run."""
    mesh = brick(2.0, 2.0, 2.0, 1, 1, 1, element=Element.H20)
    tool = replace(punch(names=("top",), travel=(0.0, 0.08, -0.02)), mu=0.1)
    if name == "capped":
        mesh, shear_at = brick(2.0, 2.0, 2.0, 2, 2, 2), {26: 0.2, 25: np.inf}
        tool = replace(tool, sampling=Sampling.NODES, mu=0.5, shear=0.1, shear_at=shear_at, candidates=("top", "right"))
    supports = {
        "weighted": PLANES[:1] + tuple(Support("base", d) for d in range(3)),
        "capped": PLANES[:1] + tuple(Support("base", d) for d in range(3)),
        "aslant": (Support("left", 0), Support("base", 2), Prescribed("right", (0.6, 0.8, 0.0), 0.002)),
    }[name]
    scene = Scene(mesh, Geometry.SOLID, STEEL, supports, (tool,))
    found = draw_solid(2)
    found = replace(found, scene=scene, schedule=Schedule(2), form="newton")
    return found, run(found, scene)


def planted(name: str, **changes) -> Ran:
    """The run with another state at its end."""
    _, ran = drawn(name)
    last = ran.steps[-1]
    return replace(ran, steps=[*ran.steps[:-1], with_course(last, state=replace(last.state, **changes))])


@pytest.mark.parametrize("name", ["weighted", "aslant", "capped"])
def test_what_is_right_is_passed(name):
    found, ran = drawn(name)
    assert (ran.reason, len(ran.steps)) == ("", 2)
    wrong, measures = faults(ran, exact=True)
    assert wrong == []
    assert max(m.disc for m in measures) < 1e-7
    assert np.abs(touching(found.scene, ran.steps[-1]).slip).max() > 1e-3


@pytest.mark.parametrize(
    ("measure", "change"),
    [
        ("equilibrium", lambda end: {"stress": end.stress * (1 + 1e-4)}),
        ("equilibrium", lambda end: {"forces": end.forces[::-1]}),
        ("disc", lambda end: {"forces": end.forces * (1, 1.01, 1)}),
        ("placed", lambda end: {"nodes": end.nodes + 1e-9}),
        ("penetration", lambda end: {"nodes": end.nodes * (1, 1, 1 + 1e-6), "gap": end.gap - 2e-6}),
    ],
)
@pytest.mark.parametrize("name", ["weighted", "aslant", "capped"])
def test_planted_errors_are_found(name, measure, change):
    end = drawn(name)[1].steps[-1].state
    assert getattr(measured(planted(name, **change(end)))[-1], measure) > 2 * LIMITS[measure]


@pytest.mark.parametrize("name", ["weighted", "aslant", "capped"])
def test_turned_by_any_angle_a_body_has_the_same_forces(name):
    found, ran = drawn(name)
    seen = turned(found.scene, Q * (1.0, -1.0, 1.0))
    assert seen.name == "turned"
    other = run(found, seen.scene)
    assert faults(other, exact=True)[0] == []
    assert disagreement(ran, other, seen, 0.0) < 1e-7
    assert disagreement(planted(name, forces=1.001 * ran.steps[-1].state.forces), other, seen, 0.0) > 5e-4


@pytest.mark.parametrize("element", [Element.H8, Element.H20, Element.T10], ids=lambda element: element.value)
def test_caps_are_those_of_the_library(element):
    """Of constant shear where the upper side leans and comes down on one edge, and is curved, a part at each node."""
    mesh = curved(element) if element.quadratic else brick(2.0, 2.0, 2.0, 2, 2, 2)
    top = mesh.boundary_nodes("top")
    tool = punch(
        (-0.05, 0.0, -1.0), ("top", "right", "back"), (0.0, 0.02, -0.05), shear=0.3, shear_at={int(top[0]): 0.7}
    )
    sampling = Sampling.WEIGHTED if element is Element.H20 else Sampling.NODES
    tool = replace(tool, sampling=sampling, mu=np.inf, point=tuple(mesh.nodes[mesh.nodes[:, 2].argmax()].tolist()))
    scene = Scene(mesh, Geometry.SOLID, STEEL, tuple(Support("base", d) for d in range(3)), (tool,))
    *_, last = run(replace(draw_solid(2), scene=scene, schedule=Schedule(4), form="newton"), scene).steps
    found, cap = touching(scene, last).cap, last.solved.rows.cap
    assert 0 < np.sum(cap > 0) < len(cap)
    np.testing.assert_allclose(found, cap, rtol=1e-9, atol=1e-12 * cap.max())


def test_paths_whose_components_go_apart_are_turned_with_their_tools():
    path = ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (1.0, (1.0, 1.0, 1.0)))
    mesh = brick(2.0, 2.0, 2.0, 1, 1, 1, element=Element.H8)
    scene = Scene(mesh, Geometry.SOLID, STEEL, PLANES[2:], (punch(path=path, travel=(0.03, 0.01, -0.02)),))
    tool, other = scene.tools[0], turned(scene, Q).scene.tools[0]
    for tau in (0.2, 0.5, 0.8, 1.0):
        np.testing.assert_allclose(other.pose(tau)[:3], Q @ tool.pose(tau)[:3], atol=1e-16)


def taken(seeds):
    """The scenes of seeds, without those that are refused when they are made."""
    for seed in seeds:
        with suppress(SceneError):
            yield draw_solid(seed)


@pytest.mark.slow
def test_weighted_contact_leaning_sides_and_slants_are_drawn():
    kinds = list(taken(range(26)))
    for word in ("weighted", "aslant"):
        assert 3 <= sum(word in found.kind.split() for found in kinds) <= 20
    planes = [s for found in kinds for s in found.scene.supports if isinstance(s, Symmetry)]
    assert {type(plane.direction) for plane in planes} == {int, tuple}


@pytest.mark.parametrize("lean", [0.0, -0.05], ids=["cut", "askew"])
def test_unfolded_a_body_has_the_same_forces_on_each_half(lean):
    found, _ = drawn("weighted")
    tool = punch((lean, 0.0, -1.0), ("top", "right"), (0.0, 0.08, -0.02), mu_at={6: 0.3})
    loads = PointForce(4, (0.0, 1.0, 2.0)), Traction("back", (1.0, 2.0, 0.0))
    scene = replace(found.scene, tools=(tool,), loads=loads)
    ran, seen = run(found, scene), unfolded(scene, PLANES[0])
    other = run(found, seen.scene)
    assert (ran.reason, other.reason, len(other.scene.tools)) == ("", "", 1 if lean == 0 else 2)
    assert disagreement(ran, other, seen, 0.0) < 1e-7
    wrong = [with_course(a, state=replace(a.state, forces=0.999 * a.state.forces)) for a in ran.steps]
    assert disagreement(replace(ran, steps=wrong), other, seen, 0.0) > 5e-4
