"""Figures of any run of the upsetting: any friction, element, sampling, end; alone or with another beside."""

import numpy as np
import pytest

from bipot.errors import ResultsError
from bipot.fem.projection import VolumeChange
from bipot.laws.coulomb import Status
from bipot.laws.hardening import Linear
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout
from bipot.paper import upsetting
from bipot.results import open as open_results
from bipot.tools.tool import Sampling
from paper_figs import fig1_mesh, fig2_velocity, fig_force_stroke, fig_traction
from paper_figs.contact_line import contact_line
from paper_figs.fig_traction import words
from paper_figs.shown import Group, landings, shown
from studies.known_limits import KEPT, limits_of
from tests.drawn import FIGURES, clashes, drawn, record

Q4P0 = {"element": Element.Q4, "volume": VolumeChange.P0}
KINDS = {
    "many mu": [({"mu": mu}, "") for mu in (0.0, 0.05, 0.1, 0.2, np.inf)],
    "q8p1, 20 %": [({"mu": 0.2, "reduction": 0.2, "volume": VolumeChange.P1}, "")],
    "t6": [({"mu": 0.3, "element": Element.T6, "volume": VolumeChange.P0}, "")],
    "q9p1 fanned": [({"mu": 0.3, "element": Element.Q9, "volume": VolumeChange.P1, "layout": Layout.FANNED}, "")],
    "t3": [({"mu": 0.1, "element": Element.T3}, "")],
    "weighted": [({"mu": 0.3, "sampling": Sampling.WEIGHTED}, "")],
    "hardening": [({"mu": 0.1, "hardening": Linear(300.0, 500.0)}, "")],
    "beside": [({"mu": mu}, "") for mu in (0.1, 0.3)] + [({"mu": 0.1, **Q4P0, "elements": 6}, "q4p0")],
    "weighted beside nodes": [({"mu": 0.3, "sampling": Sampling.WEIGHTED}, ""), ({"mu": 0.3, **Q4P0}, "q4p0")],
}


def recorded(folder, kind):
    """The runs of a kind, in their folders."""
    for asked, where in KINDS[kind]:
        scene = upsetting(**{"elements": 3, "reduction": 0.25, "volume": VolumeChange.AS_IS, **asked})
        parameters = {"layout": asked.get("layout", Layout.TENSOR).value}
        record(folder / where / f"mu{asked['mu']:g}", scene, parameters=parameters)
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folders of runs by kind, each made once."""
    kept = {}

    def make(kind):
        if kind not in kept:
            kept[kind] = recorded(tmp_path_factory.mktemp("runs"), kind)
        return kept[kind]

    return make


def labels(figure):
    """What the figure's own legend says."""
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
@pytest.mark.parametrize("kind", KINDS)
def test_every_figure_of_every_kind_is_whole_and_legible(kind, figure, made):
    assert clashes(drawn(figure, made(kind))) == []


def test_a_run_may_be_given_by_its_own_folder(made):
    (group,) = shown(made("many mu") / "mu0.2")
    assert group.mu == 0.2


def test_coefficients_come_in_order_and_look_different(made):
    groups = shown(made("many mu"))
    assert [group.mu for group in groups] == [0.0, 0.05, 0.1, 0.2, np.inf]
    looks = {(Group(k, groups[0].run).colour, Group(k, groups[0].run).marker) for k in range(40)}
    assert len(looks) == 40


@pytest.mark.slow
def test_the_words_are_those_of_the_element(made):
    ax = drawn(fig1_mesh, made("t6")).axes[1]
    assert any("18 six-node triangles, 49 nodes" in text.get_text() for text in ax.texts)
    assert "T6/P0" in drawn(fig2_velocity, made("t6")).axes[0].get_title()
    assert any("Q9/P1, fanned" in label for label in labels(drawn(fig_force_stroke, made("q9p1 fanned"))))


@pytest.mark.slow
def test_closed_forms_and_limits_are_where_they_apply(made):
    seeds = labels(drawn(fig_force_stroke, made("many mu")))
    assert [label for label in seeds if "slab" in label] == [
        rf"slab, $\mu$ = {mu}; in (a)" for mu in ("0.05", "0.1", "0.2")
    ]
    assert [label for label in seeds if "limit" in label] == [r"limit of refined meshes and its band, $\mu$ = 0.1"]
    assert any("exact" in label for label in seeds)
    harder = labels(drawn(fig_force_stroke, made("hardening")))
    assert len(harder) == 1
    assert "Q8" in harder[0]


@pytest.mark.slow
def test_limits_drawn_are_those_of_the_file_as_far_as_the_run_comes(made):
    left, right = drawn(fig_force_stroke, made("t6")).axes
    run = open_results(made("t6") / "mu0.3")
    known = [one for one in limits_of(run) if one.reduction <= 0.25]
    assert [one.reduction for one in known] == [0.1, 0.2]
    for ax, scale in ((left, [1e-3, 1e-3]), (right, [0.9 / (25 * np.pi), 0.8 / (25 * np.pi)])):
        (bars,) = ax.containers
        np.testing.assert_allclose(bars[0].get_xdata(), [1.0, 2.0], rtol=1e-12)
        np.testing.assert_allclose(bars[0].get_ydata(), [s * one.value for s, one in zip(scale, known, strict=True)])
        spans = [np.ptp(segment[:, 1]) for segment in bars[2][0].get_segments()]
        np.testing.assert_allclose(spans, [2 * s * one.band for s, one in zip(scale, known, strict=True)], rtol=1e-6)


@pytest.mark.parametrize(
    "other", [{"young": 2e5}, {"poisson": 0.2}, {"height": 12.0}, {"diameter": 9.0}, {"hardening": Linear(300.0, 1.0)}]
)
def test_another_cylinder_has_no_limit(other, tmp_path):
    for name, data in (("seed", {}), ("other", other)):
        record(tmp_path / name, upsetting(mu=0.1, elements=1, reduction=0.02, **data), increments=1)
    assert len(limits_of(open_results(tmp_path / "seed"))) == 5
    assert limits_of(open_results(tmp_path / "other")) == []


def test_a_coefficient_that_is_not_in_the_file_and_a_file_that_is_not_there_are_blanks(made, tmp_path):
    assert limits_of(open_results(made("many mu") / "mu0.2")) == []
    run = open_results(made("many mu") / "mu0.1")
    assert KEPT.is_file()
    assert len(limits_of(run)) == 5
    assert limits_of(run, tmp_path / "limits.csv") == []


@pytest.mark.slow
def test_runs_beside_are_drawn_beside(made):
    folder = made("beside")
    one, three = shown(folder)
    assert (one.beside is not None, three.beside is not None) == (True, False)
    axes = drawn(fig2_velocity, folder).axes
    titles = [ax.get_title() for ax in axes if ax.axison]
    assert [title.split(",")[0] for title in titles] == ["(a) Q8", "(b) Q4/P0", "(c) Q8"]
    assert axes[0].get_position().y0 == pytest.approx(axes[1].get_position().y0)
    tractions = [ax.get_title() for ax in drawn(fig_traction, folder).axes if ax.axison]
    assert sum("Q4/P0" in title for title in tractions) == 2
    curves = labels(drawn(fig_force_stroke, folder))
    assert sum("Q4/P0" in label for label in curves) == 1


def test_a_run_of_another_problem_is_not_drawn_beside(tmp_path, capsys):
    record(tmp_path / "mu0.1", upsetting(mu=0.1, elements=2, reduction=0.1), increments=2)
    other = upsetting(mu=0.1, elements=4, reduction=0.1, hardening=Linear(300.0, 100.0), **Q4P0)
    record(tmp_path / "q4p0" / "mu0.1", other, increments=2)
    (group,) = shown(tmp_path)
    assert group.beside is None
    assert "left out: it poses another problem" in capsys.readouterr().err


@pytest.mark.parametrize("figure", FIGURES, ids=lambda module: module.__name__)
@pytest.mark.parametrize("stop", [1, 6])
def test_a_run_that_stopped_is_drawn_as_far_as_it_came_and_said(figure, stop, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        record(tmp_path / "mu0.3", upsetting(mu=0.3, elements=3, reduction=0.25), stop=stop)
    figure_made = drawn(figure, tmp_path)
    assert clashes(figure_made) == []
    if figure in (fig2_velocity, fig_traction):
        assert all("(stopped)" in ax.get_title() for ax in figure_made.axes)
    if figure is fig_force_stroke:
        end = open_results(tmp_path / "mu0.3")["reduction"][-1]
        assert any(f"stopped at {100 * end:.2g} %" in label for label in labels(figure_made))


def test_what_is_no_run_of_the_study_is_refused_in_a_sentence(tmp_path):
    record(tmp_path / "mu0.1", upsetting(mu=0.1, elements=1, reduction=0.02), increments=1)
    file = tmp_path / "mu0.1" / "run.vtkhdf"
    file.write_bytes(file.read_bytes().replace(b"force_N", b"farce_N"))
    with pytest.raises(ResultsError, match=r"mu0\.1"):
        shown(tmp_path)


@pytest.mark.slow
def test_landings_are_marked_where_a_node_of_the_side_comes_to_carry(tmp_path):
    record(tmp_path / "mu0.3", upsetting(mu=0.3, elements=8, reduction=0.42, **Q4P0), increments=20)
    run = open_results(tmp_path / "mu0.3")
    side = np.setdiff1d(run.mesh.boundary_nodes("side"), run.mesh.boundary_nodes("top"))
    touching = np.array([np.abs(run.nodal("gap", row)[side]) < 1e-9 for row in range(len(run))])
    grown = 1 + np.flatnonzero(np.diff(touching.sum(axis=1)) > 0)
    assert grown.size
    assert landings(run).tolist() == grown.tolist()
    for ax in drawn(fig_force_stroke, tmp_path).axes:
        (marks,) = [line for line in ax.lines if line.get_label() == fig_force_stroke.LANDS]
        np.testing.assert_allclose(marks.get_xdata(), 10 * run["reduction"][grown])
    assert fig_force_stroke.LANDS in labels(drawn(fig_force_stroke, tmp_path))


def test_no_landing_is_in_the_legend_of_a_run_without(made):
    assert fig_force_stroke.LANDS not in labels(drawn(fig_force_stroke, made("q8p1, 20 %")))


def test_weighted_tractions_are_linear_between_points_and_carry_the_force(made):
    run = open_results(made("weighted") / "mu0.3")
    line = contact_line(run, -1)
    assert line.weighted
    # int p 2 pi r dr over an edge on which r is quadratic in s: by a rule exact for what is of degree four.
    mesh, nodes = run.mesh, run.state().nodes
    s, weight = np.polynomial.legendre.leggauss(4)
    s, weight = (s + 1) / 2, weight / 2
    total = 0.0
    for edge, (p, q) in zip(mesh.boundary("top"), line.edge_pressure, strict=True):
        a, m, b = nodes[edge, 0]
        assert {a, b} == set(nodes[edge[[0, 2]], 0])
        r = a * (1 - s) * (1 - 2 * s) + 4 * m * s * (1 - s) + b * s * (2 * s - 1)
        slope = a * (4 * s - 3) + 4 * m * (1 - 2 * s) + b * (4 * s - 1)
        total += weight @ ((p * (1 - s) + q * s) * 2 * np.pi * r * np.abs(slope))
    assert total == pytest.approx(run["force_N"][-1], rel=2e-3)
    said = labels(drawn(fig_traction, made("weighted")))
    assert r"pressure $p$, linear on edges" in said
    assert not any("mean" in label for label in said)


@pytest.mark.slow
def test_a_point_of_a_crease_that_carries_nothing_is_not_shown_to_slip_as_the_other_one_does(tmp_path):
    record(tmp_path, upsetting(mu=0.3, elements=8, sampling=Sampling.WEIGHTED), increments=25)
    line = contact_line(open_results(tmp_path), -1)
    (corner,) = {radius for radius in line.radius if (line.radius == radius).sum() == 2}
    carrying, idle = sorted(np.flatnonzero(line.radius == corner), key=lambda k: -line.pressure[k])
    assert line.pressure[carrying] > 100.0
    assert line.pressure[idle] == pytest.approx(0.0, abs=1e-6)
    assert [line.status[carrying], line.status[idle]] == [Status.SLIP, Status.OPEN]


@pytest.mark.slow
def test_friction_envelope_and_statuses_are_told_only_where_they_are(made, tmp_path):
    record(tmp_path / "muinf", upsetting(mu=np.inf, elements=3, reduction=0.25))
    assert not any("Coulomb" in text.get_text() for text in drawn(fig1_mesh, tmp_path).axes[1].texts)
    assert any("Coulomb" in text.get_text() for text in drawn(fig1_mesh, made("t6")).axes[1].texts)
    said = labels(drawn(fig_traction, tmp_path))
    assert not any("envelope" in label for label in said)
    assert "slip" not in said
    assert any("envelope" in label for label in labels(drawn(fig_traction, made("t6"))))


def test_marks_that_the_frame_leaves_out_are_counted(made):
    line = contact_line(open_results(made("t6") / "mu0.3"), -1)
    top = np.sort(line.pressure)[-2:].mean()
    assert "1 mark outside the frame" in words(line, (-1000.0, top))
    assert "outside" not in words(line, (-1e5, 1e5))
