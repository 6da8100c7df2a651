"""Closed forms against their published numbers; every figure from a small run; results missing or incomplete."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from bipot import plot
from bipot.columns import COURSE, INCREMENT, SECONDS, Column
from bipot.elements import Element
from bipot.errors import SceneError
from bipot.forms import Tangent
from bipot.laws.coulomb import Status
from bipot.marching import Control, Schedule, march
from bipot.mesh import cylinder
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.scene import upsetting
from paper_figs import fig1_mesh, fig2_velocity, fig_force_stroke, fig_traction
from paper_figs.closed_forms import Cylinder
from paper_figs.common import MU, STYLE, runs
from studies.quality import quality

FIGURES = (fig1_mesh, fig2_velocity, fig_force_stroke, fig_traction)
PAPER = Cylinder(10.0, 5.0, 210_000.0, 0.3, 300.0)
REDUCTION = 0.25


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


def test_the_exact_force_starts_elastic():
    strain = 1e-4
    at = np.array(-np.expm1(-strain))
    area = np.pi * (5 * np.exp(0.3 * strain)) ** 2
    assert PAPER.exact_force(at) == pytest.approx(210_000 * strain * area, rel=1e-12)


def record(folder, mu, stop=None):
    """A small run with the columns that the figures read."""
    scene = upsetting(mu=mu, elements=3, reduction=REDUCTION)
    own = (
        Column("reduction", "of the height", lambda _, a: REDUCTION * a.state.tau),
        Column("force_N", "on the punch, N", lambda system, a: -a.tool_forces[0, 1]),
    )
    with Recorder(folder, scene, (INCREMENT, *own, *COURSE, SECONDS), {"mu": mu}, {}) as out:
        control = Control(Tangent())
        for accepted in march(scene, Schedule(5, first=0.005), control):
            out.record(accepted)
            if accepted.number == stop:
                raise KeyboardInterrupt


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("upsetting")
    for mu in MU:
        record(folder / f"mu{mu:g}", mu)
    return folder


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
def test_figures_write_pdf_and_png(figure, results, tmp_path, capsys):
    figure.main(["--results", str(results), "--out", str(tmp_path / "figures")])
    name = figure.__name__.rpartition(".")[2]
    pdf, png = (tmp_path / "figures" / f"{name}.{kind}" for kind in ("pdf", "png"))
    assert pdf.read_bytes().startswith(b"%PDF")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().out.split() == [str(pdf), str(png)]


def test_figures_go_beside_the_results_by_default(results):
    fig_force_stroke.main(["--results", str(results)])
    assert (results / "figures/fig_force_stroke.png").is_file()


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
def test_no_text_is_cut_off_or_covers_another(figure, results, monkeypatch):
    texts, draw = [], Text.draw

    def collect(text, renderer):
        if text.get_visible() and text.get_text().strip():
            texts.append(text)
        draw(text, renderer)

    monkeypatch.setattr(Text, "draw", collect)
    with mpl.rc_context(STYLE):
        drawn = figure.draw(runs(results))
        drawn.draw_without_rendering()
        frame = drawn.get_window_extent()
        boxes = [(text.get_text(), text.get_window_extent()) for text in texts]
    assert len(boxes) > 5
    for words, box in boxes:
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1, words
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1, words
    for i, (words, box) in enumerate(boxes):
        for others, other in boxes[:i]:
            assert not box.overlaps(other), (words, others)


def test_fig2_prints_the_measures_of_the_mesh_it_shows(results):
    drawn = fig2_velocity.draw(runs(results))
    for ax, mu in zip(drawn.axes, MU, strict=True):
        run = open_results(results / f"mu{mu:g}")
        worth = quality(run.state().nodes, run.mesh.elements)
        words = " ".join(text.get_text() for text in ax.texts)
        assert f"Jacobian ratio {worth.jacobian.min():.2f}" in words
        assert f"aspect ratio {worth.aspect.max():.1f}" in words
        arrows = next(c for c in ax.collections if isinstance(c, mpl.quiver.Quiver))
        # What stays in contact moves with the punch: one punch speed down.
        held = (run.nodal("status") == Status.SLIP) | (run.nodal("status") == Status.STICK)
        held &= (run.nodal("status", -2) == Status.SLIP) | (run.nodal("status", -2) == Status.STICK)
        assert held.sum() > 2
        np.testing.assert_allclose(arrows.V[held], -fig2_velocity.ARROW_MM, rtol=1e-9)


def test_force_stroke_shows_results_and_references(results):
    (ax, *_) = fig_force_stroke.draw(runs(results)).axes
    drawn = {line.get_label(): line for line in ax.lines}
    run = open_results(results / "mu0.3")
    line = drawn[r"finite elements, $\mu$ = 0.3"]
    np.testing.assert_allclose(line.get_ydata()[1:], run["force_N"] / 1e3, rtol=1e-12)
    np.testing.assert_allclose(line.get_xdata()[1:], 10 * run["reduction"], rtol=1e-12)
    exact = drawn[r"exact, $\mu$ = 0"].get_ydata()[-1]
    assert exact == pytest.approx(PAPER.exact_force(np.array(REDUCTION)) / 1e3, rel=1e-12)


def test_references_are_left_out_with_hardening(results):
    found = runs(results)
    for run in found:
        run.scene["perfectly_plastic"] = False
    labels = fig_force_stroke.draw(found).axes[0].get_legend_handles_labels()[1]
    assert labels == [rf"finite elements, $\mu$ = {mu:g}" for mu in MU]


def test_traction_means_obey_coulomb_where_all_slips(results):
    line = fig_traction.contact_line(open_results(results / "mu0.1"), -1)
    ratio = line.mean_shear / line.mean_pressure
    # The edge at the axis holds a node whose tangent is held.
    np.testing.assert_allclose(np.sort(ratio)[1:], 0.1, rtol=1e-6)


@pytest.mark.parametrize("mu", MU)
def test_tractions_of_every_increment_have_the_sign_and_are_in_the_cone(results, mu):
    run = open_results(results / f"mu{mu:g}")
    for row in range(len(run)):
        line = fig_traction.contact_line(run, row)
        assert (line.pressure >= 0).all()
        assert (np.abs(line.shear) <= mu * line.pressure).all()
        assert (line.mean_pressure > 0).all()
        assert (np.abs(line.mean_shear) <= mu * line.mean_pressure * (1 + 1e-9)).all()


def test_edge_means_drawn_carry_the_punch_force(results):
    run = open_results(results / "mu0.1")
    line = fig_traction.contact_line(run, -1)
    # All nodes touch and the punch is horizontal, so an edge is a ring between its ends.
    area = np.pi * np.abs(np.diff(line.ends**2, axis=1))[:, 0]
    assert area @ line.mean_pressure == pytest.approx(run["force_N"][-1], rel=1e-9)


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
def test_missing_results_name_the_command_and_fail(figure, tmp_path):
    with pytest.raises(SystemExit, match=r"run: python -m studies\.upsetting --mu 0\.1 0\.3 --out .*nothing") as caught:
        figure.main(["--results", str(tmp_path / "nothing")])
    assert caught.value.code not in (0, None)


def test_incomplete_results_are_refused(results, tmp_path):
    (tmp_path / "mu0.1").symlink_to(results / "mu0.1")
    with pytest.raises(KeyboardInterrupt):
        record(tmp_path / "mu0.3", 0.3, stop=2)
    with pytest.raises(SystemExit, match="incomplete"):
        fig1_mesh.main(["--results", str(tmp_path)])


def test_plots_return_what_they_draw_on_the_axes_given():
    ax = Figure().subplots()
    mesh = cylinder(5.0, 5.0, 2, 2, element=Element.Q8)
    drawn = plot.mesh(mesh.nodes, mesh.elements, ax)
    assert drawn in ax.collections
    assert len(drawn.get_segments()) == 12
    assert plot.vectors(mesh.nodes, mesh.nodes, ax) in ax.collections
    assert plot.force_stroke(np.array([1.0]), np.array([2.0]), ax).get_xydata().tolist() == [[0, 0], [1, 2]]
    steps, marks = plot.traction_profile(np.array([[0.0, 2.0]]), np.array([3.0]), np.ones(3), np.ones(3), ax)
    assert steps.get_segments()[0].tolist() == [[0, 3], [2, 3]]
    assert marks in ax.lines


def test_curved_edges_follow_their_parabola():
    nodes = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])
    x, y = plot.curved(nodes, np.array([[0, 1, 2]]))[0].T
    np.testing.assert_allclose(y, x * (2 - x), atol=1e-14)
    np.testing.assert_allclose(x, np.linspace(0, 2, 9), atol=1e-14)
