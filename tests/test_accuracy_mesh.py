"""The study of the mesh's error in fast mode: its tables, its figure; and what its kept results claim."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from bipot.meshes.layout import Layout
from bipot.tools.tool import Sampling
from paper_figs import fig_mesh
from studies.accuracy import mesh, plan
from studies.accuracy.limits import Limit
from studies.accuracy.row import Discretisation, Row
from studies.accuracy.scatter import Scatter
from studies.element_types import ElementType
from studies.outputs import read_curves
from studies.tables import read_csv, read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("accuracy")
    assert mesh.main(["--fast", "--out", str(out)]) == 0
    return out


@pytest.mark.slow
def test_the_element_that_does_not_lock_is_softer_and_its_pressure_is_even(results):
    rows = {(str(r.of), r.elements, r.reduction): r for r in read_rows(results / "mesh.csv", Row)}
    assert len(rows) == len(plan.FAST.jobs()) * len(mesh.MARKS)
    for side in (3, 6):
        papers, best = rows["q8 tensor nodes", side, 0.45], rows["q4p0 tensor nodes", 2 * side, 0.45]
        assert best.force_N < 0.985 * papers.force_N
        assert best.line < 0.1 * papers.line
        assert best.p_min_MPa > papers.p_min_MPa > 0
        assert best.overlap_mm < 1e-12


def test_profiles_carry_the_force_and_obey_the_law(results):
    found = read_curves(results / "mesh.h5")
    for row in read_rows(results / "mesh.csv", Row):
        along = found[mesh.name(row)]
        apart = np.diff(along["radius"])
        # Of two weighted points at a crease each is of its side.
        assert (apart > 0).all() or (row.sampling == "weighted" and (apart >= 0).all())
        assert (np.abs(along["shear"]) <= row.mu * along["pressure"] * (1 + 1e-9)).all()
        assert (np.diff(along["at"]) > 0).all()
        assert (along["at"][-1], along["force_N"][-1]) == (row.reduction, row.force_N)
        assert (along["max_radius_mm"][-1], along["contact_radius_mm"][-1]) == (
            row.max_radius_mm,
            row.contact_radius_mm,
        )
        if row.element == "q4p0":
            force = np.pi * np.trapezoid(2 * along["pressure"] * along["radius"], along["radius"])
            assert force == pytest.approx(row.force_N, rel=0.12)


@pytest.mark.parametrize("series", plan.ALL, ids=lambda one: str(one.of))
def test_without_friction_every_element_is_exact(series):
    """F = sigma_Y pi R^2 in logarithmic strain: 42815.427 N at 45 %."""
    *_, (end, _) = mesh.run(plan.Job(0.0, series.of, 2, 90))
    assert end.reduction == 0.45
    assert end.force_N == pytest.approx(42815.427, rel=2e-6)


@pytest.mark.slow
def test_a_run_that_would_fold_is_told_as_far_as_it_comes():
    found = mesh.run(plan.Job(0.3, Discretisation(ElementType.Q9P1), 3, 9))
    assert 0 < len(found) < len(mesh.MARKS)
    whole = mesh.run(plan.Job(0.3, Discretisation(ElementType.Q9P1, Layout.FANNED), 3, 9))
    assert [row.reduction for row, _ in whole] == list(mesh.MARKS)


def test_limits_and_jumps_are_written_from_the_rows(results):
    limits = read_rows(results / "limits.csv", Limit)
    assert len(limits) == 3 * len(mesh.MARKS)
    assert {limit.meshes for limit in limits} == {"q4p0 tensor nodes 12, q4p0 fanned nodes 12, q8p1 fanned nodes 6"}
    for row in read_rows(results / "mesh.csv", Row):
        force = next(one for one in limits if (one.quantity, one.reduction) == ("force_N", row.reduction))
        if row.element == "q4p0":
            assert force.value == pytest.approx(row.force_N, rel=0.06)
    landed = read_rows(results / "scatter.csv", Scatter)
    assert landed
    assert all(0 < row.first_landing <= row.reduction <= 0.45 and row.landings > 0 for row in landed)


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_figure_reads_results_only(results, tmp_path, capsys):
    fig_mesh.main(["--results", str(results), "--out", str(tmp_path)])
    assert (tmp_path / "fig_mesh.png").read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.split()) == 2
    with pytest.raises(SystemExit, match=r"run: python -m studies\.accuracy\.mesh"):
        fig_mesh.main(["--results", str(tmp_path / "nothing")])


BANDS = {0.1: {0.1: 0.001, 0.2: 0.001, 0.3: 0.001, 0.4: 0.001, 0.45: 0.002}, 0.3: dict.fromkeys(mesh.MARKS, 0.005)}
"""Half widths asked of the force's limits, relative."""


def test_the_kept_limits_are_as_sharp_as_asked():
    limits = [one for one in read_rows(KEPT / "limits.csv", Limit) if one.quantity == "force_N"]
    assert {(one.mu, one.reduction) for one in limits} == {(mu, part) for mu in BANDS for part in BANDS[mu]}
    for one in limits:
        assert one.band <= BANDS[one.mu][one.reduction] * one.value
        # The finest mesh of Q9/P1 folds at 39.5 % at mu = 0.1.
        folded = {"q9"} if one.mu == 0.1 and one.reduction >= 0.4 else set()
        assert {word[:2] for word in one.meshes.split(", ")} == {"q4", "q8", "q9"} - folded


@pytest.mark.parametrize(("mu", "allowed"), [(0.1, 0.003), (0.3, 0.015)])
@pytest.mark.parametrize("reduction", [0.2, 0.45])
def test_the_default_element_is_near_the_kept_limits_with_pressures_above_zero(mu, allowed, reduction):
    """On 20 by 20, which has about the unknowns of the paper's mesh."""
    (row,) = (
        row
        for row in read_rows(KEPT / "mesh.csv", Row)
        if (row.element, row.layout, row.elements) == ("q4p0", "tensor", 20)
        and (row.mu, row.reduction) == (mu, reduction)
    )
    (force,) = (
        one.value
        for one in read_rows(KEPT / "limits.csv", Limit)
        if (one.mu, one.reduction, one.quantity) == (mu, reduction, "force_N")
    )
    assert row.force_N == pytest.approx(force, rel=allowed)
    assert row.p_min_MPa > 0


@pytest.mark.parametrize("kind", [ElementType.Q8, ElementType.Q8P1, ElementType.Q9P1])
def test_forces_of_weighted_contact_tend_to_the_limits_of_contact_at_nodes(kind):
    """From 5 to 10 to 20 a side: root of the mean square over all reductions and coefficients."""
    limits = {
        (one.mu, one.reduction): one.value for one in read_rows(KEPT / "limits.csv", Limit) if one.quantity == "force_N"
    }
    off = {5: [], 10: [], 20: []}
    for row in read_rows(KEPT / "mesh.csv", Row):
        if row.mu > 0 and row.of.element is kind and row.of.sampling is Sampling.WEIGHTED:
            off[row.elements].append(row.force_N / limits[row.mu, row.reduction] - 1)
    coarse, middle, fine = (float(np.sqrt(np.mean(np.square(found)))) for found in off.values())
    assert fine < middle < coarse
    assert fine < 0.01


def test_the_kept_jumps_shrink_with_the_mesh():
    """In the mean over the elements by half, from 40 edges between nodes a side to 80 (mu = 0.3)."""
    kept = {
        (row.element, row.layout, row.sampling, row.elements): row.scatter
        for row in read_rows(KEPT / "scatter.csv", Scatter)
        if row.mu == 0.3 and row.element != "q8"
    }
    pairs = [
        (size, kept[element, layout, sampling, 2 * n])
        for (element, layout, sampling, n), size in kept.items()
        if n == 20 and element != "q4p0" and sampling == "nodes"
    ]
    pairs += [(kept["q4p0", layout, "nodes", 40], kept["q4p0", layout, "nodes", 80]) for layout in ("tensor", "fanned")]
    assert len(pairs) == 4
    ratios = [fine / coarse for coarse, fine in pairs]
    assert np.mean(ratios) == pytest.approx(0.5, abs=0.1)
