"""A folder that holds no run, or a run file that is damaged or made to harm, is refused; the field is named."""

import json

import h5py
import numpy as np
import pytest

from bipot.command import main
from bipot.errors import ResultsError, SceneError
from bipot.forms import Newton
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from tests.corpus import case, runs, whole
from tests.corpus.hdf5 import of_dataset
from tests.corpus.refusals import refused

SCENE = upsetting(mu=0.3, elements=1, reduction=0.01)


def recorder(folder, existing=Existing.REFUSE):
    return Recorder(folder, SCENE, (), {}, {}, existing=existing)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A complete run of two increments."""
    path = tmp_path_factory.mktemp("results") / "run"
    with recorder(path) as out:
        for accepted in march(SCENE, Schedule(2), Control(Newton())):
            out.record(accepted)
    return path


@pytest.mark.slow
def test_a_damaged_run_file_is_refused_by_the_name_of_the_field(folder, tmp_path):
    found = list(runs.cases(folder / "run.vtkhdf", tmp_path))
    assert len(refused("tests.corpus.runs:read_all", folder / "run.vtkhdf", found)) == len(runs.KINDS) > 35


def test_a_run_file_that_is_none_is_refused(folder, tmp_path):
    valid = folder / "run.vtkhdf"
    for answer in refused(
        "tests.corpus.runs:read_all", valid, list(case.damaged(valid, tmp_path, whole.DAMAGES))
    ).values():
        assert answer.message.startswith("ResultsError")


LONG = [pytest.param(field, marks=pytest.mark.slow) for field in ("bipot/steps/gap", "bipot/mesh/nodes")]


@pytest.mark.slow
@pytest.mark.parametrize("field", ["bipot/steps/stress", "VTKHDF/Points", *LONG])
def test_a_dataset_that_is_not_what_it_should_be_is_refused(folder, tmp_path, field):
    valid = folder / "run.vtkhdf"
    # With that link the group gets a heap, by which it is refused first.
    found = [made for made in of_dataset(valid, field, tmp_path) if made.kind != "external link"]
    assert len(refused("tests.corpus.runs:read_all", valid, found)) > 8


def test_an_undamaged_one_is_read(folder):
    run, mesh, courses, _, stress, tools = runs.read_all(folder / "run.vtkhdf")
    assert len(run) == 2
    assert [course.number for course in courses] == [0, 1, 2]
    assert stress.shape == (len(mesh.elements), 6)
    assert [len(lines) for lines in tools] == [1, 1]


UNREAD = {"force_tol", "slip_tol", "volume"}
"""For other programs: nothing of the library reads them."""


def test_a_bit_flipped_in_any_number_is_noticed(folder, tmp_path):
    """In chunks: of each dataset that a step has, one byte of the last."""
    whole, places = (folder / "run.vtkhdf").read_bytes(), {}
    with h5py.File(folder / "run.vtkhdf", "r") as file:
        for name in ["VTKHDF/Points", *(f"bipot/steps/{name}" for name in file["bipot/steps"])]:
            data = file[name]
            if data.size and name.split("/")[-1] not in UNREAD:
                places[name] = data.id.get_chunk_info(data.id.get_num_chunks() - 1).byte_offset + 3
    assert len(places) > 15
    for name, place in places.items():
        data = bytearray(whole)
        data[place] ^= 16
        path = tmp_path / "run.vtkhdf"
        path.write_bytes(data)
        with pytest.raises(ResultsError, match=name.split("/")[-1]):
            runs.read_all(path)


@pytest.mark.parametrize("length", [0, 1, 100, 5000, 50_000])
def test_a_run_file_that_is_cut_off_is_refused(folder, tmp_path, length):
    path = tmp_path / "run.vtkhdf"
    path.write_bytes((folder / "run.vtkhdf").read_bytes()[:length])
    with pytest.raises(ResultsError, match=r"run\.vtkhdf"):
        runs.read_all(path)
    with pytest.raises(ResultsError, match=r"run\.vtkhdf"):
        recorder(tmp_path, Existing.RESUME)


def test_tools_without_their_run_are_not_deleted(tmp_path):
    kept = tmp_path / "tools.vtkhdf"
    kept.write_bytes(b"of another run")
    for existing in (Existing.REFUSE, Existing.RESUME):
        with pytest.raises(ResultsError, match=r"tools\.vtkhdf without run\.vtkhdf"):
            recorder(tmp_path, existing)
    assert kept.exists()


def test_files_that_are_no_run_are_refused(tmp_path):
    (tmp_path / "history.csv").write_text("increment\n")
    with pytest.raises(ResultsError, match=r"history\.csv without run\.vtkhdf"):
        recorder(tmp_path)
    (tmp_path / "run.vtkhdf").write_bytes(b"not HDF5")
    with pytest.raises(ResultsError, match=r"run\.vtkhdf"):
        recorder(tmp_path)
    h5py.File(tmp_path / "run.vtkhdf", "w").close()
    with pytest.raises(ResultsError, match=r"run\.vtkhdf: .*bipot"):
        open_results(tmp_path)
    with recorder(tmp_path, Existing.OVERWRITE):
        pass
    assert len(open_results(tmp_path)) == 0


def test_a_run_is_read_beside_an_unfinished_journal(tmp_path):
    with recorder(tmp_path):
        pass
    assert open_results(tmp_path).note == ""
    (tmp_path / "run.vtkhdf.journal").touch()
    assert "the last write was interrupted and is not begun" in open_results(tmp_path).note


def test_a_run_may_be_named_by_its_folder_or_its_file(folder, tmp_path):
    assert len(open_results(str(folder))) == len(open_results(folder / "run.vtkhdf")) == 2
    with pytest.raises(SceneError, match="path = 3: must be a path"):
        open_results(3)  # type: ignore[arg-type]
    other = tmp_path / "of another name.vtkhdf"
    other.write_bytes((folder / "run.vtkhdf").read_bytes())
    assert len(open_results(other)) == 2


@pytest.mark.parametrize("row", [2, -3])
def test_a_row_that_is_none_is_refused(folder, row):
    run = open_results(folder)
    np.testing.assert_array_equal(run.state(-1).nodes, run.state(1).nodes)
    with pytest.raises(SceneError, match=rf"row = {row}: must be in \[-2, 2\)"):
        run.state(row)


def changed(valid, path, change):
    """A copy of a run file in which something is changed, checksums and all."""
    path.write_bytes(valid.read_bytes())
    with h5py.File(path, "r+") as file:
        change(file)
    return path


def test_a_history_without_columns_is_refused(folder, tmp_path):
    """Its lines are there, a line for each step, and hold nothing."""

    def emptied(file):
        for name, values in (("history", np.full(3, ord("\n"), dtype=np.uint8)), ("history_ends", np.arange(1, 4))):
            runs.replaced(f"bipot/{name}", lambda _, values=values: values)(file)

    with pytest.raises(ResultsError, match=r"run\.vtkhdf: bipot/history: .*no columns"):
        open_results(changed(folder / "run.vtkhdf", tmp_path / "run.vtkhdf", emptied))


TOOLS = (3, [{}], [3], [{"candidates": "top"}], [{"candidates": None}])
TOLD = [("element", 3), ("material", None), ("regions", 3), *(("tools", tools) for tools in TOOLS)]


@pytest.mark.parametrize(("name", "value"), TOLD)
def test_a_scene_in_words_that_is_of_another_type_ends_no_command(folder, tmp_path, capsys, name, value):
    """What is told of a scene is text from elsewhere, as numbers are."""

    def told(file):
        scene = {**json.loads(bytes(file["bipot/about"][...]))["scene"], name: value}
        runs.about(scene=scene)(file)

    path = str(changed(folder / "run.vtkhdf", tmp_path / "run.vtkhdf", told))
    drawn = ["picture", path, "--traction", "0", "--out", str(tmp_path / "picture.png")]
    ended = [main(["info", path]), main(drawn)]
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == ended.count(2) == 2 - ended.count(0)
    assert all(f"scene: {name} = " in error for error in errors)
    assert errors or name == "element"
