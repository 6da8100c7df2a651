"""The main study with the trustworthy element beside, and its forces against the limits of refined meshes."""

import csv
import re

import numpy as np
import pytest

from bipot.results import open as open_results
from studies import upsetting
from studies.known_limits import KEPT, of_run
from studies.run_names import element_of, is_papers, name_of
from studies.upsetting_beside import BESIDE
from studies.upsetting_limits import TITLE, against_limits, force_at

SMALL = ["--elements", "2", "--increments", "2", "--reduction", "0.05", "--form", "newton"]


def study(out, *more):
    return upsetting.main([*SMALL, "--out", str(out), *more])


def test_the_trustworthy_element_is_run_beside_at_the_same_node_spacing(tmp_path):
    assert study(tmp_path, "--mu", "0.1", "0.3", "--beside") == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mu0.1", "mu0.3", BESIDE]
    for mu in ("mu0.1", "mu0.3"):
        papers, trusted = open_results(tmp_path / mu), open_results(tmp_path / BESIDE / mu)
        assert element_of(papers) == "Q8"
        assert (element_of(trusted), len(trusted.mesh.elements)) == ("Q4/P0", 16)
        assert of_run(trusted) == of_run(papers)
        assert len(trusted.mesh.boundary_nodes("top")) == len(papers.mesh.boundary_nodes("top"))


def test_beside_itself_it_is_refused(tmp_path, capsys):
    assert study(tmp_path, "--mu", "0.1", "--element-type", "q4p0", "--beside") == 2
    assert "--beside has no effect on --element-type q4p0" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_linear_element_keeps_its_side_beside(tmp_path):
    assert study(tmp_path, "--mu", "0.1", "--element-type", "t3", "--beside") == 0
    assert len(open_results(tmp_path / BESIDE / "mu0.1").mesh.elements) == 4


def cells(printed):
    """Lines of the table of forces, by friction and reduction, in columns of fixed ends."""
    lines = printed[printed.index(TITLE) :].splitlines()[1:]
    head, rows = lines[0], [line for line in lines[1:] if line.split()[2:3] == ["%"]]
    ends = [match.end() for match in re.finditer(r"\S+( \d+)?", head)]
    starts = [0, *ends]
    return [[row[a:b].strip() for a, b in zip(starts, ends, strict=False)] for row in rows]


@pytest.mark.slow
def test_the_last_table_has_both_elements_and_the_limit_at_its_marks(tmp_path, capsys):
    long = ["--fast", "--reduction", "0.22", "--form", "newton", "--mu", "0.1", "0.2", "--beside"]
    assert upsetting.main([*long, "--out", str(tmp_path)]) == 0
    table = cells(capsys.readouterr().out)
    assert [row[:2] for row in table] == [["0.1", "10 %"], ["0.1", "20 %"], ["0.1", "22 %"], ["0.2", "22 %"]]
    with KEPT.open() as file:
        rows = [row for row in csv.DictReader(file) if row["quantity"] == "force_N" and row["mu"] == "0.1"]
    known = {float(row["reduction"]): row for row in rows}
    runs = [open_results(tmp_path / where / "mu0.1") for where in ("", BESIDE)]
    for row, at in zip(table, (0.1, 0.2), strict=False):
        limit = float(known[at]["value"])
        assert row[2:4] == [f"{limit:.0f}", f"{float(known[at]['band']):.0f}"]
        for run, force, off in zip(runs, row[4::2], row[5::2], strict=True):
            near = np.interp(at, run["reduction"], run["force_N"])
            assert float(force) == pytest.approx(near, rel=2e-3)
            assert off == f"{100 * (float(force) / limit - 1):+.2f} %"
    for row in table[2:]:
        # No limit is known here: blanks, and no distances.
        assert [row[2], row[3], row[5], row[7]] == [""] * 4
        assert min(float(row[4]), float(row[6])) > 25_000
    assert float(table[2][4]) == pytest.approx(runs[0]["force_N"][-1], abs=0.05)


@pytest.mark.slow
def test_forces_are_told_only_as_far_as_a_run_comes(tmp_path):
    study(tmp_path, "--mu", "0.1")
    run = open_results(tmp_path / "mu0.1")
    assert force_at(run, 0.05) == pytest.approx(run["force_N"][-1], rel=1e-12)
    assert force_at(run, 0.06) is None
    assert force_at(run, 1e-4) is None
    middle = run["reduction"][-2:].mean()
    between = (run["force_N"] * (1 - run["reduction"]))[-2:].mean() / (1 - middle)
    assert force_at(run, middle) == pytest.approx(between, rel=1e-12)


@pytest.mark.slow
def test_without_the_file_of_limits_or_for_another_material_nothing_is_compared(tmp_path, capsys):
    study(tmp_path / "seed", "--mu", "0.1", "--reduction", "0.12")
    assert TITLE in capsys.readouterr().out
    study(tmp_path / "other", "--mu", "0.1", "--reduction", "0.12", "--hardening", "linear:300,100")
    assert TITLE not in capsys.readouterr().out
    assert against_limits([open_results(tmp_path / "seed" / "mu0.1")], tmp_path / "none.csv") == ""


@pytest.mark.slow
def test_a_name_says_what_is_unusual(tmp_path):
    study(tmp_path, "--mu", "0.1", "--element-type", "q8p1", "--layout", "fanned", "--quadrature", "gauss2")
    study(tmp_path, "--mu", "0.2", "--form", "penalty")
    assert name_of(open_results(tmp_path / "mu0.1")) == "Q8/P1, gauss2, fanned, 2 a side"
    assert name_of(open_results(tmp_path / "mu0.2")) == "Q8, penalty, 2 a side"
    assert not is_papers(open_results(tmp_path / "mu0.2"))


@pytest.mark.parametrize(("sampling", "whose"), [("nodes", True), ("weighted", False)])
def test_the_papers_contact_is_at_nodes(sampling, whose, tmp_path):
    small = ("--mu", "0", "--elements", "10", "--increments", "1", "--reduction", "0.001")
    assert upsetting.main([*small, "--form", "newton", "--sampling", sampling, "--out", str(tmp_path)]) == 0
    assert is_papers(open_results(tmp_path / "mu0")) is whose
