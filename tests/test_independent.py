"""The fuzz study's recomputation finds planted errors of known size and passes what is right."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from bipot.certificate import Bounds
from bipot.fem.assembly import element_stiffness
from bipot.fem.elements import RULES, Quadrature, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.reduction import Geometry
from bipot.increment import Limits
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.sections import block, cylinder, ring
from bipot.paper import upsetting
from bipot.response import body_space
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool
from studies.fuzz import judge as fuzz_judge
from studies.fuzz.record import setting_of, step_of
from studies.fuzz.row import Outcome
from studies.fuzz.scenes import draw
from studies.independent.element import nodal_stiffness, orientation, place
from studies.independent.increment import flow_left, measure
from studies.independent.shapes import rule, shape_functions
from tests.scenes import PLANES

STUDIES = Path(__file__).parents[1] / "studies"


@pytest.fixture(scope="module")
def increment():
    """Setting and last step of a short upsetting with hardening, plastic and sliding."""
    scene = upsetting(mu=0.2, reduction=0.02, elements=2, hardening=Linear(300.0, 500.0), quadrature=Quadrature.GAUSS2)
    accepted = list(march(scene, Schedule(4)))[-1]
    setting = setting_of(scene)
    return setting, step_of(scene, setting, accepted, float(np.abs(accepted.state.forces).max()))


def at_end(step, **changes):
    return replace(step, end=replace(step.end, **changes))


def test_the_recomputation_imports_nothing_of_the_library():
    for path in (STUDIES / "independent").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = (
                [a.name for a in node.names] if isinstance(node, ast.Import) else [getattr(node, "module", "") or ""]
            )
            assert not any(n.startswith(("bipot", "studies.fuzz")) for n in names), path


def test_the_second_element_reproduces_linear_fields_and_areas():
    rng = np.random.default_rng(0)
    values, slopes = shape_functions(rng.uniform(-1, 1, (5, 2)), 8)
    corners, middles = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]), np.array([(0, -1), (1, 0), (0, 1), (-1, 0)])
    at = np.vstack([corners, middles])
    assert np.allclose(shape_functions(at.astype(float), 8)[0], np.eye(8))
    assert np.allclose(np.einsum("qad,ai->qid", slopes, at), np.eye(2))
    assert np.allclose(values.sum(axis=1), 1)
    for name in ("gauss2", "gauss3", "radon7"):
        points, weights = rule(name)
        assert np.isclose(weights.sum(), 4)
        assert np.isclose(weights @ points[:, 0] ** 2, 4 / 3)
        assert np.isclose(weights @ np.prod(points**2, axis=1), 4 / 9)


@pytest.mark.parametrize("geometry", PLANES)
def test_nodal_stiffness_is_the_diagonal_of_the_library_s(geometry):
    pressed = upsetting(mu=0.1, elements=2, quadrature=Quadrature.RADON7)
    scene = replace(pressed, mesh=ring(2.0, 7.0, 5.0, 2, 2, element=Element.Q8), geometry=geometry, supports=())
    space, elastic = body_space(scene), Elasticity(200.0, 0.3)
    grad = gradients(scene.mesh.nodes, scene.mesh.elements, space.reference, geometry)
    K = space.matrix(element_stiffness(grad, elastic.stiffness(4))).toarray()
    placed = place(scene.mesh.nodes, scene.mesh.elements, "radon7", geometry is Geometry.AXISYMMETRIC)
    bulk, shear = np.array([[elastic.bulk]]), np.array([[elastic.shear]])
    blocks = nodal_stiffness(placed, scene.mesh.elements, bulk, shear, len(scene.mesh.nodes))
    for a, found in enumerate(blocks):
        assert np.allclose(K[2 * a : 2 * a + 2, 2 * a : 2 * a + 2], found, rtol=1e-12, atol=1e-9)


def test_a_certified_increment_passes_every_measure(increment):
    setting, step = increment
    m = measure(setting, step)
    assert fuzz_judge.broken(m, exact=True) == []
    work, *parts = m.energies
    assert all(part > 0 for part in parts)
    assert abs(work - sum(parts)) < 0.03 * work


def test_planted_errors_are_found_and_have_their_size(increment):
    setting, step = increment
    forces = step.end.forces
    off = measure(setting, at_end(step, forces=forces * np.array([1.0, 1.02])))
    assert off.law == pytest.approx(0.02 * np.abs(forces[:, 1]).max() / step.largest, rel=0.6)
    assert off.equilibrium > 1e-4
    hard = measure(setting, at_end(step, stress=1.001 * step.end.stress))
    assert hard.yielding == pytest.approx(1e-3, rel=0.01)
    assert hard.elastic == pytest.approx(1e-3, rel=0.2)
    flowed = measure(setting, at_end(step, peeq=step.end.peeq - 1e-5))
    assert flowed.flow > 1e-3
    back = replace(
        step, flow=None, end=replace(step.end, plastic_strain=2 * step.start.plastic_strain - step.end.plastic_strain)
    )
    assert measure(setting, back).plastic < -0.5
    sunk = replace(step.contacts, offset_end=step.contacts.offset_end + 1e-4 * setting.size)
    deep = measure(setting, replace(step, contacts=sunk))
    assert deep.penetration == pytest.approx(1e-4, rel=1e-3)
    pulled = measure(setting, at_end(step, forces=forces * np.array([1.0, -1.0])))
    assert pulled.friction < -1e-3
    assert "friction" in " ".join(fuzz_judge.broken(pulled, exact=True))


def test_a_trace_of_the_plastic_strain_is_left_by_the_flow_rule_and_no_strain_of_the_elastic_law(increment):
    """Nearly incompressible, its round-off times the bulk modulus may be a stress."""
    setting, step = increment
    planted = 1e-6
    seen = measure(setting, at_end(step, plastic_strain=step.end.plastic_strain + planted * np.eye(3)))
    right = measure(setting, step)
    assert seen.elastic == right.elastic
    yields = setting.yield_stress(step.end.peeq).max()
    assert seen.flow == pytest.approx(2 * setting.shear * np.sqrt(3) * planted / yields, rel=0.1)


def test_a_stored_gap_that_is_not_that_of_the_positions_is_not_believed(increment):
    setting, step = increment
    c = step.contacts
    gap = np.vecdot(c.normal, step.end.nodes[c.node]) - c.offset_end
    sunk = replace(step.contacts, offset_end=c.offset_end + 1e-4 * setting.size)
    assert measure(setting, replace(step, gap=np.maximum(gap, 0), contacts=sunk)).penetration > 0.9e-4


@pytest.mark.parametrize("exact", [True, False], ids=["exact", "penalised"])
@pytest.mark.parametrize("away", [0.1, 0.07], ids=["touching", "driven in"])
def test_a_tool_in_a_held_node_is_found_whatever_law_is_posed(away, exact):
    """The corner that two supports hold is no candidate: the library, asked for nothing, goes on through it."""
    punch = FlatTool((0.0, 10.0 + away), (0.0, -1.0), (0.0, -0.1), ("top",), mu=0.1)
    supports = (Support("base", 1), Support("left", 0), Support("right", 1))
    elastic = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))
    scene = Scene(block(10.0, 10.0, 2, 2, element=Element.Q8), Geometry.PLANE_STRAIN, elastic, supports, (punch,))
    accepted = list(march(scene, Schedule(1), Control(limits=Limits(bounds=Bounds.none()))))[-1]
    setting = setting_of(scene)
    m = measure(setting, step_of(scene, setting, accepted, 1.0))
    depth = (0.1 - away) / setting.size
    assert m.inside == pytest.approx(depth, rel=1e-9, abs=0)
    assert any("inside" in what for what in fuzz_judge.broken(m, exact)) == (depth > 0)


def test_a_folded_corner_is_seen_where_integration_points_are_not_folded():
    mesh = cylinder(1.0, 1.0, 1, 1, element=Element.Q8)
    nodes = mesh.nodes.copy()
    corner = mesh.elements[0, 2]
    nodes[corner] -= 0.3
    inside = place(nodes, mesh.elements, "gauss2", axisymmetric=False)
    assert orientation(mesh.nodes, mesh.elements, axisymmetric=True) == pytest.approx(1.0)
    assert inside.volume.min() > 0 > orientation(nodes, mesh.elements, axisymmetric=False)


@pytest.mark.parametrize("turn", [1.0, 1e-4, 1e-8, 1e-12, 0.0])
def test_flow_that_went_on_by_the_rule_leaves_nothing_however_little_it_turned(turn):
    """Nearly along each other, the two flows are told apart by round-off alone: that is no error of their sum."""
    rng = np.random.default_rng(3)
    n, beside = rng.normal(size=(2, 200, 10))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    f = 0.04 * (n + turn * beside)
    a, gamma = rng.uniform(0, 1, (200, 1)), rng.uniform(0, 0.1, (200, 1))
    left, _ = flow_left(a * f + gamma * n, f, n)
    assert left.max() < 1e-16
    off = np.pad(np.cross(n[:, :3], beside[:, :3]), ((0, 0), (0, 7)))
    off /= np.linalg.norm(off, axis=-1, keepdims=True)
    planted, _ = flow_left(a * f + gamma * n + 1e-6 * off, f, n)
    np.testing.assert_allclose(planted, 1e-6, rtol=1e-6)


def test_the_least_that_flow_leaves_is_that_of_a_bounded_least_squares_solver():
    rng = np.random.default_rng(4)
    want, f, n = rng.normal(size=(3, 100, 10))
    left, gamma = flow_left(want, f, n)
    for k in range(100):
        found = lsq_linear(np.column_stack([f[k], n[k]]), want[k], bounds=([0, 0], [1, np.inf]), tol=1e-14)
        assert left[k] == pytest.approx(np.sqrt(2 * found.cost), rel=1e-8)
        assert gamma[k] == pytest.approx(found.x[1], abs=1e-6)


@pytest.mark.parametrize("element", elements_of(2))
def test_every_element_written_a_second_time_has_the_library_s_shapes(element):
    """On its own reference shape: the square is [-1, 1]^2 there."""
    for which in RULES[element]:
        points, weights = rule(which.value)
        values, slopes = shape_functions(points, element.nodes)
        table, scale = tabulated(element, which), 2 if element.corners == 4 else 1
        np.testing.assert_allclose(weights, table.weights * scale**2, rtol=1e-12)
        np.testing.assert_allclose(values, table.values, atol=1e-13)
        np.testing.assert_allclose(slopes * scale, table.gradients, atol=1e-12)


@pytest.mark.parametrize(("seed", "element"), [(68, "T3"), (4, "T6"), (64, "Q4"), (72, "Q9")])
def test_drawn_scenes_of_other_elements_pass_the_recomputation(seed, element):
    assert draw(seed).scene.mesh.element is Element[element]
    assert fuzz_judge.judge_scene(seed).outcome is Outcome.CERTIFIED
