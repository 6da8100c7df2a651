"""What a user of PyVista gets of a run: its mesh with all fields in any step, and its tools."""

import numpy as np
import pytest
import pyvista

from bipot.results import open as open_results
from bipot.results.names import FIELDS, Place


@pytest.fixture(scope="module")
def run(recorded):
    return open_results(recorded)


def reader_at(path, step):
    reader = pyvista.get_reader(path)
    reader.reader.SetStep(step)
    return reader.read()


def test_read_gives_the_mesh_at_the_start_with_all_fields(recorded, run):
    grid = pyvista.read(recorded / "run.vtkhdf")
    np.testing.assert_array_equal(grid.points[:, :2], run.mesh.nodes)
    np.testing.assert_array_equal(np.reshape(grid.cells, (len(run.mesh.elements), -1))[:, 1:], run.mesh.elements)
    assert set(grid.point_data) == set(FIELDS[Place.NODES])
    assert set(grid.cell_data) == set(FIELDS[Place.ELEMENTS])


def test_any_step_has_the_fields_that_the_library_reads(recorded, run):
    for step in (0, 1, len(run)):
        grid, own = reader_at(recorded / "run.vtkhdf", step), run.at(float(run.times[step]), by="tau")
        assert grid.field_data["Time"][0] == own.tau
        np.testing.assert_array_equal(grid.points[:, :2], own.nodes)
        for name in FIELDS[Place.NODES]:
            np.testing.assert_array_equal(grid.point_data[name], own.nodal(name), err_msg=name)
        for name in FIELDS[Place.ELEMENTS]:
            np.testing.assert_array_equal(grid.cell_data[name], own.cell(name), err_msg=name)


def test_tools_are_lines_in_every_step(recorded, run):
    for step in (0, 1, len(run)):
        grid, own = reader_at(recorded / "tools.vtkhdf", step), run.at(float(run.times[step]), by="tau")
        assert grid.field_data["Time"][0] == own.tau
        (line,) = own.tools
        np.testing.assert_array_equal(grid.points[:, :2], line.points)
        assert grid.cell_data["tool"].tolist() == [0]
        assert grid.celltypes.tolist() == [pyvista.CellType.POLY_LINE]
