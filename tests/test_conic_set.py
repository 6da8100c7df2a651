"""The conic test set: shipped programs have the optima they say by another solver, and are read in ten lines."""

import csv
import re
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bipot.conic.problem import Cone
from bipot.conic.qoco import Qoco
from bipot.conic.solver import Accuracy
from bipot.conic.stored import load
from bipot.errors import ProgramError
from bipot.forms import FormName
from studies import conic_profiles, conic_set
from studies.conic_scenes import COURSES, Course, Ends, Moment, Pick
from studies.performance import TOLERANCES

DATA = Path(__file__).parent / "data" / "conic"
FILES = sorted(DATA.glob("*.npz"))
WHOLE = Path(__file__).parents[1] / "docs" / "results" / "conic_set.csv"


def rows_of(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_there_are_forty_of_each_scene_form_and_moment_from_50_to_10000_cones():
    names = [course.name(pick) for course in COURSES for pick in course.picks]
    assert len(set(names)) == len(names) == 40
    rows = rows_of(WHOLE)
    assert [row["name"] for row in rows] == names
    sizes = [int(row["second_order_cones"]) + int(row["conditions"]) for row in rows]
    assert 50 <= min(sizes) < 60
    assert 9000 < max(sizes) < 10_000
    kinds = Counter((row["scene"], row["form"]) for row in rows)
    assert len(kinds) == 8
    assert min(kinds.values()) >= 4
    assert {row["moment"] for row in rows} == {moment.value for moment in Moment}
    measures = ("dual_residual", "primal_residual", "duality_gap", "dual_violation")
    assert max(float(row[measure]) for row in rows for measure in measures) < 1e-8


def test_the_shipped_part_is_small_and_is_the_tables():
    assert sum(path.stat().st_size for path in DATA.iterdir()) < 600_000
    rows = {row["name"]: row for row in rows_of(DATA / "conic_set.csv")}
    assert sorted(rows) == [path.stem for path in FILES]
    assert sorted(rows) == sorted(course.name(pick) for course in COURSES if course.small for pick in course.picks)
    for path in FILES:
        program, answer = load(path)
        row = rows[path.stem]
        cones = sum(block.count for block in program.rows if block.cone is Cone.SECOND_ORDER)
        assert (len(program.q), cones) == (int(row["variables"]), int(row["second_order_cones"]))
        assert all(block.count for block in program.rows)
        assert answer.error() < 1e-9
        # How a product is summed depends on where in memory its numbers are.
        assert program.cost(answer.x) == pytest.approx(float(row["optimum"]), rel=1e-13)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_another_solver_finds_the_same_optimum(path):
    """The stored answers are Clarabel's."""
    program, answer = load(path)
    other, _ = Qoco().solve(program, Accuracy(1e-9, 200))
    assert other.error() < 1e-7
    assert program.cost(other.x) == pytest.approx(program.cost(answer.x), rel=1e-6)


def ten_lines():
    (code,) = re.findall(r"```python\n(.*?)```", (DATA / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    return code


def test_ten_lines_read_a_program_into_any_solver(monkeypatch):
    assert (DATA / "README.md").read_bytes() == conic_set.README.read_bytes()
    code = ten_lines()
    assert len(list(filter(None, code.splitlines()))) == 10
    monkeypatch.chdir(DATA)
    (first,) = re.findall(r'np\.load\("(.*?)"\)', code)
    for name in (first, "extrusion10-tangent-first_yield.npz"):
        found = {}
        exec(
            compile(code.replace(first, name).replace('"CLARABEL"', '"SCS", eps_rel=1e-8'), "README.md", "exec"), found
        )
        assert found["optimum"] == pytest.approx(float(found["f"]["optimum"][0]), rel=1e-6)


def test_a_program_is_made_again_as_it_is_shipped():
    (course,) = (course for course in COURSES if (course.scene, course.elements, course.small) == ("ring", 3, True))
    ((pick, accepted, program),) = course.programs()
    assert pick.moment is Moment.FIRST_YIELD
    assert accepted.number == 1
    shipped, answer = load(DATA / f"{course.name(pick)}.npz")
    assert np.abs(program.P - shipped.P).max() < 1e-9 * np.abs(shipped.P).max()
    assert np.abs(program.q - shipped.q).max() < 1e-9 * np.abs(shipped.q).max()
    best = conic_set.best(program)
    assert best.error() < 1e-10
    assert program.cost(best.x) == pytest.approx(program.cost(answer.x), rel=1e-8)


def test_the_best_answer_needs_one(monkeypatch):
    def fails(*given):
        raise ProgramError("stopped")

    monkeypatch.setattr(conic_set.Clarabel, "solve", fails)
    with pytest.raises(ProgramError, match="Clarabel answers to none"):
        conic_set.best(load(FILES[0])[0])


def test_of_many_increments_the_first_and_the_last_are_kept():
    ends = Ends.of([0, 1, -1, -2])
    for number in range(10):
        ends.add(number)
        assert len(ends.kept) <= 4
    assert [ends.kept[k] for k in (0, 1, -1, -2)] == [0, 1, 9, 8]


def test_programs_are_named_by_what_they_are():
    course = Course("ring", 3, 1, ())
    names = [course.name(Pick(FormName.TANGENT, Moment.LANDING, which)) for which in (0, 1, -1, -2)]
    assert names == [f"ring3-tangent-landing{end}" for end in ("", "-1", "-last", "-last1")]


def test_profiles_are_of_our_residuals(tmp_path, capsys):
    folder, out = tmp_path / "set", tmp_path / "out"
    folder.mkdir()
    for path in (FILES[0], FILES[-1]):
        shutil.copy(path, folder)
    asked = ["--set", str(folder), "--out", str(out)]
    assert conic_profiles.main([*asked, "--solvers", "clarabel", "scs"]) == 0
    assert "clarabel  2  2" in capsys.readouterr().out
    rows = rows_of(out / "solved.csv")
    assert [(row["id"], row["solver"]) for row in rows] == [
        (path.stem, name) for path in (FILES[0], FILES[-1]) for name in ("clarabel", "scs")
    ]
    assert all(0 < float(row["residual"]) < 1e-6 for row in rows)
    assert all(float(row["objective_off"]) < 1e-6 for row in rows)
    assert (out / "profile.png").read_bytes().startswith(b"\x89PNG")
    assert conic_profiles.main([*asked, "--solvers", "qoco", "--resume"]) == 0
    assert len(rows_of(out / "solved.csv")) == 6
    assert conic_profiles.main([*asked, "--solvers", "mosec", "--resume"]) == 2
    assert "--solvers = 'mosec': must be one of clarabel, qoco, scs" in capsys.readouterr().err


def test_a_solver_without_an_answer_has_solved_nothing():
    class Fails:
        def solve(self, *given):
            raise ProgramError("stopped")

    row = conic_profiles.measure("a", load(FILES[0])[0], 1.0, "fails", Fails())
    assert (row.status, row.residual) == ("ProgramError", np.inf)


def test_solvers_that_know_no_cones_are_left_out():
    found = conic_profiles.installed()
    assert {"clarabel", "qoco", "scs"} <= found.keys()
    assert not found.keys() & {"osqp", "highs", "scipy"}


def test_a_folder_without_programs_is_refused(tmp_path, capsys):
    assert conic_profiles.main(["--set", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "no programs; run: python -m studies.conic_set" in capsys.readouterr().err


def test_the_pages_table_is_counted_from_its_file():
    rows = rows_of(WHOLE.with_name("conic_solved.csv"))
    page = (WHOLE.parents[1] / "conic_set.md").read_text(encoding="utf-8")
    for name, *counts in re.findall(r"^\| (\w+) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|$", page, re.MULTILINE):
        own = [float(row["residual"]) for row in rows if row["solver"] == name.lower()]
        assert len(own) == 40
        assert [sum(residual <= tol for residual in own) for tol in TOLERANCES] == [int(count) for count in counts]
