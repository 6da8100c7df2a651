"""What is no part of a symmetric body, and how it is refused when the scene is made."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.marching import Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder, ring
from bipot.meshes.solids import cylinder_3d, ring_3d
from bipot.paper import upsetting
from bipot.scene.loads import BodyForce, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Moment, Turn
from bipot.tools.profiles.profile import Profile, flat_punch
from bipot.tools.profiles.union import Union
from bipot.tools.revolved import Revolved
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from tests.scenes import refused
from tests.test_symmetry import BASE, HEIGHT, LEFT, STEEL, WIDTH, part


def off_plane():
    """A node of the left side a millionth beside it."""
    mesh = block(WIDTH, HEIGHT, 2, 2, element=Element.Q8)
    nodes = mesh.nodes.copy()
    nodes[mesh.boundary_nodes("left")[0], 0] += 1e-6
    return Mesh(nodes, mesh.elements, mesh.boundaries)


def block_with(**changes):
    return replace(part(True, True), **changes)


def straight(**changes):
    given = {"point": (0.0, HEIGHT), "normal": (0.0, -1.0), "travel": (0.0, -0.1), "candidates": ("top",), "mu": 0.1}
    return FlatTool(**(given | changes))


def half_punch(*more):
    """It ends in the plane that cuts the block: the line would go on over the mirror image."""
    half = Profile(((2.0, 9.0), (2.0, HEIGHT), (0.0, HEIGHT)), fillets=0.5)
    return ShapedTool(Union((half, *more)) if more else half, (0.0, -0.1), ("top",), 0.1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Symmetry("left", 3), "support.direction = 3: must be 0, 1 or, in space, 2"),
        (lambda: Symmetry(3, 0), "support.boundary = 3: must be a str"),
        (lambda: Symmetry("left", 0.0), "support.direction = 0.0"),
        (lambda: block_with(supports=(Symmetry("middle", 0),)), "boundary = 'middle': must be one of"),
        (lambda: block_with(supports=(Symmetry("left", 1),)), "'left': must be one whose nodes have one coordinate 1"),
        (
            lambda: block_with(mesh=off_plane()),
            "'left': must be one whose nodes have one coordinate 0: they spread from 0 to 1e-06",
        ),
        (
            lambda: block_with(mesh=both_sides(), supports=(Symmetry("middle", 0),)),
            "'middle': must be one with the body on one side of its plane x_0 = 3",
        ),
        (
            lambda: block_with(supports=(LEFT, Symmetry("right", 0), BASE)),
            "along 0 = 'right': must be in the plane of the other, x_0 = 0: two make a periodic array",
        ),
        (
            lambda: replace(upsetting(mu=0.1, elements=1), supports=(Symmetry("axis", 0), BASE)),
            "symmetry.direction = 0: must be 1 in an axisymmetric scene",
        ),
        (
            lambda: block_with(tools=(straight(travel=(0.01, -0.1)),)),
            r"tools\[0\].travel = .*: must be without a component along 0: a plane of symmetry cuts the tool",
        ),
        (
            lambda: block_with(
                tools=(straight(), straight(point=(WIDTH, 0.0), normal=(-1.0, 0.0), candidates=("right",)))
            ),
            r"tools\[1\].travel = .*: must be without a component along 1",
        ),
        (
            lambda: block_with(tools=(half_punch(),)),
            r"tools\[0\].surface = .*: must be one that does not end in the plane of symmetry x_0 = 0: give it whole",
        ),
        (
            lambda: block_with(tools=(half_punch(Profile(((-5.0, 9.0), (-3.0, 9.0), (-3.0, HEIGHT)))),)),
            r"tools\[0\].surface = Union.*: must be one that does not end in the plane of symmetry x_0 = 0",
        ),
        (
            lambda: block_with(tools=(straight(candidates=("top", "left")),)),
            r"tools\[0\].candidates = .*: must be on the surface of the whole body: .* lies in a plane of symmetry",
        ),
        (lambda: block_with(loads=(Pressure("left", 1.0),)), r"scene.loads\[0\].boundary = .*'left'.*: must be on the"),
        (lambda: block_with(loads=(Traction("base", (0.0, 1.0)),)), r"scene.loads\[0\].boundary = .*'base'"),
        (
            lambda: block_with(loads=(Pressure("top", 1.0), BodyForce((0.0, -1.0)))),
            r"scene.loads\[1\].vector = \(0.0, -1.0\): must be without a component along 1",
        ),
        (lambda: block_with(loads=(PointForce(0, (1.0, 0.0)),)), r"scene.loads\[0\].vector = \(1.0, 0.0\)"),
        (
            lambda: block_with(supports=(LEFT, BASE, Prescribed("top", 0, 0.1))),
            "such that node .* has one displacement along 0",
        ),
    ],
)
def test_what_is_no_part_of_a_symmetric_body_is_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def both_sides():
    """A block with a named line of edges in its middle."""
    mesh = block(2 * WIDTH, HEIGHT, 2, 1, element=Element.Q8)
    middle = np.flatnonzero(mesh.nodes[:, 0] == WIDTH)
    ends, mid = middle[:2], middle[2:]
    return Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "middle": [[ends[0], mid[0], ends[1]]]})


def test_a_body_off_the_origin_and_round_off_on_the_plane_are_no_reason_to_refuse():
    scene = part(True, True)
    far = replace(scene, mesh=Mesh(scene.mesh.nodes + np.array([1e5, 0.0]), scene.mesh.elements, scene.mesh.boundaries))
    assert far.planes[0].position == 1e5
    noise = np.random.default_rng(0).uniform(-1e-12, 1e-12, scene.mesh.nodes.shape)
    assert replace(scene, mesh=Mesh(scene.mesh.nodes + noise, scene.mesh.elements, scene.mesh.boundaries)).images == 4


@pytest.mark.parametrize("name", ["load", "tool"])
def test_the_axis_of_a_ring_is_no_surface_for_loads_or_tools(name):
    mesh, held = cylinder(1.0, 1.0, 3, 3, element=Element.Q8), (Support("axis", 0), Support("base", 1))
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.05), ("top", "axis"), 0.2, sampling=Sampling.WEIGHTED)
    tools, loads = ((tool,), ()) if name == "tool" else ((), (Pressure("axis", 1.0),))
    with pytest.raises(SceneError, match=r"on the surface of the whole body: .* or on an axis, inside it"):
        Scene(mesh, Geometry.AXISYMMETRIC, STEEL, held, tools, loads=loads)


def test_round_off_of_places_far_from_the_origin_does_not_take_nodes_past_a_plane():
    c, s = np.cos(1.1), np.sin(1.1)
    Q, far, straight = np.array([[c, -s], [s, c]]), np.array([1e6, 1.2e6]), block(2.0, 1.0, 4, 2)
    mesh = Mesh(straight.nodes @ Q.T + far, straight.elements, straight.boundaries)
    tool = FlatTool(tuple(Q @ [0.0, 1.0] + far), (s, -c), (0.1 * s, -0.1 * c), ("top",), 0.2)
    planes = Symmetry("left", (c, s)), Symmetry("base", (-s, c))
    assert sum(a.cuts for a in march(Scene(mesh, Geometry.PLANE_STRAIN, STEEL, planes, (tool,)), Schedule(60))) == 0


def pressed_by(surface):
    return block_with(tools=(ShapedTool(surface, (0.0, -0.1), ("top",), 0.1),))


@pytest.mark.parametrize("off", [1e-8, -1e-8, 1e-7, -1e-7])
def test_what_ends_next_to_the_plane_or_is_nearly_a_mirror_image_is_refused(off):
    """A force on it would act on the modelled part alone, as on a tool beside its mirror image: twice as large."""
    ends = Profile(((2.0, 9.0), (2.0, HEIGHT), (off, HEIGHT)))
    refused(partial(pressed_by, ends), "must be one that does not end in the plane of symmetry x_0")
    for surface in (Circle((off, HEIGHT + 1.0), 1.0), flat_punch((off, HEIGHT), 4.0, 3.0)):
        words = "must be its own mirror image in x_0 = 0 to .*, as it is to .*, or not nearly"
        refused(partial(pressed_by, surface), words)


def test_a_closed_half_has_a_side_in_the_plane():
    """A node of the plane would touch its sharp corner, which has no unique normal; rounded off it is a tool."""
    corners = (0.0, HEIGHT), (0.0, 9.0), (2.0, 9.0), (2.0, HEIGHT)
    for fillets in (0.0, (0.0, 0.2, 0.2, 0.2)):
        half = Profile(corners, fillets, closed=True)
        refused(partial(pressed_by, half), "must be one that does not end in the plane")
    pressed_by(Profile(corners, fillets=0.2, closed=True))


def test_half_a_die_around_an_axis_is_refused():
    """Its meridian ends in the plane across the axis; where it begins on the axis, the other side closes it."""
    supports = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)
    body = Scene(cylinder_3d(1.0, 1.0, 1, 1, 1), Geometry.SOLID, STEEL, supports)

    def inside(meridian, up=0.0):
        die = Revolved(meridian, (0.0, 0.0, up), (0.0, 0.0, 1.0))
        return replace(body, tools=(ShapedTool(die, (0.0, 0.0, 0.0), ("side",), 0.1),))

    half, words = Profile(((1.1, 0.5), (1.1, 1.0), (3.0, 2.2))), "must be one that does not end in the plane"
    refused(lambda: inside(half, -0.5), words)
    inside(half, -1.0)
    inside(Profile(((1.1, -1.0), (1.1, 1.0))))
    mandrel = Profile(((0.5, 3.0), (0.5, 0.0), (0.0, 0.0)), fillets=0.1)
    bore = replace(body, mesh=ring_3d(0.6, 1.0, 1.0, 1, 1, 1))
    die = Revolved(mandrel, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    replace(bore, tools=(ShapedTool(die, (0.0, 0.0, 0.0), ("bore",), 0.1),))
    tube = Scene(ring(0.6, 1.0, 1.0, 1, 1), Geometry.AXISYMMETRIC, STEEL, (Symmetry("base", 1),))
    replace(tube, tools=(ShapedTool(mandrel, (0.0, 0.0), ("bore",), 0.1),))


@pytest.mark.parametrize(
    ("turn", "travel", "taken"),
    [
        (None, (0.0, -0.1), False),
        (Turn(0.0, (-0.5, HEIGHT)), (0.0, -0.1), False),
        (None, (0.05, -0.1), False),
        (Turn(-0.1, (-0.5, HEIGHT)), (0.0, 0.0), True),
        (Turn(-2 * np.pi, (-0.5, HEIGHT)), (0.0, 0.0), True),
        (Turn(0.0, (-0.5, HEIGHT), driven_by=Moment(-1.0)), (0.0, 0.0), True),
        (None, (2.0 * WIDTH + 0.5, -0.1), True),
    ],
)
def test_a_flat_part_over_the_plane_is_a_tool_beside_its_image_only_if_these_part(turn, travel, taken):
    """Pressed on, both meet the same candidates: of one tool half of the force was given as the whole."""
    over = Profile(((3 * WIDTH, HEIGHT), (-2 * WIDTH, HEIGHT), (-2 * WIDTH - 1.0, HEIGHT + 1.0)), 0.3)
    tool, half = ShapedTool(over, travel, ("top",), 0.1, turn=turn), part(True, False)
    if taken:
        assert replace(half, tools=(tool,)).tools == (tool,)
    else:
        refused(lambda: replace(half, tools=(tool,)), "as far as gaps of candidates and of their images tell")
