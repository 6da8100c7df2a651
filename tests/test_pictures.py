"""Pictures of a run: what is drawn is what the run holds, and pyplot is left alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure
from PIL import Image

from bipot import Circle, FlatTool, Mesh, Prescribed, Sampling, Schedule, ShapedTool, Support, block, march, plot
from bipot.errors import SceneError
from bipot.fem.elements import tabulated_at
from bipot.meshes.elements import Element, elements_of
from bipot.plot.contours import chains, tessellation
from bipot.results import Recorder
from bipot.results import open as open_results
from tests.scenes import refused, scene


@pytest.fixture(scope="module")
def run(recorded):
    return open_results(recorded)


@pytest.fixture
def ax():
    """Axes of a figure that pyplot does not know, nor learns of."""
    known = pyplot.get_fignums()
    yield Figure().add_subplot()
    assert pyplot.get_fignums() == known


def test_a_contour_has_the_values_of_the_nodes_where_they_are(run, ax):
    drawn = plot.contour(run, "pressure", 0.1, ax)
    step = run.at(0.1)
    values, corners = step.nodal("pressure"), drawn.get_paths()
    assert corners is not None
    triangulation = drawn._triangulation
    places = np.column_stack([triangulation.x, triangulation.y])
    for node, value in zip(step.nodes, values, strict=True):
        here = np.abs(places - node).max(axis=1) < 1e-9
        assert here.any()
        np.testing.assert_allclose(drawn.get_array()[here], value, rtol=1e-6, atol=1e-3)
    assert drawn.get_clim() == pytest.approx((drawn.get_array().min(), drawn.get_array().max()))
    area = np.abs(np.linalg.det(np.diff(places[triangulation.triangles], axis=1))).sum() / 2
    assert area == pytest.approx(shoelace(step.nodes, run.mesh.outline), rel=1e-3)


def shoelace(nodes, outline):
    """Area inside edges that run anticlockwise, their middle nodes taken as corners."""
    pieces = np.concatenate([outline[:, k : k + 2] for k in range(outline.shape[1] - 1)])
    (x, y), (u, v) = nodes[pieces[:, 0]].T, nodes[pieces[:, 1]].T
    return np.sum(x * v - u * y) / 2


def test_a_contour_says_what_it_shows(run, ax):
    plot.contour(run, "stress_zz", 0.1, ax)
    assert (
        ax.get_title()
        == f"increment {run.at(0.1).step}, reduction {100 * run['reduction'][run.at(0.1).step - 1]:.4g} %"
    )
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("r (mm)", "z (mm)")
    assert [bar.get_ylabel() for bar in ax.figure.axes[1:]] == ["stress_zz (N/mm^2)"]
    low, high = run.at(0.1).nodes.min(axis=0), run.at(0.1).nodes.max(axis=0)
    for (first, last), own, other in zip((ax.get_xlim(), ax.get_ylim()), low, high, strict=True):
        assert first < own < other < last
    plot.contour(run, "displacement", ax=ax, limits=(0.0, 2.0), colorbar=False)
    assert ax.collections[-3].get_clim() == (0.0, 2.0)
    assert ax.get_title() == f"increment {len(run)}, reduction 20 %"


def test_the_tools_are_drawn_where_they_are(run, ax):
    plot.contour(run, "mises", 0.0, ax, by="tau")
    (line,) = ax.collections[-1].get_segments()
    np.testing.assert_allclose(line[:, 1], 5.0)
    assert ax.get_title() == "step 0, tau = 0"


@pytest.mark.parametrize(
    ("field", "at", "words"),
    [
        ("temperature", None, "field = 'temperature': must be one of"),
        ("contact_pressure", None, "field = 'contact_pressure': must be one of the whole body; .*--traction"),
        ("status", None, "must be one of the whole body"),
        ("stress", None, "field = 'stress': must be a component, as in stress_rr"),
        ("mises", 0.7, r"reduction = 0\.7: must be in"),
    ],
)
def test_what_cannot_be_drawn_is_refused(run, ax, field, at, words):
    with pytest.raises(SceneError, match=words):
        plot.contour(run, field, at, ax)


def test_what_a_contour_is_told_of_its_style_comes_first(run, ax):
    drawn = plot.contour(run, ax=ax, vmin=1.0, shading="flat")
    assert drawn.get_clim()[0] == 1.0
    assert not hasattr(drawn, "_triangulation")


@pytest.mark.parametrize("limits", [(1.0, 0.0), (0.0, np.nan), ("a", "b"), 3.0, "ab"], ids=str)
def test_limits_of_colours_that_are_no_range_are_refused(run, ax, limits):
    refused(lambda: plot.contour(run, ax=ax, limits=limits), "limits = ")


@pytest.mark.parametrize("element", elements_of(2))
def test_the_pieces_of_an_element_are_the_whole_of_it(element):
    points, triangles = tessellation(element)
    doubled = np.linalg.det(np.diff(points[triangles], axis=1))
    assert (doubled > 0).all()
    assert doubled.sum() / 2 == pytest.approx(1.0 if element.corners == 4 else 0.5)
    np.testing.assert_allclose(tabulated_at(element, points).values.sum(axis=1), 1.0)


def test_tractions_are_drawn_from_the_axis_outwards(run, ax):
    pressure, shear = plot.contact_traction(run, 0.1, ax)
    step = run.at(0.1)
    top = np.flatnonzero(step.nodal("status") >= 0)
    x, values = pressure.get_data()
    known = ~np.isnan(values)
    assert 1 < known.sum() <= len(top)
    # On the flat punch the arc is the radius.
    for radius, value, other in zip(x[known], values[known], shear.get_ydata()[known], strict=True):
        node = top[np.argmin(np.abs(step.nodes[top] - (radius, 5 * (1 - run["reduction"][step.step - 1]))).max(axis=1))]
        assert value == step.nodal("contact_pressure")[node]
        assert other == step.nodal("contact_shear")[node]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["pressure", "shear"]
    assert ax.get_ylabel() == "traction (N/mm^2)"
    with pytest.raises(SceneError, match=r"tool = 1: must be in \[0, 1\)"):
        plot.contact_traction(run, ax=ax, tool=1)


def test_of_two_tools_that_may_touch_the_same_surface_each_has_its_own_tractions(tmp_path):
    """Of both platens, and of a body beside them, top and base are candidates; only one is pressed by each."""
    both = ("top", "base")
    above = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.001), both, 0.1)
    below = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), both, 0.1)
    given = scene(mesh=block(1.0, 1.0, 2, 2), supports=(Support("left", 0),), tools=(above, below))
    with Recorder(tmp_path, given, (), {}, {}) as out:
        out.record(next(march(given, Schedule(1))))
    run = open_results(tmp_path)
    for tool, name in enumerate(both):
        pressure, shear = plot.contact_traction(run, ax=Figure().add_subplot(), tool=tool)
        x = pressure.get_xdata()
        paths = chains(run.mesh, list(both))
        known = [np.isfinite(line.get_ydata()) for line in (pressure, shear)]
        drawn = np.concatenate([np.append(path, -1) for path in paths])
        assert set(drawn[known[0]].tolist()) == set(run.mesh.boundary_nodes(name).tolist())
        np.testing.assert_array_equal(*known)
        assert np.isfinite(x[known[0]]).all()


def test_a_picture_without_an_edge_in_contact_says_so(run, tmp_path, ax):
    plot.contact_traction(run, 0.1, ax)
    assert len(ax.texts) == 0
    ball = ShapedTool(Circle((0.0, 2.0), 1.0), (0.0, -0.01), ("top",), 0.0)  # on one node
    given = scene(mesh=block(1.0, 1.0, 1, 1), tools=(ball,))
    with Recorder(tmp_path, given, (), {}, {}) as out:
        out.record(next(march(given, Schedule(1))))
    plot.contact_traction(open_results(tmp_path), ax=ax)
    assert [text.get_text() for text in ax.texts] == ["no edge of the surface is pressed"]


def test_a_weld_that_pulls_is_not_said_to_be_out_of_contact(tmp_path, ax):
    pulled = scene(
        mesh=block(1.0, 1.0, 2, 2), tools=(FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.001), ("top",), np.inf),)
    )
    with Recorder(tmp_path, pulled, (), {}, {}) as out:
        out.record(next(march(pulled, Schedule(1))))
    run = open_results(tmp_path)
    assert run.nodal("contact_force_y").sum() > 1.0
    plot.contact_traction(run, ax=ax)
    assert [text.get_text() for text in ax.texts] == ["no edge of the surface is pressed"]


@pytest.mark.parametrize("element", [Element.Q4, Element.T6])
def test_boundaries_are_followed_along_the_surface(element):
    mesh = block(3.0, 1.0, 3, 2, element=element)
    (around,) = chains(mesh, ["left", "top", "right"])
    np.testing.assert_array_equal(mesh.nodes[around[[0, -1]]], [(0.0, 0.0), (3.0, 0.0)])
    assert np.linalg.norm(np.diff(mesh.nodes[around], axis=0), axis=1).sum() == pytest.approx(5.0)
    assert sorted(len(path) for path in chains(mesh, ["left", "right"])) == [3, 3] or element.quadratic
    (closed,) = chains(mesh, list(mesh.boundaries))
    assert closed[0] == closed[-1]


@pytest.mark.parametrize(
    ("sampling", "element"),
    [(Sampling.NODES, Element.Q4), (Sampling.NODES, Element.Q9), (Sampling.WEIGHTED, Element.Q9)],
)
def test_the_lines_of_tractions_end_where_a_support_holds_the_surface(tmp_path, sampling, element, ax):
    """At the middle of the top, which is held: what is left and right of it is not joined."""
    mesh = block(6.0, 1.0, 6, 1, element=element)
    top = mesh.boundary("top")
    below = mesh.nodes[top, 0].max(axis=1) <= 4.0 + 1e-9
    held = top[below & (mesh.nodes[top, 0].min(axis=1) >= 2.0 - 1e-9)]
    named = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "held": held})
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.001), ("top",), 0.1, sampling=sampling)
    supports = (Support("base", 0), Support("base", 1), Prescribed("held", 1, -0.002))
    given = scene(mesh=named, supports=supports, tools=(tool,))
    with Recorder(tmp_path, given, (), {}, {}) as out:
        for accepted in march(given, Schedule(2)):
            out.record(accepted)
    pressure, shear = plot.contact_traction(open_results(tmp_path), ax=ax)
    for line in (pressure, shear):
        x, y = line.get_data()
        known = np.isfinite(y)
        assert known[x < 1.5].any()
        assert known[x > 4.5].any()
        last, first = np.flatnonzero(known & (x < 3.0))[-1], np.flatnonzero(known & (x > 3.0))[0]
        assert not known[(x > 2.2) & (x < 3.8)].any()
        assert np.isnan(y[last + 1 : first]).any()


@pytest.mark.parametrize("side", ["left", "right"])
def test_an_upright_surface_is_followed_from_below_in_every_step(tmp_path, side, ax):
    """Its ends are one above the other at rest, and either may come to be on the left: here by the push of a wall."""
    wall = {"left": FlatTool((0.0, 0.0), (1.0, 0.0), (0.02, 0.0), ("left",), 0.3)}
    wall["right"] = FlatTool((1.0, 0.0), (-1.0, 0.0), (-0.02, 0.0), ("right",), 0.3)
    held = Support("right" if side == "left" else "left", 0)
    given = scene(mesh=block(1.0, 1.0, 2, 2), supports=(held, Support("base", 1)), tools=(wall[side],))
    with Recorder(tmp_path, given, (), {}, {}) as out:
        for accepted in march(given, Schedule(2)):
            out.record(accepted)
    run = open_results(tmp_path)
    for tau in run.times[1:]:
        ax.clear()
        pressure, _ = plot.contact_traction(run, tau, ax, by="tau")
        step = run.at(tau, by="tau")
        along = given.mesh.boundary_nodes(side)
        along = along[np.argsort(step.nodes[along, 1])]
        np.testing.assert_array_equal(pressure.get_ydata()[:-1], step.nodal("contact_pressure")[along])
        np.testing.assert_allclose(pressure.get_xdata()[:-1], step.nodes[along, 1], atol=1e-9)


@pytest.mark.slow
def test_a_round_tool_is_drawn_and_pictures_of_every_step_move(tmp_path, ax):
    ball = ShapedTool(Circle((0.0, 2.0), 1.0), (0.0, -0.01), ("top",), 0.0)
    given = scene(mesh=block(1.0, 1.0, 2, 2), tools=(ball,))
    with Recorder(tmp_path, given, (), {}, {}) as out:
        for accepted in march(given, Schedule(2)):
            out.record(accepted)
    result = open_results(tmp_path)
    plot.contour(result, "mises", ax=ax)
    (line,) = ax.collections[-1].get_segments()
    np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 1] - 1.99), 1.0)
    path = plot.animate(result, "mises", tmp_path / "mises.gif", frames=2)
    with Image.open(path) as image:
        assert (image.format, image.n_frames) == ("GIF", 2)
    assert ax.get_xlabel().endswith("(unit of length)")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"path": "film.mp4"}, r"path = 'film\.mp4': must be one that ends in \.gif"),
        ({"path": None}, "path = None: must be a path"),
        ({"frames": 0}, "frames = 0"),
        ({"rate": 1e-9}, r"rate = 1e-09: must be in \[0.01, 100\] frames per second"),
        ({"rate": 1000.0}, "rate = 1000.0"),
    ],
)
def test_animations_that_cannot_be_are_refused(run, tmp_path, given, words):
    with pytest.raises(SceneError, match=words):
        plot.animate(run, "mises", **{"path": tmp_path / "film.gif", **given})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("junk", [None, "mine", Path("mine")])
def test_what_is_no_run_is_not_drawn(junk, tmp_path, ax):
    words = "result = .*: must be a History, as bipot.results.open"
    refused(lambda: plot.contour(junk, ax=ax), words)
    refused(lambda: plot.contact_traction(junk, ax=ax), words)
    refused(lambda: plot.animate(junk, "mises", tmp_path / "a.gif"), words)


def test_thin_lines_run_between_the_regions_of_a_body(tmp_path):
    """In contours along parabolas, in pictures of elements straight from end to end."""
    mesh = block(1.0, 1.0, 2, 2, element=Element.Q8)
    given = scene(mesh=replace(mesh, regions={"left": [0, 2]}))
    with Recorder(tmp_path, given, (), {}, {}) as out:
        for accepted in march(given, Schedule(2)):
            out.record(accepted)
    result, known = open_results(tmp_path), given.mesh.interfaces
    assert np.unique(known).size == 5
    for draw in (lambda ax: plot.contour(result, "mises", ax=ax), lambda ax: plot.body(accepted, np.arange(4.0), ax)):
        ax = Figure().add_subplot()
        draw(ax)
        thin = [lines for lines in ax.collections if lines.get_linewidth()[0] == 0.8]
        assert [len(lines.get_paths()) for lines in thin] == [2]
        ends = [path.vertices[[0, -1]] for path in thin[0].get_paths()]
        np.testing.assert_allclose(ends, accepted.state.nodes[known[:, [0, -1]]], atol=1e-9)
