"""Results that are there: left alone, gone on with or made anew, and whole at any moment; streams that nobody reads."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import h5py
import numpy as np
import pytest

from bipot.errors import ResultsError
<<<<<<< HEAD
from bipot.results import Existing
from studies import convergence, coupling, energy, fuzz, hard_cases, load_cases, optimisers, outputs, solvers
from studies.fuzz_row import HEADER
from studies.outputs import CHOICES, exact, opened, read_curves
from studies.tables import read_csv, read_rows, write_csv, write_hdf5
=======
from studies import outputs
from studies.outputs import CHOICES, Policy, exact, opened, read_curves
from studies.tables import read_rows, write_csv, write_hdf5
>>>>>>> h2

ROOT = Path(__file__).parents[1]


class Kind(Enum):
    """A parameter that is no number."""

    ONE = "one"


@dataclass(frozen=True)
class Line:
    """A row."""

    mu: float
    number: int
    name: str
    good: bool
    value: float


LINES = [Line(mu, k, f'a "{k}", b', k % 2 == 0, np.float64(mu / 3)) for k, mu in enumerate((0.1, 1 / 3, 0.1 + 1e-16))]
PARAMETERS = {"elements": 10, "kind": Kind.ONE, "start": 1 / 3}


def key(line):
    return line.mu, line.number


def table(folder, policy=Existing.REFUSE, parameters=None, **more):
    return opened(folder, "lines", Line, key, policy, parameters=parameters or PARAMETERS, **more)


@pytest.fixture
def made(tmp_path):
    """A folder with a table of three lines."""
    table(tmp_path).add(*LINES)
    return tmp_path


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_lines_are_exact_when_read_again(made):
    again = table(made, Existing.RESUME)
    assert again.rows == LINES
    assert all(key(line) in again for line in LINES)
    assert (float(np.nextafter(0.1, 1)), 0) not in again


def test_results_that_are_there_are_left_alone_unless_something_is_asked(made):
    before = content(made)
    with pytest.raises(ResultsError, match="holds results of this study") as refused:
        table(made)
    assert str(made) in str(refused.value)
    assert CHOICES in str(refused.value)
    assert content(made) == before


def test_nothing_is_lost_before_there_is_something_new(made):
    """What is refused after the folder was opened, or stopped, leaves the old results."""
    before = content(made)
    afresh = table(made, Existing.OVERWRITE, {**PARAMETERS, "elements": 20})
    assert content(made) == before
    afresh.add(LINES[1])
    assert read_rows(made / "lines.csv", Line)[0].number == 1
    assert table(made, Existing.RESUME, {**PARAMETERS, "elements": 20}).rows == [LINES[1]]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"elements": 20}, "holds results with elements = 10, not 20"),
        ({"start": 1 / 3 + 1e-16}, "holds results with start = 0.333"),
        ({"more": 1}, 'holds results with more = "absent", not 1'),
    ],
)
def test_results_of_other_parameters_are_refused_by_name(changed, words, made):
    before = content(made)
    with pytest.raises(ResultsError, match=words):
        table(made, Existing.RESUME, PARAMETERS | changed)
    assert content(made) == before


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("lines.parameters.json", None, "lines.parameters.json is missing"),
        ("lines.parameters.json", "{", "cannot be read"),
        ("lines.parameters.json", "[1]", "cannot be read"),
        ("lines.csv", "mu,number,name\n0.1,1,a\n", "has other columns"),
        ("lines.csv", "mu,number,name,good,value\n0.1,1.5,a,True,0\n", "line 2: number"),
        ("lines.csv", "mu,number,name,good,value\n0.1\n", "line 2: 1 values"),
        ("lines.csv", "\0\xff", "cannot be read"),
        ("lines.csv", "\0", "has other columns"),
    ],
)
def test_damaged_results_are_refused_in_a_sentence(file, text, words, made):
    (made / file).unlink() if text is None else (made / file).write_text(text, encoding="latin-1")
    with pytest.raises(ResultsError, match=words):
        table(made, Existing.RESUME)


def test_lines_are_in_the_order_of_the_study_and_kept_ones_it_did_not_ask_for_come_last(made):
    again = table(made, Existing.RESUME, order=[(0.5, 9), key(LINES[2]), key(LINES[1])])
    again.add(new := Line(0.5, 9, "", False, 0.0))
    assert [line.number for line in again.rows] == [9, 2, 1, 0]
    again.add(replace(new, value=1.0))
    assert next(line.value for line in again.rows) == 1.0
    assert read_rows(made / "lines.csv", Line)[0].value == 1.0


def test_a_line_is_kept_only_with_its_curve(tmp_path):
    def curve(line):
        return f"curve {line.number}"

    first = table(tmp_path, curve=curve)
    first.add(*LINES[:2], curves={curve(line): {"x": np.arange(3) / line.mu} for line in LINES[:2]})
    again = table(tmp_path, Existing.RESUME, curve=curve)
    np.testing.assert_array_equal(again.curves["curve 1"]["x"], np.arange(3) / LINES[1].mu)
    write_hdf5(tmp_path / "lines.h5", LINES[:2], {"curve 0": {"x": np.zeros(0)}})
    assert table(tmp_path, Existing.RESUME, curve=curve).rows == [LINES[0]]
    (tmp_path / "lines.h5").write_bytes(b"no such file")
    with pytest.raises(ResultsError, match=r"lines\.h5: cannot be read"):
        table(tmp_path, Existing.RESUME, curve=curve)
    (tmp_path / "lines.h5").unlink()
    assert table(tmp_path, Existing.RESUME, curve=curve).rows == []


def test_nan_in_a_key_is_itself():
    assert (exact(float("nan")), exact(0.1)) == (None, 0.1)


def test_a_folder_that_cannot_be_made_is_refused_at_once(tmp_path):
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file" / "a", tmp_path / ("x" * 300)):
        for policy in Existing:
            with pytest.raises(ResultsError, match=r"cannot be (written|read) \((Not a dir|File name too long)"):
                table(folder, policy)


def limited(folder, size):
    """Run in a process whose files may have ``size`` bytes: write larger tables, and say what happened."""
    code = f"""
import resource, sys
from pathlib import Path
import numpy as np
from bipot.errors import ResultsError
from studies.tables import write_csv, write_hdf5
from tests.test_outputs import LINES
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
folder = Path({str(folder)!r})
for write in (
    lambda: write_csv(folder / "lines.csv", LINES * 1000),
    lambda: write_hdf5(folder / "lines.h5", LINES, {{"a": {{"x": np.zeros(10**5)}}}}),
):
    try:
        write()
    except ResultsError as error:
        print(error)
"""
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)


def test_a_full_disk_leaves_the_old_tables_and_says_so(made):
    write_hdf5(made / "lines.h5", LINES, {"b": {"y": np.ones(3)}})
    before = content(made)
    ended = limited(made, 10_000)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.count("cannot be written (File too large)") == 2
    assert content(made) == before
    np.testing.assert_array_equal(read_curves(made / "lines.h5")["b"]["y"], np.ones(3))


def test_a_kill_at_any_moment_leaves_a_whole_table(tmp_path):
    """Many kills while a large table is written over and over: each time it is one of the two."""
    code = f"""
from pathlib import Path
from studies.tables import write_csv
from tests.test_outputs import LINES
while True:
    for lines in (LINES * 3000, LINES * 2000):
        write_csv(Path({str(tmp_path / "lines.csv")!r}), lines)
        print(flush=True)
"""
    for _ in range(3):
        with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE) as process:
            for _ in range(np.random.default_rng().integers(1, 5)):
                process.stdout.readline()
            process.kill()
        assert len(read_rows(tmp_path / "lines.csv", Line)) in (6000, 9000)


def test_a_link_to_a_table_stays_one(tmp_path):
    (tmp_path / "link.csv").symlink_to(tmp_path / "real.csv")
    write_csv(tmp_path / "link.csv", LINES)
    assert (tmp_path / "link.csv").is_symlink()
    assert len(read_rows(tmp_path / "real.csv", Line)) == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.csv", "real.csv"]


<<<<<<< HEAD
# Every study that solves for long.

FAST = ["--fast", "--out"]
STUDIES = (
    (convergence, "convergence.csv", ["--mu", "0"]),
    (coupling, "coupling.csv", []),
    (energy, "energy.csv", []),
    (hard_cases, "hard_cases.csv", ["--only", "13", "--forms", "newton", "tangent"]),
    (load_cases, "load_cases.csv", []),
    (solvers, "solvers.csv", []),
)


def test_every_study_with_a_table_has_both_options():
    scripts = [path for path in (ROOT / "studies").glob("*.py") if "__main__" in path.read_text(encoding="utf-8")]
    lacking = [path.stem for path in scripts if "add_options(" not in path.read_text(encoding="utf-8")]
    assert len(scripts) > 12
    # The parser of the first is in studies/upsetting_case.py; the second has nothing to lose.
    assert sorted(lacking) == ["comparison_page", "upsetting"]


def test_every_command_goes_through_the_one_that_ends_it():
    scripts = [path for folder in ("studies", "benchmarks") for path in (ROOT / folder).glob("*.py")]
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


@pytest.mark.parametrize(("study", "file", "asked"), STUDIES, ids=[file for _, file, _ in STUDIES])
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
    return ["--scenes", "0", "--coulomb", "3", "--out", str(folder), *more]


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


def test_a_line_that_does_not_fit_on_the_disk_is_not_there_in_part(tmp_path):
    size = len(",".join(HEADER)) + 2 + 150

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    command = [sys.executable, "-m", "studies.fuzz", *fuzz_line(tmp_path)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, preexec_fn=limit, check=False)
    assert (ended.returncode, ended.stderr.count("\n")) == (2, 1)
    assert "fuzz.csv: cannot be written" in ended.stderr
    lines = (tmp_path / "fuzz.csv").read_text().splitlines(keepends=True)
    assert 1 < len(lines) < 4
    assert all(line.endswith("\n") for line in lines)


# Standard output and error that nobody reads.


def study_with(out, folder, error=subprocess.PIPE):
    command = [sys.executable, "-m", "studies.penalty_round_off", "--fast", "--out", str(folder)]
    return subprocess.run(command, cwd=ROOT, stdout=out, stderr=error, text=True, check=False)


@pytest.fixture
def broken_pipe():
    """The end to write to of a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    yield writing
    with suppress(OSError):
        os.close(writing)


def test_a_pipe_that_nobody_reads_ends_nothing(broken_pipe, tmp_path):
    ended = study_with(broken_pipe, tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


def test_no_pipe_at_all_ends_nothing(broken_pipe, tmp_path):
    ended = study_with(broken_pipe, tmp_path, error=broken_pipe)
    assert ended.returncode == 0
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams_end_nothing_and_nothing_goes_into_files_in_their_place(closed, tmp_path):
    command = f"{sys.executable} -m studies.penalty_round_off --fast --out {tmp_path} {closed}"
    ended = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


def test_what_compiled_code_prints_goes_into_no_file_in_the_place_of_a_closed_stream(tmp_path):
    """The first file that is opened would have the number of standard output."""
    (tmp_path / "studies").mkdir()
    shutil.copy(ROOT / "studies" / "__init__.py", tmp_path / "studies")
    code = "import os\nwith open('lines.csv', 'w') as file:\n    os.write(1, b'printed')\n    file.write('kept')\n"
    (tmp_path / "studies" / "planted.py").write_text(code)
    subprocess.run(["sh", "-c", f"{sys.executable} -m studies.planted >&-"], cwd=tmp_path, check=True)
    assert (tmp_path / "lines.csv").read_text() == "kept"


def test_a_help_that_nobody_reads_is_quiet(broken_pipe):
    command = [sys.executable, "-m", "studies.penalty_round_off", "--help"]
    ended = subprocess.run(command, cwd=ROOT, stdout=broken_pipe, stderr=subprocess.PIPE, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a full disk by name")
def test_a_full_disk_under_standard_output_is_said_and_the_table_is_there(tmp_path):
    with Path("/dev/full").open("w") as full:
        ended = study_with(full, tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: ")
    assert ended.stderr.count("\n") == 1
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


def test_sigterm_ends_a_study_like_ctrl_c(tmp_path):
    command = [sys.executable, "-m", "studies.hard_cases", "--out", str(tmp_path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=120)
    assert (process.returncode, said) == (130, "stopped; what was computed is on disk\n")
    assert len(read_csv(tmp_path / "hard_cases.csv", "")) >= 1


=======
>>>>>>> h2
def test_the_table_in_hdf5_has_the_columns_of_the_other(made):
    write_hdf5(made / "lines.h5", LINES, {})
    with h5py.File(made / "lines.h5", "r") as file:
        assert list(file["table/number"]) == [0, 1, 2]
        assert file["table/name"].asstr()[2] == LINES[2].name
    assert outputs.read_curves(made / "lines.h5") == {}
