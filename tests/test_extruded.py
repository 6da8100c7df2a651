"""Prisms in space: distance, normal and curvature against differences, and a march beside plane strain."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.extruded import Extruded
from bipot.tools.profiles import Profile, Union, flat_punch, wedge
from bipot.tools.surfaces import Plane
from bipot.tools.tool import ShapedTool
from tests.scenes import refused
from tests.test_revolved import AT, WAYS, smooth
from tests.test_surfaces import slope

PLACED = {"point": (0.3, -0.2, 0.1), "first": (0.6, 0.8, 0.0), "second": (0.0, 0.0, 1.0)}
OBLIQUE = {"first": (2 / 3, 1 / 3, 2 / 3), "second": (-1 / 3, -2 / 3, 2 / 3)}
SECTIONS = {
    "circle": Circle((0.2, 0.5), 0.7),
    "punch": flat_punch((0.0, -0.5), 1.5, 4.0, 0.3),
    "die": Profile(((2.0, -1.0), (0.5, -1.0), (0.5, 1.0)), 0.3),
    "two": Union((Circle((0.0, 0.0), 0.5), Circle((3.0, 0.0), 0.7))),
}
PUNCH = flat_punch((0.0, 1.0), 1.2, 1.0, 0.3)


@pytest.mark.parametrize("name", SECTIONS)
@pytest.mark.parametrize("placed", [PLACED, OBLIQUE])
def test_normal_curvature_and_what_is_passed_are_those_of_the_gap(name, placed):
    surface = Extruded(SECTIONS[name], **placed)
    kept = smooth(surface)
    assert kept.sum() > 20
    at, ways = AT[kept], WAYS[kept]
    _, normal, curvature = surface.distance(at)
    by_difference = slope(lambda t: surface.distance(at + t * ways).gap)
    np.testing.assert_allclose(by_difference, np.vecdot(normal, ways), atol=1e-7)
    bent = slope(lambda t: surface.distance(at + t * ways).normal)
    np.testing.assert_allclose(bent, (curvature @ ways[..., None])[..., 0], atol=2e-5)
    opened = surface.passed(AT, 0.3 * WAYS)
    grown = surface.distance(AT + 0.3 * WAYS).gap - surface.distance(AT).gap
    np.testing.assert_allclose(opened, grown[:, None], atol=1e-13)
    np.testing.assert_allclose(surface.gap(AT, 0.3 * WAYS[0]), surface.distance(AT - 0.3 * WAYS[0]).gap, atol=1e-13)
    for line in surface.lines(np.array(surface.point), 3.0):
        np.testing.assert_allclose(surface.distance(line).gap, 0.0, atol=1e-12)


def test_a_prism_is_its_own_image_across_it_and_where_its_section_is():
    surface = Extruded(PUNCH, **PLACED)
    along = (-0.8, 0.6, 0.0)
    middle = float(np.dot(surface.first, surface.point))
    assert surface.mirrored(along, 0.7, 1e-12)
    assert surface.mirrored(surface.first, middle, 1e-12)
    assert not surface.mirrored(surface.first, middle + 0.1, 1e-12)
    assert not surface.mirrored((1.0, 0.0, 0.0), 0.0, 1e-12)
    for normal, position in (((1.0, 0.0, 0.0), 0.3), (along, 0.2)):
        image = surface.image(normal, position)
        seen = AT + 2 * (position - AT @ np.array(normal))[:, None] * np.array(normal)
        np.testing.assert_allclose(image.distance(seen).gap, surface.distance(AT).gap, atol=1e-14)
        assert image.image(normal, position).same(surface, 1e-12)
        assert image.same(surface, 1e-12) == (normal is along)


@pytest.mark.parametrize("name", SECTIONS)
@pytest.mark.parametrize("placed", [PLACED, OBLIQUE])
def test_a_prism_is_the_same_in_whatever_directions_its_section_is_given(name, placed):
    """Turned by 36.87 degrees, from another place, and left-handed; a section that is turned alone is another."""
    surface, angle = Extruded(SECTIONS[name], **placed), np.arctan2(0.8, 0.6)
    half = (-np.sin(angle / 2), np.cos(angle / 2))
    turned = surface.section.image((0.0, 1.0), 0.0).image(half, 0.0)
    moved = turned.image((1.0, 0.0), 0.0).image((1.0, 0.0), 0.25)
    (one, two), along = (np.array([surface.first, surface.second]), np.cross(surface.first, surface.second))
    first, second = 0.6 * one - 0.8 * two, 0.8 * one + 0.6 * two
    point = np.array(surface.point) - 0.5 * first + 0.7 * along
    other = Extruded(moved, tuple(point), tuple(first), tuple(second))
    np.testing.assert_allclose(other.distance(AT).gap, surface.distance(AT).gap, atol=1e-13)
    mirrored = Extruded(moved.image((1.0, 0.0), 0.0), other.point, tuple(-first), other.second)
    for same in (other, mirrored):
        assert same.same(surface, 1e-12)
        assert surface.same(same, 1e-12)
    assert not replace(surface, section=moved).same(surface, 1e-12)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Union((Extruded(PUNCH), Extruded(Circle((0.0, 4.0), 1.0)))),
        lambda: Extruded(Plane((0.0, 1.0), (0.0, -1.0)), first=(0.6, 0.8, 0.0)),
    ],
)
def test_prisms_that_a_plane_of_symmetry_cuts_give_the_force_on_the_whole_body(make):
    """A union of prisms, and a plane whose section is oblique to both planes: it was a half and a quarter of that."""
    _, solid = scenes()
    tool = replace(solid.tools[0], surface=make())
    assert all(plane.cuts(tool) for plane in solid.planes)


def scenes():
    """A half of a block under a punch in plane strain, and a slice of the same in space."""
    material = VonMises(Elasticity(70e3, 0.33), Linear(100.0, 300.0))
    flat = Scene(
        block(1.5, 1.0, 6, 4),
        Geometry.PLANE_STRAIN,
        material,
        (Symmetry("left", 0), Support("base", 1)),
        tools=(ShapedTool(PUNCH, (0.0, -0.1), ("top",), 0.2),),
    )
    sides = (Symmetry("left", 0), Support("base", 2), Symmetry("front", 1), Support("back", 1))
    tool = ShapedTool(Extruded(PUNCH), (0.0, 0.0, -0.1), ("top",), 0.2)
    solid = replace(flat, mesh=brick(1.5, 0.5, 1.0, 6, 1, 4), geometry=Geometry.SOLID, supports=sides, tools=(tool,))
    return flat, solid


def test_a_slice_under_a_prism_is_in_plane_strain():
    """Half a millimetre thick, beside its mirror image, whose force is counted too."""
    plane, space = (list(march(scene, Schedule(2, first=0.05, settling=1, growth=4.0)))[-1] for scene in scenes())
    np.testing.assert_allclose(space.tool_force(0)[2], plane.tool_force(0)[1], rtol=1e-7)
    behind = space.scene.mesh.nodes[:, 1] == 0
    found = np.sort(space.state.nodes[behind][:, [0, 2]], axis=0)
    np.testing.assert_allclose(found, np.sort(plane.state.nodes, axis=0), atol=1e-8)


def test_an_edge_between_nodes_is_noticed():
    """It comes down in the middle of a row of faces, deeper than a quarter of their longest edge."""
    _, solid = scenes()
    edge = ShapedTool(Extruded(wedge((0.625, 1.001), 30.0, 2.0, 0.01)), (0.0, 0.0, -0.15), ("top",), 0.2)
    with pytest.raises(IncrementFailed, match=r"tools\[0\] comes into the body between nodes"):
        list(march(replace(solid, tools=(edge,)), Schedule(1), Control(Newton(), fallbacks=(), cuts=0)))


def test_half_a_prism_and_a_reversed_one_are_refused_as_their_sections_are():
    _, solid = scenes()

    def under(section):
        return lambda: replace(solid, tools=(replace(solid.tools[0], surface=Extruded(section)),))

    half = Profile(((0.6, 2.0), (0.6, 1.0), (0.0, 1.0)), 0.3)
    refused(under(half), "does not end in the plane of symmetry|the whole tool")
    refused(under(PUNCH.followed_back()), "with its points in the other order the tool")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Extruded(PUNCH, first=(1.0, 1.0, 0.0)), "extruded.first = .*: must be a unit vector"),
        (lambda: Extruded(PUNCH, second=(1.0, 0.0, 0.0)), "extruded.second = .*: must be at a right angle to first"),
        (lambda: Extruded(PUNCH, point=(0.0, 0.0)), "extruded.point"),
        (lambda: Extruded(Extruded(PUNCH)), "extruded.section = .*: must be a surface of a plane"),
        (lambda: Extruded(Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))), "extruded.section = .*: must be"),
        (lambda: Extruded("punch"), "extruded.section = 'punch': must be a Surface"),
        (lambda: Extruded(wedge((0.0, 0.0), 60.0, 1.0, 0.1), first=(1.0, 0.0)), "extruded.first"),
    ],
)
def test_bad_prisms_are_refused_by_name(make, words):
    refused(make, words)
