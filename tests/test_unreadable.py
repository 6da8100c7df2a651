"""A folder that holds no run, or files that are none, is refused in words."""

import h5py
import numpy as np
import pytest

from bipot.errors import ResultsError, SceneError
from bipot.forms import Newton
from bipot.marching import Control, Schedule, march
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.scene import upsetting

SCENE = upsetting(mu=0.3, elements=1, reduction=0.01)


def recorder(folder):
    return Recorder(folder, SCENE, (), {}, {})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A complete run of two increments."""
    path = tmp_path_factory.mktemp("results") / "run"
    with recorder(path) as out:
        for accepted in march(SCENE, Schedule(2), Control(Newton())):
            out.record(accepted)
    return path


def test_foreign_or_broken_files_are_refused(tmp_path):
    (tmp_path / "history.csv").write_text("increment\n")
    with pytest.raises(ResultsError, match=r"history\.csv without run\.vtkhdf"):
        recorder(tmp_path)
    (tmp_path / "run.vtkhdf").write_bytes(b"not HDF5")
    with pytest.raises(ResultsError, match=r"run\.vtkhdf: cannot be read"):
        recorder(tmp_path)


def no_run(folder, **attributes):
    """Readable curves beside an HDF5 file that has a run's parameters and nothing else."""
    (folder / "history.csv").write_text("increment\n1\n")
    with h5py.File(folder / "run.vtkhdf", "w") as file:
        file.create_group("bipot").attrs.update({"parameters": "{}", "scene": "{}", "complete": True, **attributes})


@pytest.mark.parametrize("curves", [b"", b"a,b\n1\n", b"\xff\xfe\x00", b"a\n" + b"1" * 200_000])
def test_curves_that_are_no_table_are_refused(tmp_path, curves):
    no_run(tmp_path)
    (tmp_path / "history.csv").write_bytes(curves)
    with pytest.raises(ResultsError, match=r"history\.csv: cannot be read"):
        open_results(tmp_path)


@pytest.mark.parametrize("attributes", [{"parameters": "{"}, {"scene": 3}])
def test_parameters_that_are_none_are_refused(tmp_path, attributes):
    no_run(tmp_path, **attributes)
    with pytest.raises(ResultsError, match=r"run\.vtkhdf: cannot be read"):
        open_results(tmp_path)


@pytest.mark.parametrize("ask", [open_results, recorder])
def test_a_file_of_something_else_is_refused(tmp_path, ask):
    no_run(tmp_path)
    h5py.File(tmp_path / "run.vtkhdf", "w").close()
    with pytest.raises(ResultsError, match=r"run\.vtkhdf: cannot be read"):
        ask(tmp_path)


@pytest.mark.parametrize("ask", [lambda run: run.state(), lambda run: run.nodal("gap"), lambda run: run.mesh])
def test_fields_that_are_missing_are_said(tmp_path, ask):
    no_run(tmp_path)
    with pytest.raises(ResultsError, match=r"run\.vtkhdf: cannot be read"):
        ask(open_results(tmp_path))


def test_a_folder_may_be_a_string_and_must_be_a_path(folder):
    assert len(open_results(str(folder))) == len(open_results(folder)) == 2
    with pytest.raises(SceneError, match="folder = 3: must be a path"):
        open_results(3)  # type: ignore[arg-type]


@pytest.mark.parametrize("row", [2, -3])
def test_a_row_that_is_none_is_refused(folder, row):
    run = open_results(folder)
    np.testing.assert_array_equal(run.state(-1).nodes, run.state(1).nodes)
    with pytest.raises(SceneError, match=rf"row = {row}: must be in \[-2, 2\)"):
        run.state(row)
