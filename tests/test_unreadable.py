"""A folder that holds no run, or a run file that is damaged or made to harm, is refused; the field is named."""

import json

import h5py
import numpy as np
import pytest

from bipot.errors import ResultsError, SceneError
from bipot.forms import Newton
from bipot.marching import Control, Schedule, march
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from bipot.scene import upsetting

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


@pytest.fixture
def damaged(folder, tmp_path):
    """Makes a copy of the run that a function of its open file has changed."""

    def make(change):
        path = tmp_path / "run.vtkhdf"
        path.write_bytes((folder / "run.vtkhdf").read_bytes())
        with h5py.File(path, "r+") as file:
            change(file)
        return path

    return make


def read_all(path):
    """Everything that a run file tells."""
    run = open_results(path)
    mesh = run.mesh
    courses = [run.start, *(run.course(row) for row in range(len(run)))]
    nodal = [run.nodal(name) for name in ("displacement", "gap", "status")]
    return run, mesh, courses, nodal, run.cell("stress")


def replaced(name, make):
    """The dataset with other content, checksums and all."""

    def change(file):
        values = make(file[name][...])
        del file[name]
        file[name] = values

    return change


def about(**changed):
    return replaced(
        "bipot/about",
        lambda old: np.frombuffer(json.dumps({**json.loads(bytes(old)), **changed}).encode(), dtype=np.uint8),
    )


def at(place, value):
    def make(values):
        values[place] = value
        return values

    return make


def attribute(group, name, value):
    def change(file):
        file[group].attrs[name] = value

    return change


def soft(file):
    del file["bipot/steps/stress"]
    file["bipot/steps/stress"] = h5py.SoftLink("/bipot/steps/plastic_strain")


def outside(file):
    del file["bipot/steps/stress"]
    file["bipot/steps/stress"] = h5py.ExternalLink("other.h5", "stress")


def external(file):
    shape = file["bipot/steps/peeq"].shape
    del file["bipot/steps/peeq"]
    file.create_dataset("bipot/steps/peeq", shape, "f8", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])


def virtual(file):
    shape = file["bipot/steps/peeq"].shape
    del file["bipot/steps/peeq"]
    layout = h5py.VirtualLayout(shape, "f8")
    layout[...] = h5py.VirtualSource(".", "bipot/steps/flow_peeq", shape)
    file.create_virtual_dataset("bipot/steps/peeq", layout)


def huge(file):
    del file["bipot/steps/stress"]
    file.create_dataset("bipot/steps/stress", (3, 1, 10**9, 4), "f8", chunks=(1, 1, 100, 4))


KINDS = {
    "no steps": (attribute("VTKHDF/Steps", "NSteps", 0), "NSteps"),
    "a negative count": (attribute("VTKHDF/Steps", "NSteps", -3), "NSteps"),
    "more steps than there are": (attribute("VTKHDF/Steps", "NSteps", 10**9), "history_ends"),
    "a count of text": (attribute("VTKHDF/Steps", "NSteps", "many"), "NSteps"),
    "a count of floats": (attribute("VTKHDF/Steps", "NSteps", 2.5), "NSteps"),
    "another format": (attribute("bipot", "format", 99), "format"),
    "nothing of ours": (lambda file: file.__delitem__("bipot"), "bipot"),
    "no JSON": (replaced("bipot/about", lambda old: old[:-1]), "about"),
    "JSON of a list": (replaced("bipot/about", lambda _: np.frombuffer(b"[]", dtype=np.uint8)), "parameters"),
    "no text": (replaced("bipot/about", lambda old: np.full(9, 0xFF, dtype=np.uint8)), "about"),
    "parameters of text": (about(parameters="none"), "parameters"),
    "boundaries that are not there": (about(boundaries=["a", "b", "c", "d", "e", "f"]), "boundaries"),
    "boundaries of numbers": (about(boundaries=[1, 2, 3, 4]), "boundaries"),
    "ends that go back": (replaced("bipot/history_ends", at(1, 3)), "history_ends"),
    "ends beyond the end": (replaced("bipot/history_ends", at(2, 10**6)), "history"),
    "a row too few": (replaced("bipot/history", lambda old: np.where(old == 10, 32, old).astype(np.uint8)), "history"),
    "times that go back": (replaced("VTKHDF/Steps/Values", at(1, 1.0)), "Values"),
    "times beyond the path": (replaced("VTKHDF/Steps/Values", at(2, 7.0)), "Values"),
    "times of nothing": (replaced("VTKHDF/Steps/Values", at(2, np.nan)), "Values"),
    "a stress of nothing": (replaced("bipot/steps/stress", at((2, 0, 0, 0), np.nan)), "stress"),
    "an infinite gap": (replaced("bipot/steps/gap", at((1, 0), np.inf)), "gap"),
    "a plastic strain of another shape": (
        replaced("bipot/steps/plastic_strain", lambda old: old[:, :, :2]),
        "plastic_strain",
    ),
    "forces of other candidates": (replaced("bipot/steps/contact_force", lambda old: old[:, 1:]), "contact_force"),
    "positions of fewer nodes": (replaced("VTKHDF/Points", lambda old: old[:-3]), "Points"),
    "a stress of whole numbers": (replaced("bipot/steps/stress", lambda old: old.astype(int)), "stress"),
    "a stress of texts": (
        replaced("bipot/steps/stress", lambda old: np.full(old.shape, b"text", dtype="S4")),
        "stress",
    ),
    "fewer steps of one field": (replaced("bipot/steps/du", lambda old: old[:-1]), "du"),
    "elements of other nodes": (replaced("bipot/mesh/elements", lambda old: old + 5), "mesh"),
    "nodes of nothing": (replaced("bipot/mesh/nodes", at((0, 0), np.nan)), "nodes"),
    "a negative number of increments": (replaced("bipot/steps/number", at(1, -1)), "number"),
    "energies of nothing": (replaced("bipot/steps/energies", at((1, 0), np.nan)), "energies"),
    "a largest force below one": (replaced("bipot/steps/largest", at(2, 1e-3)), "largest"),
    "a field that is missing": (lambda file: file.__delitem__("bipot/steps/peeq"), "peeq"),
    "a soft link": (soft, "stress"),
    "an external link": (outside, "stress"),
    "external storage": (external, "peeq"),
    "a virtual dataset": (virtual, "peeq"),
    "a declared size": (huge, "stress"),
    "a group for a field": (
        lambda file: (file.__delitem__("bipot/steps/gap"), file.create_group("bipot/steps/gap")),
        "gap",
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_run_file_is_refused_by_the_name_of_the_field(damaged, kind):
    change, field = KINDS[kind]
    path = damaged(change)
    with pytest.raises(ResultsError) as refused:
        read_all(path)
    assert str(path) in str(refused.value)
    assert field in str(refused.value)


def test_an_undamaged_one_is_read(damaged):
    run, mesh, courses, _, stress = read_all(damaged(lambda file: None))
    assert len(run) == 2
    assert [course.number for course in courses] == [0, 1, 2]
    assert stress.shape == (len(mesh.elements), 6)


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
            read_all(path)


@pytest.mark.parametrize("length", [0, 1, 100, 5000, 50_000])
def test_a_run_file_that_is_cut_off_is_refused(folder, tmp_path, length):
    path = tmp_path / "run.vtkhdf"
    path.write_bytes((folder / "run.vtkhdf").read_bytes()[:length])
    with pytest.raises(ResultsError, match=r"run\.vtkhdf"):
        read_all(path)
    with pytest.raises(ResultsError, match=r"run\.vtkhdf"):
        recorder(tmp_path, Existing.RESUME)


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


@pytest.mark.parametrize("named", ["folder", "file"])
def test_a_run_of_an_older_version_is_refused_by_name(tmp_path, named):
    h5py.File(tmp_path / "run.h5", "w").close()
    with pytest.raises(ResultsError, match=r"run\.h5: was written by an older version .* run again"):
        open_results(tmp_path if named == "folder" else tmp_path / "run.h5")
    with pytest.raises(ResultsError, match=r"run\.h5: was written by an older version"):
        recorder(tmp_path)


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
