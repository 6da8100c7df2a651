"""Closed forms against their published numbers; every figure of the paper's two runs; results missing or stopped."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from bipot import plot
from bipot.errors import SceneError
from bipot.laws.coulomb import Status
from bipot.meshes.elements import Element
from bipot.meshes.sections import cylinder
from bipot.paper import upsetting
from bipot.results import open as open_results
from paper_figs import fig2_velocity, fig_force_stroke
from paper_figs.contact_line import contact_line
from paper_figs.fig_traction import profile
from paper_figs.shown import shown
from studies.closed_forms import PAPER
from studies.quality import quality, stretch_ratios
from tests.drawn import FIGURES, REDUCTION, boxes, clashes, drawn, record

MU = (0.1, 0.3)


@pytest.mark.parametrize(
    ("reduction", "radius", "force", "rigid"),
    [
        (0.10, 5.2689571, 26164.983, 26179.939),
        (0.30, 5.9744358, 33640.693, 33659.921),
        (0.45, 6.7400726, 42815.427, 42839.900),
        (0.60, 7.9034357, 58871.212, 58904.863),
    ],
)
def test_frictionless_table(reduction, radius, force, rigid):
    at = np.array(reduction)
    assert PAPER.exact_radius(at) == pytest.approx(radius, abs=5e-8)
    assert PAPER.exact_force(at) == pytest.approx(force, abs=5e-4)
    # The slab force without friction, by its own series 1 + x/3 + O(x^2).
    mu = 1e-4
    x = 2 * mu * 5 / np.sqrt(1 - at) / (10 * (1 - at))
    assert PAPER.slab_force(at, mu) / (1 + x / 3) == pytest.approx(rigid, abs=2e-3)


def test_slab_and_bound_at_45_per_cent():
    at = np.array(0.45)
    assert PAPER.slab_force(at, 0.1) == pytest.approx(46570, abs=5)
    assert PAPER.slab_force(at, 0.3) == pytest.approx(55600, abs=5)
    assert PAPER.sticking_bound(at) == pytest.approx(63050, abs=5)
    with pytest.raises(SceneError, match="mu = 0"):
        PAPER.slab_force(at, 0.0)


def test_the_slab_slips_until_its_friction_is_the_shear_strength():
    """mu e^x = 1/sqrt3 at x = 2 mu R/h, R/h = (1 - red)^-1.5/2: (1 - red)^1.5 = mu/ln(1/(mu sqrt3))."""
    end = 1 - (0.3 / np.log(1 / (0.3 * np.sqrt(3)))) ** (2 / 3)
    assert 0.40 < end < 0.41
    assert PAPER.slips(np.array([end - 1e-9, end + 1e-9]), 0.3).tolist() == [True, False]
    assert not PAPER.slips(np.array(0.0), 0.58)


def test_the_exact_force_starts_elastic():
    strain = 1e-4
    at = np.array(-np.expm1(-strain))
    area = np.pi * (5 * np.exp(0.3 * strain)) ** 2
    assert PAPER.exact_force(at) == pytest.approx(210_000 * strain * area, rel=1e-12)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("upsetting")
    for mu in MU:
        record(folder / f"mu{mu:g}", upsetting(mu=mu, elements=3, reduction=REDUCTION))
    return folder


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
def test_figures_write_pdf_and_png(figure, results, tmp_path, capsys):
    figure.main(["--results", str(results), "--out", str(tmp_path / "figures")])
    name = figure.__name__.rpartition(".")[2]
    pdf, png = (tmp_path / "figures" / f"{name}.{kind}" for kind in ("pdf", "png"))
    assert pdf.read_bytes().startswith(b"%PDF")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().out.split() == [str(pdf), str(png)]


@pytest.mark.slow
def test_figures_go_beside_the_results_by_default(results):
    fig_force_stroke.main(["--results", str(results)])
    assert (results / "figures/fig_force_stroke.png").is_file()


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
def test_no_text_is_cut_off_or_covers_another(figure, results):
    made = drawn(figure, results)
    assert len(boxes(made)) > 5
    assert clashes(made) == []


def test_fig2_prints_the_measures_of_the_mesh_it_shows(results):
    for ax, mu in zip(drawn(fig2_velocity, results).axes, MU, strict=True):
        run = open_results(results / f"mu{mu:g}")
        nodes, mesh = run.state().nodes, run.mesh
        assert f"Jacobian ratio {quality(nodes, mesh.elements).jacobian.min():.2g} (at rest 1;" in ax.get_xlabel()
        stretch = stretch_ratios(nodes, mesh.elements, mesh.nodes).max()
        assert f"stretch ratio {stretch:.1f} (at rest 1; without friction {0.75**-1.5:.1f})" in ax.get_xlabel()
        arrows = next(c for c in ax.collections if isinstance(c, mpl.quiver.Quiver))
        # What stays in contact moves with the punch: one punch speed down.
        held = (run.nodal("status") == Status.SLIP) | (run.nodal("status") == Status.STICK)
        held &= (run.nodal("status", -2) == Status.SLIP) | (run.nodal("status", -2) == Status.STICK)
        assert held.sum() > 2
        np.testing.assert_allclose(arrows.V[held], -fig2_velocity.ARROW * 5.0, rtol=1e-9)


def test_force_stroke_shows_results_and_references(results):
    left, right = drawn(fig_force_stroke, results).axes
    lines = {line.get_label(): line for line in left.lines}
    run = open_results(results / "mu0.3")
    name = r"Q8, 9 elements, $\mu$ = 0.3"
    np.testing.assert_allclose(lines[name].get_ydata()[1:], run["force_N"] / 1e3, rtol=1e-12)
    np.testing.assert_allclose(lines[name].get_xdata()[1:], 10 * run["reduction"], rtol=1e-12)
    exact = lines[r"exact without friction, $\mu$ = 0"].get_ydata()[-1]
    assert exact == pytest.approx(PAPER.exact_force(np.array(REDUCTION)) / 1e3, rel=1e-12)
    (beside,) = [line for line in right.lines if line.get_label() == name]
    pressure = run["force_N"] * (1 - run["reduction"]) / (np.pi * 25)
    np.testing.assert_allclose(beside.get_ydata()[1:], pressure, rtol=1e-12)
    assert "below the frame" in right.texts[0].get_text()


@pytest.mark.slow
def test_references_are_left_out_with_hardening(results):
    groups = shown(results)
    for group in groups:
        group.run.scene["perfectly_plastic"] = False
    labels = fig_force_stroke.draw(groups).axes[0].get_legend_handles_labels()[1]
    assert labels == [rf"Q8, 9 elements, $\mu$ = {mu:g}" for mu in MU]


def test_traction_means_obey_coulomb_where_all_slips(results):
    line = contact_line(open_results(results / "mu0.1"), -1)
    ratio = line.edge_shear[:, 0] / line.edge_pressure[:, 0]
    # The edge at the axis holds a node whose tangent is held.
    np.testing.assert_allclose(np.sort(ratio)[1:], 0.1, rtol=1e-6)


@pytest.mark.parametrize("mu", MU)
def test_tractions_of_every_increment_have_the_sign_and_are_in_the_cone(results, mu):
    run = open_results(results / f"mu{mu:g}")
    for row in range(len(run)):
        line = contact_line(run, row)
        assert (line.pressure >= 0).all()
        assert (np.abs(line.shear) <= mu * line.pressure).all()
        assert (line.edge_pressure > 0).all()
        assert (np.abs(line.edge_shear) <= mu * line.edge_pressure * (1 + 1e-9)).all()


def test_edge_means_drawn_carry_the_punch_force(results):
    run = open_results(results / "mu0.1")
    line = contact_line(run, -1)
    # All nodes touch and the punch is horizontal, so an edge is a ring between its ends.
    area = np.pi * np.abs(np.diff(line.ends**2, axis=1))[:, 0]
    assert area @ line.edge_pressure[:, 0] == pytest.approx(run["force_N"][-1], rel=1e-9)


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
def test_missing_results_name_the_command_and_fail(figure, tmp_path):
    with pytest.raises(SystemExit, match=r"run: python -m studies\.upsetting --mu 0\.1 0\.3 --out .*nothing") as caught:
        figure.main(["--results", str(tmp_path / "nothing")])
    assert caught.value.code not in (0, None)


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
def test_a_run_without_an_increment_is_left_out_and_said(figure, tmp_path, capsys):
    with pytest.raises(KeyboardInterrupt):
        record(tmp_path / "mu0.3", upsetting(mu=0.3, elements=3, reduction=REDUCTION), stop=0)
    with pytest.raises(SystemExit, match="no results; run"):
        figure.main(["--results", str(tmp_path)])
    assert "mu0.3: left out: no increment is recorded" in capsys.readouterr().err


def test_plots_return_what_they_draw_on_the_axes_given():
    ax = Figure().subplots()
    mesh = cylinder(5.0, 5.0, 2, 2, element=Element.Q8)
    drawn = plot.mesh(mesh.nodes, mesh.elements, ax)
    assert drawn in ax.collections
    assert len(drawn.get_segments()) == 12
    assert plot.vectors(mesh.nodes, mesh.nodes, ax) in ax.collections
    assert plot.force_stroke(np.array([1.0]), np.array([2.0]), ax).get_xydata().tolist() == [[0, 0], [1, 2]]
    steps, marks = profile(ax, np.array([[0.0, 2.0]]), np.array([3.0]), np.ones(3), np.ones(3), "o", "red")
    assert steps.get_segments()[0].tolist() == [[0, 3], [2, 3]]
    linear = np.array([[1.0, 3.0]])
    slopes, _ = profile(ax, np.array([[0.0, 2.0]]), linear, np.ones(3), np.ones(3), "o", "red")
    assert slopes.get_segments()[0].tolist() == [[0, 1], [2, 3]]
    assert marks in ax.lines


def test_curved_edges_follow_their_parabola():
    nodes = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])
    x, y = plot.curved(nodes, np.array([[0, 1, 2]]))[0].T
    np.testing.assert_allclose(y, x * (2 - x), atol=1e-14)
    np.testing.assert_allclose(x, np.linspace(0, 2, 9), atol=1e-14)
