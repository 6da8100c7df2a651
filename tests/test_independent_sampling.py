"""Weighted contact in the fuzz study: its own weights are the library's, and its judge finds planted errors by them."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.contact import sampling
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.increment import Limits
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder, ring
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool, Sampling
from studies.fuzz import judge as fuzz_judge
from studies.fuzz import points as fuzz_points
from studies.fuzz.points import points_of, posed
from studies.fuzz.record import setting_of, step_of
from studies.fuzz.scenes import draw
from studies.fuzz.unfolded import unfolded
from studies.fuzz.variants import variants
from studies.fuzz.whole import misstated
from studies.independent.candidates import Contacts
from studies.independent.contact import point_stiffness
from studies.independent.increment import measure
from studies.independent.sampling import around_ends
from tests.scenes import PLANES, with_course

MATERIAL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))
QUADRATIC = [element for element in elements_of(2) if element.quadratic]
GRADED = (1.0, 0.2)

BODIES = {
    "block": lambda element: (block(10.0, 6.0, 3, 2, element=element), ("top", "right")),
    "cylinder": lambda element: (cylinder(5.0, 6.0, 3, 2, GRADED, element), ("top", "side")),
    "ring": lambda element: (ring(2.0, 7.0, 6.0, 3, 2, GRADED, element), ("side", "top")),
}


def curved(mesh):
    """The mesh with its sides bent and stretched: middle nodes are not in the middle."""
    (x, y), size = mesh.nodes.T, mesh.size
    moved = x * (1 + 0.2 * np.sin(2 * y / size)), y + 0.15 * size * np.cos(1.5 * x / size) + 0.1 * y**2 / size
    return Mesh(np.column_stack(moved), mesh.elements, mesh.boundaries)


def under_a_punch(mesh, geometry=Geometry.PLANE_STRAIN, names=("top", "right"), supports=None, **changes):
    """A body under a punch that touches its top, in weighted means."""
    top = float(mesh.nodes[:, 1].max())
    punch = FlatTool((0.0, top), (0.0, -1.0), (0.0, -0.02 * mesh.size), names, 0.2, sampling=Sampling.WEIGHTED)
    inner = next(name for name in ("axis", "left", "bore") if name in mesh.boundaries)
    supports = (Support("base", 1), Support(inner, 0)) if supports is None else supports
    return Scene(mesh, geometry, MATERIAL, supports, (replace(punch, **changes),))


@pytest.mark.parametrize("bent", [False, True], ids=["straight", "curved"])
@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("element", QUADRATIC)
def test_weights_written_a_second_time_are_the_library_s(element, body, geometry, bent):
    mesh, names = BODIES[body](element)
    scene = under_a_punch(curved(mesh) if bent else mesh, geometry, names)
    found, known = posed(scene, setting_of(scene)), system_of(scene).candidates
    np.testing.assert_array_equal(found.node, known.node)
    np.testing.assert_allclose(found.weights, known.means.weights.toarray(), rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(points_of(scene, setting_of(scene), scene.tools[0]).ends, known.points[0].point)
    # Two of them at the corner of top and side, in one node.
    assert len(np.unique(found.node)) < len(found.node) < len(mesh.boundary_nodes(*names))


@pytest.mark.parametrize("turn", [-61.0, -59.0, 59.0, 61.0])
def test_edges_share_a_point_unless_one_turns_by_more_than_sixty_degrees(turn):
    angle = np.deg2rad(turn)
    way = np.array([np.cos(angle), np.sin(angle)])
    nodes = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], *(np.array([1.0, 0.0]) + s * way for s in (0.5, 1.0))])
    edges = np.array([[0, 1, 2], [4, 3, 2]])
    found = around_ends(nodes, edges, axisymmetric=False)
    assert found.node.tolist() == ([0, 2, 4] if abs(turn) < 60 else [0, 2, 2, 4])
    ends, alone = np.eye(5)[[0, 4]], np.eye(5)[[1, 3]]
    np.testing.assert_allclose(found.weights[[0, -1]], ends / 3 + 2 * alone / 3, atol=1e-15)


@pytest.mark.slow
def test_candidates_and_held_nodes_are_the_library_s_whatever_is_drawn():
    weighted = 0
    for seed in range(740070, 740110):
        scene = draw(seed).scene
        found, known = posed(scene, setting_of(scene)), system_of(scene).candidates
        held = fuzz_points.held_nodes(scene, setting_of(scene))
        np.testing.assert_array_equal(
            np.column_stack([found.node, found.tool]), np.column_stack([known.node, known.tool])
        )
        np.testing.assert_allclose(found.weights, known.means.weights.toarray(), rtol=0, atol=1e-13)
        np.testing.assert_array_equal(held.node, np.concatenate(known.held))
        weighted += known.weighted
        np.testing.assert_array_equal(found.rubs, known.tangent_free)
        np.testing.assert_array_equal(found.fixed, known.tangent_held)
    assert weighted > 5


def march_of(scene, increments=4, control=None):
    return fuzz_judge.Ran(scene, list(march(scene, Schedule(increments), control or Control())), "")


@pytest.fixture(scope="module")
def pressed():
    """The run of a ring that slides and is plastic; its side comes near the punch, points beside the top's are open."""
    mesh = ring(2.0, 7.0, 5.0, 3, 2, element=Element.Q8)
    return march_of(replace(under_a_punch(mesh, Geometry.AXISYMMETRIC, ("top", "side")), quadrature=Quadrature.GAUSS2))


def last_step(run):
    setting, accepted = setting_of(run.scene), run.steps[-1]
    return setting, step_of(run.scene, setting, accepted, float(np.abs(accepted.state.forces).max()))


def found(run, **changes):
    """What is said of the last increment with ``changes`` to what was recorded."""
    setting, step = last_step(run)
    return fuzz_judge.broken(measure(setting, replace(step, **changes)), exact=True)


def at_their_nodes(contacts):
    """Candidates of flat tools as if they were the nodes where they are."""
    one = np.searchsorted(contacts.parts.owner, np.arange(len(contacts.node)))
    by_node = {name: getattr(contacts, name)[one] for name in ("normal", "offset", "offset_end", "motion", "taken")}
    return replace(contacts, weights=np.eye(contacts.weights.shape[1])[contacts.node], **by_node)


def with_forces(run, forces):
    return {"end": replace(last_step(run)[1].end, forces=forces)}


def test_what_is_right_passes(pressed):
    assert [fuzz_judge.broken(m, exact=True) for m in fuzz_judge.measured(pressed)] == [[]] * 4
    r = pressed.steps[-1].state.forces
    assert (np.abs(r[:, 1]) > 0.199 * r[:, 0])[r[:, 0] > 0].sum() >= 2
    assert (r[:, 0] == 0).any()


def test_candidates_taken_for_their_nodes_are_found(pressed):
    """As if weights were those of nodes: neither balance nor gap is that of what was solved."""
    said = " ".join(found(pressed, contacts=at_their_nodes(last_step(pressed)[1].contacts)))
    assert "equilibrium" in said
    assert "penetration" in said


def test_a_force_moved_to_the_next_candidate_is_found(pressed):
    r = pressed.steps[-1].state.forces.copy()
    one, other = np.flatnonzero(r[:, 0] > 0)[:2]
    moved = 1e-4 * r[one]
    r[one] -= moved
    r[other] += moved
    assert any("equilibrium" in what for what in found(pressed, **with_forces(pressed, r)))


def test_forces_on_nodes_in_balance_that_no_pressure_makes_are_found(pressed):
    """Nodal forces W' r are in balance with the body; taken for those of candidates at their nodes they are not."""
    state = pressed.steps[-1].state
    contacts = last_step(pressed)[1].contacts
    onto = (contacts.weights.T @ state.forces)[contacts.node]
    assert any("equilibrium" in what for what in found(pressed, **with_forces(pressed, onto)))


def test_a_gap_of_the_mean_is_found_where_its_node_has_none(pressed):
    """A middle node lifted by little: every node at the end of an edge is where it was."""
    setting, step = last_step(pressed)
    on_top = step.contacts.weights[np.argmax(step.end.forces[:, 0])]
    middle = np.setdiff1d(np.flatnonzero(on_top), step.contacts.node)[0]
    lifted, depth = step.end.nodes.copy(), 1e-6 * setting.size
    for way, said in ((1.0, "penetration"), (-1.0, "law")):
        lifted[middle, 1] = step.end.nodes[middle, 1] + way * depth
        assert any(said in what for what in found(pressed, end=replace(step.end, nodes=lifted), gap=None))
    deep = lifted.copy()
    deep[middle, 1] = step.end.nodes[middle, 1] + depth
    measures = measure(setting, replace(step, end=replace(step.end, nodes=deep), gap=None))
    most = np.abs(step.contacts.weights[step.end.forces[:, 0] > 0, middle]).max()
    assert measures.penetration == pytest.approx(most * 1e-6, rel=1e-6)


def test_a_stored_gap_that_is_that_of_the_node_is_not_believed(pressed):
    step = last_step(pressed)[1]
    c = step.contacts
    sunk = replace(c, offset_end=c.offset_end + 1e-4)
    by_node = np.maximum(at_their_nodes(c).gap(step.end.nodes), 0)
    assert any("penetration" in what for what in found(pressed, contacts=sunk, gap=by_node))


def test_a_shear_beyond_the_cone_is_found(pressed):
    r = pressed.steps[-1].state.forces
    assert any("law" in what for what in found(pressed, **with_forces(pressed, r * (1.0, 1.001))))
    back = found(pressed, **with_forces(pressed, r * (1.0, -1.0)))
    assert any("friction" in what for what in back)


def test_a_library_with_other_means_is_found(monkeypatch):
    """Hats that are not linear: such pressures are in balance with their gaps, but not those that are posed."""
    monkeypatch.setattr(sampling, "hats", lambda *_: np.array([[1.0, 0.6, 0.0], [0.0, 0.4, 1.0]]))
    scene = replace(under_a_punch(block(10.0, 5.0, 2, 2, element=Element.Q8)), quadrature=Quadrature.GAUSS2)
    run = march_of(scene, 2)
    assert any("equilibrium" in what for m in fuzz_judge.measured(run) for what in fuzz_judge.broken(m, exact=True))


def test_a_held_node_in_a_tool_is_found_though_means_are_outside():
    """The corner that two supports hold; the mean around it may move, and stays out of the punch."""
    mesh = block(10.0, 10.0, 2, 2, element=Element.Q8)
    supports = Support("base", 1), Support("left", 0), Support("left", 1)
    scene = under_a_punch(mesh, names=("top",), supports=supports, travel=(0.0, -1e-4))
    run = march_of(scene, 1, Control(limits=Limits(bounds=Bounds.none())))
    setting, step = last_step(run)
    measures = measure(setting, step)
    assert measures.inside == pytest.approx(1e-5, rel=1e-9)
    assert any("inside" in what for what in fuzz_judge.broken(measures, exact=True))
    assert step.contacts.node[0] == step.held.node[0]


def test_weighted_contact_under_forces_and_supports_that_move_passes():
    mesh = block(10.0, 10.0, 2, 2, element=Element.Q8)
    driven = {"driven_by": Force((0.0, -2500.0)), "travel": (0.01, 0.0)}
    supports = Support("left", 0), Prescribed("right", 0, 0.03), Support("base", 1)
    run = march_of(
        replace(under_a_punch(mesh, names=("top",), supports=supports, **driven), quadrature=Quadrature.GAUSS2)
    )
    measures = fuzz_judge.measured(run)
    assert [fuzz_judge.broken(m, exact=True) for m in measures] == [[]] * 4
    assert misstated(run.scene, run.steps, measures) == []


def contact_of(weights):
    """A mean that a tool touches from below."""
    count = int(np.count_nonzero(weights))
    none, first, way = np.zeros(count), np.zeros(1, np.intp), np.tile([0.0, 1.0], (count, 1))
    return Contacts(first, np.array([weights]), np.ones(1, bool), first, way, np.zeros(1), none, none, 0 * way, 0 * way)


def test_the_stiffness_of_a_point_is_that_of_its_node_or_of_its_nodes_together():
    K = np.array([2.0, 5.0, 9.0])[:, None, None] * np.array([[3.0, 0.5], [0.5, 1.0]])
    free = np.ones((3, 2), dtype=bool)
    assert point_stiffness(contact_of([0.0, 1.0, 0.0]), K, free) == pytest.approx(5.0)
    third = np.full(3, 1 / 3)
    assert point_stiffness(contact_of(third), K, free) == pytest.approx(16.0)
    held = free.copy()
    held[1:, 1] = False
    assert point_stiffness(contact_of(third), K, held) == pytest.approx(2.0 * 9)
    assert point_stiffness(contact_of(third), K, ~free) == pytest.approx(16.0)


@pytest.mark.slow
def test_weighted_contact_is_drawn_without_changing_other_scenes(monkeypatch):
    # One of two Q8 with constants for their volumes is refused: it has motions nearly without strain.
    seeds = sorted({*range(710100, 710180)} - {710172})
    drawn = [draw(seed) for seed in seeds]
    quadratic = [d for d in drawn if d.scene.mesh.element.quadratic]
    assert 0.25 < sum("weighted" in d.kind for d in drawn) / len(quadratic) < 0.55
    assert all(d.scene.mesh.element.quadratic for d in drawn if "weighted" in d.kind)
    tools = [d.scene.tools for d in drawn if "weighted" in d.kind]
    assert any(len({tool.sampling for tool in pair}) == 2 for pair in tools)
    assert any(tool.mu_at for pair in tools for tool in pair if tool.sampling is Sampling.WEIGHTED)
    monkeypatch.setattr(fuzz_points, "WEIGHTED", 0.0)
    for seed, known in zip(seeds, drawn, strict=True):
        again = draw(seed)
        assert "weighted" not in again.kind
        assert (again.form, again.schedule, again.scene.supports) == (known.form, known.schedule, known.scene.supports)
        for tool, other in zip(again.scene.tools, known.scene.tools, strict=True):
            assert replace(tool, sampling=other.sampling, mu_at=other.mu_at) == other


@pytest.mark.parametrize("seed", [740087, 740094, 740180])
def test_variants_of_weighted_scenes_agree_and_forces_that_differ_are_found(seed):
    drawn = draw(seed)
    assert "weighted" in drawn.kind
    base = fuzz_judge.run(drawn, drawn.scene)
    seen = variants(drawn.scene, seed) + unfolded(drawn.scene)
    assert [one.name for one in seen] == ["units", "mirrored", "renumbered", "unfolded"]
    for one in seen:
        other = fuzz_judge.run(drawn, one.scene)
        force, _, count = fuzz_judge.disagreement(base, other, one, 0.0)
        assert force < fuzz_judge.DISAGREEMENT
        assert count == len(base.steps) > 2
        last = other.steps[-1]
        moved = last.state.forces * np.where(np.arange(len(last.state.forces)) % 2, 1.01, 1.0)[:, None]
        planted = with_course(last, state=replace(last.state, forces=moved))
        said = fuzz_judge.disagreement(base, replace(other, steps=[*other.steps[:-1], planted]), one, 0.0)
        assert said[0] > fuzz_judge.DISAGREEMENT
