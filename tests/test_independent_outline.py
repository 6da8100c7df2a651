"""The fuzz study's own outlines of tools, caps and depths: against dense samples, closed forms, and the library's."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.contact.sampling import hat_areas, nodal_areas
from bipot.fem.reduction import Geometry
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.profiles import Profile, Union
from bipot.tools.surfaces import Plane
from bipot.tools.tool import ShapedTool
from studies.fuzz.surfaces import Seen, cut, outlines
from studies.independent.between import between, surface_of
from studies.independent.chains import disc, half_plane
from studies.independent.data import Setting
from studies.independent.sampling import Parts
from studies.independent.shear import Edges, around, carried, shares
from studies.independent.tools import Going, Rigid, met
from tests.profiles import drawn, sampled

SEEDS = range(12)


def outline_of(surface):
    (own,) = outlines(surface)
    return own


@pytest.mark.parametrize("seed", SEEDS)
def test_an_outline_is_as_far_off_as_the_densest_samples_of_the_line_say(seed):
    profile = drawn(seed)
    line, x = sampled(profile, 1e-3), np.random.default_rng(seed).uniform(-1.5, 1.5, (50, 2))
    near = outline_of(profile).near(x)
    far = np.array([np.hypot(*(line - point).T).min() for point in x])
    np.testing.assert_allclose(np.abs(near.gap), far, atol=1e-3)
    feet = x - near.gap[:, None] * near.normal
    assert max(np.hypot(*(line - foot).T).min() for foot in feet) < 1e-3


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("length", [1e-9, 1e-3, 0.5])
def test_outlines_written_a_second_time_are_the_library_s(seed, length):
    profile, rng = drawn(seed), np.random.default_rng(seed)
    x, by = rng.uniform(-1.5, 1.5, (200, 2)), length * rng.normal(size=(200, 2))
    for surface in (profile, Circle((0.1, 0.4), 0.7), Circle((0.1, 0.4), 0.7, concave=True)):
        own, known = outline_of(surface), surface.distance(x)
        near = own.near(x)
        np.testing.assert_allclose(near.gap, known.gap, atol=1e-14)
        np.testing.assert_allclose(near.normal, known.normal, atol=1e-12)
        np.testing.assert_allclose(near.stretch, 1 - known.curvature * known.gap, atol=1e-12)
        np.testing.assert_array_equal(near.past, surface.beyond(x))
        np.testing.assert_allclose(own.slid(x, by), surface.passed(x, by), atol=1e-13)


@pytest.mark.parametrize("inside", [True, False])
def test_next_to_a_sharp_corner_a_point_is_inside_or_outside(inside):
    """A wedge of which each flank rises by 3 in 4: by h above the tip a point is 4/5 h deep, by h below it h off."""
    own, h = outline_of(Profile(((4.0, 3.0), (0.0, 0.0), (-4.0, 3.0)))), 1e-9
    x, by = np.array([[0.0, h if inside else -h]]), np.array([[0.0, -h / 2]])
    assert own.near(x).gap[0] == pytest.approx(-0.8 * h if inside else h, rel=1e-6, abs=0.0)
    assert own.slid(x, by)[0, 0] == pytest.approx(0.4 * h if inside else h / 2, rel=1e-6, abs=0.0)
    np.testing.assert_allclose(own.near(x).normal, [[0.0, -1.0]], atol=1e-12)


def test_slips_of_a_billionth_are_no_differences_of_places():
    ball, by = disc((0.0, 5.0), 5.0, hollow=False), np.array([[1e-9, 0.0]])
    opened, slid = ball.slid(np.array([[0.0, 0.0]]), by)[0]
    assert slid == pytest.approx(-1e-9, rel=1e-12, abs=0.0)
    assert opened == pytest.approx(1e-19, rel=1e-9, abs=0.0)


def tool_of(outline, gone, begun=(0.0, 0.0, 0.0), centre=(0.0, 0.0)):
    begun, gone = np.array(begun, float), np.array(gone, float)
    return Rigid((outline,), np.array(centre), begun, begun + gone, gone)


def going(start, end, weights=None):
    """Nodes one by one, or as means of these weights, of a body that rests but for them."""
    parts = Parts.of(np.eye(len(start)) if weights is None else weights)
    return Going(parts, start, end, end - start, lambda fraction: 0.0 * fraction * start)


def test_a_node_that_goes_round_with_a_roll_does_not_slip_and_one_that_rests_slips_by_the_arc():
    roll, angle = tool_of(disc((0.0, 2.0), 2.0, hollow=False), (0.0, 0.0, 0.3), centre=(0.0, 2.0)), 0.3
    start = np.array([[0.0, 0.0], [0.0, 0.0]])
    end = np.array([[2 * np.sin(angle), 2 - 2 * np.cos(angle)], [0.0, 0.0]])
    found = met(roll, going(start, end), 1.0)
    np.testing.assert_allclose(found.slip, [0.0, 2 * angle], atol=1e-15)
    np.testing.assert_allclose(found.opened, 0.0, atol=1e-15)
    np.testing.assert_allclose(found.normal[1][0], [np.sin(angle), -np.cos(angle)], atol=1e-15)


def test_what_a_node_slides_in_the_air_before_it_touches_is_no_slip():
    """A plane that comes down on a node at a slant: half of the way it is not there yet."""
    plane = tool_of(half_plane((0.0, 1.0), (0.0, -1.0)), (0.5, -2.0, 0.0))
    start = np.zeros((1, 2))
    found = met(plane, going(start, np.array([[0.0, -1.0]])), 1.0)
    assert found.slip == pytest.approx(0.25, abs=1e-14)
    touching = replace(plane, begun=np.array([0.0, -1.0, 0.0]), ended=np.array([0.5, -3.0, 0.0]))
    along = met(touching, going(start, np.array([[0.0, -2.0]])), 1.0)
    assert along.slip == pytest.approx(0.5, abs=1e-14)


def test_a_mean_lands_where_its_gap_closes_and_slips_by_the_mean_of_its_nodes_arcs():
    """Two nodes, one half a length farther off: a plane that comes down at a slant by two lengths closes their mean gap
    after three halves. On the last quarter of its way both slip.
    """
    plane, start = tool_of(half_plane((0.0, 1.25), (0.0, -1.0)), (0.5, -2.0, 0.0)), np.array([[0.0, 0.0], [1.0, -0.5]])
    means = met(plane, going(start, start - (0.0, 1.0), np.array([[0.5, 0.5]])), 1.0)
    assert means.apart.tolist() == [True]
    np.testing.assert_allclose(means.slip, 0.125, atol=1e-14)
    alone = met(plane, going(start, start - (0.0, 1.0)), 1.0)
    np.testing.assert_allclose(alone.slip, [0.5 * (1 - 1.25 / 2), 0.5 * (1 - 1.75 / 2)], atol=1e-14)


def test_nodes_of_a_mean_that_touches_slip_from_the_start_though_one_is_off_the_tool():
    """On a ball: each by its own arc, R/(R + g) of what it moves by, whatever its gap."""
    ball = tool_of(disc((0.0, 2.0), 2.0, hollow=False), (0.0, 0.0, 0.0))
    start = np.array([[0.0, 0.5], [0.0, -0.5]])
    found = met(ball, going(start, start + np.array([1e-6, 0.0]), np.array([[0.5, 0.5]])), 1.0)
    np.testing.assert_allclose(found.gap[0], [-0.5, 0.5], atol=1e-15)
    assert not found.apart.any()
    np.testing.assert_allclose(found.slip, -1e-6 * np.array([2 / 1.5, 2 / 2.5]), rtol=1e-9)


def test_a_turned_tool_sees_points_where_they_would_be_if_it_rested():
    turn, rng = Turn(0.7, (0.3, -0.2)), np.random.default_rng(0)
    x, by = rng.normal(size=(2, 20, 2))
    begun, gone = np.array([0.1, 0.4, 0.7]), np.array([-0.2, 0.3, 0.05])
    own = Rigid((half_plane((0.0, 0.0), (0.0, 1.0)),), np.array(turn.centre), begun, begun + gone, gone)
    np.testing.assert_allclose(own.seen(x, begun), turn.own(x, begun), atol=1e-14)
    np.testing.assert_allclose(own.way(x, by), turn.own(x + by, begun + gone) - turn.own(x, begun), atol=1e-14)
    np.testing.assert_allclose(own.placed(own.seen(x, begun), begun), x, atol=1e-14)
    # Of a point of the tool the way is known: from where it is in one pose to where it is in the other.
    ends = own.placed(x, begun), own.placed(x, begun + gone)
    np.testing.assert_allclose(own.carried(sum(ends) / 2), ends[1] - ends[0], atol=1e-14)
    np.testing.assert_allclose(gone[:2] + turn.carried(sum(ends) / 2, begun, gone), ends[1] - ends[0], atol=1e-14)
    np.testing.assert_allclose(gone[:2] + turn.swept(ends[0], begun, gone), ends[1] - ends[0], atol=1e-14)


@pytest.mark.parametrize("axisymmetric", [False, True])
def test_areas_and_caps_are_those_of_a_flat_edge_that_lies_on_the_tool(axisymmetric):
    x = np.array([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    around = 2 * np.pi * np.array([1 / 6 * 2 * 1.0, 4 / 6 * 2 * 2.0, 1 / 6 * 2 * 3.0])
    expected = around if axisymmetric else np.array([1, 4, 1]) / 3
    np.testing.assert_allclose(shares(x[None], axisymmetric)[0], expected, rtol=1e-14)
    edges, strength = Edges(np.array([[0, 1, 2]]), np.array([0]), np.array([[0, 1, 2]])), np.array([3.0])
    half = carried(edges, np.array([0.0, 0.25, 0.0]), strength, x, x, axisymmetric)
    np.testing.assert_allclose(half, 1.5 * expected, rtol=1e-14)


@pytest.mark.parametrize("axisymmetric", [False, True])
def test_caps_of_means_have_the_areas_of_hats_and_lie_by_the_gaps_of_the_edge_s_two(axisymmetric):
    x = np.array([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0], [5.0, 0.0]])
    edges = Edges(np.array([[0, 1, 2], [2, 3, 4]]), np.array([0, 0]), np.array([[0, 1], [1, 2]]))
    # int (1 - s) 2 pi r ds over an edge from r = a to a + 2 is 2 pi (a + 2/3).
    a = np.array([1 + 2 / 3, 1 + 4 / 3, 3 + 2 / 3, 3 + 4 / 3]) * 2 * np.pi if axisymmetric else np.ones(4)
    found = carried(edges, np.array([0.0, 0.0, 0.25]), np.array([3.0]), x, x, axisymmetric)
    np.testing.assert_allclose(found, 3 * np.array([a[0], a[1] + a[2] / 2, a[3] / 2]), rtol=1e-14)


@pytest.mark.parametrize("geometry", [Geometry.PLANE_STRAIN, Geometry.AXISYMMETRIC])
def test_areas_of_bent_edges_are_the_library_s_and_none_is_negative(geometry):
    x = np.random.default_rng(1).uniform(0.1, 1.0, (30, 2))
    lines = np.arange(30).reshape(10, 3)
    own = shares(x[lines], geometry is Geometry.AXISYMMETRIC)
    assert (own >= 0).all()
    np.testing.assert_allclose(own, nodal_areas(x, lines, geometry), rtol=1e-12, atol=1e-14)
    hats = around(x[lines], geometry is Geometry.AXISYMMETRIC)
    np.testing.assert_allclose(hats, hat_areas(x, lines, geometry), rtol=1e-12, atol=1e-14)


def square(mirrors=()):
    """The unit square, of one element of four nodes."""
    elements, rest = np.array([[0, 1, 2, 3]]), np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    held, beside = np.zeros((4, 2), dtype=bool), [np.flatnonzero(rest[:, d] == at) for d, at in mirrors]
    return Setting(
        elements, False, True, "gauss2", 1.0, 0.3, np.ones_like, held, 1.0, rest,
        surface=surface_of(elements, beside), mirrors=tuple(mirrors),
    )  # fmt: skip


@pytest.mark.parametrize(("deep", "allowed"), [(0.2, 0.25), (0.3, 0.25), (0.01, 0.25)])
def test_a_ball_between_nodes_is_as_deep_as_its_lowest_point(deep, allowed):
    ball = tool_of(disc((0.5, 1.0 + 0.6 - deep), 0.6, hollow=False), (0.0, 0.0, 0.0))
    assert between(square(), (ball,), square().rest) == pytest.approx(deep / allowed, rel=1e-3)


def test_a_ball_in_the_whole_body_is_seen_from_its_half_and_none_where_it_is_outside():
    inside = tool_of(disc((-0.5, 0.5), 0.1, hollow=False), (0.0, 0.0, 0.0))
    assert between(square(), (inside,), square().rest) == 0.0
    half = square([(0, 0.0)])
    assert between(half, (inside,), half.rest) == pytest.approx(0.5 / (0.25 * 0.2), rel=0.05)
    assert between(square(), (tool_of(half_plane((0.0, 0.5), (0.0, -1.0)), (0.0, 0.0, 0.0)),), square().rest) == 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_tools_seen_in_a_mirror_or_other_units_are_as_far_off(seed):
    profile = drawn(seed)
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1.5, 1.5, (50, 2))
    for surface in (profile, Union((Circle((0.2, 0.1), 0.3), Plane((0.0, 0.4), (0.6, -0.8))))):
        gap = surface.distance(x).gap
        mirror, units = Seen.mirrored(0, 0.3), Seen.scaled(1e3)
        image = np.array([mirror.point(tuple(point)) for point in x])
        np.testing.assert_allclose(mirror.surface(surface).distance(image).gap, gap, atol=1e-12)
        np.testing.assert_allclose(units.surface(surface).distance(1e3 * x).gap, 1e3 * gap, atol=1e-9)
        shaped = ShapedTool(surface, (0.1, 0.2), ("top",), 0.1, turn=Turn(0.3, (0.2, 0.5)))
        twice = mirror.tool(mirror.tool(shaped))
        assert isinstance(twice, ShapedTool)
        assert twice.turn == pytest.approx(shaped.turn) if twice.turn is None else twice.turn.angle == 0.3
        assert twice.surface.same(surface, 1e-12) if surface is profile else True


def test_a_plane_cuts_what_is_its_own_mirror_image():
    def tool(surface):
        return ShapedTool(surface, (0.0, 0.0), ("top",), 0.1)

    ball, die = Circle((0.3, 2.0), 1.0), Profile(((3.3, 1.0), (0.8, 0.4), (-0.2, 0.4), (-2.7, 1.0)), 0.1)
    for surface in (ball, die, Union((ball, die))):
        assert cut(tool(surface), 0, 0.3)
        assert not cut(tool(surface), 0, 0.2)
        assert not cut(tool(surface), 1, 0.3)
