"""Signed distances against finite differences and closed forms, and what is refused as a surface or as its tool."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.contact.overlap import least_along
from bipot.tools.circle import Circle
from bipot.tools.surfaces import Plane, Surface, frames
from bipot.tools.tool import FlatTool, ShapedTool
from tests.scenes import refused, scene

SURFACES = (
    Plane((0.3, -0.2), (0.6, -0.8)),
    Circle((0.3, -0.2), 0.7),
    Circle((0.3, -0.2), 4.0, concave=True),
)

RNG = np.random.default_rng(3)
AT = RNG.uniform(-2, 2, (40, 2))
WAYS = RNG.uniform(-1, 1, (40, 2))


def slope(f, h=1e-3):
    """Of f(t) at 0, by Richardson's rule on central differences."""
    one, two = ((f(k * h) - f(-k * h)) / (2 * k * h) for k in (1, 2))
    return (4 * one - two) / 3


def shaped(surface=SURFACES[1], **changes):
    given = {"surface": surface, "travel": (0.0, -0.1), "candidates": ("top",), "mu": 0.1}
    return ShapedTool(**(given | changes))


@pytest.mark.parametrize("surface", SURFACES)
def test_normal_and_curvature_are_the_derivatives_of_the_gap(surface):
    _, normal, curvature = surface.distance(AT)
    tangent = frames(normal)[:, 1]
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-15)
    by_difference = slope(lambda t: surface.distance(AT + t * WAYS).gap)
    np.testing.assert_allclose(by_difference, np.vecdot(normal, WAYS), atol=1e-9)
    turned = slope(lambda t: surface.distance(AT + t * WAYS).normal)
    expected = (curvature * np.vecdot(tangent, WAYS))[:, None] * tangent
    np.testing.assert_allclose(turned, expected, atol=1e-7)


@pytest.mark.parametrize("surface", SURFACES)
def test_what_is_passed_is_the_growth_of_gap_and_arc(surface):
    gap, normal, curvature = surface.distance(AT)
    opened, slid = surface.passed(AT, 0.3 * WAYS).T
    np.testing.assert_allclose(opened, surface.distance(AT + 0.3 * WAYS).gap - gap, atol=1e-14)
    along = (1 - curvature * gap) * np.vecdot(frames(normal)[:, 1], WAYS)
    np.testing.assert_allclose(slope(lambda t: surface.passed(AT, t * WAYS))[:, 1], along, atol=1e-8)
    there = AT + 0.1 * WAYS
    parts = surface.passed(AT, 0.1 * WAYS)[:, 1] + surface.passed(there, 0.2 * WAYS)[:, 1]
    np.testing.assert_allclose(parts, slid, atol=1e-14)


@pytest.mark.parametrize("surface", SURFACES)
def test_small_growth_is_not_the_difference_of_two_distances(surface):
    """Of a step of 1e-12 all digits are right, where positions have four."""
    _, normal, _ = surface.distance(AT)
    opened = surface.passed(AT, 1e-12 * WAYS)[:, 0]
    np.testing.assert_allclose(opened, 1e-12 * np.vecdot(normal, WAYS), atol=1e-23)


@pytest.mark.parametrize("surface", SURFACES)
def test_a_moved_surface_has_the_gaps_of_points_that_moved_the_other_way(surface):
    moved = np.array([0.2, -0.5])
    np.testing.assert_allclose(surface.gap(AT, moved), surface.distance(AT - moved).gap, atol=1e-15)
    assert (surface.size(AT, moved) >= np.abs(surface.gap(AT, moved)) / 2).all()
    assert isinstance(surface, Surface)


def test_the_convex_and_the_hollow_circle_are_one_line_seen_from_its_two_sides():
    ball, hollow = Circle((0.3, -0.2), 0.7), Circle((0.3, -0.2), 0.7, concave=True)
    one, other = ball.distance(AT), hollow.distance(AT)
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, -b)
    np.testing.assert_allclose(np.linalg.norm(AT - one.gap[:, None] * one.normal - [0.3, -0.2], axis=1), 0.7)


def test_at_its_centre_a_circle_has_finite_numbers():
    for circle in SURFACES[1:]:
        gap, normal, curvature = circle.distance(np.array(circle.centre))
        assert abs(gap) == circle.radius
        assert np.linalg.norm(normal) == 1.0
        assert np.isfinite(curvature)
        assert np.isfinite(circle.passed(np.array(circle.centre), np.zeros(2))).all()


def test_a_mirror_image_is_asked_of_normal_or_centre():
    assert Plane((3.0, 1.0), (0.0, -1.0)).mirrored((1.0, 0.0), 0.0, 1e-9)
    assert not Plane((3.0, 1.0), (0.6, -0.8)).mirrored((1.0, 0.0), 3.0, 1e-9)
    assert Circle((0.5, 1.0), 2.0).mirrored((1.0, 0.0), 0.5 + 1e-10, 1e-9)
    assert not Circle((0.5, 1.0), 2.0).mirrored((1.0, 0.0), 0.0, 1e-9)


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("surface", SURFACES[1:])
def test_the_least_gap_along_an_edge_is_that_of_a_fine_sampling(surface, count):
    edges = np.random.default_rng(5).uniform(-1, 1, (200, count, 2))
    if count == 3:
        edges[:, 1] = edges[:, [0, 2]].mean(axis=1) + 0.1 * edges[:, 1]
    s = np.linspace(0, 1, 4001)
    shapes = [1 - s, s] if count == 2 else [(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)]
    sampled = surface.distance(np.einsum("ns,fnd->fsd", np.array(shapes), edges)).gap.min(axis=1)
    found = least_along(shaped(surface), edges)
    assert (found <= sampled + 1e-15).all()
    # Next to the centre, where the gap has a kink, the samples are too far apart.
    smooth = np.abs(np.abs(sampled) - surface.radius) > 0.1
    assert smooth.sum() > 100
    np.testing.assert_allclose(found[smooth], sampled[smooth], atol=1e-6)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Circle((0.0, 0.0), 0.0), r"circle.radius = 0.0: must be finite and > 0"),
        (lambda: Circle((0.0, 0.0), float("nan")), "circle.radius"),
        (lambda: Circle((0.0, 0.0), True), "circle.radius = True: must be a number"),
        (lambda: Circle((0.0, 0.0), 1e50), "circle.radius"),
        (lambda: Circle((0.0, float("inf")), 1.0), "circle.centre"),
        (lambda: Circle("up", 1.0), "circle.centre"),
        (lambda: Circle((0.0, 0.0), 1.0, concave=1), "circle.concave"),
        (lambda: Plane((0.0, 0.0), (0.0, 2.0)), "plane.normal = .*: must be a unit vector"),
        (lambda: Plane((0.0,), (0.0, 1.0)), "plane.point"),
        (lambda: shaped("round"), "tool.surface = 'round': must be a Surface"),
        (lambda: shaped(Circle), "tool.surface"),
        (lambda: shaped(mu=-0.1), "mu = -0.1"),
        (lambda: shaped(sampling="weighted"), "tool.sampling = 'weighted': must be a Sampling"),
        (lambda: scene(tools=(shaped(candidates=("nowhere",)),)), "nowhere"),
        (lambda: scene(tools=(shaped(candidates=("base", "top"), surface="flat"),)), "tool.surface"),
    ],
)
def test_what_is_no_surface_is_refused_in_a_sentence(make, words):
    refused(make, words)


def test_a_flat_tool_and_a_plane_as_its_surface_are_one():
    flat = FlatTool((0.3, -0.2), (0.6, -0.8), (0.0, -0.1), ("top",), 0.1)
    same = shaped(Plane((0.3, -0.2), (0.6, -0.8)))
    assert flat.face == same.face
    assert flat.flat
    assert same.flat
    assert not shaped().flat
    assert replace(flat, point=(1.0, 0.0)).face.point == (1.0, 0.0)
    np.testing.assert_array_equal(flat.distance(AT, np.ones(2)), same.distance(AT, np.ones(2)))


def test_points_cross_a_circle_where_their_way_goes_deep_into_it_and_out_on_another_side():
    circle, start = Circle((1.0, 2.0), 0.5), np.array([[1.0, 1.5]] * 6)
    by = [[0.0, 1.0], [0.0, 0.6], [0.5, 0.5], [0.25, 0.07], [0.0, 0.4], [3.0, 0.0]]
    np.testing.assert_array_equal(circle.crossed(start, np.array(by)), [True, True, True, False, False, False])
    far = np.array([[1.0, -8.0], [-8.0, 1.4]])
    np.testing.assert_array_equal(circle.crossed(far, np.array([[0.0, 20.0], [20.0, 0.0]])), [True, False])
    assert not replace(circle, concave=True).crossed(start, np.array(by)).any()
    assert not Plane((0.0, 0.0), (0.0, 1.0)).crossed(AT, WAYS).any()
    assert not circle.crossed(np.array(circle.centre), np.zeros(2))
