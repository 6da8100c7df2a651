"""The study of the mesh's error in fast mode: its tables, how it extrapolates, its figure."""

import math
import shutil
from dataclasses import replace

import numpy as np
import pytest

from paper_figs import fig_mesh
from studies.accuracy import mesh
from studies.accuracy.limits import extrapolated, richardson
from studies.accuracy.row import Row
from studies.element_types import ElementType
from studies.outputs import read_curves
from studies.tables import read_csv


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("accuracy")
    assert mesh.main(["--fast", "--out", str(out)]) == 0
    return out


def test_the_element_that_does_not_lock_is_softer_and_its_pressure_is_even(results):
    rows = {(r["element"], r["elements"], r["reduction"]): r for r in read_csv(results / "mesh.csv", "")}
    assert len(rows) == 4 * len(mesh.MARKS)
    for side in (2, 4):
        papers, best = rows["q8", side, 0.45], rows["q4p0", 2 * side, 0.45]
        assert best["force_N"] < 0.98 * papers["force_N"]
        assert best["line"] < 0.1 * papers["line"]
        assert best["p_min_MPa"] > papers["p_min_MPa"] > 0
        assert best["overlap_mm"] < 1e-12


def test_profiles_carry_the_force_and_obey_the_law(results):
    for row in read_csv(results / "mesh.csv", ""):
        name = mesh.named(row["mu"], row["element"], int(row["elements"]), row["reduction"])
        along = read_curves(results / "mesh.h5")[name]
        assert (np.diff(along["radius"]) > 0).all()
        assert (np.abs(along["shear"]) <= row["mu"] * along["pressure"] * (1 + 1e-9)).all()
        if row["element"] == "q4p0":
            force = np.pi * np.trapezoid(2 * along["pressure"] * along["radius"], along["radius"])
            assert force == pytest.approx(row["force_N"], rel=0.12)


@pytest.mark.parametrize("kind", mesh.Plan().kinds)
def test_without_friction_every_element_is_exact(kind):
    """F = sigma_Y pi R^2 in logarithmic strain: 42815.427 N at 45 %."""
    *_, (end, _) = mesh.run(mesh.Job(0.0, kind, 2, 90))
    assert end.reduction == 0.45
    assert end.force_N == pytest.approx(42815.427, rel=2e-6)


def test_a_run_that_would_fold_is_told_as_far_as_it_comes():
    found = mesh.run(mesh.Job(0.3, ElementType.Q9P1, 3, 9))
    assert 0 < len(found) < len(mesh.MARKS)


@pytest.mark.parametrize(
    ("values", "limit", "uncertainty"),
    [
        ([8.0, 4.0, 2.0], 0.0, 2.0),
        ([5.0, 2.0, 1.25], 1.0, 0.25),
        ([1.0, 3.0, 2.0], 2.0, 1.0),
        ([2.0, 1.0, 1.0], 1.0, 1.0),
    ],
)
def test_what_shows_an_order_is_extrapolated_and_what_shows_none_is_uncertain(values, limit, uncertainty):
    assert richardson(values) == pytest.approx((limit, uncertainty))


def test_limits_need_two_elements_of_different_families_and_bracket_them(results):
    rows = [Row(**r) for r in read_csv(results / "mesh.csv", "")]
    one = next(row for row in rows if row.element == "q4p0")
    series = [
        replace(one, element=element, elements=side * scale, force_N=1000 + off + 8.0 / side)
        for element, scale, off in (("q4p0", 2, 1.0), ("q8p1", 1, -1.0))
        for side in (2, 4, 8)
    ]
    assert extrapolated(series[:3]) == []
    force = next(limit for limit in extrapolated(series) if limit.quantity == "force_N")
    assert force.value == pytest.approx(1000)
    assert math.isclose(force.band, 1.0, rel_tol=1e-9)


def test_the_rows_of_a_run_are_kept_or_made_together(results, tmp_path, capsys):
    for name in ("mesh.csv", "mesh.h5", "mesh.parameters.json"):
        shutil.copy(results / name, tmp_path)
    line, path = ["--fast", "--out", str(tmp_path)], tmp_path / "mesh.csv"
    assert mesh.main(line) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in (str(tmp_path), "--resume", "--overwrite"))
    whole = read_csv(path, "")
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    assert mesh.main([*line, "--resume"]) == 0
    again, lasting = read_csv(path, ""), len(whole) - len(mesh.MARKS)
    assert again[:lasting] == whole[:lasting]
    for row, before in zip(again, whole, strict=True):
        assert str(row | {"seconds": 0}) == str(before | {"seconds": 0})


def test_the_figure_reads_results_only(results, tmp_path, capsys):
    fig_mesh.main(["--results", str(results), "--out", str(tmp_path)])
    assert (tmp_path / "fig_mesh.png").read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.split()) == 2
    with pytest.raises(SystemExit, match=r"run: python -m studies\.accuracy\.mesh"):
        fig_mesh.main(["--results", str(tmp_path / "nothing")])
