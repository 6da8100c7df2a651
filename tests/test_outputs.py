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
from bipot.results import Existing
from studies import outputs
from studies.outputs import CHOICES, exact, opened, read_curves
from studies.tables import read_rows, write_csv, write_hdf5

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
    with pytest.raises(ResultsError, match=r"lines\.h5: its size in bytes = 12: .* it is no HDF5 file"):
        table(tmp_path, Existing.RESUME, curve=curve)
    (tmp_path / "lines.h5").unlink()
    assert table(tmp_path, Existing.RESUME, curve=curve).rows == []


CURVES = {
    "a declared size": lambda file: file.create_dataset("curves/a/x", (2**27,), "f8", chunks=(2**10,)),
    "an external link": lambda file: file.__setitem__("curves/a", h5py.ExternalLink("other.h5", "/")),
    "a soft link": lambda file: file.__setitem__("curves/a/x", h5py.SoftLink("/curves")),
    "external storage": lambda file: file.create_dataset("curves/a/x", (9,), "f8", external=[("/etc/passwd", 0, 72)]),
    "a text": lambda file: file.__setitem__("curves/a/x", "text"),
    "a loop": lambda file: file.__setitem__("curves/a/x", file.create_group("curves/b")),
    "no group": lambda file: file.__setitem__("curves/a", 3.0),
}


@pytest.mark.parametrize("make", CURVES.values(), ids=CURVES)
def test_curves_of_a_stranger_are_checked_before_they_are_read(make, tmp_path):
    with h5py.File(tmp_path / "lines.h5", "w") as file:
        make(file)
    with pytest.raises(ResultsError, match=r"lines\.h5: /curves"):
        read_curves(tmp_path / "lines.h5")


@pytest.mark.parametrize("policy", Existing)
@pytest.mark.parametrize("parameters", [PARAMETERS, {"elements": 3}], ids=["same", "other"])
def test_of_two_studies_in_one_folder_the_second_is_refused_and_no_row_is_lost(policy, parameters, tmp_path):
    if policy is Existing.RESUME:
        table(tmp_path).add(LINES[0])
        parameters = PARAMETERS
    one, other = table(tmp_path, policy), table(tmp_path, policy, parameters)
    one.add(LINES[1])
    there = content(tmp_path)
    with pytest.raises(ResultsError, match=r"lines\.csv: is written by another process"):
        other.add(LINES[2])
    assert content(tmp_path) == there
    one.add(LINES[2])
    assert table(tmp_path, Existing.RESUME).rows == one.rows


@pytest.mark.parametrize(("old", "new"), [("True", "yes"), (",1,", ",0,")])
def test_words_that_are_no_truth_and_rows_of_one_key_are_refused(old, new, tmp_path):
    table(tmp_path).add(*(replace(line, mu=0.1) for line in LINES))
    path = tmp_path / "lines.csv"
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(ResultsError, match=r"good = yes: must be one of True, False|two rows of \(0\.1, 0\)"):
        table(tmp_path, Existing.RESUME)


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


@pytest.mark.slow
def test_a_full_disk_leaves_the_old_tables_and_says_so(made):
    write_hdf5(made / "lines.h5", LINES, {"b": {"y": np.ones(3)}})
    before = content(made)
    ended = limited(made, 10_000)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.count("cannot be written (File too large)") == 2
    assert content(made) == before
    np.testing.assert_array_equal(read_curves(made / "lines.h5")["b"]["y"], np.ones(3))


@pytest.mark.slow
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


def test_the_table_in_hdf5_has_the_columns_of_the_other(made):
    write_hdf5(made / "lines.h5", LINES, {})
    with h5py.File(made / "lines.h5", "r") as file:
        assert list(file["table/number"]) == [0, 1, 2]
        assert file["table/name"].asstr()[2] == LINES[2].name
    assert outputs.read_curves(made / "lines.h5") == {}
