"""Surfaces of a user's own: what their methods say of each other has to agree, or the scene is refused."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.profiles.profile import Profile
from bipot.tools.revolved import Revolved
from bipot.tools.surfaces import Distance, Surface, Tips, frames
from bipot.tools.tool import ShapedTool


def pressed(surface, mesh: Mesh | None = None) -> Scene:
    """A block of height one under the surface."""
    mesh = block(2.0, 1.0, 4, 2) if mesh is None else mesh
    down = (0.0,) * (mesh.dimension - 1) + (-0.1,)
    geometry = Geometry.PLANE_STRAIN if mesh.dimension == 2 else Geometry.SOLID
    supports = tuple(Support("base", d) for d in range(mesh.dimension))
    return Scene(
        mesh, geometry, Elastic(Elasticity(1e3, 0.3)), supports, tools=(ShapedTool(surface, down, ("top",), 0.1),)
    )


class Tilted(Circle):
    """The normal is that of a plane."""

    def distance(self, x):
        found = super().distance(x)
        return found._replace(normal=np.broadcast_to((0.0, -1.0), x.shape))


class Inward(Circle):
    """The normal points into the tool."""

    def distance(self, x):
        found = super().distance(x)
        return found._replace(normal=-found.normal)


class Squared(Circle):
    """The gap is zero on the circle, but no distance off it."""

    def distance(self, x):
        found = super().distance(x)
        return found._replace(gap=(1 + found.gap / self.radius) ** 2 - 1)

    def gap(self, x, moved):
        return self.distance(x - moved).gap


class Backwards(Circle):
    """The gap to the moved surface is that to the surface moved the other way."""

    def gap(self, x, moved):
        return super().gap(x, -np.asarray(moved))


class Short(Circle):
    """A surface of a plane that gives the growth of the gap alone."""

    def passed(self, x, by):
        return super().passed(x, by)[..., :1]


class Still(Circle):
    """Points that move pass nothing."""

    def passed(self, x, by):
        return 0 * super().passed(x, by)


class Chord(Circle):
    """The gap grows along the normal where points come from, as on a straight."""

    def passed(self, x, by):
        return np.vecdot(frames(self.distance(x).normal), by[..., None, :])


class Mirrored(Circle):
    """Arcs are measured the other way."""

    def passed(self, x, by):
        return super().passed(x, by) * (1, -1)


class Stopped(Revolved):
    """The gap does not grow as points move off."""

    def passed(self, x, by):
        return 0 * super().passed(x, by)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (Tilted, r"tools\[0\].surface.distance = 'normal': must be the gradient of the gap, a distance"),
        (Inward, r"surface.distance = 'normal': must be the gradient of the gap, a distance"),
        (Squared, r"surface.distance = 'normal': must be the gradient of the gap, a distance"),
        (Backwards, r"surface.gap = '.*': must be that of distance\(x - moved\)"),
        (Chord, r"surface.passed = '.*': must be the growth of the gap"),
        (Short, r"surface.passed = '.*': must be an array \(1, 5, 2\) of numbers, for points \(1, 5, 2\)"),
        (Still, r"surface.passed = '.*': must be the growth of the gap"),
        (Mirrored, r"surface.passed = '.*': must be the growth of the arc along \(n_y, -n_x\)"),
    ],
)
def test_a_surface_whose_methods_do_not_agree_is_refused(kind, message):
    """The first was pressed in by a force 3 % too large, the last by one 13 % too small, both with a certificate."""
    with pytest.raises(SceneError, match=message):
        pressed(kind((0.5, 2.5), 1.5))


@pytest.mark.parametrize("radius", [1.5, 200.0])
def test_a_size_that_the_gaps_do_not_show_excuses_nothing(radius):
    """Steps and tolerances followed a stated size of 1e12, in which a gap that moves the wrong way was round-off."""

    class Boasting(Backwards):
        def size(self, x, moved):
            return np.full(x.shape[:-1], 1e12)

    with pytest.raises(SceneError, match=r"surface.gap = '.*': must be that of distance\(x - moved\)"):
        pressed(Boasting((0.5, 1.0 + radius), radius))


@pytest.mark.parametrize("centre", [(0.5, 2.5), (0.5, 2.7)])
def test_one_whose_methods_agree_is_taken(centre):
    class Own(Circle):
        """A surface that the library does not know."""

    assert pressed(Own(centre, 1.5)).tools[0].face.centre == centre


@pytest.mark.parametrize(("known", "x"), [(False, 0.0), (True, 0.5)])
def test_one_that_is_wrong_of_itself_in_a_plane_of_symmetry_is_refused(known, x):
    """Half of the force was given as the whole, as the image met all that it met; or twice that of one beside."""

    class Wrong(Circle):
        def mirrored(self, normal, position, roundoff):
            return known

    scene = pressed(Wrong((x, 2.5), 1.5))
    with pytest.raises(SceneError, match=r"tools\[0\].surface = .*: must be its own mirror image in x_0 = 0"):
        replace(scene, supports=(Symmetry("left", 0), Support("base", 1)))


@pytest.mark.parametrize("radius", [1e6, 1e10, 1e12])
def test_a_roll_that_is_nearly_flat_is_taken(radius):
    """What is left of a gap, the difference of so large numbers, was held against its methods."""
    beside = (0.3 * radius, 2.0 + radius * np.sqrt(1 - 0.3**2))
    assert pressed(Circle(beside, radius)).tools[0].face.radius == radius


@pytest.mark.parametrize("way", [1, -1])
def test_a_sharp_punch_level_with_most_candidates_is_taken(way):
    """At the level of its face the wall begins: a step up is along that, one down around the corner."""
    right = Profile(((1.9, 3.0), (1.9, 1.0), (1.6, 1.0), (1.6, 3.0)))
    punch = right if way == 1 else right.image((1.0, 0.0), 1.0)
    assert pressed(punch).tools[0].face is punch


def test_a_surface_in_space_is_held_to_the_same():
    mesh, meridian = brick(2.0, 2.0, 1.0, 2, 2, 1), Circle((0.0, 0.0), 1.5)
    pressed(Revolved(meridian, (1.0, 1.0, 2.5), (0.0, 0.0, 1.0)), mesh)
    with pytest.raises(SceneError, match=r"surface.passed = '.*': must be the growth of the gap"):
        pressed(Stopped(meridian, (1.0, 1.0, 2.5), (0.0, 0.0, 1.0)), mesh)


def test_what_is_no_surface_hears_what_it_lacks():
    class Half:
        """A surface to which little was written."""

        def distance(self, x):
            return Distance(x[..., 1], np.zeros_like(x), x[..., 1])

    with pytest.raises(SceneError, match=r"must be a Surface; it has no gap, size, passed, crossed, tips, beyond"):
        ShapedTool(Half(), (0.0, -1.0), ("top",), 0.1)


@pytest.mark.parametrize("radius", [20.0, 200.0])
def test_a_normal_that_is_off_by_less_than_a_degree_is_refused(radius):
    """Feet of points near the surface are off it by the square of that: 2.5 degrees passed."""
    with pytest.raises(SceneError, match=r"surface.distance = 'normal': must be the gradient of the gap"):
        pressed(Tilted((0.7, 1.0 + radius), radius))


def test_a_growth_of_gaps_that_is_right_for_short_ways_only_is_refused():
    """A tool of radius 20 that slid by 2 left gaps of 0.016 where they were 0.009, and did 14 % more work."""
    with pytest.raises(SceneError, match=r"surface.passed = 'off by 0.02.*': must be the growth of the gap"):
        pressed(Chord((0.7, 21.0), 20.0))


def test_a_tool_that_begins_in_all_of_its_candidates_is_held_to_the_same():
    """Such a one was not looked at."""
    assert pressed(Circle((0.7, 200.994), 200.0)).tools[0].face.distance(np.array([2.0, 1.0])).gap < 0
    for kind in (Chord, Tilted, Still):
        with pytest.raises(SceneError, match=r"tools\[0\].surface.* must be the (growth|gradient) of the gap"):
            pressed(kind((0.7, 200.994), 200.0))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("size", 3.0),
        ("size", np.full(5, np.inf)),
        ("size", None),
        ("gap", [1.0] * 5),
        ("crossed", False),
        ("crossed", np.zeros((5, 2), dtype=bool)),
        ("beyond", np.zeros(5)),
        ("tips", None),
        ("tips", Tips([[0.5, 2.5]], [1.5], 3.0)),
        ("tips", Tips(np.zeros((1, 2)), np.zeros(2), 3.0)),
        ("tips", Tips(np.empty((0, 2)), np.empty(0), np.nan)),
    ],
)
def test_what_a_method_gives_is_an_array_of_the_right_kind(name, said):
    """These were errors of numpy's, in the scene or amid a march."""
    kind = type("Own", (Circle,), {name: lambda *_: said})
    with pytest.raises(SceneError, match=rf"tools\[0\].surface.{name} = .*: must be"):
        pressed(kind((0.5, 2.5), 1.5))


def test_a_surface_that_lacks_a_method_cannot_be_made():
    """It inherited one that gives None."""
    with pytest.raises(TypeError, match="abstract method"):
        type("Own", (Surface,), {"distance": Circle.distance})()
