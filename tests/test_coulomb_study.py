"""The study: its table and profile by hand, and one run of its command line."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest

from bipot import coulomb
from studies import coulomb_profiles as study
from studies.performance import performance_profile, solved_table

GENERATED = Path(__file__).parent / "data" / "fclib"


def row(id, solver, residual, seconds):
    return study.Row(id, 3, 1, solver, "", residual, residual, 0.0, 1, seconds)


ROWS = [
    row("a", "fast", 1e-9, 1.0),
    row("b", "fast", 1e-5, 1.0),
    row("a", "slow", 1e-11, 4.0),
    row("b", "slow", 1e-9, 2.0),
]


def test_the_table_counts_by_residual():
    table = solved_table(ROWS)
    assert [line[0] for line in table] == ["slow", "fast"]
    assert table[0][1:6] == ["2", "2", "2", "1", "2"]
    assert table[1][1:6] == ["2", "1", "1", "0", "2"]


def test_the_profile_is_the_ratio_to_the_best_solver():
    profile = performance_profile(ROWS, 1e-8)
    np.testing.assert_allclose(profile["slow"], [1.0, 4.0])
    np.testing.assert_allclose(profile["fast"], [1.0, np.inf])


def test_the_command_line_writes_its_tables(tmp_path, capsys):
    for name in ("cards_mu0p4-00030-nc53", "pile_mu1p0-00060-nc53"):
        shutil.copy(GENERATED / f"{name}.hdf5", tmp_path)
    out = tmp_path / "out"
    arguments = ["--problems", str(tmp_path), "--solvers", "auto", "tresca", "--limit", "5", "--workers", "1"]
    assert study.main([*arguments, "--out", str(out)]) == 0
    with (out / "solved.csv").open() as file:
        rows = list(csv.DictReader(file))
    header = "id dim contacts solver status residual residual_unit_free bipotential_gap iterations seconds"
    assert list(rows[0]) == header.split()
    assert len(rows) == 4
    assert all(float(r["residual"]) <= 1e-10 for r in rows if r["solver"] == "auto")
    assert (out / "profile.csv").exists()
    assert "auto  2  2  2  2" in capsys.readouterr().out


def test_an_infeasible_file_is_called_that(tmp_path):
    H = np.array([[1.0, 0, -1, 0], [0, 1, 0, 1]])
    coulomb.write_fclib(
        tmp_path / "wedge.hdf5", coulomb.GlobalCoulombProblem(np.eye(2), H, np.zeros(2), [-1.0, 0, -1, 0], 0.2, 2)
    )
    row = study.measure((tmp_path / "wedge.hdf5", "auto"), 5.0)
    assert (row.status, row.residual) == ("infeasible", np.inf)


def test_problems_of_one_name_are_refused(tmp_path, capsys):
    for folder in ("one", "other"):
        (tmp_path / folder).mkdir()
        shutil.copy(GENERATED / "cards_mu0p4-00030-nc53.hdf5", tmp_path / folder)
    assert study.main(["--problems", *map(str, tmp_path.iterdir()), "--out", str(tmp_path / "out")]) == 2
    assert "tells problems apart by their names" in capsys.readouterr().err


def test_required_counts_fail_the_study_when_they_are_missed():
    rows = [row("a", "auto", 1e-11, 1.0), row("b", "auto", 1e-7, 1.0)]
    assert study.missed(rows, [2, 2, 1, 1]) == []
    assert study.missed(rows, [2, 2, 2, 1]) == ["1 solved at 1e-08, 2 required"]


def test_the_command_is_called_as_it_is_run(capsys):
    with pytest.raises(SystemExit) as stop:
        study.main(["--solvers", "none"])
    assert stop.value.code == 2
    assert "studies.coulomb_profiles: error: argument --solvers" in capsys.readouterr().err


def test_an_empty_folder_is_said_and_skipped(tmp_path, capsys):
    assert study.main(["--problems", str(tmp_path), "--out", str(tmp_path)]) == 0
    assert "no .hdf5 files" in capsys.readouterr().out


def test_what_is_no_folder_is_refused(tmp_path, capsys):
    """A folder of another name, or a single file, was said to hold nothing, with exit code 0."""
    for given in (tmp_path / "none", GENERATED / "cards_mu0p4-00030-nc53.hdf5"):
        assert study.main(["--problems", str(given), "--out", str(tmp_path)]) == 2
        assert f"{given}: no folder of FCLIB files" in capsys.readouterr().err
