"""Supports and planes of symmetry between the axes: what is refused, in words, and what their mirror images are."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.meshes.sections import block
from bipot.scene.loads import BodyForce, Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, Union
from bipot.tools.surfaces import Plane, imaged
from tests.inclined import BASE, QUARTER, along, body, flat, places, sector, turned


def ring_with(*supports):
    """A cylinder's quarter with such supports at its axis and base."""
    mesh = block(1.0, 1.0, 2, 2)
    return Scene(mesh, Geometry.AXISYMMETRIC, Elastic(Elasticity(1000.0, 0.3)), supports)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Support("base", (1.0, 1.0)), r"support\.direction = \(1\.0, 1\.0\): must be a unit vector"),
        (lambda: body((Support("base", (0.6, 0.8, 0.0)),)), r"support\.direction = .*: must be of 2 numbers"),
        (lambda: Support("base", (np.nan, 1.0)), r"support\.direction = .*: must be two finite numbers"),
        (lambda: Support("base", "up"), r"support\.direction = 'up': must be 0, 1 or, in space, 2, or a unit vector"),
        (lambda: Support("base", True), r"support\.direction = True: must be 0, 1 or"),
        (lambda: Support("base", 1.0), r"support\.direction = 1\.0: must be 0, 1 or"),
        (lambda: Support("base", 3), r"support\.direction = 3: must be 0, 1 or, in space, 2, or a unit vector"),
        (
            lambda: body((Support("base", along(30.0)), Prescribed("base", along(210.0), 0.1))),
            r"node 0 has one displacement along \(-0\.866\d*, -0\.5\)",
        ),
        (
            lambda: body((*BASE, Prescribed("base", along(30.0), 0.1))),
            r"node 0 has one displacement along \(0\.866\d*, 0\.5\)",
        ),
        (
            lambda: body((Support("base", along(30.0)), Prescribed("left", along(30.01), 0.1))),
            r"directions that hold node 0, one of them driven, are one or at an angle above 0\.001, not 0\.00017",
        ),
        (
            lambda: body((Support("base", 1),), (flat(point=(0.0, 0.0), normal=(0.0, 1.0), candidates=("base",)),)),
            "boundaries of which a node can move along its normal",
        ),
        (
            lambda: ring_with(Support("left", along(10.0)), Support("base", 1)),
            "such that they hold node .* on the axis along 0",
        ),
        (
            lambda: ring_with(Prescribed("left", along(10.0), 0.1), Prescribed("left", along(80.0), 0.1)),
            r"\['left', 'left'\]: must be none that moves the axis along 0",
        ),
        (
            lambda: ring_with(Support("left", 0), Symmetry("base", along(80.0))),
            r"symmetry\.direction = \(0\.17.*\): must be 1 in an axisymmetric scene",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_in_words(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_a_cone_holds_a_node_of_the_axis_beside_what_holds_it_there():
    scene = ring_with(Support("left", 0), Prescribed("base", along(80.0), 0.01))
    tip = np.flatnonzero((scene.mesh.nodes == 0).all(axis=1))
    np.testing.assert_allclose(scene.holding.at(1.0)[tip], [[0.0, 0.01 / math.sin(math.radians(80.0))]], rtol=1e-15)


PLANES = turned(body(QUARTER, (flat(),)))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: replace(PLANES, supports=(PLANES.supports[0], Symmetry("base", along(100.0)))),
            "'base': must be one whose nodes have one coordinate",
        ),
        (
            lambda: replace(PLANES, supports=(*PLANES.supports, Symmetry("right", along(210.0)))),
            r"along \(-0\.866\d*, -0\.5\) = 'right': must be in the plane of the other, \(0\.866\d*, 0\.5\) \. x = ",
        ),
        (lambda: replace(PLANES, loads=(BodyForce(along(30.0)),)), r"loads\[0\]\.vector = .* component along \(0\.866"),
        (
            lambda: replace(PLANES, tools=(replace(PLANES.tools[0], travel=along(100.0)),)),
            r"tools\[0\]\.travel = .* component along \(0\.866\d*, 0\.5\): a plane of symmetry cuts the tool",
        ),
        (lambda: replace(PLANES, loads=(Pressure("left", 1.0),)), "lies in a plane of symmetry"),
        (
            lambda: replace(
                sector(Geometry.PLANE_STRAIN),
                supports=(Symmetry("base", along(110.0)), Symmetry("top", along(-20.0))),
            ),
            "or across it at a right angle: images of images would overlap",
        ),
    ],
)
def test_planes_of_symmetry_aslant_are_refused_as_those_along_the_axes_are(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_a_quarter_aslant_has_the_mirror_images_of_the_straight_one_around_it():
    straight = body(QUARTER, (flat(),))
    ends = straight.surroundings.ends(straight.mesh.nodes)
    np.testing.assert_allclose(PLANES.surroundings.ends(PLANES.mesh.nodes), places(ends), atol=1e-14)
    assert [plane.cuts(PLANES.tools[0]) for plane in PLANES.planes] == [True, False]
    assert [plane.words for plane in straight.planes] == ["x_0 = 0", "x_1 = 0"]


SHAPES = (
    Plane((0.3, -0.2), (0.6, -0.8)),
    Circle((0.5, 1.0), 0.7, concave=True),
    Profile(((1.0, -2.0), (1.0, 0.0), (0.6, 1.0), (0.6, 2.0)), (0.2, 0.5)),
    Profile(((0.0, 0.0), (0.0, 1.0), (2.0, 1.0), (1.0, 0.0)), 0.1, closed=True),
)


@pytest.mark.parametrize("surface", [*SHAPES, Union(SHAPES[1:3])], ids=lambda surface: type(surface).__name__)
def test_the_mirror_image_of_a_surface_is_as_far_from_mirror_images(surface):
    x, normal = np.random.default_rng(3).uniform(-2.0, 2.0, (50, 2)), along(25.0)
    image = surface.image(normal, 0.4)
    seen, found = surface.distance(x), image.distance(imaged(x, normal, 0.4))
    np.testing.assert_allclose(found.gap, seen.gap, atol=1e-13)
    np.testing.assert_allclose(found.normal, imaged(seen.normal, normal, 0.0), atol=1e-9)
    assert image.image(normal, 0.4).same(surface, 1e-12)
    assert not surface.mirrored(normal, 0.4, 1e-9)


@pytest.mark.parametrize("angle", [0.0, 40.0])
def test_a_surface_is_its_own_mirror_image_in_its_plane_of_symmetry_however_that_lies(angle):
    normal, across = np.array(along(angle)), np.array(along(angle + 90.0))
    punch = tuple(
        tuple((a * normal + b * across).tolist()) for a, b in ((1.0, 4.0), (1.0, 2.0), (-1.0, 2.0), (-1.0, 4.0))
    )
    for surface in (Circle(tuple(2.0 * across), 1.0), Plane((0.0, 0.0), along(angle + 90.0)), Profile(punch, 0.5)):
        assert surface.mirrored(along(angle), 0.0, 1e-9)
        assert not surface.mirrored(along(angle + 10.0), 0.0, 1e-9)


def test_resting_supports_that_are_almost_parallel_hold_a_node_both_ways():
    scene = body((Support("base", along(30.0)), Support("base", along(30.01))))
    assert scene.holding.held[scene.mesh.boundary_nodes("base")].all()
    one = body((Support("base", along(30.0)), Support("base", along(210.0))))
    assert one.holding.held.sum() == len(one.mesh.boundary_nodes("base"))


def test_round_off_of_a_direction_that_is_held_is_no_component_across_it():
    holding = body((Support("base", along(30.0)),)).holding
    same = np.array([[-math.sqrt(3) / 2, -0.5]])
    (x, y), (u, v) = along(30.0), same[0]
    assert x * v - y * u != 0
    np.testing.assert_array_equal(holding.axes.at(holding.axes.nodes[:1], same), [[-1.0, 0.0]])
    assert not holding.free_along(holding.axes.nodes[:1], same).any()
