"""Unions of surfaces, what is refused as a profile, and profiles in other units and places."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from bipot import (
    Elasticity,
    Geometry,
    Linear,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    VonMises,
    block,
    march,
)
from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, Union, flat_punch, wedge
from bipot.tools.surfaces import Plane, Surface
from tests.profiles import drawn, on_line
from tests.scenes import refused
from tests.test_profiles import SEEDS, around


@pytest.mark.slow
@given(SEEDS)
def test_a_union_is_the_nearest_of_its_surfaces(seed):
    parts = (Circle((0.8, 0.2), 0.4), Plane((0.0, -1.2), (0.0, 1.0)), drawn(seed))
    union, (x, by) = Union(parts), around(seed)
    found, each = union.distance(x), [part.distance(x) for part in parts]
    nearest = np.argmin([one.gap for one in each], axis=0)
    for k, one in enumerate(each):
        for a, b in zip(found, one, strict=True):
            np.testing.assert_array_equal(a[nearest == k], b[nearest == k])
    np.testing.assert_array_equal(union.gap(x, np.zeros(2)), found.gap)
    np.testing.assert_allclose(union.passed(x, by)[:, 0], union.distance(x + by).gap - found.gap, atol=1e-13)
    same = nearest == np.argmin([part.gap(x + by, np.zeros(2)) for part in parts], axis=0)
    slips = np.array([part.passed(x, by)[:, 1] for part in parts])[nearest, np.arange(len(x))]
    np.testing.assert_array_equal(union.passed(x, by)[same, 1], slips[same])
    np.testing.assert_array_equal(union.crossed(x, by), np.any([part.crossed(x, by) for part in parts], axis=0))
    np.testing.assert_array_equal(union.beyond(x), parts[2].beyond(x) & (nearest == 2))
    assert (union.size(x, np.ones(2)) >= parts[0].size(x, np.ones(2))).all()
    assert isinstance(union, Surface)
    assert Union((Circle((0.0, 1.0), 0.4), Plane((0.0, -1.2), (0.0, 1.0)))).mirrored((1.0, 0.0), 0.0, 1e-9)
    assert not union.mirrored((1.0, 0.0), 0.0, 1e-9)


def test_over_a_joint_of_circles_the_arc_on_each_counts_to_where_they_are_equally_near():
    """A way over a valley between circles of two sizes."""
    one, other = Circle((0.0, 0.0), 1.0), Circle((2.5, 0.5), 2.0)
    x, by = np.array([-0.8, 1.3]), np.array([3.6, 1.4])

    def angle(circle, part):
        return np.arctan2(*(x + part * by - circle.centre)[::-1])

    def nearer(part):
        far = [np.linalg.norm(x + part * by - circle.centre) - circle.radius for circle in (one, other)]
        return far[0] - far[1]

    joint = brentq(nearer, 0.0, 1.0, xtol=1e-15)
    assert 0.1 < joint < 0.4
    arc = sum(c.radius * (angle(c, a) - angle(c, b)) for c, a, b in ((one, 0.0, joint), (other, joint, 1.0)))
    slips = (
        Union((one, other)).passed(np.array([x]), np.array([by]))[0, 1],
        -Union((other, one)).passed(np.array([x + by]), np.array([-by]))[0, 1],
    )
    np.testing.assert_allclose(slips, arc, rtol=1e-13)


@pytest.mark.parametrize("joint", [(1.03, 1.03), (1.2, 0.9)], ids=["abut", "lap"])
@pytest.mark.parametrize("slide", [0.3, -0.3])
def test_a_face_in_two_parts_is_slid_along_as_in_one(joint, slide):
    """Forces and friction work are those of one profile, in increments that take nodes over the joint."""

    def half(a, b):
        return Profile(((b, 1.0), (a, 1.0), (a, 5.0), (b, 5.0)), closed=True)

    def slid(face):
        path = ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
        scene = Scene(
            block(2.0, 1.0, 6, 2),
            Geometry.PLANE_STRAIN,
            VonMises(Elasticity(1000.0, 0.3), Linear(3.0, 30.0)),
            (Support("base", 0), Support("base", 1)),
            tools=(ShapedTool(face, (slide, -0.02), ("top",), 0.1, path=path),),
        )
        *_, last = march(scene, Schedule(4))
        return np.append(last.tool_force(0), last.energies.friction)

    parts = slid(Union((half(-9.0, joint[0]), half(joint[1], 9.0))))
    np.testing.assert_allclose(parts, slid(half(-9.0, 9.0)), rtol=1e-8)


SQUARE = ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0))

SLOTTED = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (5.0, 1.0), (5.0, 0.0))
"""A line that a side leads back along to (1, 0) and on, over its first one."""


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Profile("line"), "profile.points = 'line': must be pairs of numbers"),
        (lambda: Profile(np.array("q")), "profile.points = array.*: must be pairs of numbers"),
        (
            lambda: Profile(((5.0, 1.0), (0.0, 1.0), (0.0, 5.0)), np.array(1.0)),
            "profile.fillets = array.*: must be a number",
        ),
        (lambda: Profile(((0.0, 0.0),)), "profile.points = .*: must be at least 2"),
        (lambda: Profile(SQUARE[:2], closed=True), "profile.points = .*: must be at least 3"),
        (lambda: Profile((*SQUARE, (1.0, "up"))), r"profile.points\[4\]"),
        (lambda: Profile((*SQUARE, (1.0, float("nan")))), r"profile.points\[4\]"),
        (lambda: Profile((*SQUARE, (1e50, 0.0))), r"profile.points\[4\]"),
        (lambda: Profile(SQUARE, -0.1), "profile.fillets = -0.1"),
        (lambda: Profile(SQUARE, float("inf")), "profile.fillets = inf"),
        (lambda: Profile(SQUARE, True), "profile.fillets = True"),
        (lambda: Profile(SQUARE, (0.1, "big")), r"profile.fillets\[1\] = 'big'"),
        (lambda: Profile(SQUARE, (0.1,)), r"profile.fillets = .*: must be a radius, or 2"),
        (lambda: Profile(SQUARE, (0.1,) * 3, closed=True), r"profile.fillets = .*: must be a radius, or 4"),
        (lambda: Profile(SQUARE, closed=1), "profile.closed = 1"),
        (lambda: Profile((*SQUARE[:2], *SQUARE[1:])), r"profile.points = .*: must be different: number \[1\]"),
        (lambda: Profile((*SQUARE, SQUARE[0]), closed=True), r"different: number \[4\]"),
        (lambda: Profile((*SQUARE[:2], SQUARE[0], SQUARE[3])), "does not go back on itself"),
        (lambda: Profile(SQUARE[:3], 1.2), r"profile.fillets = \[1.2\]: must be such that they fit on a side of 1"),
        (
            lambda: Profile(SQUARE, (0.6, 0.5), closed=False),
            r"fit on a side of 1: by corner they are \{1: 0.6, 2: 0.5\}",
        ),
        (lambda: Profile(SQUARE, 0.51, closed=True), "fit on a side of 1"),
        (lambda: Profile((SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]), closed=True), "does not meet itself"),
        (
            lambda: Profile((SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[3], SQUARE[0])),
            "beyond its ends: go on, or close it",
        ),
        (lambda: Profile(((1.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, 0.0), (0.5, -1.0))), "beyond its ends"),
        (lambda: Profile(((0.0, 1.0), (0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (-1.0, 0.5), (3.0, 3.0))), "meet itself"),
        (lambda: Profile(((0.0, 4.0), (0.0, 0.0), (4.0, 0.0), (0.9, 0.9), (5.0, 1.0)), (3.0, 0.0, 0.0)), "corner 1"),
        (lambda: Profile((*SLOTTED, (0.5, 0.0), (0.5, -1.0), (0.0, -1.0)), closed=True), "does not meet itself"),
        (lambda: Profile((*SLOTTED, (2.0, 0.0))), "does not meet itself"),
        (lambda: Profile(((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)), closed=True), "profile.points"),
        (lambda: Profile(SQUARE, 1e-50), "profile.fillets = 1e-50"),
        (lambda: wedge((0.0, 0.0), 90.0, 1.0), "wedge.semi_angle = 90.0"),
        (lambda: wedge((0.0, 0.0), 45.0, 0.0), "wedge.length"),
        (lambda: wedge((0.0, "x"), 45.0, 1.0), "wedge.apex"),
        (lambda: wedge((0.0, 0.0), 45.0, 1.0, 2.0), "profile.fillets"),
        (lambda: wedge((0.0, 0.0), 45.0, 1.0, "r"), "wedge.radius = 'r': must be a number"),
        (lambda: flat_punch((0.0, 0.0), -1.0, 1.0), "punch.width"),
        (lambda: flat_punch((0.0, 0.0), 1.0, 1.0, -0.1), "punch.radius = -0.1: must be finite and >= 0"),
        (lambda: flat_punch((0.0, 0.0), 1.0, 1.0, 0.6), "profile.fillets"),
        (lambda: Union(()), "union.surfaces"),
        (lambda: Union((Circle((0.0, 0.0), 1.0), "plane")), r"union.surfaces\[1\] = 'plane'"),
        (lambda: Union(Circle((0.0, 0.0), 1.0)), "union.surfaces"),
    ],
)
def test_what_is_no_profile_is_refused_in_a_sentence(make, words):
    refused(make, words)


def test_straight_corners_and_numbers_of_any_kind_are_no_matter():
    plain = Profile(SQUARE, 0.25, closed=True)
    same = Profile(np.array([(0, 0), (0, 0.5), (0, 1), (1, 1), (1, 0), (0.3, 0)]), [0.25, 9, 0.25, 0.25, 0.25, 0], True)
    x, by = around(4)
    for one, other in zip(same.distance(x), plain.distance(x), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)
    np.testing.assert_allclose(same.passed(x, by), plain.passed(x, by), atol=1e-14)
    assert same.mirrored((1.0, 0.0), 0.5, 1e-12)
    assert re.fullmatch(r"Profile\(points=.*, fillets=0.25, closed=True\)", repr(plain))
    assert plain == Profile(SQUARE, 0.25, closed=True)
    assert hash(plain) == hash(Profile(SQUARE, 0.25, closed=True))


@pytest.mark.slow
@given(SEEDS, st.sampled_from([1e-25, 1e-6, 1e12, 1e25]), st.sampled_from([0.0, 1e3, 1e6]))
def test_units_and_places_are_no_matter(seed, unit, far):
    """To the round-off of coordinates so many sizes away from the origin."""
    profile, (x, by) = drawn(seed), around(seed)
    shift = far * np.array([1.0, -0.7])
    points = (np.array(profile.points) + shift) * unit
    other = Profile(tuple(map(tuple, points.tolist())), unit * profile.fillets, profile.closed)
    noise = 1e-13 * (1 + far)
    np.testing.assert_allclose(other.distance((x + shift) * unit).gap / unit, profile.distance(x).gap, atol=noise)
    on = on_line(profile, seed)
    np.testing.assert_allclose(other.distance((on + shift) * unit).gap / unit, 0.0, atol=noise)
    assert (other.beyond((x + shift) * unit) == profile.beyond(x)).mean() > 0.95
    if far == 0:
        np.testing.assert_array_equal(other.crossed(x * unit, by * unit), profile.crossed(x, by))
        half = profile.pieces.length / 2
        clear = np.abs(np.abs(profile.passed(x, by)[:, 1]) - half) > 1e-9
        np.testing.assert_allclose(
            other.passed(x * unit, by * unit)[clear] / unit, profile.passed(x, by)[clear], atol=1e-12
        )
