"""Every study that solves for long leaves its results, goes on with them or makes them anew, and ends as all do."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from studies import convergence, coupling, energy, hard_cases, optimisers, solvers
from studies.accuracy import paced
from studies.fuzz import __main__ as fuzz
from studies.fuzz.row import HEADER
from studies.tables import read_csv
from studies.verification import __main__ as verification
from tests.test_outputs import content

ROOT = Path(__file__).parents[1]
FAST = ["--fast", "--out"]
STUDIES = (
    (convergence, "convergence.csv", ["--mu", "0"]),
    (coupling, "coupling.csv", []),
    (energy, "energy.csv", []),
    (hard_cases, "hard_cases.csv", ["--only", "13", "--forms", "newton", "tangent"]),
    (paced, "paced.csv", []),
    (solvers, "solvers.csv", []),
    (verification, "verification.csv", ["--only", "shear_lag", "bar_under_weight"]),
)
LONG = {"coupling.csv", "paced.csv"}

EACH = [pytest.param(*one, marks=[pytest.mark.slow] * (one[1] in LONG), id=one[1]) for one in STUDIES]


def test_every_study_with_a_table_has_both_options():
    """Those that read results, and a run whose answer another study keeps, have none to lose."""
    scripts = [path for path in (ROOT / "studies").rglob("*.py") if "__main__" in path.read_text(encoding="utf-8")]
    adding = ("parser_of(", "add_options(", "OPTIONS.parser()")
    without = [path for path in scripts if not any(word in path.read_text(encoding="utf-8") for word in adding)]
    lacking = {path.parent.name if path.stem == "__main__" else path.stem for path in without}
    assert len(scripts) > 12
    assert lacking <= {"alone", "block_alone", "comparison_page", "picture", "provenance", "quoted", "upsetting"}


def test_every_command_goes_through_the_one_that_ends_it():
    scripts = [path for folder in ("studies", "benchmarks") for path in (ROOT / folder).rglob("*.py")]
    mains = {
        path.stem: [ast.unparse(decorator) for decorator in node.decorator_list]
        for path in scripts
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and node.name == "main"
    }
    assert len(mains) > 15
    assert {name for name, decorators in mains.items() if decorators != ["command"]} == set()


def timeless(path):
    """A table without its seconds, which no two runs share."""
    return [{name: str(v) for name, v in row.items() if "seconds" not in name} for row in read_csv(path, "")]


@pytest.mark.parametrize(("study", "file", "asked"), EACH)
def test_a_study_leaves_goes_on_with_or_replaces_its_results(study, file, asked, tmp_path, capsys):
    line, path = [*asked, *FAST, str(tmp_path)], tmp_path / file
    code = study.main(line)
    whole, text = timeless(path), path.read_text()
    capsys.readouterr()
    assert study.main(line) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in (str(tmp_path), "--resume", "--overwrite"))
    assert said.count("\n") == 1
    assert path.read_text() == text
    assert study.main([*line, "--resume"]) == code
    assert path.read_text() == text
    lines = text.splitlines(keepends=True)
    path.write_text("".join(lines[:-1]))
    assert study.main([*line, "--resume"]) == code
    assert path.read_text().splitlines(keepends=True)[: len(lines) - 1] == lines[:-1]
    assert timeless(path) == whole
    with pytest.raises(SystemExit) as stop:
        study.main([*line, "--resume", "--overwrite"])
    assert stop.value.code == 2


def test_the_optimisers_of_one_march_are_kept_or_compared_together(tmp_path, monkeypatch):
    made = []

    def rows(compared):
        made.append(compared)
        return [optimisers.Row(o.value, 1, 0.0, 1.0, 1, 0.0, 0) for o in optimisers.Optimiser]

    monkeypatch.setattr(optimisers, "compare", lambda *asked: asked)
    monkeypatch.setattr(optimisers, "rows", rows)
    line, path = ["--fast", "--out", str(tmp_path)], tmp_path / "optimisers.csv"
    assert [optimisers.main(line), optimisers.main(line), optimisers.main([*line, "--resume"])] == [0, 2, 0]
    assert len(made) == 1
    whole = path.read_text()
    path.write_text("".join(whole.splitlines(keepends=True)[:-1]))
    assert optimisers.main([*line, "--resume"]) == 0
    assert len(made) == 2
    assert path.read_text() == whole


def test_a_table_of_the_short_form_is_not_gone_on_with_by_the_long_one(tmp_path, capsys):
    line = ["--mu", "0", "--out", str(tmp_path)]
    assert convergence.main([*line, "--fast"]) == 0
    before = content(tmp_path)
    assert convergence.main([*line, "--resume"]) == 2
    assert "holds results with at_elements = 2, not 10" in capsys.readouterr().err
    assert content(tmp_path) == before


# The fuzz study appends.


def fuzz_line(folder, *more):
    return [
        "--scenes",
        "0",
        "--shaped",
        "0",
        "--solid",
        "0",
        "--solid-shaped",
        "0",
        "--regional",
        "0",
        "--solid-regional",
        "0",
        "--parts",
        "0",
        "--solid-parts",
        "0",
        "--coulomb",
        "3",
        "--out",
        str(folder),
        *more,
    ]


@pytest.mark.parametrize("lost", [1, 40, 0])
def test_what_a_kill_left_of_a_last_line_is_run_again(lost, tmp_path):
    assert fuzz.main(fuzz_line(tmp_path)) == 0
    path = tmp_path / "fuzz.csv"
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) - lost])
    assert fuzz.main(fuzz_line(tmp_path)) == 0
    seconds = HEADER.index("seconds")
    again = path.read_bytes().splitlines()
    assert [line.split(b",")[:seconds] for line in again] == [line.split(b",")[:seconds] for line in whole.splitlines()]


@pytest.mark.slow
def test_a_fuzz_table_is_made_afresh_when_asked_and_a_strangers_is_refused(tmp_path, capsys):
    path = tmp_path / "fuzz.csv"
    assert fuzz.main(fuzz_line(tmp_path, "--seed", "7")) == 0
    assert fuzz.main(fuzz_line(tmp_path, "--overwrite")) == 0
    assert [line.split(",")[0] for line in path.read_text().splitlines()[1:]] == ["0", "1", "2"]
    for text in ("seed,kind\n1,2\n", ",".join(HEADER) + "\nx" * 2 + "\n", "\xff\xfe"):
        path.write_text(text, encoding="latin-1")
        assert fuzz.main(fuzz_line(tmp_path)) == 2
        assert "fuzz.csv: " in capsys.readouterr().err
        assert path.read_text(encoding="latin-1") == text


@pytest.mark.slow
def test_a_line_that_does_not_fit_on_the_disk_is_not_there_in_part(tmp_path):
    resource, size = pytest.importorskip("resource"), len(",".join(HEADER)) + 2 + 150

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    command = [sys.executable, "-m", "studies.fuzz", *fuzz_line(tmp_path)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, preexec_fn=limit, check=False)
    assert (ended.returncode, ended.stderr.count("\n")) == (2, 1)
    assert "fuzz.csv: cannot be written" in ended.stderr
    lines = (tmp_path / "fuzz.csv").read_text().splitlines(keepends=True)
    assert 1 < len(lines) < 4
    assert all(line.endswith("\n") for line in lines)
