"""A run on disk: recorded row by row, read back exactly, refused in words."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bipot.errors import IncrementFailed, ResultsError, SceneError
from bipot.meshes.mesh import Mesh
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT, Column, certificate, energies
from bipot.results.description import same_mesh, same_state
from bipot.system import system_of
from tests.recording import (
    HEADER,
    PARAMETERS,
    SCENE,
    UNITS,
    arrays,
    recorder,
    steps,
)


def test_header_is_the_columns_in_their_order(recorded):
    assert (recorded / "history.csv").read_text().splitlines()[0] == HEADER


def test_rows_read_back_exactly(recorded, marched):
    history = open_results(recorded)
    assert history.complete
    assert len(history) == len(marched)
    assert history["increment"].tolist() == [a.number for a in marched]
    assert history["reduction"].tolist() == [0.2 * a.state.tau for a in marched]
    assert history["equilibrium"].tolist() == [a.solved.certificate.equilibrium for a in marched]
    assert history["form"].tolist() == [a.form.value for a in marched]
    assert history["reason"].tolist() == [a.reason for a in marched]
    assert history["passes"].dtype.kind == "i"


def test_energies_are_those_of_the_whole_body_in_the_asked_unit(recorded, marched):
    history = open_results(recorded)
    assert SCENE.images == 2
    np.testing.assert_allclose(history["work_J"], [1e-3 * a.energies.work for a in marched], rtol=1e-15)
    gap = [2e-3 * a.solved.certificate.gap for a in marched]
    np.testing.assert_allclose(history["bipotential_gap_J"], gap, rtol=1e-15)


def test_states_and_mesh_read_back_exactly(recorded, marched):
    history = open_results(recorded)
    for row, a in enumerate(marched):
        state = history.state(row)
        for read, written in zip(arrays(state), arrays(a.state), strict=True):
            np.testing.assert_array_equal(read, written)
    np.testing.assert_array_equal(history.mesh.nodes, SCENE.mesh.nodes)
    np.testing.assert_array_equal(history.mesh.boundary("top"), SCENE.mesh.boundary("top"))
    np.testing.assert_array_equal(history.nodal("velocity", 2)[:, :2], marched[2].state.velocity)


def test_where_no_row_is_said_the_last_one_is_meant(recorded, marched):
    history, last = open_results(recorded), marched[-1].state
    assert history.course().number == marched[-1].number > 3
    for read, written in zip(arrays(history.state()), arrays(last), strict=True):
        np.testing.assert_array_equal(read, written)
    np.testing.assert_array_equal(history.points("peeq"), last.peeq)
    np.testing.assert_array_equal(history.nodal("velocity")[:, :2], last.velocity)
    np.testing.assert_array_equal(history.cell("peeq"), history.cell("peeq", len(marched) - 1))
    assert (history.cell("peeq") != history.cell("peeq", 1)).any()


def test_energies_without_a_factor_are_those_of_the_march(marched):
    system, columns = system_of(SCENE), (*certificate("N mm"), *energies("N mm"))
    found = {column.name: column.value(system, marched[-1]) for column in columns}
    assert found["work_N mm"] == marched[-1].energies.work
    assert found["bipotential_gap_N mm"] == SCENE.images * marched[-1].solved.certificate.gap


def test_states_and_meshes_that_differ_in_one_thing_are_not_the_same():
    state, mesh = steps()[-1].state, SCENE.mesh
    assert not same_state(replace(state, tau=0.5 * state.tau), state)
    turned = Mesh(mesh.nodes, np.roll(mesh.elements[::-1], 1, axis=0), mesh.boundaries)
    other = Mesh(mesh.nodes, mesh.elements, dict(list(mesh.boundaries.items())[::-1]))
    fewer = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "top": mesh.boundary("top")[:-1]})
    assert not any(same_mesh(mesh, changed) for changed in (turned, other, fewer))
    assert same_mesh(mesh, Mesh(mesh.nodes, mesh.elements, mesh.boundaries))


def test_unknown_names_are_refused_with_the_known_ones(recorded):
    history = open_results(recorded)
    with pytest.raises(SceneError, match=r"column = 'force': must be one of \['increment'"):
        history["force"]
    with pytest.raises(SceneError, match="field = 'temperature': must be one of"):
        history.nodal("temperature")


@pytest.mark.parametrize("row", [1.5, "a", None, True, 10**400])
def test_rows_that_are_no_whole_numbers_are_refused(recorded, row):
    history = open_results(recorded)
    for asked in (history.snapshot, history.state, history.course):
        with pytest.raises(SceneError, match=r"row = .*: must be"):
            asked(row)
    for asked in (history.nodal, history.cell, history.points):
        with pytest.raises(SceneError, match=r"row = .*: must be"):
            asked("mises", row)
    assert history.snapshot(np.int64(0)).step == 1


@pytest.mark.parametrize("name", [[], None, 1, {}, np.array(["tau", "mises"])])
def test_names_that_are_no_strings_are_refused(recorded, name):
    history = open_results(recorded)
    with pytest.raises(SceneError, match=r"column = .*: must be a str"):
        history[name]
    for asked in (history.at().nodal, history.at().cell, history.at().points):
        with pytest.raises(SceneError, match=r"field = .*: must be a str"):
            asked(name)
    if name is not None:
        with pytest.raises(SceneError, match=r"by = .*: must be a str or None"):
            history.at(0.5, name)


def test_text_with_commas_and_lines_survives(tmp_path, marched):
    said = 'tangent: 3 passes left equilibrium = 2, "cone" = 1;\ncut'
    columns = (INCREMENT, Column("reason", "", lambda _, a: said), Column("x", "", lambda _, a: np.float64(0.1)))
    with Recorder(tmp_path / "run", SCENE, columns, PARAMETERS, UNITS) as out:
        out.record(marched[0])
    assert open_results(tmp_path / "run")["reason"].tolist() == [said]
    assert open_results(tmp_path / "run")["x"].tolist() == [0.1]


def test_every_history_has_the_energy_error_asked_for_or_not(tmp_path, recorded, marched):
    with Recorder(tmp_path / "run", SCENE, (INCREMENT,), PARAMETERS, UNITS) as out:
        for increment in marched:
            out.record(increment)
    assert list(open_results(tmp_path / "run").columns) == ["increment", "energy_error"]
    history = open_results(recorded)
    spent = history["elastic_J"] + history["plastic_J"] + history["friction_J"]
    expected = (history["work_J"] - spent) / history["work_J"]
    assert np.abs(expected).max() > 1e-5
    for found in (history, open_results(tmp_path / "run")):
        np.testing.assert_allclose(found["energy_error"], expected, atol=1e-13)


def test_every_row_is_on_disk_at_once(tmp_path, marched):
    with recorder(tmp_path / "run") as out:
        for count, increment in enumerate(marched[:3], start=1):
            out.record(increment)
            with (tmp_path / "run/history.csv").open(newline="") as file:
                assert len(list(csv.reader(file))) == 1 + count
            assert len(open_results(tmp_path / "run")) == count


def test_a_failed_increment_gets_the_history_so_far(tmp_path, marched):
    def fails():
        with recorder(tmp_path / "run") as out:
            out.record(marched[0])
            out.record(marched[1])
            raise IncrementFailed("use more increments", marched[1].state)

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


@pytest.mark.parametrize("name", ["run.vtkhdf", "history.csv", "run.lock", "run.vtkhdf.new"])
def test_a_folder_in_the_way_of_a_file_is_said(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(ResultsError, match=r"cannot be written|history\.csv without|run\.vtkhdf: is no file"):
        recorder(tmp_path).__enter__()
