"""Ways along, around, through and past the end of profiles; their mirror images."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bipot.tensors import norm
from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, flat_punch, wedge
from bipot.tools.surfaces import Plane
from tests.profiles import drawn, sampled
from tests.test_profiles import ROUND, SEEDS, around

BLADE = Profile(((0.05, 2.0), (0.05, 0.0), (-0.05, 0.0), (-0.05, 2.0)))
COMB = Profile(
    ((0.5, 0.0), (0.45, 0.0), (0.45, 1.0), (0.05, 1.0), (0.05, 0.0), (0.0, 0.0), (0.0, 2.0), (0.5, 2.0)), closed=True
)


@given(SEEDS)
def test_what_is_passed_is_the_growth_of_the_gap(seed):
    profile, (x, by) = drawn(seed), around(seed)
    opened = profile.passed(x, by)[:, 0]
    np.testing.assert_allclose(opened, profile.distance(x + by).gap - profile.distance(x).gap, atol=1e-13)


@given(SEEDS)
def test_arcs_add_up_along_the_line_to_its_length(seed):
    """Of the dense sample from first to last, and of parts of any length."""
    profile = drawn(seed)
    line = sampled(profile)
    length = norm(np.diff(line, axis=0, append=line[:1] if profile.closed else line[-1:])).sum()
    rng = np.random.default_rng(seed)
    stops = line[np.sort(rng.choice(np.arange(1, len(line) - 1), 30, replace=False))]
    stops = np.concatenate([line[:1], stops, line[:1] if profile.closed else line[-1:]])
    slips = np.array([profile.passed(a, b - a)[1] for a, b in pairwise(stops)])
    assert slips.sum() == pytest.approx(length, rel=1e-6)
    if not profile.closed:
        assert profile.passed(stops[0], stops[-1] - stops[0])[1] == pytest.approx(slips.sum(), rel=1e-12)


@given(SEEDS)
@pytest.mark.slow
def test_a_way_meets_the_line_where_the_gap_changes_its_sign(seed):
    """Seen in small steps, between which it may only touch the line."""
    profile, (x, by) = drawn(seed), around(seed)
    steps = np.linspace(0.0, 1.0, 2001)
    gaps = profile.distance(x[:, None] + steps[:, None] * by[:, None]).gap
    for met, gap in zip(profile.pieces.met(x, by), gaps, strict=True):
        changes = np.flatnonzero(np.sign(gap[1:]) != np.sign(gap[:-1]))
        found = np.unique(met[met < 1].round(12))
        for step in changes:
            assert (np.abs(found - (steps[step] + steps[step + 1]) / 2) < 1e-3).any()
        for part in found:
            assert np.abs(gap[np.abs(steps - part) < 1e-3]).min() < 5e-3


@given(SEEDS, st.integers(2, 9))
def test_parts_of_a_way_add_up_to_the_whole_of_it(seed, count):
    """Where no way leads around a closed line by more than half of it."""
    profile, (x, by) = drawn(seed), around(seed)
    whole, parts, at = profile.passed(x, by), np.zeros((len(x), 2)), x
    for _ in range(count):
        parts += profile.passed(at, by / count)
        at = at + by / count
    short = np.abs(parts[:, 1]) < 0.45 * profile.pieces.length
    assert short.sum() > 10
    np.testing.assert_allclose(parts[short], whole[short], atol=1e-12)


@given(SEEDS)
def test_small_growth_is_not_the_difference_of_two_distances(seed):
    """Of a step of 1e-12 all digits are right, where positions have four."""
    profile, (x, by) = drawn(seed), around(seed)
    gap, normal, curvature = profile.distance(x)
    smooth = (profile.pieces.foot(x + 1e-6 * by).piece == profile.pieces.foot(x).piece) & (np.abs(curvature) < 1e3)
    opened, slid = profile.passed(x, 1e-12 * by)[smooth].T
    np.testing.assert_allclose(opened, 1e-12 * np.vecdot(normal, by)[smooth], atol=1e-20)
    along = (1 - curvature * gap) * np.vecdot(normal[:, ::-1] * (1, -1), by)
    np.testing.assert_allclose(slid, 1e-12 * along[smooth], atol=1e-20)


def test_the_arc_stands_still_while_a_point_goes_around_a_sharp_corner():
    corner = Profile(((0.0, 1.0), (0.0, 0.0), (-1.0, 0.0)))
    opened, slid = corner.passed(np.array([0.1, 0.0]), np.array([-0.1, -0.2]))
    np.testing.assert_allclose([opened, slid], [0.1, 0.0], atol=1e-15)
    np.testing.assert_allclose(corner.passed(np.array([0.0, 0.3]), np.array([-0.4, -0.3])), [0.0, 0.7], atol=1e-15)


def test_around_a_closed_line_slips_are_those_of_the_shorter_way():
    square = Profile(((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)), closed=True)
    start, end = np.array([0.1, 0.0]), np.array([0.0, 0.2])
    assert square.passed(start, end - start)[1] == pytest.approx(0.3, rel=1e-14)
    assert square.passed(end, start - end)[1] == pytest.approx(-0.3, rel=1e-14)


@pytest.mark.slow
@settings(max_examples=50)
@given(SEEDS)
def test_who_slides_along_a_profile_does_not_cross_it(seed):
    """From place to place, by a part of the least radius, and off it outwards."""
    profile = drawn(seed, sharp=False)
    line = sampled(profile, 1e-3)
    places = line[~profile.beyond(line)]
    ahead = max(1, int(profile.fillets / 1e-3 / 2))
    start, end = places[:-ahead], places[ahead:]
    near = norm(end - start) < profile.fillets
    normal = profile.distance(end).normal
    start, end, near, normal = start[::7], end[::7], near[::7], normal[::7]
    for off in (0.0, 1e-12, -1e-12, 0.1 * profile.fillets):
        way = end + off * normal - start
        assert not (profile.crossed(start, way) & near & (profile.distance(start + way).gap > -1e-9)).any()


@pytest.mark.parametrize("radius", [0.0, 1e-3, 0.05])
def test_corners_of_punches_and_wedges_are_gone_around_in_short_ways(radius):
    """A way over a corner of a right angle is the shortest, however small the fillet is."""
    punch, edge = flat_punch((0.0, 0.0), 1.0, 2.0, radius), radius * (1 - np.sqrt(0.5))
    start = np.array([[0.49 - radius, 0.0], [0.5, radius + 0.01], [0.47 - radius, 0.0], [0.5 - edge, edge]])
    end = np.array([[0.5, radius + 0.01], [0.49 - radius, 0.0], [0.501, radius + 0.03], [0.5, radius + 0.01]])
    assert not punch.crossed(start, end - start).any()
    blunt = wedge((0.0, 0.0), 60.0, 2.0, radius)
    flank = np.array([0.1, 0.1 / np.tan(np.pi / 3) - (0 if radius == 0 else 1e-3)])
    assert not blunt.crossed(flank, flank * (-2.0, 0.0))


def test_ways_through_thin_parts_are_found():
    through = np.array([[0.06, 1.0], [0.05, 0.5], [-0.3, 0.2], [0.05 + 1e-12, 0.5]])
    by = np.array([[-0.12, 0.01], [-0.1, 0.0], [0.6, 0.3], [-0.1 - 2e-12, 0.3]])
    assert BLADE.crossed(through, by).all()
    assert BLADE.crossed(through + by, -by).all()
    beside = np.array([[0.06, 1.0], [0.06, -0.01], [0.05, 0.5]])
    assert not BLADE.crossed(beside, np.array([[0.0, -0.5], [-0.12, 0.0], [0.0, 0.2]])).any()
    # Into the next gap of a comb, where the surface looks as where the way began; and past all of it.
    for by_comb in ((-0.2, 0.0), (0.5, 0.0)):
        assert COMB.crossed(np.array([0.6, 0.5]) - (0.4, 0) * (np.array(by_comb) > 0), np.array(by_comb))
    assert not COMB.crossed(np.array([0.1, 0.5]), np.array([0.3, 0.1]))
    sharp = wedge((0.0, 0.0), 15.0, 2.0)
    assert sharp.crossed(np.array([0.3, 1.0]), np.array([-0.6, 0.0]))


def test_a_punch_that_is_driven_past_a_node_in_its_middle_has_crossed_it():
    """It comes out at the side, around a right angle, from deeper than who slides around the edge."""
    punch = flat_punch((0.0, 0.0), 1.0, 2.0, 0.1)
    assert punch.crossed(np.array([0.05, 0.0]), np.array([0.46, 0.5]))
    assert not punch.crossed(np.array([0.4, 0.0]), np.array([0.1, 0.1]))


def test_no_way_inside_a_hollow_circle_crosses_it():
    hollow, (x, by) = Profile(ROUND.points[::-1], 1.0, closed=True), around(3)
    inside = (hollow.distance(x).gap > 0) & (hollow.distance(x + by).gap > 0)
    assert inside.sum() > 10
    assert not hollow.crossed(x, by)[inside].any()


def test_points_past_an_open_end_are_told():
    x = np.array([[0.0, 1.99], [0.0, 2.01], [0.0, 1.01], [0.2, 2.5], [-0.2, 1.5]])
    np.testing.assert_array_equal(BLADE.beyond(x + np.array([0.05, 0.0])), [False, True, False, True, False])
    line = Profile(((1.0, 0.0), (-1.0, 0.0)))
    ends = np.array([[1.0, 0.3], [1.0 + 1e-12, 0.0], [1.0 + 1e-6, -0.2], [-2.0, 0.4]])
    np.testing.assert_array_equal(line.beyond(ends), [False, False, True, True])
    assert not ROUND.beyond(10 * ends).any()
    assert not Plane((0.0, 0.0), (0.0, 1.0)).beyond(ends).any()
    assert not Circle((0.0, 0.0), 1.0).beyond(ends).any()


@given(SEEDS)
def test_a_profile_and_its_mirror_image_are_one_where_it_is_symmetric(seed):
    profile, rng = drawn(seed), np.random.default_rng(seed)
    assert not profile.mirrored((1.0, 0.0), 0.0, 1e-6)
    assert not profile.mirrored((0.0, 1.0), 0.3, 1e-6)
    # A half with its mirror image.
    count = rng.integers(2, 6)
    half = np.stack([np.sort(rng.uniform(0.5, 2.5, count)), np.arange(count) + rng.uniform(0, 0.1, count)], axis=-1)
    fillets = tuple(rng.uniform(0, 0.02, count - 1).tolist())
    both = tuple(map(tuple, np.concatenate([half[::-1], half * (-1, 1)]).tolist()))
    whole = Profile(both, (*fillets[::-1], *fillets))
    assert whole.mirrored((1.0, 0.0), 0.0, 1e-12)
    assert not whole.mirrored((1.0, 0.0), 1e-3, 1e-6)
    assert not whole.mirrored((0.0, 1.0), 0.0, 1e-6)
    uneven = Profile(both, (*fillets[::-1], *fillets[:-1], fillets[-1] + 1e-3))
    assert not uneven.mirrored((1.0, 0.0), 0.0, 1e-9)


def test_closed_profiles_are_their_mirror_image_whatever_corner_they_begin_at():
    points = ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0))
    radii = (0.1, 0.2, 0.2, 0.1)
    for k in range(4):
        shape = Profile(points[k:] + points[:k], radii[k:] + radii[:k], closed=True)
        assert shape.mirrored((1.0, 0.0), 0.5, 1e-12)
        assert not shape.mirrored((0.0, 1.0), 0.5, 1e-12)
        assert not shape.mirrored((1.0, 0.0), 0.6, 1e-3)
    assert not Profile(points, (0.1, 0.2, 0.1, 0.2), closed=True).mirrored((1.0, 0.0), 0.5, 1e-12)


@pytest.mark.slow
@settings(max_examples=25)
@given(SEEDS)
def test_ways_meet_the_line_where_a_fine_sampling_changes_sides(seed):
    profile, (x, by) = drawn(seed), around(seed)
    part = np.linspace(0, 1, 2001)
    met = profile.pieces.met(x, by)
    outside = profile.distance(x[:, None] + part[:, None] * by[:, None]).gap > 0
    for own, sides in zip(met, outside, strict=True):
        low = part[:-1][sides[1:] != sides[:-1]]
        assert all(((own >= a - 1e-12) & (own <= a + 1 / 2000 + 1e-12)).any() for a in low)
        # Each place where they meet is on the line, and seen from both sides or passed over between two samples.
        if len(low) > 1:
            assert len(np.unique(own[own < 1].round(9))) >= len(low)
    met = np.where(met < 1, met, np.nan)
    gap = profile.distance(x[:, None] + np.nan_to_num(met)[..., None] * by[:, None]).gap
    np.testing.assert_allclose(gap[np.isfinite(met)], 0.0, atol=1e-13)


@pytest.mark.parametrize("tiny", [5e-324, 1e-310, 1e-160])
def test_a_way_of_next_to_nothing_meets_no_line(tiny):
    x = np.array([[0.3, 1.0], [-0.1, 0.5], [0.0, -1.0]])
    for by in (np.full((3, 2), tiny), np.array([[tiny, 0.1]] * 3)):
        assert not BLADE.crossed(x, by).any()
        assert (BLADE.pieces.met(x, by) == 1.0).all()
