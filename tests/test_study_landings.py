"""The study of located landings in fast mode: columns, where it cuts, what is left the same, its figure."""

import numpy as np
import pytest

from bipot.laws.flow import Integration
from paper_figs import fig_landings
from studies import landings
from studies.landings import Course
from studies.tables import read_csv


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("landings")
    assert landings.main(["--fast", "--out", str(out)]) == 0
    return out


@pytest.mark.slow
def test_a_located_run_ends_an_increment_at_the_landing_and_is_the_same_before(results):
    rows = read_csv(results / "landings.csv", "")
    assert len(rows) == 5
    for integration in Integration:
        inside, located = (r for r in rows if r["integration"] == integration.value and r["increments"] == 12)
        assert (inside["located"], located["located"]) == (0, 1)
        assert located["accepted"] == inside["accepted"] + 1
        assert located["force_20_N"] == inside["force_20_N"]
        assert located["force_45_N"] != inside["force_45_N"]
        # The side of this mesh lands once; the event lies inside the increment that held it.
        assert inside["landings"] == located["landings"] == 1
        assert 0.36 < located["first_landing"] < inside["first_landing"] < 0.45
    assert rows[-1]["curve_error"] == 0


@pytest.mark.slow
def test_the_figure_reads_results_only(results, tmp_path, capsys):
    fig_landings.main(["--results", str(results), "--out", str(tmp_path)])
    assert (tmp_path / "fig_landings.png").read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.split()) == 2
    with pytest.raises(SystemExit, match=r"run: python -m studies\.landings"):
        fig_landings.main(["--results", str(tmp_path / "nothing")])


def course(reduction, force):
    found = (np.array(reduction), np.array(force))
    return Course(Integration.BDF2, False, 1, *found, (), 0, 0)


def test_the_curves_error_is_taken_at_the_ends_of_its_own_increments():
    reference = course([0.0, 0.2, 0.4, 0.6], [2.0, 2.0, 2.0, 9.0])
    assert course([0.1, 0.3], [2.2, 2.2]).error(reference, 0.4) == pytest.approx(0.1)
    assert course([0.1, 0.3, 0.5], [2.2, 2.2, 50.0]).error(reference, 0.3) == pytest.approx(0.1)


def test_an_unwritable_folder_is_refused_before_the_first_march(tmp_path, monkeypatch, capsys):
    monkeypatch.delattr(landings, "course")
    (tmp_path / "file").touch()
    assert landings.main(["--fast", "--out", str(tmp_path / "file" / "results")]) == 2
    assert "file/results: cannot be written (Not a directory)" in capsys.readouterr().err


@pytest.mark.slow
def test_a_resumed_study_measures_kept_runs_by_the_reference_as_if_never_stopped(results, tmp_path, monkeypatch):
    def stopped(*asked):
        if asked[2] == 16:
            raise KeyboardInterrupt
        return course(*asked)

    course = landings.course
    monkeypatch.setattr(landings, "course", stopped)
    assert landings.main(["--fast", "--out", str(tmp_path)]) == 130
    assert all(np.isnan(row["curve_error"]) for row in read_csv(tmp_path / "landings.csv", ""))
    made = []
    monkeypatch.setattr(landings, "course", lambda *asked: made.append(asked[2]) or course(*asked))
    assert landings.main(["--fast", "--resume", "--out", str(tmp_path)]) == 0
    assert made == [16]
    assert (tmp_path / "landings.csv").read_text() == (results / "landings.csv").read_text()
