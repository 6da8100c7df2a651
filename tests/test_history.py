"""A run on disk: recorded, interrupted, refused, read back, resumed; progress."""

import csv
import io
import shutil
import subprocess
import sys
from dataclasses import fields
from itertools import islice
from pathlib import Path

import h5py
import numpy as np
import pytest

from bipot.columns import COURSE, INCREMENT, SECONDS, Column, certificate, energies
from bipot.errors import IncrementFailed, ResultsError, SceneError
from bipot.forms import Tangent
from bipot.hdf5 import journal
from bipot.laws.flow import Flow
from bipot.marching import Control, Schedule, march
from bipot.progress import Bar, Progress, terminal
from bipot.response import State
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from bipot.scene import upsetting

SCENE = upsetting(mu=0.3, elements=2, reduction=0.2)
SCHEDULE = Schedule(4, first=0.005)
CONTROL = Control(Tangent())
REDUCTION = Column("reduction", "of the height", lambda _, a: 0.2 * a.state.tau)
COLUMNS = (INCREMENT, REDUCTION, *energies("J", 1e-3), *COURSE, *certificate("J", 1e-3), SECONDS)
PARAMETERS = {"mu": 0.3, "elements": 2, "hardening": None, "form": "tangent"}
UNITS = {"length": "mm", "force": "N"}
HEADER = (
    "increment,reduction,work_J,elastic_J,plastic_J,friction_J,energy_error,passes,cuts,form,reason,"
    "route,contraction,coupling_steps,undetermined,below_resolution,"
    "equilibrium,tool_equilibrium,yield_violation,penetration,cone_violation,law,bipotential_gap_J,relative_gap,seconds"
)


def recorder(folder, existing=Existing.REFUSE, start=None, **changed):
    return Recorder(folder, SCENE, COLUMNS, {**PARAMETERS, **changed}, UNITS, existing=existing, start=start)


@pytest.fixture(scope="module")
def accepted():
    return list(march(SCENE, SCHEDULE, CONTROL))


@pytest.fixture(scope="module")
def folder(accepted, tmp_path_factory):
    """A complete run on disk."""
    path = tmp_path_factory.mktemp("results") / "mu0.3"
    with recorder(path) as out:
        for increment in accepted:
            out.record(increment)
    return path


def test_header_is_the_columns_in_their_order(folder):
    assert (folder / "history.csv").read_text().splitlines()[0] == HEADER


def test_rows_read_back_exactly(folder, accepted):
    history = open_results(folder)
    assert history.complete
    assert len(history) == len(accepted)
    assert history["increment"].tolist() == [a.number for a in accepted]
    assert history["reduction"].tolist() == [0.2 * a.state.tau for a in accepted]
    assert history["equilibrium"].tolist() == [a.solved.certificate.equilibrium for a in accepted]
    assert history["form"].tolist() == [a.form.value for a in accepted]
    assert history["reason"].tolist() == [a.reason for a in accepted]
    assert history["passes"].dtype.kind == "i"


def test_energies_are_those_of_the_whole_body_in_the_asked_unit(folder, accepted):
    history = open_results(folder)
    assert SCENE.images == 2
    np.testing.assert_allclose(history["work_J"], [1e-3 * a.energies.work for a in accepted], rtol=1e-15)
    gap = [2e-3 * a.solved.certificate.gap for a in accepted]
    np.testing.assert_allclose(history["bipotential_gap_J"], gap, rtol=1e-15)


def arrays(state):
    """Everything a state holds, its flow included."""
    own = [np.asarray(getattr(state, f.name)) for f in fields(State) if f.name != "flow"]
    return own + [np.asarray(getattr(state.flow, f.name)) for f in fields(Flow)]


def test_states_and_mesh_read_back_exactly(folder, accepted):
    history = open_results(folder)
    for row, a in enumerate(accepted):
        state = history.state(row)
        for read, written in zip(arrays(state), arrays(a.state), strict=True):
            np.testing.assert_array_equal(read, written)
    np.testing.assert_array_equal(history.mesh.nodes, SCENE.mesh.nodes)
    np.testing.assert_array_equal(history.mesh.boundary("top"), SCENE.mesh.boundary("top"))
    np.testing.assert_array_equal(history.nodal("velocity", 2)[:, :2], accepted[2].state.velocity)


def test_unknown_names_are_refused_with_the_known_ones(folder):
    history = open_results(folder)
    with pytest.raises(SceneError, match=r"column = 'force': must be one of \['increment'"):
        history["force"]
    with pytest.raises(SceneError, match="field = 'temperature': must be one of"):
        history.nodal("temperature")


def test_text_with_commas_and_lines_survives(tmp_path, accepted):
    said = 'tangent: 3 passes left equilibrium = 2, "cone" = 1;\ncut'
    columns = (INCREMENT, Column("reason", "", lambda _, a: said), Column("x", "", lambda _, a: np.float64(0.1)))
    with Recorder(tmp_path / "run", SCENE, columns, PARAMETERS, UNITS) as out:
        out.record(accepted[0])
    assert open_results(tmp_path / "run")["reason"].tolist() == [said]
    assert open_results(tmp_path / "run")["x"].tolist() == [0.1]


def test_every_history_has_the_energy_error_asked_for_or_not(tmp_path, folder, accepted):
    with Recorder(tmp_path / "run", SCENE, (INCREMENT,), PARAMETERS, UNITS) as out:
        for increment in accepted:
            out.record(increment)
    assert list(open_results(tmp_path / "run").columns) == ["increment", "energy_error"]
    history = open_results(folder)
    spent = history["elastic_J"] + history["plastic_J"] + history["friction_J"]
    expected = (history["work_J"] - spent) / history["work_J"]
    assert np.abs(expected).max() > 1e-5
    for found in (history, open_results(tmp_path / "run")):
        np.testing.assert_allclose(found["energy_error"], expected, atol=1e-13)


def test_every_row_is_on_disk_at_once(tmp_path, accepted):
    with recorder(tmp_path / "run") as out:
        for count, increment in enumerate(accepted[:3], start=1):
            out.record(increment)
            with (tmp_path / "run/history.csv").open(newline="") as file:
                assert len(list(csv.reader(file))) == 1 + count
            assert len(open_results(tmp_path / "run")) == count


def interrupted(folder, accepted, count):
    """A run stopped by Ctrl-C after ``count`` increments."""
    with recorder(folder) as out:
        for increment in islice(accepted, count):
            out.record(increment)
        raise KeyboardInterrupt


def test_an_interrupted_run_goes_on_in_its_folder_as_if_nothing_had_been(tmp_path, folder, accepted):
    with pytest.raises(KeyboardInterrupt):
        interrupted(tmp_path / "run", accepted, 5)
    history = open_results(tmp_path / "run")
    assert not history.complete
    assert len(history) == 5
    with recorder(tmp_path / "run", existing=Existing.RESUME) as out:
        for increment in march(SCENE, SCHEDULE, CONTROL, out.start):
            out.record(increment)
    resumed, whole = open_results(tmp_path / "run"), open_results(folder)
    assert resumed.complete
    for name in set(whole.columns) - {"seconds"}:
        np.testing.assert_array_equal(resumed[name], whole[name])
    for row in range(len(whole)):
        for read, written in zip(arrays(resumed.state(row)), arrays(whole.state(row)), strict=True):
            np.testing.assert_array_equal(read, written)


def test_a_complete_run_is_not_marched_again(tmp_path, folder):
    shutil.copytree(folder, tmp_path / "run")
    with recorder(tmp_path / "run", existing=Existing.RESUME) as out:
        assert list(march(SCENE, SCHEDULE, CONTROL, out.start)) == []
    assert (tmp_path / "run/history.csv").read_bytes() == (folder / "history.csv").read_bytes()
    assert open_results(tmp_path / "run").complete


def test_what_does_not_go_on_from_the_last_increment_is_refused(tmp_path, accepted):
    with recorder(tmp_path) as out:
        out.record(accepted[0])
        with pytest.raises(ResultsError, match=r"increment 3 .* does not go on from increment 1"):
            out.record(accepted[2])
        # A march from the state alone counts anew.
        with pytest.raises(ResultsError, match=r"increment 1 .* does not go on from increment 1"):
            out.record(next(march(SCENE, SCHEDULE, CONTROL, start=accepted[0].state)))
    assert len(open_results(tmp_path)) == 1


def test_a_run_of_another_start_has_that_as_its_step_zero(tmp_path, accepted):
    with recorder(tmp_path / "run", start=accepted[3].course) as out:
        assert out.start.number == 4
        out.record(accepted[4])
    history = open_results(tmp_path / "run")
    for read, written in zip(arrays(history.start.state), arrays(accepted[3].state), strict=True):
        np.testing.assert_array_equal(read, written)
    assert history["increment"].tolist() == [5]
    other = upsetting(mu=0.3, elements=1, reduction=0.2)
    with pytest.raises(SceneError, match=r"start\."):
        Recorder(tmp_path / "other", other, COLUMNS, {}, {}, start=accepted[3].state)


def test_a_failed_increment_gets_the_history_so_far(tmp_path, accepted):
    def fails():
        with recorder(tmp_path / "run") as out:
            out.record(accepted[0])
            out.record(accepted[1])
            raise IncrementFailed("use more increments", accepted[1].state)

    with pytest.raises(IncrementFailed) as caught:
        fails()
    assert len(caught.value.history) == 2
    assert not caught.value.history.complete


def test_a_run_without_increments_is_readable_and_resumes_from_rest(tmp_path):
    with recorder(tmp_path / "run"):
        pass
    history = open_results(tmp_path / "run")
    assert len(history) == 0
    assert ",".join(history.columns) == HEADER
    assert history.end.state.tau == 0
    assert history.end.number == 0
    with pytest.raises(SceneError, match="row = -1"):
        history.state()


def test_other_parameters_are_refused_before_anything_is_touched(folder):
    before = (folder / "history.csv").read_bytes()
    with pytest.raises(ResultsError, match=r"mu0\.3: holds a run with elements = 2, not 20"):
        recorder(folder, elements=20)
    with pytest.raises(ResultsError, match="fast = absent, not True"):
        recorder(folder, fast=True)
    with pytest.raises(ResultsError, match="hardening = None, not absent"):
        Recorder(folder, SCENE, COLUMNS, {k: v for k, v in PARAMETERS.items() if k != "hardening"}, UNITS)
    assert (folder / "history.csv").read_bytes() == before


def test_a_run_is_left_alone_unless_asked(tmp_path, folder):
    shutil.copytree(folder, tmp_path / "run")
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    said = r"run: holds a complete run: resume it \(--resume\), or overwrite it \(--overwrite\)"
    with pytest.raises(ResultsError, match=said):
        recorder(tmp_path / "run")
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before


def test_a_run_is_overwritten_when_asked(tmp_path, accepted):
    for count in (3, 2):
        with recorder(tmp_path / "run", existing=Existing.OVERWRITE) as out:
            for increment in accepted[:count]:
                out.record(increment)
    assert len(open_results(tmp_path / "run")) == 2
    assert not open_results(tmp_path / "run").complete


@pytest.mark.parametrize("mu", [np.inf, 0.1])
def test_parameters_compare_as_they_are_stored(tmp_path, mu):
    for _ in range(2):
        with recorder(tmp_path / "run", Existing.RESUME, mu=mu, radii=(1, 2)):
            pass
    assert open_results(tmp_path / "run").parameters["mu"] == mu


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ResultsError, match=r"file.run: cannot be written"), recorder(tmp_path / "file" / "run"):
        pass


def test_missing_results_name_the_command(tmp_path):
    with pytest.raises(ResultsError, match=r"nowhere: no results .*; run: python -m studies\.upsetting"):
        open_results(tmp_path / "nowhere", "python -m studies.upsetting")
    with pytest.raises(ResultsError, match="no results"):
        open_results(Path("/nonexistent"))


def test_two_columns_of_one_name_are_refused(tmp_path):
    with pytest.raises(SceneError, match="of different names"):
        Recorder(tmp_path, SCENE, (INCREMENT, INCREMENT), PARAMETERS, UNITS)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_is_silent_unless_stderr_is_a_terminal(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert type(terminal()) is Progress
    # Closed, as where a study is started by a desktop.
    monkeypatch.setattr(sys, "stderr", None)
    assert type(terminal()) is Progress
    monkeypatch.setattr(sys, "stderr", Terminal())
    bar = terminal()
    assert isinstance(bar, Bar)
    bar.start("mu = 0.3")
    bar.advance(0.25, "F = 30 kN")
    bar.advance(1.0)
    bar.close()
    assert "mu = 0.3 100 %" in sys.stderr.getvalue()


def test_silence_writes_nothing(capfd):
    silent = Progress()
    silent.start("run")
    silent.advance(0.5, "note")
    silent.close()
    assert capfd.readouterr() == ("", "")


def test_the_library_imports_without_its_optional_extras():
    code = (
        "import sys; sys.modules['matplotlib'] = sys.modules['tqdm'] = None; "
        "import bipot, bipot.results, bipot.plot, bipot.progress"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_is_longer_than_the_count_covers_is_cut_back_and_said(tmp_path, accepted):
    with recorder(tmp_path) as out:
        for increment in accepted[:2]:
            out.record(increment)
    with h5py.File(tmp_path / "run.vtkhdf", "r+") as file:
        for name in ("bipot/steps/peeq", "VTKHDF/Points", "bipot/history"):
            file[name].resize(len(file[name]) + 7, axis=0)
    assert len(open_results(tmp_path)) == 2
    with recorder(tmp_path, Existing.RESUME) as out:
        assert out.note == "what was written after increment 2 was not complete and is left out"
        for increment in accepted[2:]:
            out.record(increment)
    history = open_results(tmp_path)
    assert history.complete
    np.testing.assert_array_equal(history.state(5).peeq, accepted[5].state.peeq)
    np.testing.assert_array_equal(history.state(5).nodes, accepted[5].state.nodes)


def test_what_is_shorter_is_named(tmp_path, accepted):
    with recorder(tmp_path) as out:
        out.record(accepted[0])
    with h5py.File(tmp_path / "run.vtkhdf", "r+") as file:
        file["VTKHDF/CellData/mises"].resize(1, axis=0)
    with pytest.raises(ResultsError, match=r"CellData/mises: rows = 1: must be 8 for 2 steps"):
        recorder(tmp_path, Existing.RESUME).__enter__()
    with h5py.File(tmp_path / "run.vtkhdf", "r+") as file:
        del file["VTKHDF/CellData/mises"]
    with recorder(tmp_path, Existing.RESUME) as out, pytest.raises(ResultsError, match="CellData/mises is missing"):
        out.record(accepted[1])


@pytest.mark.parametrize("name", ["run.vtkhdf", "history.csv", "run.lock", "run.vtkhdf.new"])
def test_a_folder_in_the_way_of_a_file_is_said(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(ResultsError, match=r"cannot be written|history\.csv without|run\.vtkhdf: is no file"):
        recorder(tmp_path).__enter__()


def test_a_full_disk_leaves_what_was_recorded_and_the_run_goes_on_when_there_is_room(tmp_path, accepted, monkeypatch):
    with recorder(tmp_path) as out:
        out.record(accepted[0])
        with monkeypatch.context() as patched:
            patched.setattr(journal.os, "write", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left")))
            with pytest.raises(ResultsError, match=r"cannot be written .*No space left.* 1 increments are recorded"):
                out.record(accepted[1])
        # What was half appended must not be taken for a step later.
        with pytest.raises(ResultsError, match="nothing more is written"):
            out.record(accepted[1])
    assert len(open_results(tmp_path)) == 1
    with recorder(tmp_path, Existing.RESUME) as out:
        for increment in accepted[1:]:
            out.record(increment)
    assert open_results(tmp_path).complete


def test_what_is_interrupted_in_the_middle_of_a_step_is_not_gone_on_with(tmp_path, accepted, monkeypatch):
    with recorder(tmp_path) as out:
        out.record(accepted[0])
        with monkeypatch.context() as patched:
            patched.setattr("bipot.results.vtkhdf.cell_fields", lambda _: (_ for _ in ()).throw(KeyboardInterrupt()))
            with pytest.raises(KeyboardInterrupt):
                out.record(accepted[1])
        with pytest.raises(ResultsError, match="cannot be written"):
            out.record(accepted[1])
    assert len(open_results(tmp_path)) == 1
    np.testing.assert_array_equal(open_results(tmp_path).state().stress, accepted[0].state.stress)
