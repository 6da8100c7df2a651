"""A folder that holds a run already: gone on with, overwritten, refused, mended; and what is cut off in the middle."""

import shutil
from dataclasses import replace
from itertools import islice

import h5py
import numpy as np
import pytest

from bipot.errors import ResultsError, SceneError
from bipot.forms import Newton
from bipot.hdf5 import journal
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from tests.recording import COLUMNS, CONTROL, PARAMETERS, SCENE, SCHEDULE, UNITS, arrays, recorder


def interrupted(folder, steps, count):
    """A run stopped by Ctrl-C after ``count`` increments."""
    with recorder(folder) as out:
        for increment in islice(steps, count):
            out.record(increment)
        raise KeyboardInterrupt


def test_an_interrupted_run_goes_on_in_its_folder_as_if_nothing_had_been(tmp_path, recorded, marched):
    with pytest.raises(KeyboardInterrupt):
        interrupted(tmp_path / "run", marched, 5)
    history = open_results(tmp_path / "run")
    assert not history.complete
    assert len(history) == 5
    with recorder(tmp_path / "run", existing=Existing.RESUME) as out:
        for increment in march(SCENE, SCHEDULE, CONTROL, out.start):
            out.record(increment)
    resumed, whole = open_results(tmp_path / "run"), open_results(recorded)
    assert resumed.complete
    for name in set(whole.columns) - {"seconds"}:
        np.testing.assert_array_equal(resumed[name], whole[name])
    for row in range(len(whole)):
        for read, written in zip(arrays(resumed.state(row)), arrays(whole.state(row)), strict=True):
            np.testing.assert_array_equal(read, written)


def test_a_complete_run_is_not_marched_again(tmp_path, recorded):
    shutil.copytree(recorded, tmp_path / "run")
    with recorder(tmp_path / "run", existing=Existing.RESUME) as out:
        assert list(march(SCENE, SCHEDULE, CONTROL, out.start)) == []
    assert (tmp_path / "run/history.csv").read_bytes() == (recorded / "history.csv").read_bytes()
    assert open_results(tmp_path / "run").complete


def test_what_does_not_go_on_from_the_last_increment_is_refused(tmp_path, marched):
    with recorder(tmp_path) as out:
        out.record(marched[0])
        with pytest.raises(ResultsError, match=r"increment 3 .* does not go on from increment 1"):
            out.record(marched[2])
        # A march from the state alone counts anew.
        with pytest.raises(ResultsError, match=r"increment 1 .* does not go on from increment 1"):
            out.record(next(march(SCENE, SCHEDULE, CONTROL, start=marched[0].state)))
    assert len(open_results(tmp_path)) == 1


def test_a_run_of_another_start_has_that_as_its_step_zero(tmp_path, marched):
    with recorder(tmp_path / "run", start=marched[3].course) as out:
        assert out.start.number == 4
        out.record(marched[4])
    history = open_results(tmp_path / "run")
    for read, written in zip(arrays(history.start.state), arrays(marched[3].state), strict=True):
        np.testing.assert_array_equal(read, written)
    assert history["increment"].tolist() == [5]
    other = upsetting(mu=0.3, elements=1, reduction=0.2)
    with pytest.raises(SceneError, match=r"start\."):
        Recorder(tmp_path / "other", other, COLUMNS, {}, {}, start=marched[3].state)


def test_other_parameters_are_refused_before_anything_is_touched(recorded):
    before = (recorded / "history.csv").read_bytes()
    with pytest.raises(ResultsError, match=r"mu0\.3: holds a run with elements = 2, not 20"):
        recorder(recorded, elements=20)
    with pytest.raises(ResultsError, match="fast = absent, not True"):
        recorder(recorded, fast=True)
    with pytest.raises(ResultsError, match="hardening = None, not absent"):
        Recorder(recorded, SCENE, COLUMNS, {k: v for k, v in PARAMETERS.items() if k != "hardening"}, UNITS)
    with pytest.raises(ResultsError, match="units: length = mm, not m;"):
        Recorder(recorded, SCENE, COLUMNS, PARAMETERS, {**UNITS, "length": "m"})
    changed = replace(SCENE, tools=(replace(SCENE.tools[0], travel=(0.0, -0.5)),))
    with pytest.raises(ResultsError, match=r"scene: tools\[0\]\.travel\[1\] = -1\.0, not -0\.5;"):
        Recorder(recorded, changed, COLUMNS, PARAMETERS, UNITS)
    assert (recorded / "history.csv").read_bytes() == before


def test_a_run_goes_on_by_another_schedule_and_control_unless_its_parameters_tell_them(tmp_path):
    """A march that failed may go on by shorter increments or other forms; who wants to be refused says so."""
    others, control = Schedule(8), Control(Newton(), cuts=3)
    told = {"schedule": repr(SCHEDULE), "control": repr(CONTROL)}
    for parameters in ({}, told):
        with recorder(tmp_path / str(len(parameters)), **parameters) as begun:
            begun.record(next(march(SCENE, SCHEDULE, CONTROL)))
    with recorder(tmp_path / "0", Existing.RESUME) as resumed:
        for accepted in islice(march(SCENE, others, control, resumed.start), 2):
            resumed.record(accepted)
    assert open_results(tmp_path / "0")["form"].tolist() == ["tangent", "newton", "newton"]
    for other in ({"schedule": repr(others)}, {"control": repr(control)}):
        with pytest.raises(ResultsError, match=f"holds a run with {next(iter(other))} = "):
            recorder(tmp_path / "2", Existing.RESUME, **{**told, **other})
    assert recorder(tmp_path / "2", Existing.RESUME, **told).existing is Existing.RESUME


def test_a_run_is_left_alone_unless_asked(tmp_path, recorded):
    shutil.copytree(recorded, tmp_path / "run")
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    said = r"run: holds a complete run: resume it \(Existing\.RESUME or --resume\), or overwrite it \("
    with pytest.raises(ResultsError, match=said):
        recorder(tmp_path / "run")
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before


def test_a_run_is_overwritten_when_asked(tmp_path, marched):
    for count in (3, 2):
        with recorder(tmp_path / "run", existing=Existing.OVERWRITE) as out:
            for increment in marched[:count]:
                out.record(increment)
    assert len(open_results(tmp_path / "run")) == 2
    assert not open_results(tmp_path / "run").complete


@pytest.mark.parametrize("mu", [np.inf, 0.1])
def test_parameters_compare_as_they_are_stored(tmp_path, mu):
    for _ in range(2):
        with recorder(tmp_path / "run", Existing.RESUME, mu=mu, radii=(1, 2)):
            pass
    assert open_results(tmp_path / "run").parameters["mu"] == mu


def test_what_is_longer_than_the_count_covers_is_cut_back_and_said(tmp_path, marched):
    with recorder(tmp_path) as out:
        for increment in marched[:2]:
            out.record(increment)
    with h5py.File(tmp_path / "run.vtkhdf", "r+") as file:
        for name in ("bipot/steps/peeq", "VTKHDF/Points", "bipot/history"):
            file[name].resize(len(file[name]) + 7, axis=0)
    assert len(open_results(tmp_path)) == 2
    with recorder(tmp_path, Existing.RESUME) as out:
        assert out.note == "what was written after increment 2 was not complete and is left out"
        for increment in marched[2:]:
            out.record(increment)
    history = open_results(tmp_path)
    assert history.complete
    np.testing.assert_array_equal(history.state(5).peeq, marched[5].state.peeq)
    np.testing.assert_array_equal(history.state(5).nodes, marched[5].state.nodes)


def test_what_is_shorter_is_named(tmp_path, marched):
    with recorder(tmp_path) as out:
        out.record(marched[0])
    with h5py.File(tmp_path / "run.vtkhdf", "r+") as file:
        file["VTKHDF/CellData/mises"].resize(1, axis=0)
    with pytest.raises(ResultsError, match=r"CellData/mises: rows = 1: must be 8 for 2 steps"):
        recorder(tmp_path, Existing.RESUME).__enter__()
    with h5py.File(tmp_path / "run.vtkhdf", "r+") as file:
        del file["VTKHDF/CellData/mises"]
    with recorder(tmp_path, Existing.RESUME) as out, pytest.raises(ResultsError, match="CellData/mises is missing"):
        out.record(marched[1])


@pytest.mark.parametrize("part", ["VTKHDF/CellData", "VTKHDF/Steps/PointDataOffsets"])
def test_a_file_that_lacks_a_part_is_named_and_closed(tmp_path, marched, part):
    """Left open, HDF5 wrote to a closed Python file when its objects were collected, and could end the process."""
    with recorder(tmp_path) as out:
        out.record(marched[0])
    with h5py.File(tmp_path / "run.vtkhdf", "r+") as file:
        del file[part]
    opened = h5py.h5f.get_obj_count(types=h5py.h5f.OBJ_FILE)
    with pytest.raises(ResultsError, match=r"run\.vtkhdf: cannot be gone on with"):
        recorder(tmp_path, Existing.RESUME).__enter__()
    assert h5py.h5f.get_obj_count(types=h5py.h5f.OBJ_FILE) == opened


def test_a_full_disk_leaves_what_was_recorded_and_the_run_goes_on_when_there_is_room(tmp_path, marched, monkeypatch):
    with recorder(tmp_path) as out:
        out.record(marched[0])
        with monkeypatch.context() as patched:
            patched.setattr(journal.os, "write", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left")))
            with pytest.raises(
                ResultsError, match=r"cannot be written .*No space left.* increments up to 1 are recorded"
            ):
                out.record(marched[1])
        # What was half appended must not be taken for a step later.
        with pytest.raises(ResultsError, match="nothing more is written"):
            out.record(marched[1])
    assert len(open_results(tmp_path)) == 1
    with recorder(tmp_path, Existing.RESUME) as out:
        for increment in marched[1:]:
            out.record(increment)
    assert open_results(tmp_path).complete


def test_what_is_interrupted_in_the_middle_of_a_step_is_not_gone_on_with(tmp_path, marched, monkeypatch):
    with recorder(tmp_path) as out:
        out.record(marched[0])
        with monkeypatch.context() as patched:
            patched.setattr("bipot.results.vtkhdf.cell_fields", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt()))
            with pytest.raises(KeyboardInterrupt):
                out.record(marched[1])
        with pytest.raises(ResultsError, match="cannot be written"):
            out.record(marched[1])
    assert len(open_results(tmp_path)) == 1
    np.testing.assert_array_equal(open_results(tmp_path).state().stress, marched[0].state.stress)
