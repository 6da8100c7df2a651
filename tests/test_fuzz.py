"""The fuzz study: its recomputation finds planted errors of known size and passes what is right; its table says so."""

import ast
import csv
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from bipot.errors import NotConverged, SceneError
from bipot.fem.assembly import element_stiffness
from bipot.fem.elements import Quadrature
from bipot.fem.kinematics import Geometry, gradients, strain_operator
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity
from bipot.march import Schedule, march
from bipot.mesh import cylinder, ring
from bipot.response import body_space
from bipot.scene import upsetting
from studies import fuzz, fuzz_coulomb, fuzz_judge
from studies.fuzz_record import setting_of, step_of
from studies.fuzz_row import HEADER, Outcome, Row
from studies.fuzz_scenes import draw
from studies.fuzz_variants import mirrored, renumbered, variants
from studies.independent import flow_left, measure
from studies.independent_element import nodal_stiffness, orientation, place, rule, shape_functions

STUDIES = Path(__file__).parents[1] / "studies"
GOOD_SEED = 7


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
    for path in STUDIES.glob("independent*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = (
                [a.name for a in node.names] if isinstance(node, ast.Import) else [getattr(node, "module", "") or ""]
            )
            assert not any(n.startswith(("bipot", "studies.fuzz")) for n in names), path


def test_the_second_element_reproduces_linear_fields_and_areas():
    rng = np.random.default_rng(0)
    values, slopes = shape_functions(rng.uniform(-1, 1, (5, 2)))
    corners, middles = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]), np.array([(0, -1), (1, 0), (0, 1), (-1, 0)])
    at = np.vstack([corners, middles])
    assert np.allclose(shape_functions(at.astype(float))[0], np.eye(8))
    assert np.allclose(np.einsum("qad,ai->qid", slopes, at), np.eye(2))
    assert np.allclose(values.sum(axis=1), 1)
    for name in ("gauss2", "gauss3", "radon7"):
        points, weights = rule(name)
        assert np.isclose(weights.sum(), 4)
        assert np.isclose(weights @ points[:, 0] ** 2, 4 / 3)
        assert np.isclose(weights @ np.prod(points**2, axis=1), 4 / 9)


@pytest.mark.parametrize("geometry", list(Geometry))
def test_nodal_stiffness_is_the_diagonal_of_the_library_s(geometry):
    pressed = upsetting(mu=0.1, elements=2, quadrature=Quadrature.RADON7)
    scene = replace(pressed, mesh=ring(2.0, 7.0, 5.0, 2, 2), geometry=geometry, supports=())
    space, elastic = body_space(scene), Elasticity(200.0, 0.3)
    grad = gradients(scene.mesh.nodes, scene.mesh.elements, space.reference, geometry)
    K = space.matrix(element_stiffness(strain_operator(grad.shape), elastic.stiffness(4), grad.volume)).toarray()
    placed = place(scene.mesh.nodes, scene.mesh.elements, "radon7", geometry is Geometry.AXISYMMETRIC)
    blocks = nodal_stiffness(placed, scene.mesh.elements, elastic.bulk, elastic.shear, len(scene.mesh.nodes))
    for a, block in enumerate(blocks):
        assert np.allclose(K[2 * a : 2 * a + 2, 2 * a : 2 * a + 2], block, rtol=1e-12, atol=1e-9)


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


def test_a_stored_gap_that_is_not_that_of_the_positions_is_not_believed(increment):
    setting, step = increment
    c = step.contacts
    gap = np.vecdot(c.normal, step.end.nodes[c.node]) - c.offset_end
    sunk = replace(step.contacts, offset_end=c.offset_end + 1e-4 * setting.size)
    assert measure(setting, replace(step, gap=np.maximum(gap, 0), contacts=sunk)).penetration > 0.9e-4


def test_a_folded_corner_is_seen_where_integration_points_are_not_folded():
    mesh = cylinder(1.0, 1.0, 1, 1)
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


def test_variants_seen_twice_are_the_scene():
    scene = draw(GOOD_SEED).scene
    twice = mirrored(mirrored(scene, 1).scene, 1).scene
    assert np.array_equal(twice.mesh.elements, scene.mesh.elements)
    assert np.allclose(twice.mesh.nodes, scene.mesh.nodes)
    order = np.random.default_rng(1).permutation(len(scene.mesh.nodes))
    other = renumbered(scene, order, np.arange(len(scene.mesh.elements)))
    assert np.array_equal(other.scene.mesh.nodes[other.number], scene.mesh.nodes)
    assert {v.name for v in variants(scene, 0)} == {"units", "mirrored", "renumbered"}


def test_forces_that_differ_between_variants_are_found():
    drawn = draw(GOOD_SEED)
    seen = variants(drawn.scene, GOOD_SEED)[0]
    base, other = fuzz_judge.run(drawn, drawn.scene), fuzz_judge.run(drawn, seen.scene)
    assert fuzz_judge.disagreement(base, other, seen, 0.0)[0] < fuzz_judge.DISAGREEMENT
    last = other.steps[-1]
    moved = replace(last, state=replace(last.state, forces=1.001 * last.state.forces))
    planted = replace(other, steps=[*other.steps[:-1], moved])
    largest = max(np.abs(step.state.forces).max() for step in other.steps)
    share = float(np.abs(last.state.forces).max() / largest)
    assert fuzz_judge.disagreement(base, planted, seen, 0.0)[0] == pytest.approx(1e-3 * share, rel=0.01)


def raises(error):
    def fail(*_, **__):
        raise error

    return fail


@pytest.mark.parametrize(
    ("error", "outcome"),
    [
        (NotConverged("in words"), Outcome.REFUSED),
        (ZeroDivisionError("raw"), Outcome.RAW),
        (RuntimeWarning("overflow"), Outcome.WARNING),
    ],
)
def test_how_a_run_ends_is_its_outcome(monkeypatch, error, outcome):
    monkeypatch.setattr(fuzz_judge, "march", raises(error))
    row = fuzz_judge.judge_scene(GOOD_SEED)
    assert row.outcome is outcome
    assert str(error) in row.reason


def test_a_scene_refused_when_it_is_made_is_refused(monkeypatch):
    monkeypatch.setattr(fuzz_judge, "draw", raises(SceneError("mu = -1: must be >= 0")))
    row = fuzz_judge.judge_scene(GOOD_SEED)
    assert row.outcome is Outcome.REFUSED
    assert "must be" in row.reason


def test_a_warning_of_numpy_is_an_outcome(monkeypatch):
    monkeypatch.setattr(fuzz_judge, "march", lambda *_: warnings.warn("quiet", RuntimeWarning))
    assert fuzz_judge.judge_scene(GOOD_SEED).outcome is Outcome.WARNING


def test_a_measure_above_its_limit_is_wrong(monkeypatch):
    whole = fuzz_judge.measured

    def planted(ran):
        return [replace(m, equilibrium=2 * fuzz_judge.LIMITS["equilibrium"]) for m in whole(ran)]

    assert fuzz_judge.judge_scene(GOOD_SEED, others=False).outcome is Outcome.CERTIFIED
    monkeypatch.setattr(fuzz_judge, "measured", planted)
    assert fuzz_judge.judge_scene(GOOD_SEED, others=False).outcome is Outcome.WRONG


def posed(W, q, mu, dim=2):
    W, q = np.array(W, float), np.array(q, float)
    return fuzz_coulomb.Posed(W, q, np.broadcast_to(np.array(mu, float), (len(q) // dim,)), dim, "auto")


def test_the_enumeration_tells_solvable_problems_from_others():
    assert fuzz_coulomb.least_violation(posed([[1, 1], [1, 1]], [-1, 0], 2.0)) > 0.1
    W = [[18, 12, -12, 12], [12, 8, -8, 8], [-12, -8, 8, -8], [12, 8, -8, 8]]
    assert fuzz_coulomb.least_violation(posed(W, [-1, 0, 2, -2], 2.0)) < 1e-9
    assert fuzz_coulomb.least_violation(posed(np.eye(2), [-1.0, 0.1], 0.3)) < 1e-12


def test_a_discrete_answer_is_measured_without_its_force_as_a_scale():
    exact = posed(np.eye(2), [-1.0, 0.1], 0.3)
    assert fuzz_coulomb.law_error(exact, np.array([1.0, -0.1])) < 1e-15
    assert fuzz_coulomb.law_error(exact, np.array([1.01, -0.1])) == pytest.approx(0.01, rel=0.1)
    runaway = posed([[1, 1], [1, 1]], [-1, 0], 2.0)
    assert fuzz_coulomb.law_error(runaway, np.array([5.6e9, -5.6e9])) > 0.1


def test_what_a_stick_still_slips_is_not_multiplied_by_the_coefficient():
    """Forces 1e-11 from those that stick, at mu = 1e6: the natural map would say 1e-5."""
    stick = posed(np.eye(2), [-1.0, 0.5], 1e6)
    assert fuzz_coulomb.law_error(stick, np.array([1.0, -0.5 + 1e-11])) == pytest.approx(1e-11, rel=0.2)


def test_a_discrete_answer_called_solved_that_is_not_is_wrong(monkeypatch):
    monkeypatch.setattr(fuzz_coulomb, "draw", lambda seed: posed(np.eye(2), [-1.0, 0.1], 0.3))
    assert fuzz_coulomb.judge_coulomb(0).outcome is Outcome.CERTIFIED
    solve = fuzz_coulomb.coulomb.solve
    monkeypatch.setattr(fuzz_coulomb.coulomb, "solve", lambda *a: replace(solve(*a), r=np.array([1.0, 0.1])))
    assert fuzz_coulomb.judge_coulomb(0).outcome is Outcome.WRONG


def table_of(folder):
    with (folder / "fuzz.csv").open(newline="") as file:
        return list(csv.reader(file))


def test_the_study_writes_goes_on_and_counts(tmp_path, capsys):
    line = ["--scenes", "1", "--coulomb", "3", "--seed", str(GOOD_SEED), "--out", str(tmp_path)]
    code = fuzz.main(line)
    header, *lines = table_of(tmp_path)
    assert header == HEADER == [
        "seed", "kind", "form", "outcome", "reason", "increments",
        "worst_residual", "worst_law", "worst_disagreement", "seconds",
    ]  # fmt: skip
    assert [row[1].split()[0] for row in lines] == ["scene", "coulomb", "coulomb", "coulomb"]
    assert code == int(any(row[3] in fuzz.FAILURES for row in lines))
    said = capsys.readouterr().out.splitlines()[-1]
    assert sum(int(part.split()[0]) for part in said.split(", ")) == 4
    assert fuzz.main(line) == code
    assert table_of(tmp_path) == [header, *lines]
    assert capsys.readouterr().out.splitlines()[-1] == said


@pytest.mark.parametrize(("outcome", "code"), [(o, int(o.value in fuzz.FAILURES)) for o in Outcome])
def test_exit_code_says_whether_anything_is_wrong(tmp_path, monkeypatch, outcome, code):
    row = Row(0, "scene block", "tangent", outcome, "a\nreason", 1, 0.0, 0.0, 0.0, 0.0)
    monkeypatch.setitem(fuzz.JUDGES, "scene", lambda seed: replace(row, seed=seed))
    assert fuzz.main(["--scenes", "2", "--coulomb", "0", "--out", str(tmp_path)]) == code


def test_ctrl_c_is_quiet_and_keeps_what_is_done(tmp_path, monkeypatch):
    def stop(seed):
        if seed == 1:
            raise KeyboardInterrupt
        return Row(seed, "scene block", "tangent", Outcome.CERTIFIED, "", 1, 0.0, 0.0, 0.0, 0.0)

    monkeypatch.setitem(fuzz.JUDGES, "scene", stop)
    assert fuzz.main(["--scenes", "3", "--coulomb", "0", "--out", str(tmp_path)]) == 130
    assert len(table_of(tmp_path)) == 2


@pytest.mark.parametrize("bad", [["--scene", "3"], ["--scenes", "-1"], ["--jobs", "0"]])
def test_abbreviated_and_bad_options_are_refused(bad, capsys):
    with pytest.raises(SystemExit):
        fuzz.main(bad)
    assert bad[0] in capsys.readouterr().err or "unrecognized" in capsys.readouterr().err
