"""Profiles: distance, normal, curvature and arc against dense samples, finite differences and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from bipot.contact.overlap import least_along
from bipot.tensors import norm
from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, flat_punch, wedge
from bipot.tools.surfaces import Plane, Surface, frames
from tests.profiles import drawn, on_line, reflected, sampled, turn, turned
from tests.test_surfaces import shaped, slope

SEEDS = st.integers(0, 10**6)

ROUND = Profile(((1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)), 1.0, closed=True)
"""A square whose fillets leave nothing of its sides."""

DIE = Profile(((1.0, -2.0), (1.0, 0.0), (0.6, 1.0), (0.6, 2.0)), (0.2, 0.5))
"""Of extrusion, on the right of the billet: container, cone and land."""


def around(seed, count=60):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.5, 1.5, (count, 2)), rng.uniform(-1, 1, (count, 2))


@given(SEEDS)
def test_distance_is_that_to_the_nearest_place_of_a_dense_sample(seed):
    profile, (x, _) = drawn(seed), around(seed)
    step = 2e-4
    nearest, _ = cKDTree(sampled(profile, step)).query(x)
    gap = np.abs(profile.distance(x).gap)
    assert (gap <= nearest + 1e-12).all()
    assert (nearest <= gap + step).all()


@pytest.mark.slow
@given(SEEDS)
def test_the_gap_is_as_steep_as_one_everywhere_and_so_has_one_sign_on_each_side(seed):
    """Inside, outside, across joints, corners and places that are equally near to two pieces."""
    profile, (x, by) = drawn(seed), around(seed)
    for size in (1e-6, 1e-2, 1.0):
        grown = profile.distance(x + size * by).gap - profile.distance(x).gap
        assert (np.abs(grown) <= size * norm(by) + 1e-14).all()
    on = on_line(profile, seed)
    np.testing.assert_allclose(profile.distance(on).gap, 0.0, atol=1e-13)


@given(SEEDS)
def test_the_tool_is_on_the_right(seed):
    """Of the middle of every side that a fillet has left some of."""
    profile = drawn(seed, sharp=True)
    points = np.array(profile.points)
    sides = (np.roll(points, -1, axis=0) - points)[: None if profile.closed else -1]
    middle = points[: len(sides)] + sides / 2
    right = sides[:, ::-1] * (1.0, -1.0) / norm(sides)[:, None]
    np.testing.assert_allclose(profile.distance(middle + 1e-9 * right).gap, -1e-9, atol=1e-15)
    np.testing.assert_allclose(profile.distance(middle).normal, -right, atol=1e-12)


@given(SEEDS)
def test_the_place_that_is_nearest_is_on_the_line_and_straight_below(seed):
    profile, (x, _) = drawn(seed), around(seed)
    gap, normal, _ = profile.distance(x)
    np.testing.assert_allclose(norm(normal), 1.0, rtol=1e-14)
    np.testing.assert_allclose(profile.distance(x - gap[:, None] * normal).gap, 0.0, atol=1e-13)


def smooth(profile, x, ways, h):
    """Points that no joint and no place as near to two pieces is next to: the pieces are one's own."""
    ends = [profile.pieces.foot(x + k * h * ways).piece for k in (-2, 0, 2)]
    return (ends[0] == ends[1]) & (ends[1] == ends[2]) & (np.abs(profile.distance(x).gap) > 0.02)


@given(SEEDS)
def test_normal_and_curvature_are_the_derivatives_of_the_gap(seed):
    profile, (x, ways) = drawn(seed), around(seed)
    x, ways = (part[smooth(profile, x, ways, 1e-4)] for part in (x, ways))
    away = np.abs(profile.distance(x).curvature) < 50
    x, ways = x[away], ways[away]
    gap, normal, curvature = profile.distance(x)
    tangent = frames(normal)[:, 1]
    by_difference = slope(lambda t: profile.distance(x + t * ways).gap, 1e-4)
    np.testing.assert_allclose(by_difference, np.vecdot(normal, ways), atol=1e-8)
    turning = slope(lambda t: profile.distance(x + t * ways).normal, 1e-4)
    np.testing.assert_allclose(turning, (curvature * np.vecdot(tangent, ways))[:, None] * tangent, atol=1e-4)
    slid = slope(lambda t: profile.passed(x, t * ways)[:, 1], 1e-4)
    np.testing.assert_allclose(slid, (1 - curvature * gap) * np.vecdot(tangent, ways), atol=1e-6)


def joints(profile):
    """Places of the joints between straights and rounds, and the normals there."""
    s = profile.pieces.straights
    places = [s.start, s.start + s.length[:, None] * s.along]
    ends = np.concatenate(places) if profile.closed else np.concatenate([places[0][1:], places[1][:-1]])
    normals = s.normal if profile.closed else s.normal[1:]
    return ends, np.concatenate([normals, s.normal if profile.closed else s.normal[:-1]])


@given(SEEDS, st.floats(-0.005, 0.05))
def test_at_fillets_the_normal_goes_on_and_the_curvature_is_that_of_one_side(seed, gap):
    profile = drawn(seed, sharp=False)
    place, normal = joints(profile)
    x = place + gap * normal
    found = profile.distance(x)
    own = np.abs(found.gap - gap) < 1e-12
    np.testing.assert_allclose(found.normal[own], normal[own], atol=1e-9)
    steps = 1e-7 * frames(normal[own])[:, 1]
    sides = np.array([0.0, *(1 / (gap + k * profile.fillets) for k in (-1, 1))])
    for step in (steps, -steps):
        there = profile.distance(x[own] + step)
        np.testing.assert_allclose(there.normal, normal[own], atol=1e-9 + 1.01e-7 * np.abs(sides).max())
        assert (np.abs(there.curvature[:, None] - sides).min(axis=1) < 1e-3 * np.abs(sides).max()).all()


def test_a_sharp_corner_is_a_fan_outside_and_nothing_but_its_sides_inside():
    corner = Profile(((0.0, 1.0), (0.0, 0.0), (-1.0, 0.0)))
    x = np.array([[0.3, -0.4], [0.3, 0.2], [-0.4, -0.1], [-0.2, 0.1]])
    gap, normal, curvature = corner.distance(x)
    np.testing.assert_allclose(gap, [0.5, 0.3, 0.1, -0.1], rtol=1e-15)
    np.testing.assert_allclose(normal, [[0.6, -0.8], [1, 0], [0, -1], [0, -1]], atol=1e-15)
    np.testing.assert_allclose(curvature, [2.0, 0, 0, 0], rtol=1e-15)
    hollow = Profile(corner.points[::-1]).distance(x)
    for one, other in zip((gap, normal, curvature), hollow, strict=True):
        np.testing.assert_allclose(other, -one, atol=1e-15)
    middle = np.sqrt(0.5)
    for at in (np.zeros(2), np.full(2, 1e-17), np.full(2, -1e-17)):
        found = corner.distance(at)
        np.testing.assert_allclose(found.normal, [middle, -middle], rtol=1e-14)
        assert abs(found.gap) < 1e-16
        assert found.curvature == 0


@given(SEEDS)
def test_followed_the_other_way_all_signs_turn(seed):
    profile, (x, by) = drawn(seed), around(seed)
    other = Profile(profile.points[::-1], profile.fillets, profile.closed)
    away = np.abs(profile.distance(x).gap) > 1e-6
    for one, two in zip(profile.distance(x), other.distance(x), strict=True):
        np.testing.assert_allclose(two[away], -one[away], rtol=1e-9, atol=1e-12)
    if not profile.closed:
        np.testing.assert_allclose(other.passed(x, by), -profile.passed(x, by), atol=1e-12)


def test_a_long_straight_line_is_a_plane():
    plane, (x, by) = Plane((0.3, -0.2), (0.6, -0.8)), around(1)
    points = np.array(plane.point) + np.outer([50.0, 3.0, -50.0], (0.8, 0.6))
    for line in (
        Profile(tuple(map(tuple, points[[2, 0]].tolist()))),
        Profile(tuple(map(tuple, points[::-1].tolist()))),
    ):
        for one, other in zip(Profile(line.points[::-1]).distance(x), plane.distance(x), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-14)
        np.testing.assert_allclose(Profile(line.points[::-1]).passed(x, by), plane.passed(x, by), atol=1e-15)


@pytest.mark.parametrize("concave", [False, True])
def test_a_square_of_fillets_alone_is_a_circle(concave):
    circle = Circle((0.0, 0.0), 1.0, concave=concave)
    profile = Profile(ROUND.points[::-1], 1.0, closed=True) if concave else ROUND
    x, by = around(2, 400)
    for one, other in zip(profile.distance(x), circle.distance(x), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(profile.passed(x, by), circle.passed(x, by), atol=1e-13)
    # Ways from place to place of the circle.
    start, way = x / norm(x)[:, None], by / norm(by)[:, None] - x / norm(x)[:, None]
    np.testing.assert_array_equal(profile.crossed(start, way), circle.crossed(start, way))
    assert 200 < circle.crossed(start, way).sum() < 300 or concave
    assert concave or profile.inner_radius == pytest.approx(1.0, rel=1e-6)


@given(SEEDS, st.floats(-3, 3))
def test_a_turned_and_a_mirrored_profile_has_turned_and_mirrored_distances(seed, angle):
    profile, (x, by) = drawn(seed), around(seed)
    R, shift = turn(angle), np.array([0.7, -0.3])
    gap, normal, curvature = profile.distance(x)
    near = np.abs(curvature) < 1e3
    there = turned(profile, angle, shift).distance(x @ R.T + shift)
    np.testing.assert_allclose(there.gap, gap, atol=1e-13)
    np.testing.assert_allclose((there.normal @ R)[near], normal[near], atol=1e-10)
    beside = reflected(profile).distance(x * (-1, 1))
    np.testing.assert_allclose(beside.gap, gap, atol=1e-13)
    np.testing.assert_allclose((beside.normal * (-1, 1))[near], normal[near], atol=1e-10)
    passed = reflected(profile).passed(x * (-1, 1), by * (-1, 1))
    half = profile.pieces.length / 2
    turns = np.abs(np.abs(profile.passed(x, by)[:, 1]) - half) > 1e-9
    np.testing.assert_allclose((passed * (1, -1))[turns], profile.passed(x, by)[turns], atol=1e-12)


@given(SEEDS)
def test_a_moved_profile_has_the_gaps_of_points_that_moved_the_other_way(seed):
    profile, (x, _) = drawn(seed), around(seed)
    moved = np.array([0.2, -0.5])
    np.testing.assert_allclose(profile.gap(x, moved), profile.distance(x - moved).gap, atol=1e-15)
    assert (profile.size(x, moved) >= np.abs(profile.gap(x, moved)) / 2).all()
    assert isinstance(profile, Surface)


def test_the_die_of_an_extrusion_has_the_lengths_of_its_parts():
    """From the container round both corners to the land: fillets shorten the way by 2 trim - r theta each."""
    theta = np.arctan2(0.4, 1.0)
    way = np.hypot(0.4, 1.0) + 2.0 - (0.2 + 0.5) * (2 * np.tan(theta / 2) - theta)
    start, end = np.array([0.95, -1.0]), np.array([0.5, 2.0])
    opened, slid = DIE.passed(start, end - start)
    assert slid == pytest.approx(way, rel=1e-14)
    assert opened == pytest.approx(0.05, rel=1e-13)
    # The throat is convex, the corner of the container is not.
    throat, corner = np.array([0.58, 0.99]), np.array([0.98, 0.01])
    assert DIE.distance(throat).curvature == pytest.approx(1 / (0.5 + DIE.distance(throat).gap), rel=1e-12)
    assert DIE.distance(corner).curvature == pytest.approx(-1 / (0.2 - DIE.distance(corner).gap), rel=1e-12)


def test_a_cone_and_a_flat_punch_by_closed_forms():
    cone = wedge((0.2, 1.0), 70.0, 3.0, 0.1)
    tip = 1.0 + 0.1 * (1 / np.sin(np.radians(70.0)) - 1)
    gap, normal, curvature = cone.distance(np.array([0.2, 0.5]))
    np.testing.assert_allclose([gap, *normal, curvature], [tip - 0.5, 0, -1, 1 / (0.1 + tip - 0.5)], atol=1e-14)
    flank = cone.distance(np.array([1.0, 1.1]))
    expected = 0.8 * np.cos(np.radians(70.0)) - 0.1 * np.sin(np.radians(70.0))
    np.testing.assert_allclose([flank.gap, flank.curvature], [expected, 0.0], atol=1e-14)
    punch = flat_punch((0.0, 1.0), 2.0, 3.0, 0.25)
    x = np.array([[0.3, 0.8], [1.2, 3.0], [1.05, 0.85]])
    np.testing.assert_allclose(punch.distance(x).gap, [0.2, 0.2, np.hypot(0.3, 0.4) - 0.25], rtol=1e-14)
    assert punch.inner_radius == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("profile", [DIE, replace(DIE, fillets=0.0), flat_punch((0.2, 0.1), 0.8, 3.0, 0.1)])
def test_the_least_gap_along_an_edge_is_that_of_a_fine_sampling(profile, count):
    """Of edges shorter than a piece, as meshes have: along longer ones there may be more dips than one."""
    rng = np.random.default_rng(5)
    edges = rng.uniform(-1, 1, (200, 1, 2)) + 0.1 * rng.uniform(-1, 1, (200, count, 2))
    s = np.linspace(0, 1, 4001)
    shapes = [1 - s, s] if count == 2 else [(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)]
    fine = profile.distance(np.einsum("ns,fnd->fsd", np.array(shapes), edges)).gap.min(axis=1)
    found = least_along(shaped(profile), edges)
    np.testing.assert_allclose(found, fine, atol=2e-4)
