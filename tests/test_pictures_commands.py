"""The commands that summarise a run and draw pictures of it, and how they end."""

import subprocess
import sys
import tomllib
from pathlib import Path

import h5py
import pytest

import bipot
from bipot.command import main
from bipot.plot.contours import moment
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import Column
from studies import picture
from tests.recording import SCENE, steps


@pytest.mark.slow
def test_the_study_draws_as_the_command_does(recorded, tmp_path, capsys):
    pictures = [tmp_path / "one.png", tmp_path / "other.png"]
    asked = [str(recorded), "--field", "mises", "--at", "0.1", "--out"]
    assert picture.main([*asked, str(pictures[0])]) == main(["picture", *asked, str(pictures[1])]) == 0
    assert capsys.readouterr().out == f"{pictures[0]}\n{pictures[1]}\n"
    assert pictures[0].read_bytes() == pictures[1].read_bytes()


def test_the_command_says_its_version(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"bipot {bipot.__version__}\n"


def test_the_command_draws_and_says_where(recorded, tmp_path, capsys):
    for name, options in {
        "traction.pdf": ["--traction", "0"],
        "by.svg": ["--field", "stress_zz", "--at", "0.5", "--by", "tau"],
    }.items():
        assert main(["picture", str(recorded), *options, "--out", str(tmp_path / name)]) == 0
        assert capsys.readouterr().out == f"{tmp_path / name}\n"
        assert (tmp_path / name).stat().st_size > 5000


def test_without_a_place_the_picture_is_in_the_folder_of_the_run(recorded, tmp_path, capsys):
    (tmp_path / "run.vtkhdf").write_bytes((recorded / "run.vtkhdf").read_bytes())
    assert main(["picture", str(tmp_path), "--field", "peeq", "--at", "0.2"]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'peeq_0.2.png'}\n"


@pytest.mark.slow
def test_pictures_of_other_steps_have_other_names(recorded, tmp_path):
    (tmp_path / "run.vtkhdf").write_bytes((recorded / "run.vtkhdf").read_bytes())
    for options in ([], ["--at", "0.2"], ["--at", "0.2", "--by", "tau"], ["--at", "0.1"], ["--at", "0.10000001"]):
        assert main(["picture", str(tmp_path), *options]) == 0
    names = {"mises", "mises_0.2", "mises_tau_0.2", "mises_0.1", "mises_0.10000001"}
    assert {path.stem for path in tmp_path.glob("*.png")} == names


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--field", "temperature"], "error: field = 'temperature': must be one of"),
        (["--at", "0.9"], "error: reduction = 0.9: must be in [0.001, 0.2]"),
        (["--by", "tau"], "error: --by = 'tau': must be left out without --at, whose column it is"),
        (["--by", "form", "--at", "1"], "error: by = 'form': must be tau, or a column"),
        (["--traction", "3"], "error: tool = 3: must be in [0, 1)"),
        (["--out", "picture.xyz"], "error: --out = picture.xyz: must end in one of"),
        (["--out", "picture"], "error: --out = picture: must end in one of"),
        (["--out", "nowhere/picture.png"], "error: nowhere/picture.png: cannot be written"),
        (["--at", "0.1", "--out", "a.gif"], "error: --out = a.gif: must not end in .gif with --traction, --at or --by"),
    ],
)
def test_bad_pictures_end_with_one_sentence(recorded, tmp_path, monkeypatch, capsys, options, words):
    monkeypatch.chdir(tmp_path)
    assert main(["picture", str(recorded), *options]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith(words)
    assert told.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("argv", [[], ["draw"], ["info"], ["picture", "x", "--at", "half"], ["info", "x", "--fie"]])
def test_a_command_line_that_is_none_ends_with_code_2(argv, capsys):
    with pytest.raises(SystemExit) as stop:
        main(argv)
    assert stop.value.code == 2
    assert "usage: bipot" in capsys.readouterr().err


def test_info_says_what_the_run_holds(recorded, capsys):
    run = open_results(recorded)
    assert main(["info", str(recorded)]) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"{recorded / 'run.vtkhdf'}: complete, {len(run)} increments to tau = 1\n")
    for words in ("elements = 2", "Q8 elements, axisymmetric", "MPa" if "stress" in run.units else "N/mm^2"):
        assert words in told
    for name in run.columns:
        assert f"\n  {name} " in told
    assert f"  {run['work_J'][-1]}\n" in told


def test_info_of_what_is_no_run_is_one_sentence(recorded, tmp_path, capsys):
    (tmp_path / "mu0.1").mkdir()
    assert main(["info", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"error: {tmp_path}: no results (run.vtkhdf missing)\n"
    (tmp_path / "mu0.1" / "run.vtkhdf").write_bytes(b"")
    assert main(["info", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"error: {tmp_path}: holds runs in mu0.1: name one of these\n"
    assert main(["info", str(tmp_path / "mu0.1")]) == 2
    told = capsys.readouterr().err
    assert told.startswith("error: ")
    assert told.count("\n") == 1
    with h5py.File(tmp_path / "run.vtkhdf", "w") as file:
        file["a\nb"] = 1
    assert main(["info", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("package", ["matplotlib", "PIL"])
def test_what_is_not_installed_is_said(recorded, tmp_path, monkeypatch, capsys, package):
    for module in ("bipot.command", "bipot.plot.animation"):
        monkeypatch.setattr(f"{module}.find_spec", lambda name: None if name == package else object())
    assert main(["picture", str(recorded), "--out", str(tmp_path / "a.gif")]) == 2
    told = capsys.readouterr().err
    assert {"matplotlib": "a picture needs matplotlib", "PIL": "needs pillow"}[package] in told
    assert "pip install bipot[studies]" in told


def test_the_console_entry_point_is_the_command():
    told = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())
    assert told["project"]["scripts"] == {"bipot": f"{main.__module__}:{main.__name__}"}


def test_the_package_is_the_command_too():
    run = subprocess.run([sys.executable, "-m", "bipot", "info", "none"], capture_output=True, text=True)
    assert run.returncode == 2
    assert "none: no results" in run.stderr


def test_info_tells_names_and_values_of_several_lines_in_one(tmp_path, capsys):
    own = Column("a\nb", "", lambda _, a: "c\r\nd")
    with Recorder(tmp_path, SCENE, (own,), {"e\nf": "g\n  columns, with the last value:"}, {}) as out:
        out.record(steps()[0])
    assert main(["info", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.split("\n")
    assert ["a\\nb", "c\\r\\nd"] in [line.split() for line in lines]
    assert "  e\\nf = g\\n  columns, with the last value:" in lines


def test_a_column_of_words_called_reduction_names_no_moment(tmp_path):
    """The run has its pseudo-times, as one without that column does."""
    column = Column("reduction", "how much", lambda system, accepted: "some")
    with Recorder(tmp_path, SCENE, (column,), {}, {}) as recorder:
        recorder.record(steps()[0])
    run = open_results(tmp_path)
    assert moment(run, run.at()).startswith("step 1, tau = ")
    assert main(["picture", str(tmp_path), "--out", str(tmp_path / "picture.png")]) == 0
