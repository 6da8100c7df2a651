"""Surfaces of revolution: distance, normal and curvatures against differences, slips, mirror images."""

from fractions import Fraction

import numpy as np
import pytest

from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, Union, flat_punch, wedge
from bipot.tools.revolved import Revolved, cone, roll, sphere
from bipot.tools.slips import Slip, spin, transported
from bipot.tools.surfaces import Distance, Plane, frames
from tests.scenes import refused
from tests.solids import turned
from tests.test_surfaces import slope

AXIS = tuple((np.array([1.0, -2.0, 2.0]) / 3.0).tolist())
POINT = (0.3, -0.2, 0.1)
SURFACES = {
    "plane": Plane(POINT, AXIS),
    "sphere": sphere(POINT, 0.7),
    "hollow sphere": sphere(POINT, 4.0, concave=True),
    "cylinder": roll(POINT, AXIS, 0.7),
    "bore": roll(POINT, AXIS, 2.5, concave=True),
    "cone": cone(POINT, AXIS, 30.0, 4.0, 0.5),
    "torus": Revolved(Circle((1.5, 0.2), 0.4), POINT, AXIS),
    "punch": Revolved(flat_punch((0.0, 0.0), 1.5, 4.0, 0.3), POINT, AXIS),
    "die": Revolved(Profile(((0.0, -0.5), (2.0, -0.5), (2.0, 1.0), (3.0, 1.0)), 0.3), POINT, AXIS),
    "two": Union((sphere(POINT, 0.7), sphere((3.0, 0.0, 0.0), 0.7))),
}
CONSTANT = ("plane", "sphere", "hollow sphere", "cylinder", "bore")
RNG = np.random.default_rng(5)
AT = RNG.uniform(-2, 2, (60, 3))
WAYS = RNG.uniform(-1, 1, (60, 3))


def smooth(surface, h=2e-3):
    """Points (m,) about which the surface has one piece that is nearest, and none of its corners or centres."""
    near = [surface.distance(AT + s * h * WAYS).curvature for s in (-1, 0, 1)]
    size = np.abs(near[1]).max(axis=(1, 2))
    apart = np.abs(near[0] + near[2] - 2 * near[1]).max(axis=(1, 2))
    return (size < 20) & (apart < 1e-3)


@pytest.mark.parametrize("name", SURFACES)
def test_normal_and_both_curvatures_are_derivatives_of_the_gap(name):
    surface = SURFACES[name]
    kept = smooth(surface)
    assert kept.sum() > 20
    at, ways = AT[kept], WAYS[kept]
    _, normal, curvature = surface.distance(at)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(curvature, curvature.swapaxes(1, 2), atol=1e-14)
    by_difference = slope(lambda t: surface.distance(at + t * ways).gap)
    np.testing.assert_allclose(by_difference, np.vecdot(normal, ways), atol=1e-7)
    bent = slope(lambda t: surface.distance(at + t * ways).normal)
    np.testing.assert_allclose(bent, (curvature @ ways[..., None])[..., 0], atol=2e-5)


def test_closed_forms():
    out = np.array([[0.0, 0.0, 2.0], [1.0, 2.0, 2.0]])
    gap, normal, curvature = sphere((0.0, 0.0, 0.0), 1.5).distance(out)
    np.testing.assert_allclose(gap, [0.5, 1.5], rtol=1e-15)
    far = np.linalg.norm(out, axis=1)
    np.testing.assert_allclose(normal, out / far[:, None], rtol=1e-15, atol=1e-16)
    principal = np.linalg.eigvalsh(curvature)
    np.testing.assert_allclose(principal, np.column_stack([0 * far, 1 / far, 1 / far]), atol=1e-15)
    torus = Revolved(Circle((3.0, 0.0), 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    at = np.array([0.0, 5.0, 0.0]), np.array([0.0, 1.0, 0.0])
    for x, expected in zip(at, ([0, 1 / 5, 1 / 2], [-1.0, 0, 1 / 2]), strict=True):
        np.testing.assert_allclose(np.linalg.eigvalsh(torus.distance(x).curvature), expected, atol=1e-15)
    slope_ = np.sin(np.radians(30.0))
    flank = cone((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 30.0, 10.0).distance(np.array([2.0, 0.0, 1.0]))
    np.testing.assert_allclose(flank.gap, 2.0 * np.cos(np.pi / 6) - slope_, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.eigvalsh(flank.curvature), [0, 0, np.cos(np.pi / 6) / 2.0], atol=1e-15)


@pytest.mark.parametrize("name", ["sphere", "cone", "punch", "cylinder"])
def test_on_the_axis_and_next_to_it_a_surface_is_as_smooth_as_it_is(name):
    surface = SURFACES[name]
    down = np.array(POINT) - 0.9 * np.array(AXIS)
    beside = down + 1e-9 * np.array([2.0, 1.0, 0.0]) / np.sqrt(5.0)
    on, near = surface.distance(down), surface.distance(beside)
    for value in on:
        assert np.isfinite(value).all()
    if name != "cylinder":
        np.testing.assert_allclose(on.normal, np.negative(AXIS), atol=1e-15)
        np.testing.assert_allclose(near.curvature, on.curvature, atol=1e-7)
        across = np.eye(3) - np.outer(AXIS, AXIS)
        c = 0.0 if name == "punch" else 1 / (on.gap + SURFACES[name].tips().radius[0])
        np.testing.assert_allclose(on.curvature, c * across, atol=1e-12)


@pytest.mark.parametrize("name", SURFACES)
def test_what_is_passed_is_the_growth_of_the_gap(name):
    surface = SURFACES[name]
    opened = surface.passed(AT, 0.3 * WAYS)
    assert opened.shape == (len(AT), 1)
    grown = surface.distance(AT + 0.3 * WAYS).gap - surface.distance(AT).gap
    np.testing.assert_allclose(opened[:, 0], grown, atol=1e-13)
    np.testing.assert_allclose(surface.gap(AT, 0.3 * WAYS[0]), surface.distance(AT - 0.3 * WAYS[0]).gap, atol=1e-13)


def test_small_ways_are_passed_to_their_own_round_off():
    """A sphere of a radius of 1e6: places of 1e-10 of round-off, ways of 1e-8 to 1e-9 of themselves."""
    x, by = np.array([[0.5, 0.3, 0.0]]), 1e-8 * np.array([[1.0, 2.0, -1.0]])
    ball = sphere((0.0, 0.0, 1e6), 1e6)
    np.testing.assert_allclose(ball.passed(x, by)[0, 0], 1e-8 + 1e-8 * 1.1e-6, rtol=1e-11)


def slip_on(surface, x, by, reference):
    """The slip of points x that go by as much, with what it needs."""
    start, end = surface.distance(x), surface.distance(x + by)
    framed = transported(reference, end.normal)
    turning = (end.curvature @ spin(reference, end.normal)[..., None])[..., 0]
    return Slip(start.gap, start.normal, by, end.gap, framed, end.curvature, turning)


@pytest.mark.parametrize("name", [name for name in SURFACES if name != "two"])
def test_the_slip_s_derivative_is_one(name):
    surface = SURFACES[name]
    kept = smooth(surface) & (np.abs(surface.distance(AT).gap) < 1.0)
    x, by = AT[kept], 0.1 * WAYS[kept]
    same = np.vecdot(surface.distance(x).normal, surface.distance(x + by).normal) > 0.5
    x, by = x[same], by[same]
    reference = frames(surface.distance(x + 0.3 * RNG.normal(size=x.shape)).normal)
    slip = slip_on(surface, x, by, reference)
    ways = RNG.uniform(-1, 1, x.shape)
    expected = (slip.derivative() @ ways[..., None])[..., 0]
    found = slope(lambda t: slip_on(surface, x, by + t * ways, reference).components, 1e-4)
    close = np.abs(found - expected).max(axis=1) < 1e-6
    # Where the step leaves a piece of the profile there is none.
    assert close.mean() > (0.999 if name in (*CONSTANT, "torus") else 0.8)


@pytest.mark.parametrize(
    ("surface", "start", "end", "length"),
    [
        (sphere((0.0, 0.0, 0.0), 2.0), (2.0, 0.0, 0.0), (2 * np.cos(1.0), 2 * np.sin(1.0), 0.0), 2.0),
        (roll((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 2.0), (2.0, 0.0, 0.0), (0.0, 2.0, 1.5), np.hypot(np.pi, 1.5)),
        (Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (1.0, 0.0, 0.0), (4.0, 4.0, 0.0), 5.0),
    ],
    ids=["sphere", "helix", "plane"],
)
def test_slips_are_shortest_lines_on_what_has_constant_curvatures(surface, start, end, length):
    """And grow by the unit tangent there, as do arcs: friction's work is that of the tangent force."""
    x, y = np.array([start]), np.array([end])
    reference = frames(surface.distance(x + 0.1).normal)
    slip = slip_on(surface, x, y - x, reference)
    np.testing.assert_allclose(np.linalg.norm(slip.components), length, rtol=1e-13)
    along = slip.components[0] / length
    pulled = along @ slip.derivative()[0]
    np.testing.assert_allclose(pulled, along @ slip.frames[0, 1:], atol=1e-13)


def test_on_other_surfaces_slips_add_up_but_for_the_third_order_of_an_increment():
    """Along a cone's helix: the error falls to an eighth in an increment that is halved, so in all to a fourth."""
    flank = cone((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 30.0, 10.0)

    def whole(n):
        s = np.linspace(0.0, 1.0, n + 1)
        r, z = (1 + s) / 2, (1 + s) * np.cos(np.pi / 6)
        line = np.column_stack([r * np.cos(s), r * np.sin(s), z])
        x, by = line[:-1], np.diff(line, axis=0)
        lengths = np.linalg.norm(slip_on(flank, x, by, frames(flank.distance(x).normal)).components, axis=1)
        return lengths, line

    fine = np.linalg.norm(np.diff(whole(20000)[1], axis=0), axis=1).sum()
    errors = [abs(whole(n)[0].sum() - fine) for n in (4, 8, 16)]
    assert errors[0] < 1e-2
    assert errors[1] < errors[0] / 3.5
    assert errors[2] < errors[1] / 3.5


def test_a_motion_in_a_meridian_slips_by_its_arc_on_rounds_and_straights():
    punch = Revolved(flat_punch((0.0, 0.0), 1.5, 4.0, 0.3), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    plane = flat_punch((0.0, 0.0), 1.5, 4.0, 0.3)
    for one, other in (((0.1, -0.1), (0.3, -0.05)), ((0.6, -0.1), (0.85, 0.2))):
        x, by = np.array([[one[0], 0.0, one[1]]]), np.array([[other[0] - one[0], 0.0, other[1] - one[1]]])
        slip = slip_on(punch, x, by, frames(punch.distance(x).normal)).components
        arc = plane.passed(np.array(one), np.subtract(other, one))[1]
        assert np.linalg.norm(slip) == pytest.approx(abs(arc), rel=1e-12)


@pytest.mark.parametrize("name", SURFACES)
def test_mirror_images_and_surfaces_turned_are_the_same_from_the_other_side(name):
    surface = SURFACES[name]
    normal = tuple((np.array([2.0, -1.0, 2.0]) / 3.0).tolist())
    image = surface.image(normal, 0.4)
    m = np.array(normal)
    mirrored = AT + 2 * (0.4 - AT @ m)[:, None] * m
    np.testing.assert_allclose(image.distance(mirrored).gap, surface.distance(AT).gap, atol=1e-13)
    assert image.image(normal, 0.4).same(surface, 1e-9)
    assert surface.same(surface, 1e-9)
    if name != "plane":
        assert not surface.mirrored(normal, 0.4, 1e-9)


def test_which_planes_mirror_what():
    ball, tube = SURFACES["sphere"], SURFACES["cylinder"]
    any_ = np.array([0.6, 0.0, 0.8])
    assert ball.mirrored((0.6, 0.0, 0.8), float(any_ @ POINT), 1e-9)
    along = frames(np.array(AXIS))[1]
    for name in ("cylinder", "cone", "torus", "punch", "die"):
        surface = SURFACES[name]
        assert surface.mirrored(tuple(along.tolist()), float(along @ POINT), 1e-9)
        assert not surface.mirrored(tuple(along.tolist()), float(along @ POINT) + 0.1, 1e-9)
        assert not surface.mirrored((0.6, 0.0, 0.8), float(any_ @ POINT), 1e-9)
    assert tube.mirrored(AXIS, 7.0, 1e-9)
    ring, height = SURFACES["torus"], float(np.dot(AXIS, POINT))
    assert ring.mirrored(AXIS, height + 0.2, 1e-9)
    assert not ring.mirrored(AXIS, height, 1e-9)
    upside_down = Revolved(Circle((1.5, -0.2), 0.4), POINT, tuple(-a for a in AXIS))
    assert ring.same(upside_down, 1e-9)


def test_who_comes_out_on_another_side_crossed_and_who_slides_or_grazes_did_not():
    ball = sphere((0.0, 0.0, 0.0), 1.0)
    ways = {
        ((0.0, 0.1, 3.0), (0.0, 0.0, -6.0)): True,
        ((0.0, 0.0, 1.0), (0.3, 0.0, -2.0)): True,
        ((0.0, 0.999, 3.0), (0.0, 0.0, -6.0)): False,
        ((0.0, 0.0, 1.0), (0.5, 0.0, -0.13)): False,
        ((2.0, 0.0, 3.0), (0.0, 0.0, -6.0)): False,
        ((0.0, 0.0, 1.5), (0.0, 0.0, -0.6)): False,
    }
    x, by = (np.array(v) for v in zip(*ways, strict=True))
    np.testing.assert_array_equal(ball.crossed(x, by), list(ways.values()))
    disc = Revolved(Profile(((1.0, 0.05), (1.0, -0.05), (-1.0, -0.05), (-1.0, 0.05)), 0.02, True), (0, 0, 0), (0, 0, 1))
    through = np.array([[0.3, 0.4, 40.0], [1.2, 0.0, 40.0]])
    np.testing.assert_array_equal(disc.crossed(through, np.array([[0.0, 0.0, -80.0]] * 2)), [True, False])
    assert not roll((0, 0, 0), (0, 0, 1), 1.0, concave=True).crossed(x, by).any()


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Revolved(Circle((0.5, 0.0), 1.0), POINT, AXIS), "revolved.meridian"),
        (lambda: Revolved(Plane((1.0, 0.0), (0.6, 0.8)), POINT, AXIS), "revolved.meridian"),
        (lambda: Revolved(Plane((-1.0, 0.0), (1.0, 0.0)), POINT, AXIS), "revolved.meridian"),
        (lambda: Revolved(Plane((0.0, 0.0), (0.6, 0.8)), POINT, AXIS), "revolved.meridian"),
        (lambda: Revolved(wedge((0.1, 0.0), 30.0, 1.0), POINT, AXIS), "revolved.meridian"),
        (lambda: Revolved(sphere(POINT, 1.0), POINT, AXIS), "revolved.meridian"),
        (lambda: Revolved("ball", POINT, AXIS), "revolved.meridian"),  # type: ignore[arg-type]
        (lambda: Revolved(Circle((0.0, 0.0), 1.0), (0.0, 1.0), AXIS), "revolved.point"),
        (lambda: Revolved(Circle((0.0, 0.0), 1.0), POINT, (0.0, 1.0)), "revolved.axis"),
        (lambda: Revolved(Circle((0.0, 0.0), 1.0), POINT, (0.0, 1.0, 1.0)), "revolved.axis"),
        (lambda: roll(POINT, AXIS, -1.0), "roll.radius"),
        (lambda: roll(POINT, AXIS, 1.0, concave=1), "roll.concave"),  # type: ignore[arg-type]
        (lambda: roll((0.0, 1.0), AXIS, 1.0), "roll.point"),
        (lambda: roll(POINT, (0.0, 1.0, 1.0), 1.0), "roll.axis"),
        (lambda: sphere((0.0, 1.0), 1.0), "sphere.centre"),
        (lambda: sphere(POINT, 0.0), "sphere.radius"),
        (lambda: cone((0.0, 1.0), AXIS, 45.0, 1.0), "cone.tip"),
        (lambda: cone(POINT, (0.0, 1.0), 45.0, 1.0), "cone.axis"),
        (lambda: cone(POINT, AXIS, 90.0, 1.0), "cone.semi_angle"),
        (lambda: cone(POINT, AXIS, 45.0, 0.0), "cone.length"),
        (lambda: Union((SURFACES["sphere"], Circle((0.0, 0.0), 1.0))), "union.surfaces"),
    ],
)
def test_what_is_no_surface_of_revolution_is_refused_by_name(make, field):
    refused(make, field)


@pytest.mark.parametrize("unit", [1e3, 1.0, 1e-3, 1e-9])
def test_round_off_of_a_meridian_counts_alike_in_all_units(unit):
    """A cylinder's line that is tilted by 1e-8, and a tip that is off the axis by 2e-12, in units of any length."""
    Revolved(Plane((10 * unit, 0.0), (1.0, 1e-8)), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    pointed = Profile(((3 * unit, 4 * unit), (2e-12 * unit, unit), (-3 * unit, 4 * unit)))
    assert len(Revolved(pointed, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)).tips().radius) == 1


def test_lines_are_on_the_surface_and_all_around_it():
    for name, surface in SURFACES.items():
        lines = surface.lines(np.array(POINT), 2.0)
        x = np.concatenate(lines)
        assert x.shape[1] == 3
        if name != "two":
            np.testing.assert_allclose(surface.distance(x).gap, 0.0, atol=1e-12)
    x = np.concatenate(SURFACES["sphere"].lines(np.zeros(3), 1.0)) - POINT
    np.testing.assert_allclose(x.min(axis=0), -0.7, atol=0.05)
    np.testing.assert_allclose(x.max(axis=0), 0.7, atol=0.05)


def test_frames_carried_are_orthonormal_and_turned_ones_stay_turned_by_as_much():
    normal = AT / np.linalg.norm(AT, axis=1)[:, None]
    reference = frames(WAYS / np.linalg.norm(WAYS, axis=1)[:, None])
    found = transported(reference, normal)
    np.testing.assert_allclose(found @ found.swapaxes(1, 2), np.broadcast_to(np.eye(3), found.shape), atol=1e-13)
    np.testing.assert_allclose(np.linalg.det(found), 1.0, rtol=1e-13)
    Q = turned((1.0, 0.0, 0.0), 0.7)
    other = transported(Q @ reference, normal)
    np.testing.assert_allclose(other, Q @ found, atol=1e-13)
    back = transported(reference, -reference[:, 0])
    np.testing.assert_allclose(np.linalg.det(back), 1.0, rtol=1e-13)
    assert isinstance(SURFACES["sphere"].distance(AT), Distance)


def test_an_angle_may_be_any_number():
    assert cone(POINT, AXIS, Fraction(100, 4), 1.0) == cone(POINT, AXIS, 25.0, 1.0)
