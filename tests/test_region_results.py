"""Regions of a mesh in the file of a run: read back, shown by VTK, told by the command, and asked for on resuming."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

from bipot import DeformableTool, Elastic, Elasticity, Geometry, Support, block, together
from bipot.command import info
from bipot.errors import ResultsError, SceneError
from bipot.marching import march
from bipot.results import Existing, Recorder
from bipot.results import open as open_results
from bipot.results.description import same_mesh, same_scene
from tests.recording import COLUMNS, CONTROL, PARAMETERS, SCENE, SCHEDULE, UNITS, steps

REGIONS = {"shell": [1, 3], "core": [0, 1]}

FIRST = [1, 0, -1, 0]

PARTED = replace(SCENE, mesh=replace(SCENE.mesh, regions=REGIONS))


def recorder(folder, scene=PARTED, existing=Existing.REFUSE):
    return Recorder(folder, scene, COLUMNS, PARAMETERS, UNITS, existing=existing, patience=0.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of the scene on a mesh with regions, stopped after two increments and resumed."""
    path = tmp_path_factory.mktemp("parted")
    for count in (2, 99):
        with recorder(path, existing=Existing.RESUME) as out:
            for _, increment in zip(range(count), march(PARTED, SCHEDULE, CONTROL, out.start), strict=False):
                out.record(increment)
    return path


def test_regions_are_read_back(folder):
    run = open_results(folder)
    assert run.complete
    assert run.mesh == PARTED.mesh
    assert same_mesh(run.mesh, PARTED.mesh)
    assert run.regions == ("shell", "core")


def test_vtk_reads_the_first_region_of_each_element_in_every_step(folder):
    reader = vtkHDFReader()
    reader.SetFileName(str(folder / "run.vtkhdf"))
    reader.UpdateInformation()
    run = open_results(folder)
    for step, time in enumerate(run.times):
        reader.UpdateTimeStep(time)
        cells = reader.GetOutput().GetCellData()
        np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray("region")), FIRST)
        # Others are still those of their own step.
        expected = run.cell("peeq", step - 1) if step else np.zeros(4)
        np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray("peeq")), expected)
    with h5py.File(folder / "run.vtkhdf") as file:
        assert len(file["VTKHDF/Steps/CellDataOffsets/region"]) == len(run.times)
        assert json.loads(bytes(file["bipot/about"][...]))["regions"] == ["shell", "core"]


def test_the_field_is_described_and_read_by_name(folder):
    run = open_results(folder)
    assert run.fields["elements"]["region"] == {
        "meaning": "number of its region, of several the first; -1 in none",
        "unit": "1",
        "components": [],
    }
    for row in range(len(run)):
        np.testing.assert_array_equal(run.cell("region", row), FIRST)
    with pytest.raises(SceneError, match="field = 'region'"):
        run.nodal("region")


def test_regions_of_a_part_are_told_apart_from_the_rest_of_it(tmp_path):
    """The part is a region, too, which has all of its elements."""
    insert = replace(block(1.0, 1.0, 2, 2), regions={"insert": [1]})
    mesh = together({"die": insert, "other": replace(insert, nodes=np.add(insert.nodes, (0.0, 1.0)))})
    held = Support("die/base", 0), Support("die/base", 1), Support("other/top", 0), Support("other/top", 1)
    tools = (DeformableTool(("die/top",), ("other/base",), 0.1),)
    with recorder(tmp_path, replace(PARTED, mesh=mesh, geometry=Geometry.PLANE_STRAIN, supports=held, tools=tools)):
        pass
    run = open_results(tmp_path)
    numbers = run.at(0.0, by="tau").cell("region")
    assert [run.regions[k] for k in numbers[:5]] == ["die", "die/insert", "die", "die", "other"]


def test_without_regions_there_is_no_such_field(recorded):
    run = open_results(recorded)
    assert run.regions == ()
    assert run.mesh.regions == {}
    assert "region" not in run.fields["elements"]
    with pytest.raises(ResultsError, match="CellData/region = missing: must be of a run on a mesh with regions"):
        run.cell("region")
    with h5py.File(recorded / "run.vtkhdf") as file:
        assert "region" not in file["VTKHDF/CellData"]
        assert "region" not in file["VTKHDF/Steps/CellDataOffsets"]


def test_the_summary_names_the_regions(folder, recorded):
    assert "; boundaries axis, side, base, top; regions shell, core\n" in info(open_results(folder))
    assert "regions" not in info(open_results(recorded))


def test_the_summary_tells_the_material_of_each_region(tmp_path):
    own = Elastic(Elasticity(70_000.0, 0.25))
    with recorder(tmp_path, replace(PARTED, regions={"core": own})):
        pass
    words = info(open_results(tmp_path))
    assert f"\nmaterial: {PARTED.material!r}\nmaterial of core: {own!r}\ntools: " in words


@pytest.mark.parametrize(
    "regions", [{}, {"shell": [1, 3]}, {"core": [0, 1], "shell": [1, 3]}, {**REGIONS, "core": [0]}]
)
def test_a_run_on_a_mesh_of_other_regions_is_not_gone_on_with(folder, regions):
    other = replace(SCENE, mesh=replace(SCENE.mesh, regions=regions))
    assert not same_scene(other, PARTED)
    with pytest.raises(ResultsError, match="holds a run on another mesh"):
        recorder(folder, other, Existing.RESUME)


def test_an_increment_of_a_mesh_of_other_regions_is_not_recorded(tmp_path):
    with recorder(tmp_path) as out, pytest.raises(ResultsError, match="is of another scene"):
        out.record(steps()[0])


@pytest.mark.parametrize("said", [["core"], [1], "core", None, [["core"]], ["core", "shell", "rest"]], ids=str)
def test_regions_that_are_not_there_are_refused_in_words(folder, said, tmp_path):
    path = tmp_path / "run.vtkhdf"
    path.write_bytes((folder / "run.vtkhdf").read_bytes())
    with h5py.File(path, "r+") as file:
        if said == ["core"]:
            file["bipot/mesh/regions/0"][0] = 7
        about = json.loads(bytes(file["bipot/about"][...])) | {"regions": said}
        del file["bipot/about"]
        file["bipot/about"] = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)
    with pytest.raises(ResultsError, match="region"):
        _ = open_results(path).mesh
