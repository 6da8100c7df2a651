"""The study of the corner oscillation in fast mode, its measures on fields that are known, and its figure."""

import h5py
import numpy as np
import pytest

from bipot.fem.elements import RULES, Quadrature, tabulated
from bipot.meshes.elements import Element
from bipot.paper import upsetting
from paper_figs import fig_corner
from studies import corner
from studies.corner import alternation, constraints, unevenness
from studies.tables import read_csv


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("corner")
    assert corner.main(["--fast", "--out", str(out)]) == 0
    return out


@pytest.mark.slow
def test_two_by_two_oscillates_less_than_the_over_constrained_rules(results):
    rows = {(r["mu"], r["quadrature"]): r for r in read_csv(results / "corner.csv", "")}
    assert len(rows) == 6
    for mu in (0.1, 0.3):
        locking_free = rows[mu, "gauss2"]
        for rule in ("radon7", "gauss3"):
            for measure in ("line", "corner", "inside", "corner_inside"):
                assert locking_free[measure] < 0.8 * rows[mu, rule][measure]
            assert locking_free["force_N"] < rows[mu, rule]["force_N"]
    assert all(r["worst_relative_gap"] < 1e-7 for r in rows.values())


def test_edge_means_beside_the_oscillating_values_carry_the_force_and_have_its_sign(results):
    rows = {(r["mu"], r["quadrature"]): r for r in read_csv(results / "corner.csv", "")}
    with h5py.File(results / "corner.h5", "r") as file:
        for (mu, rule), row in rows.items():
            along = {name: data[...] for name, data in file[f"curves/{corner.curve_name(mu, rule, 4)}"].items()}
            ends, mean = along["ends"], along["mean_pressure"]
            np.testing.assert_allclose(ends.ravel(), np.repeat(along["radius"][::2], 2)[1:-1])
            assert np.pi * np.diff(ends**2, axis=1)[:, 0] @ mean == pytest.approx(row["force_N"], rel=1e-8)
            assert (mean > 0).all()
            assert (np.abs(along["mean_shear"]) <= mu * mean * (1 + 1e-9)).all()
            assert np.ptp(mean) < np.ptp(along["consistent_pressure"])


@pytest.mark.parametrize(
    ("rule", "published"), [(Quadrature.GAUSS2, 1.5), (Quadrature.RADON7, 0.857), (Quadrature.GAUSS3, 0.75)]
)
def test_unknowns_per_constraint_are_those_of_the_literature(rule, published):
    count, isochoric = constraints(upsetting(mu=0.1, elements=3, quadrature=rule))
    assert count == pytest.approx(published, abs=5e-4)
    assert 0 < isochoric < 1


def test_alternation_is_the_amplitude_and_misses_cubics():
    i = np.arange(9.0)
    np.testing.assert_allclose(alternation(3 * (-1) ** i + i**3 - 5 * i), 3.0, rtol=1e-12)


@pytest.mark.parametrize("rule", RULES[Element.Q8])
def test_unevenness_is_the_size_of_what_no_linear_field_fits(rule):
    table = tabulated(Element.Q8, rule)
    x, y = 2 * table.points.T - 1
    # xi eta is orthogonal to 1, xi, eta in every rule of degree 3, and its mean square is 1/9.
    field = np.array([5 + x - 2 * y, 4 * x * y + y])
    np.testing.assert_allclose(unevenness(field, table.points, table.weights), [0, 4 / 3], rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_the_figure_reads_results_only(results, tmp_path, capsys):
    fig_corner.main(["--results", str(results), "--out", str(tmp_path)])
    assert (tmp_path / "fig_corner.png").read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.split()) == 2
    with pytest.raises(SystemExit, match=r"run: python -m studies\.corner"):
        fig_corner.main(["--results", str(tmp_path / "nothing")])
