"""Jumps of the force on meshes that are fine where the side lands: a fast run, and what is kept of a whole one."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from studies.accuracy import rolling
from studies.accuracy.rolling import FAST, LANDING, SIZE, Plan, Row, key
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"


def test_the_fast_study_writes_what_its_march_comes_to(tmp_path):
    """Of 9 edges in the landing part all but one come to lie on the punch, and none above it."""
    assert rolling.main(["--fast", "--out", str(tmp_path)]) == 0
    (row,) = read_rows(tmp_path / "rolling.csv", Row)
    (mesh,) = FAST.meshes
    assert (row.radial, row.axial, row.fine) == (mesh.radial, mesh.axial, mesh.fine)
    assert row.increments >= FAST.increments
    assert 0 < row.first_landing <= row.reduction <= 0.45
    assert 0 < row.landings < mesh.fine
    assert 0 < row.scatter < 0.05
    assert abs(row.off_20) < 0.02


@pytest.mark.parametrize("mesh", Plan().meshes)
def test_the_fine_part_of_the_side_is_at_its_end(mesh):
    side = mesh.scene(0.3).mesh
    ends = np.unique(side.nodes[side.boundary_nodes("side"), 1])
    assert len(ends) == mesh.axial + 1
    np.testing.assert_allclose(np.diff(ends)[-mesh.fine :], LANDING / mesh.fine)
    assert np.diff(ends)[: -mesh.fine].min() > LANDING / mesh.fine
    assert ends[-1] == SIZE


def test_a_mesh_with_twice_the_elements_a_side_has_them_in_the_same_places():
    for coarse, fine in pairwise(Plan().meshes):
        assert (fine.radial, fine.axial, fine.fine) == (2 * coarse.radial, 2 * coarse.axial, 2 * coarse.fine)


def test_the_kept_jumps_are_as_the_page_says():
    """At most 0.5 % with the elements of a square mesh of 20 a side, and less than half of that with those of 10."""
    rows = read_rows(KEPT / "rolling.csv", Row)
    assert [key(row) for row in rows] == [(mu, mesh.radial, mesh.axial) for mesh, mu in Plan().runs()]
    coarse, fine = rows
    assert [row.radial * row.axial for row in rows] == [10**2, 20**2]
    assert fine.scatter <= 0.005
    assert fine.scatter <= coarse.scatter / 2
    assert max(abs(fine.off_20), abs(fine.off_45)) < 0.015
