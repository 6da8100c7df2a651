"""``run.vtkhdf``: read back through VTK's own reader, and while it is being written."""

import json
import platform

import h5py
import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import reference
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from bipot.errors import ResultsError
from bipot.fem.elements import Quadrature, tabulated
from bipot.forms import Tangent
from bipot.hdf5 import growing, storage
from bipot.hdf5.checked import opened
from bipot.laws.coulomb import Status
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.paper import upsetting
from bipot.results import Recorder
from bipot.results.fields import NO_CANDIDATE

PARAMETERS = {"mu": 0.3, "elements": 3, "form": "tangent"}
UNITS = {"length": "mm", "force": "N", "stress": "MPa"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A written run: path, system, accepted increments."""
    scene = upsetting(mu=0.3, elements=3, reduction=0.2)
    system = system_of(scene)
    folder = tmp_path_factory.mktemp("run")
    accepted = []
    with Recorder(folder, scene, (), PARAMETERS, UNITS) as out:
        for increment in march(scene, Schedule(3, first=0.005, settling=1, growth=4.0), Control(Tangent())):
            accepted.append(increment)
            out.record(increment)
    path = folder / "run.vtkhdf"
    return path, system, accepted


@pytest.fixture(scope="module")
def every(run):
    """(time, points, nodal arrays, cell arrays) of step 0 and every increment, by VTK's reader."""
    reader = vtkHDFReader()
    assert reader.CanReadFile(str(run[0]))
    reader.SetFileName(str(run[0]))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    out = []
    for time in times:
        reader.UpdateTimeStep(time)
        grid = reader.GetOutput()
        nodal, cell = grid.GetPointData(), grid.GetCellData()
        out.append(
            (
                time,
                vtk_to_numpy(grid.GetPoints().GetData()).copy(),
                {
                    nodal.GetArrayName(i): vtk_to_numpy(nodal.GetArray(i)).copy()
                    for i in range(nodal.GetNumberOfArrays())
                },
                {cell.GetArrayName(i): vtk_to_numpy(cell.GetArray(i)).copy() for i in range(cell.GetNumberOfArrays())},
            )
        )
    return out


@pytest.fixture(scope="module")
def steps(every):
    """Those of the increments."""
    return every[1:]


def test_vtk_reads_the_body_at_rest_as_step_zero(run, every):
    _, system, _ = run
    time, points, nodal, cell = every[0]
    node = system.candidates.node
    assert time == 0
    np.testing.assert_array_equal(points[:, :2], system.body.scene.mesh.nodes)
    for name in ("displacement", "velocity", "contact_force"):
        assert not nodal[name].any()
    assert not nodal["contact_pressure"][node].any()
    assert (nodal["status"][node] == Status.OPEN).all()
    np.testing.assert_allclose(nodal["gap"][node], 5 - points[node, 1], atol=1e-14)
    assert not any(values.any() for values in cell.values())


def test_vtk_chooses_the_reader_by_the_name(run):
    """What ParaView asks of a file before it is opened: its ending is that of VTKHDF, and the reader takes it."""
    assert run[0].suffix == ".vtkhdf"
    assert vtkHDFReader().CanReadFile(str(run[0]))


def test_vtk_reads_times_points_displacement_and_velocity_of_every_increment(run, steps):
    _, _, accepted = run
    assert [step[0] for step in steps] == [a.state.tau for a in accepted]
    for (_, points, nodal, _), a in zip(steps, accepted, strict=True):
        np.testing.assert_array_equal(points[:, :2], a.state.nodes)
        np.testing.assert_array_equal(nodal["velocity"][:, :2], a.state.velocity)
        np.testing.assert_array_equal(nodal["displacement"][:, :2], a.displacement)
        assert not points[:, 2].any()
        assert not nodal["velocity"][:, 2].any()


def test_vtk_reads_contact_fields_of_every_increment(run, steps):
    _, system, accepted = run
    node = system.candidates.node
    others = np.setdiff1d(np.arange(len(steps[0][1])), node)
    for (_, _, nodal, _), a in zip(steps, accepted, strict=True):
        result = a.traction
        np.testing.assert_array_equal(nodal["contact_pressure"][node], result.recovered_pressure)
        np.testing.assert_array_equal(nodal["contact_shear"][node], result.recovered_shear)
        np.testing.assert_array_equal(nodal["status"][node], result.status)
        assert (nodal["status"][others] == NO_CANDIDATE).all()
        assert np.isnan(nodal["gap"][others]).all()
        # The punch pushes down, and friction holds the outward flow back.
        np.testing.assert_allclose(nodal["contact_force"][node, 1], -a.solved.r[:, 0], atol=0)
        assert (nodal["contact_force"][:, 0] <= 0).all()
        gap = a.state.nodes[node, 1] - (5 - a.state.tau * 0.2 * 5)
        np.testing.assert_allclose(-nodal["gap"][node], gap, atol=1e-12)


def test_vtk_reads_cell_averages_weighted_by_volume(run, steps):
    _, _, accepted = run
    for (_, _, _, cell), a in zip(steps, accepted, strict=True):
        volume = a.solved.response.kinematics.volume
        total = np.sum(volume * a.state.peeq)
        assert np.sum(volume.sum(axis=1) * cell["peeq"]) == pytest.approx(total, rel=1e-12, abs=1e-12)
        mises = np.sum(volume * a.mises, axis=1) / volume.sum(axis=1)
        np.testing.assert_allclose(cell["mises"], mises, rtol=1e-12)
        mandel = np.sum(volume[..., None] * a.state.stress, axis=1) / volume.sum(axis=1)[:, None]
        np.testing.assert_allclose(cell["stress"][:, :3], mandel[:, :3], rtol=1e-12)
        np.testing.assert_allclose(cell["stress"][:, 3] * np.sqrt(2), mandel[:, 3], rtol=1e-12)
        assert not cell["stress"][:, 4:].any()
        np.testing.assert_allclose(cell["plastic_strain"][:, :3].sum(axis=1), 0, atol=1e-12)


def test_vtk_interpolates_as_our_shape_functions(run):
    path, _, accepted = run
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    reader.UpdateTimeStep(accepted[-1].state.tau)
    grid, rule = reader.GetOutput(), tabulated(Element.Q8, Quadrature.RADON7)
    elements = h5py.File(path, "r")["bipot/mesh/elements"][...]
    for e, nodes in enumerate(elements):
        expected = rule.values @ accepted[-1].state.nodes[nodes]
        for point, place in zip(rule.points, expected, strict=True):
            x, weights = [0.0] * 3, [0.0] * 8
            grid.GetCell(e).EvaluateLocation(reference(0), [*point, 0.0], x, weights)
            np.testing.assert_allclose(x[:2], place, rtol=1e-12)


def test_the_file_says_what_was_asked_in_which_units_by_which_versions(run):
    with h5py.File(run[0], "r") as file:
        own = json.loads(bytes(file["bipot/about"][...]))
        assert own["parameters"] == PARAMETERS
        assert own["units"] == UNITS
        versions = own["versions"]
        assert versions["python"] == platform.python_version()
        assert {"bipot", "numpy", "scipy", "cvxpy", "clarabel"} < versions.keys()
        assert own["scene"]["tools"][0]["mu"] == 0.3
        assert own["status"]["slip"] == Status.SLIP
        assert file["VTKHDF"].attrs["Version"][0] == 2


def test_full_integration_point_arrays_are_kept(run):
    path, _, accepted = run
    with h5py.File(path, "r") as file:
        for name in ("stress", "plastic_strain", "peeq"):
            stored = file[f"bipot/steps/{name}"]
            assert stored.maxshape[0] is None
            np.testing.assert_array_equal(stored[1:], [getattr(a.state, name) for a in accepted])
            assert not stored[0].any()


def test_every_number_has_a_checksum(run):
    """Flipped anywhere in the numbers, a bit is noticed by whoever reads the file, without this library."""
    found = []
    with h5py.File(run[0], "r") as file:
        file.visititems(lambda name, item: found.append((name, item.fletcher32)) if hasattr(item, "dtype") else None)
    assert len(found) > 40
    assert [name for name, checked in found if not checked] == []


def test_the_file_can_be_read_while_the_run_goes_on(run, tmp_path):
    _, system, accepted = run
    with Recorder(tmp_path / "run", system.body.scene, (), PARAMETERS, UNITS, patience=0) as out:
        for count, increment in enumerate(accepted[:2], start=1):
            out.record(increment)
            # Without the writer's help, as another process would: a copy of the bytes on disk.
            copy = tmp_path / f"copy{count}.vtkhdf"
            copy.write_bytes((tmp_path / "run/run.vtkhdf").read_bytes())
            with h5py.File(copy, "r") as file:
                assert file["VTKHDF/Steps"].attrs["NSteps"] == 1 + count
                last = file["bipot/steps/stress"][count]
            np.testing.assert_array_equal(last, increment.state.stress)


@pytest.mark.parametrize("shape", [(1, 1000, 7, 4), (5000, 3), (3, 2, 2, 2), (1, 1, 1, 5000)])
def test_what_is_written_of_a_large_body_is_in_chunks_that_are_read(shape, tmp_path, monkeypatch):
    most = 2**12
    for module in (growing, storage):
        monkeypatch.setattr(module, "LARGEST_CHUNK", most)
    rows, path = np.random.default_rng(1).random(shape), tmp_path / "file"
    with h5py.File(path, "w") as file:
        made = growing.Growing.create(file, "rows", rows)
        made.append(rows + 1)
        assert np.prod(file["rows"].chunks) * 8 <= most
    with opened(path, ResultsError) as root:
        np.testing.assert_array_equal(
            root.array("rows", "f", (2 * len(rows), *shape[1:])), np.append(rows, rows + 1, 0)
        )
