"""Curved tools that nodes alone do not feel: between two of them, through the body, beyond a plane of symmetry."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.sections import block
from bipot.scene.between import Surroundings
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, flat_punch
from bipot.tools.surfaces import Distance, Plane, Tips
from bipot.tools.tool import ShapedTool
from tests.curved import dragged, forces, marched, pressed
from tests.scenes import refused

RUBBER = Elastic(Elasticity(1e3, 0.3))
METAL = VonMises(Elasticity(7e4, 0.3), Linear(100.0, 200.0))


def needle(centre, radius, travel, elements=2, path=((0, 0), (1, 1))):
    """A circle smaller than an edge goes straight on, into a block that is held at its base."""
    scene = dragged(material=RUBBER, elements=elements)
    punch = replace(scene.tools[0], surface=Circle(centre, radius), travel=travel, path=path)
    return replace(scene, tools=(punch,))


@pytest.mark.parametrize("increments", [1, 5, 40])
@pytest.mark.parametrize(
    ("radius", "down"), [(0.05, 0.2), (0.05, 0.6), (0.05, 2.0), (0.01, 0.6), (0.15, 0.4), (0.15, 2.0)]
)
def test_a_circle_smaller_than_an_edge_does_not_come_in_between_its_nodes(radius, down, increments):
    """Between the nodes at 0.25 and 0.5, near them or not: whatever it does there, no node feels it."""
    for x in (0.375, 0.32):
        scene = needle((x, 1.0 + radius), radius, (0.0, -down))
        with pytest.raises(IncrementFailed, match=r"tools\[0\] comes into the body between nodes \d+ and \d+"):
            list(march(scene, Schedule(increments), Control(Newton(), fallbacks=())))


@pytest.mark.parametrize(("candidates", "advice"), [("top", "round the tool more"), ("left", "make it a candidate")])
def test_only_what_is_no_candidate_is_to_be_made_one(candidates, advice):
    """Edges of candidates were to be made candidates, too, where a tool is smaller than they are."""
    scene = needle((0.375, 1.05), 0.05, (0.0, -0.2))
    (tool,) = scene.tools
    with pytest.raises(IncrementFailed, match=rf"between nodes .* Refine the boundary there, or {advice}"):
        list(march(replace(scene, tools=(replace(tool, candidates=(candidates,)),)), Schedule(5)))


@pytest.mark.parametrize(("end", "meets"), [(-0.1, "the mirror images of nodes"), (-1.0, "the mirror image of tools")])
def test_half_a_die_that_goes_on_over_the_body_s_other_part_is_to_be_given_whole(end, meets):
    """Its cavity lacks a mirror image, and the body rises into what is beyond: a finer boundary was asked for."""
    half = ((5.0, 1.0), (2.5, 1.0), (2.5, 3.0), (0.5, 3.0), (0.5, 1.0))
    tool = ShapedTool(Profile((*half, (end, 1.0)), 0.2), (0.0, -0.1), ("top",), 0.1)
    held = Symmetry("left", 0), Support("base", 1), Support("right", 0)
    scene = Scene(block(3.0, 1.0, 12, 4), Geometry.PLANE_STRAIN, METAL, held, (tool,))
    with pytest.raises(IncrementFailed, match=rf"{meets}.* give the tool whole"):
        list(march(scene, Schedule(3)))
    both = Profile((*half, *((-x, y) for x, y in reversed(half))), 0.2)
    *_, last = march(replace(scene, tools=(replace(tool, surface=both),)), Schedule(3))
    assert last.state.tau == 1.0


def test_a_circle_that_nodes_feel_may_be_as_small_as_an_edge():
    """Edges are 0.25 long: the chord of a circle of radius 0.2 is less deep than a fourth of it."""
    for x in (0.375, 0.32, 0.25):
        accepted = marched(needle((x, 1.2), 0.2, (0.0, -0.15)), increments=6)
        assert forces(accepted)[-1, 1] < -10.0


def test_who_passes_beside_the_body_is_not_between():
    scene = needle((1.2, 1.2), 0.05, (0.0, -1.0))
    assert abs(forces(marched(scene))[-1]).max() == 0.0


@pytest.mark.parametrize("off", [0.0, 3.0])
def test_the_rounded_tip_of_a_flat_tool_comes_in_as_a_whole_circle_does(off):
    """Its corners go down beside the body, and the circle of its tip reaches far beyond its back."""
    mesh = block(1.0, 1.0, 1, 1)
    body = Surroundings.of(mesh, (), ring=False)
    tip = Profile(((0.5 + off, 1.05), (-1.0 + off, 1.8), (2.0 + off, 1.8)), (1.0, 0.0, 0.0), closed=True)
    ball = Circle((0.5 + off, 1.05 + np.sqrt(1.25)), 1.0)
    poses = np.array([[0.0, 0.0, 0.0], [0.0, -4.0, 0.0]])
    for surface in (tip, ball):
        assert surface.distance(np.array([0.5 + off, 1.0])).gap == pytest.approx(0.05 + np.sqrt(1.25) - 1.0, rel=1e-12)
        tool = ShapedTool(surface, (0.0, -4.0), ("top",), 0.1)
        found = body.between(tool, mesh.nodes, mesh.nodes, poses)
        assert (found is None) == (off > 1.0)
        assert found is None or (mesh.nodes[list(found[:2]), 1] == 1.0).all()


@pytest.mark.slow
def test_between_is_by_the_way_of_both():
    """A square goes straight on and gets out of shape, brute force: how deep a small circle is in it all the way."""
    rng = np.random.default_rng(3)
    mesh, R = block(1.0, 1.0, 1, 1), 0.01
    body = Surroundings.of(mesh, (), ring=False)
    tool = ShapedTool(Circle((0.0, 0.0), R), (0.0, 0.0), ("top",), 0.1)
    around, seen, asked = mesh.elements[0][:4], 0, 0
    for _ in range(150):
        start = mesh.nodes + rng.uniform(-1, 1, 2) + (0.0, -1.5)
        end = start + rng.uniform(-0.2, 0.2, (4, 2)) + (0.0, rng.uniform(0.0, 3.0))
        depth = np.array([_depth((start + s * (end - start))[around]) for s in np.linspace(0, 1, 200)]) + R
        # Whoever is in at the start was refused before, and whoever grazes it is on no side for sure.
        if depth[0] > 0 or abs(depth.max()) < 3 * R:
            continue
        asked += 1
        found = body.between(tool, start, end, np.zeros((2, 3))) is not None
        assert found == (depth.max() > 0)
        seen += found
    assert 15 < seen < asked - 15


def _depth(corners):
    """How far the origin is in a quadrilateral, anticlockwise; less than zero outside."""
    ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    along = ends[:, 1] - ends[:, 0]
    foot = np.clip(-np.sum(ends[:, 0] * along, axis=1) / np.sum(along**2, axis=1), 0, 1)
    near = np.hypot(*(ends[:, 0] + foot[:, None] * along).T).min()
    angles = np.arctan2(*ends[:, :, ::-1].transpose(2, 0, 1))
    turns = (np.diff(angles, axis=1) + np.pi) % (2 * np.pi) - np.pi
    return near if abs(turns.sum()) > np.pi else -near


@pytest.mark.parametrize("centre", [(0.5, 0.5), (0.3, 0.85), (0.62, 0.2)])
def test_a_circle_that_is_in_the_body_at_rest_is_refused(centre):
    refused(lambda: needle(centre, 0.06, (0.0, -0.1)), r"tools\[0\].surface.*must be off the body")
    mesh = block(1.0, 1.0, 2, 2)
    for circle in (Circle((0.5, 1.05), 0.06), Circle((0.5, 0.5), 3.0, concave=True)):
        tool = ShapedTool(circle, (0.0, 0.0), ("top",), 0.1)
        assert Surroundings.of(mesh, (), ring=False).inside(tool, mesh.nodes, np.zeros(3)) is None


def test_a_mirror_image_that_meets_the_modelled_part_is_named():
    """Beyond the plane of symmetry the circle is none of the modelled part's, but its image is there."""
    tilted = Plane((0.0, 1.0), (0.1 / np.hypot(0.1, 1.0), -1.0 / np.hypot(0.1, 1.0)))
    scene = pressed(surface=Circle((-0.3, 1.5), 0.5), travel=(0.0, -0.1))
    with pytest.raises(IncrementFailed, match=r"comes into the body|mirror image of tools\[0\].*Model the whole body"):
        marched(scene)
    down = pressed(surface=Plane((0.0, 1.3), tilted.normal), travel=(0.0, -0.5))
    with pytest.raises(IncrementFailed, match=r"mirror image of tools\[0\].*Model the whole body"):
        marched(down)
    refused(lambda: pressed(surface=tilted), r"tools\[0\].*mirror image .* is off the body")
    own = pressed(surface=Circle((0.3, 1.5), 0.5), travel=(0.0, -0.05))
    assert forces(marched(own))[-1, 1] < 0


@pytest.mark.parametrize("off", [1e-10, -3e-11])
def test_a_centre_off_the_plane_by_round_off_leaves_no_friction_at_the_pole(off):
    scene = pressed(surface=Circle((off, 3.0), 2.0))
    contacts = system_of(scene).candidates
    pole = contacts.node == np.argmin(np.hypot(*(scene.mesh.nodes - (0.0, 1.0)).T))
    assert not contacts.tangent_free[pole].any()
    np.testing.assert_allclose(forces(marched(scene))[-1], forces(marched(pressed()))[-1], rtol=1e-6)


class Broken:
    """A surface that says nothing."""

    def __init__(self, said: Any) -> None:
        self.said = said

    def distance(self, *x: Any) -> Any:
        return self.said(*x)

    def tips(self) -> Tips:
        return Tips(np.empty((0, 2)), np.empty(0), np.inf)

    gap = size = passed = crossed = beyond = mirrored = image = same = lines = distance


@pytest.mark.parametrize(
    "said",
    [
        lambda x: None,
        lambda x: Distance(x[..., 0], x, x[..., 0]),
        lambda x: Distance(x[..., 0] * np.nan, x * 0 + (0, 1.0), x[..., 0]),
        lambda x: Distance(x[..., :1], x * 0 + (0, 1.0), x[..., 0]),
    ],
)
def test_a_surface_that_is_none_is_refused(said):
    surface: Any = Broken(said)
    refused(lambda: pressed(surface=surface), r"tools\[0\].surface")


HELD = (Support("base", 0), Support("base", 1))


@pytest.mark.parametrize("geometry", [Geometry.PLANE_STRAIN, Geometry.AXISYMMETRIC])
@pytest.mark.parametrize(("y", "radius"), [(0.5, 0.2), (0.9, 0.3), (1.05, 0.3), (1.0, 0.05)])
def test_a_circle_around_a_point_of_a_plane_of_symmetry_or_the_axis_is_in_the_body_too(geometry, y, radius):
    refused(lambda: pressed(geometry, Circle((0.0, y), radius), (0.0, -0.2), elements=2), r"tools\[0\].*behind nodes")


@pytest.mark.parametrize(("centre", "radius"), [((0.25, 1.05), 0.2), ((0.375, 1.05), 0.12), ((0.5, 1.0), 0.3)])
def test_a_circle_too_deep_between_two_nodes_at_rest_is_refused(centre, radius):
    """Its centre off the body, or on a node of it."""
    refused(lambda: needle(centre, radius, (0.0, -0.1), elements=2), r"tools\[0\].*behind nodes")


def test_a_circle_that_is_smaller_than_what_a_large_one_may_come_in_does_not_fit_under_the_surface():
    """Down by seven radii, which is a fourth of an edge, aside under nodes, and up: it would lift them."""
    path = ((0.0, 0.0), (0.2, (0.0, -0.07)), (0.8, (0.3, -0.07)), (1.0, (0.3, 0.1)))
    scene = needle((0.3, 1.01), 0.01, (1.0, 1.0), elements=2, path=path)
    with pytest.raises(IncrementFailed, match=r"comes into the body between"):
        list(march(scene, Schedule(50), Control(Newton(), fallbacks=())))


@pytest.mark.parametrize("increments", [1, 2, 3])
def test_no_mirror_image_of_a_circle_goes_through_the_body(increments):
    """From beyond the plane of symmetry to its other side."""
    scene = pressed(surface=Circle((-0.5, 1.4), 0.3), travel=(0.0, -3.0), material=RUBBER, path=((0, 0), (1, 1)))
    with pytest.raises(IncrementFailed, match=r"comes into the body between|mirror image"):
        list(march(scene, Schedule(increments), Control(Newton(), fallbacks=())))


def test_no_circle_goes_through_a_node_that_is_held():
    scene = needle((1.0, 1.05), 0.05, (0.0, -0.8), elements=2)
    held = replace(scene, supports=(*HELD, Support("right", 0), Support("right", 1)))
    with pytest.raises(IncrementFailed, match=r"comes into the body between|which a support holds|goes through"):
        list(march(held, Schedule(1), Control(Newton(), fallbacks=())))


@pytest.mark.parametrize("increments", [2, 5, 20])
def test_a_circle_does_not_get_under_the_top_past_a_side_that_is_no_candidate(increments):
    path = ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    scene = needle((-0.33, 1.36), 0.319, (1.0, -0.6), elements=3, path=path)
    with pytest.raises(IncrementFailed, match=r"comes into the body between|goes through"):
        list(march(scene, Schedule(increments), Control(Newton(), fallbacks=())))


def test_what_goes_around_an_axis_stays_on_it_or_beside_it():
    ring = Geometry.AXISYMMETRIC
    refused(lambda: pressed(ring, Circle((-0.4, 1.5), 0.5)), r"tools\[0\].surface.*centres at r >= 0")
    refused(lambda: pressed(ring, Circle((0.4, 1.5), 0.5), (-0.5, -0.1)), r"tools\[0\].surface.*centres at r >= 0")
    refused(lambda: pressed(ring, travel=(0.1, -0.1)), r"tools\[0\].travel")


@pytest.mark.parametrize(("angle", "through"), [(25.0, True), (15.0, True), (9.0, False)])
def test_who_slides_round_has_not_crossed_but_who_is_open_before_and_after_was_gone_through(angle, through):
    """From one side of a circle's top straight to the other: the chord of 9 degrees is a grazing one."""
    circle, turn = Circle((0.0, 0.0), 1.0), np.radians(angle)
    on = np.array([[-np.sin(turn), np.cos(turn)]])
    for far, crosses in ((1.0, False), (1.0 + 1e-4, through)):
        assert circle.crossed(far * on, -2 * far * on * (1, 0)).tolist() == [crosses]


def test_a_plate_that_lies_through_the_body_is_refused():
    """Its corners are outside, and no candidate in it."""
    plate = Profile(((-1.0, 0.55), (2.0, 0.55), (2.0, 0.45), (-1.0, 0.45)), closed=True)
    refused(lambda: pressed(surface=plate, elements=2), r"tools\[0\].surface.*behind nodes")


def test_a_punch_that_sinks_into_a_side_that_is_no_candidate_is_refused():
    scene = dragged(material=RUBBER)
    punch = replace(
        scene.tools[0], surface=flat_punch((0.5, 1.0), 3.0, 2.0, 0.1), travel=(0.0, -0.4), candidates=("right",)
    )
    with pytest.raises(IncrementFailed, match="comes into the body between"):
        list(march(replace(scene, tools=(punch,)), Schedule(10), Control(Newton(), fallbacks=())))
