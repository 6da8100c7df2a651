"""A run goes on in the folder it was begun in, wherever the process goes meanwhile."""

import os

import pytest

from bipot import results
from bipot.errors import ResultsError
from bipot.results.recorder import Recorder
from tests.recording import COLUMNS, SCENE, complete, recorder, steps


def test_a_run_is_recorded_where_it_was_begun_wherever_the_process_goes(tmp_path, monkeypatch):
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    monkeypatch.chdir(here)
    with recorder("mine") as out:
        for increment in steps():
            out.record(increment)
            os.chdir(there)
    run = results.open(here / "mine")
    assert run.complete
    assert (here / "mine" / "history.csv").read_bytes() == run.text.encode()
    assert sorted(file.name for file in (here / "mine").iterdir()) == ["history.csv", "run.vtkhdf", "tools.vtkhdf"]
    assert not list(there.iterdir())


def test_a_recorder_made_before_the_process_goes_elsewhere_begins_where_it_was_made(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = recorder("mine")
    (tmp_path / "there").mkdir()
    monkeypatch.chdir("there")
    with made:
        pass
    assert (tmp_path / "mine" / "run.vtkhdf").is_file()


def test_an_opened_run_is_read_where_it_was_opened(tmp_path, monkeypatch):
    complete(tmp_path / "mine")
    # Under the same name there is nothing elsewhere, and then another run.
    (tmp_path / "there").mkdir()
    monkeypatch.chdir(tmp_path)
    run = results.open("mine")
    monkeypatch.chdir("there")
    assert run.nodal("mises").shape == (len(run.mesh.nodes),)
    assert run.write_tools() == tmp_path / "mine" / "tools.vtkhdf"


def test_a_path_from_a_working_directory_that_is_gone_is_refused(tmp_path, monkeypatch):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    for make in (lambda: results.open("mine"), lambda: Recorder("mine", SCENE, COLUMNS, {}, {})):
        with pytest.raises(ResultsError, match=r"mine: cannot be read or written \(no working directory"):
            make()
