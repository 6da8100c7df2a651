"""The fuzz study: variants of a scene, outcomes of a run, discrete problems, and what its table says."""

import csv
import subprocess
import sys
import warnings
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from bipot.energy import Energies
from bipot.errors import NotConverged, SceneError
from bipot.scene.supports import Symmetry
from studies.flat import axis_of, flat
from studies.fuzz import __main__ as fuzz
from studies.fuzz import coulomb as fuzz_coulomb
from studies.fuzz import judge as fuzz_judge
from studies.fuzz import tasks
from studies.fuzz import whole as fuzz_whole
from studies.fuzz.row import FAILURES, HEADER, Outcome, Row
from studies.fuzz.scenes import draw
from studies.fuzz.unfolded import unfolded
from studies.fuzz.variants import mirrored, renumbered, variants
from studies.fuzz.whole import difference
from tests.scenes import with_course

ROOT = Path(__file__).parents[1]
GOOD_SEED = 7
NO_REGIONS = ["--regional", "0", "--solid-regional", "0", "--parts", "0", "--solid-parts", "0"]
NO_OTHERS = ["--shaped", "0", "--solid", "0", "--solid-shaped", "0", *NO_REGIONS, "--coulomb", "0"]


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
    moved = with_course(last, state=replace(last.state, forces=1.001 * last.state.forces))
    planted = replace(other, steps=[*other.steps[:-1], moved])
    largest = max(np.abs(step.state.forces).max() for step in other.steps)
    share = float(np.abs(last.state.forces).max() / largest)
    assert fuzz_judge.disagreement(base, planted, seen, 0.0)[0] == pytest.approx(1e-3 * share, rel=0.01)


FOLDED_SEED = 641071


def test_a_scene_is_unfolded_about_each_of_its_planes():
    drawn = draw(FOLDED_SEED)
    planes = [support for support in drawn.scene.supports if isinstance(support, Symmetry)]
    seen = unfolded(drawn.scene)
    assert len(seen) == len(planes) > 0
    assert all(2 * variant.scene.images == drawn.scene.images for variant in seen)
    back = mirrored(seen[0].scene, axis_of(planes[0])).scene.mesh
    assert np.allclose(np.sort(back.nodes, axis=0), np.sort(seen[0].scene.mesh.nodes, axis=0))


def test_a_whole_body_that_leaves_its_symmetry_tells_nothing_of_its_half():
    seen = unfolded(draw(FOLDED_SEED).scene)[0]
    rest = seen.scene.mesh.nodes
    moved = rest + 0.1 * rest * np.where(np.arange(2) == seen.across, 1, -0.5)
    assert seen.tells(moved)
    moved[seen.number[-1]] += 1e-3
    assert not seen.tells(moved)


def planted_in_the_last(ran, **changes):
    return replace(ran, steps=[*ran.steps[:-1], replace(ran.steps[-1], **changes)])


def test_half_a_force_or_half_the_energies_called_whole_are_found():
    drawn = draw(FOLDED_SEED)
    ran, other = fuzz_judge.run(drawn, drawn.scene), unfolded(drawn.scene)[0]
    whole, measures, last = fuzz_judge.run(drawn, other.scene), fuzz_judge.measured(ran), ran.steps[-1]
    energies = Energies(*(getattr(last.energies, f.name) / 2 for f in fields(Energies)))
    halved = replace(ran, steps=[*ran.steps[:-1], with_course(last, energies=energies)])
    pushed = planted_in_the_last(ran, tool_forces=last.tool_forces / 2)

    def found(planted):
        return difference(planted.steps, whole.steps, drawn.scene, other, 0.0)

    assert fuzz_whole.misstated(drawn.scene, ran.steps, measures) == []
    assert (found(ran) < fuzz_judge.DISAGREEMENT).all()
    assert "energies off by" in fuzz_whole.misstated(drawn.scene, halved.steps, measures)[0]
    assert found(halved)[1] > 0.4
    assert "force of tool 0" in fuzz_whole.misstated(drawn.scene, pushed.steps, measures)[0]
    assert found(pushed)[0] > 0.4


@pytest.mark.slow
def test_planes_are_drawn_that_cut_tools_and_that_do_not():
    scenes = [draw(seed).scene for seed in range(60)]
    planes = [(s, flat(tool).normal[axis_of(s)]) for scene in scenes for s in scene.supports for tool in scene.tools
              if isinstance(s, Symmetry)]  # fmt: skip
    assert sum(normal == 0 for _, normal in planes) > 3
    assert sum(normal != 0 for _, normal in planes) > 3
    assert {s.boundary for s, _ in planes} == {"left", "base"}


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
    monkeypatch.setattr(fuzz_judge, "march", lambda *_, observe: warnings.warn("quiet", RuntimeWarning))
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


@pytest.mark.parametrize(("judge", "seed"), [(fuzz_judge.judge_scene, 9107), (fuzz_judge.judge_shaped, 52029)])
def test_what_the_judge_once_took_for_wrong_is_certified(judge, seed):
    """A support's node that lets go of a tool, whose friction at the start counts half; forces without a square."""
    assert judge(seed, others=False).outcome is Outcome.CERTIFIED


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


@pytest.mark.parametrize("dim", [2, 3])
def test_the_distance_to_exact_slip_is_a_planted_error_of_force_or_velocity(dim):
    """Slip 3 along e under force 5: a force off the ray by 1e-3 is seen, and so is a velocity across, or a gap."""
    e, mu = np.eye(dim - 1)[-1], np.array([0.5])
    ray = np.append(1.0, -0.5 * e) / np.hypot(1.0, 0.5)
    off = np.append(0.5, e) / np.hypot(1.0, 0.5)
    slip, gap, none = np.append(0.0, 3 * e), np.eye(dim)[0], np.zeros(1)

    def distance(force, velocity, along):
        return fuzz_coulomb._off_slip(force[None], velocity[None], mu, along[None], none, none)[0]

    assert distance(5 * ray, slip, slip[1:]) < 1e-15
    wrong = 5 * ray + 1e-3 * off
    for along in (slip[1:], -wrong[1:]):
        assert distance(wrong, slip, along) == pytest.approx(1e-3, rel=1e-9)
        assert distance(5 * ray, slip + 1e-3 * gap, along) == pytest.approx(1e-3, rel=1e-9)
    assert distance(5 * ray, -slip, -ray[1:]) == pytest.approx(3.0)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_direction_of_a_slip_too_small_to_have_one_multiplies_no_error(dim):
    """A contact at the edge of its cone slips 1e-14 the wrong way: off by that, not by its force."""
    mu, tiny = 0.5, -1e-14 * np.eye(dim - 1)[0]
    force, velocity = np.append(1.0, -mu * np.eye(dim - 1)[0]), np.append(0.0, tiny)
    none = np.zeros(1)
    by_slip, by_friction = (
        fuzz_coulomb._off_slip(force[None], velocity[None], np.array([mu]), along[None], none, none)[0]
        for along in (tiny, -force[1:])
    )
    assert by_slip > 0.5
    assert by_friction == pytest.approx(1e-14, abs=0.0)
    edge = posed(np.eye(dim), velocity - force, mu, dim)
    assert fuzz_coulomb.law_error(edge, force) < 1e-14


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
    few = ["--scenes", "1", "--shaped", "1", "--solid", "0", "--solid-shaped", "0", *NO_REGIONS, "--coulomb", "1"]
    line = [*few, "--seed", str(GOOD_SEED), "--out", str(tmp_path)]
    code = fuzz.main(line)
    header, *lines = table_of(tmp_path)
    assert header == HEADER == [
        "seed", "kind", "form", "outcome", "reason", "increments",
        "worst_residual", "worst_law", "worst_disagreement", "seconds",
    ]  # fmt: skip
    assert [row[1].split()[0] for row in lines] == ["scene", "shaped", "coulomb"]
    assert code == int(any(row[3] in FAILURES for row in lines))
    said = capsys.readouterr().out.splitlines()[-1]
    assert sum(int(part.split()[0]) for part in said.split(", ")) == 3
    assert fuzz.main(line) == code
    assert table_of(tmp_path) == [header, *lines]
    assert capsys.readouterr().out.splitlines()[-1] == said


@pytest.mark.slow
def test_processes_find_what_they_are_given(tmp_path):
    command = [sys.executable, "-m", "studies.fuzz", *NO_OTHERS, "--scenes", "0", "--coulomb", "2", "--jobs", "2"]
    ended = subprocess.run([*command, "--out", tmp_path], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(table_of(tmp_path)) == 3


@pytest.mark.parametrize(("outcome", "code"), [(o, int(o.value in FAILURES)) for o in Outcome])
def test_exit_code_says_whether_anything_is_wrong(tmp_path, monkeypatch, outcome, code):
    row = Row(0, "scene block", "tangent", outcome, "a\nreason", 1, 0.0, 0.0, 0.0, 0.0)
    monkeypatch.setitem(tasks.JUDGES, "scene", lambda seed: replace(row, seed=seed))
    assert fuzz.main(["--scenes", "2", *NO_OTHERS, "--out", str(tmp_path)]) == code


def test_ctrl_c_is_quiet_and_keeps_what_is_done(tmp_path, monkeypatch):
    def stop(seed):
        if seed == 1:
            raise KeyboardInterrupt
        return Row(seed, "scene block", "tangent", Outcome.CERTIFIED, "", 1, 0.0, 0.0, 0.0, 0.0)

    monkeypatch.setitem(tasks.JUDGES, "scene", stop)
    assert fuzz.main(["--scenes", "3", *NO_OTHERS, "--out", str(tmp_path)]) == 130
    assert len(table_of(tmp_path)) == 2


@pytest.mark.parametrize("bad", [["--scene", "3"], ["--scenes", "-1"], ["--jobs", "0"]])
def test_abbreviated_and_bad_options_are_refused(bad, capsys):
    with pytest.raises(SystemExit):
        fuzz.main(bad)
    assert bad[0] in capsys.readouterr().err or "unrecognized" in capsys.readouterr().err


def test_what_tools_take_of_loads_at_once_sets_the_scale_of_their_balance():
    """A pressure pulls the face of a block onto a tool with 150 times the forces within the block."""
    assert fuzz_judge.judge_scene(950322, others=False).outcome is Outcome.CERTIFIED


def test_a_run_is_left_in_an_increment_that_takes_too_long(monkeypatch):
    monkeypatch.setattr(fuzz_judge, "LONGEST", 0.0)
    row = fuzz_judge.judge_scene(GOOD_SEED, others=False)
    assert (row.outcome, row.increments) == (Outcome.REFUSED, 0)
    assert row.reason == "left in an increment after 0 s of processor time"
