"""Bodies that turn with a tool on a rail, in jaws, in a bush, on a peg or a pivot, or do not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick, cylinder_3d
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Symmetry
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.revolved import roll, sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool
from studies.fuzz.judge import Ran
from studies.fuzz.solid import measured as measured_in_space
from tests.riding import ANGLE, HARD, MU, plate, slab, taken
from tests.scenes import Listed


def spun(mu: float, axis=(0.0, 0.0, 1.0)) -> Scene:
    """A slab welded to a lid and lying on a rail, of which one side is near a wall."""
    wall = FlatTool((0.0, 0.5 + 0.9 * ANGLE, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 0.0), ("side",), MU)
    rail = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), mu)
    asked, mesh = slab(3, plate(3, 1.0), axis=axis), brick(1.0, 0.5, 0.1, 3, 2, 3)
    back = np.array(mesh.boundaries["back"])
    inner = np.abs(mesh.nodes[back, 2] - 0.05) < 0.04
    side = {"side": back[inner.all(axis=1)]}
    mesh = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, **side})
    return replace(asked, mesh=mesh, tools=(wall, asked.tools[1], rail))


@pytest.mark.parametrize(
    ("mu", "sticks", "axis", "share"),
    [
        (0.3, 1.0, (0.0, 0.0, 1.0), 1.0),
        (0.0, 1.0, (0.0, 0.0, 1.0), 1.0),
        (0.3, 0.5, (0.0, 0.0, 1.0), 0.0),
        (0.3, 1.0, (1.0, 0.0, 0.0), 0.0),
    ],
)
def test_a_rail_on_which_a_body_slides_lets_it_turn_along_itself(mu, sticks, axis, share):
    """Not where friction holds it there, nor about an axis in the rail."""

    def forces(system):
        rubbed = system.candidates.tool == 2
        return rubbed[:, None] * np.array([1.0, sticks * mu, 0.0])

    by, exact = taken(spun(mu, axis), forces)
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)


def jawed(other: float = ANGLE, aside: float = 0.0, mu: float = np.inf) -> Scene:
    """The same slab between two jaws: the lower one turns by an angle of its own about another place."""
    asked, floor = spun(0.3), Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    turn = Turn(other, (aside, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    jaw = ShapedTool(floor, (0.0, 0.0, 0.0), ("base",), mu, turn=turn)
    return replace(asked, tools=(asked.tools[0], replace(asked.tools[1], mu=mu), jaw))


@pytest.mark.parametrize(
    ("other", "aside", "share"),
    [(ANGLE, 0.0, 1.0), (2 * ANGLE, 0.0, 0.0), (ANGLE, 0.2, 1.0), (ANGLE, 3.0, 0.0)],
)
@pytest.mark.parametrize("held", [False, True])
def test_two_jaws_that_turn_alike_take_a_body_along_as_one(other, aside, share, held):
    """By welds, or by friction on opposite sides; not by other angles. About another place it is translated besides.

    Not about a place far beside, as rolls do.
    """

    def forces(system):
        return (system.candidates.tool > 0)[:, None] * np.array([1.0, 0.15, 0.0])

    asked = jawed(other, aside, 0.3 if held else np.inf)
    by, exact = taken(asked, forces if held else None)
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)
    if share and not aside:
        np.testing.assert_allclose(by, exact, atol=1e-15)


@pytest.mark.parametrize("jaws", [False, True])
def test_what_turns_on_a_rail_or_in_jaws_rubs_on_a_ball_from_where_it_comes_to_it(jaws):
    """A body said to rest slipped along the ball from elsewhere: friction was 19 degrees off, at 3.6 times the work."""
    asked = jawed() if jaws else spun(0.0)
    ball = ShapedTool(sphere((1.0, 0.8 + 0.9 * ANGLE, 0.05), 0.3), (0.0, 0.0, ANGLE / 2), ("side",), MU)
    scenes = [replace(asked, tools=tools) for tools in ((ball, *asked.tools[1:]), (ball, asked.tools[1]))]
    one, other = (list(march(scene, Schedule(1), Control(Newton(), fallbacks=())))[-1] for scene in scenes)
    pressed, alone = one.tool_force(0), other.tool_force(0)
    assert one.energies.friction / pressed[1] == pytest.approx(other.energies.friction / alone[1], rel=0.1)
    np.testing.assert_allclose(pressed / pressed[1], alone / alone[1], atol=0.02)
    assert max(m.energies for m in measured_in_space(Ran(scenes[0], [one], ""))) < 1e-8


def clamped(half: bool, mu: float = np.inf) -> Scene:
    """A slab between two jaws that turn alike, above its plane of symmetry or as a whole, and a ball beside it."""
    mesh = brick(1.0, 0.5, 0.05 if half else 0.1, 3, 2, 2 if half else 4)
    x = mesh.nodes - [0.0, 0.0, 0.0 if half else 0.05]
    back = np.array(mesh.boundaries["back"])
    side = {"side": back[(np.abs(x[back, 2]) < 0.04).all(axis=1)]}
    ball = ShapedTool(sphere((1.0, 0.8 + 0.9 * ANGLE, 0.0), 0.3), (0.0, 0.0, 0.0), ("side",), MU)

    def jaw(name: str, height: float) -> ShapedTool:
        face = Plane((0.0, 0.0, height), (0.0, 0.0, -np.sign(height)))
        turn = Turn(ANGLE, (0.0, 0.0, height), axis=(0.0, 0.0, 1.0))
        return ShapedTool(face, (0.0, 0.0, 0.0), (name,), mu, turn=turn)

    tools = (ball, jaw("top", 0.05)) if half else (ball, jaw("top", 0.05), jaw("base", -0.05))
    planes = (Symmetry("base", 2),) if half else ()
    return Scene(Mesh(x, mesh.elements, {**mesh.boundaries, **side}), Geometry.SOLID, HARD, planes, tools)


@pytest.mark.parametrize("mu", [0.3, np.inf])
def test_half_of_a_body_turns_with_its_jaw_and_the_image_of_that(mu):
    def forces(system):
        return (system.candidates.tool == 1)[:, None] * np.array([1.0, 0.15, 0.0])

    by, exact = taken(clamped(half=True, mu=mu), forces if mu < 1 else None)
    np.testing.assert_allclose(by, exact, atol=1e-15)


def test_half_of_a_body_that_jaws_turn_rubs_as_the_whole():
    """Said to rest, it rubbed with five times the work in the increment in which it lands."""
    rubbed = []
    for half in (False, True):
        asked = clamped(half)
        (accepted,) = march(asked, Schedule(1), Control(Newton(), fallbacks=()))
        assert max(m.energies for m in measured_in_space(Ran(asked, [accepted], ""))) < 1e-8
        rubbed.append([accepted.energies.friction, *accepted.tool_force(0)])
    assert rubbed[0][0] > 0
    np.testing.assert_allclose(rubbed[1], rubbed[0], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("node", "share"), [((0.0, 0.0, 0.0), 1.0), ((5e-4, 0.0, 0.0), 1.0), ((1.0, 0.5, 0.0), 0.0)])
@pytest.mark.parametrize("mu", [0.3, np.inf])
def test_a_pivot_holds_no_turn_about_itself(node, share, mu):
    """It holds a node on the axis, or nearly there, by friction or a weld; not one beside it."""

    def forces(system):
        return (system.candidates.tool == 2)[:, None] * np.array([1.0, 0.0, 0.0])

    asked = spun(0.0)
    x = asked.mesh.nodes.copy()
    x[np.argmin(np.linalg.norm(x - node, axis=1))] = node
    pivot = ShapedTool(sphere((node[0], node[1], -0.1), 0.1), (0.0, 0.0, 0.0), ("base",), mu)
    asked = replace(asked, mesh=replace(asked.mesh, nodes=x), tools=(*asked.tools[:2], pivot))

    def alone(system):
        touched = np.all(asked.mesh.nodes[system.candidates.node] == node, axis=1)
        return forces(system) * touched[:, None]

    by, exact = taken(asked, alone if mu < 1 else None)
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)


def shaft(bush: bool) -> Scene:
    """A cylinder welded to a chuck that turns it, in a smooth bush or not, and a ball that comes down on its end."""
    mesh, up, angle = cylinder_3d(1.0, 1.0, 2, 1, 2, quarter=False, inscribed=True), (0.0, 0.0, 1.0), 0.05
    face, turn = Plane((0.0, 0.0, 0.0), up), Turn(angle, (0.0, 0.0, 0.0), axis=up)
    chuck = ShapedTool(face, (0.0, 0.0, 0.0), ("base",), np.inf, turn=turn)
    top = mesh.nodes[mesh.boundary_nodes("top")]
    met = Rotation.from_rotvec([0.0, 0.0, angle]).apply(top[np.argmin(np.abs(np.hypot(*top[:, :2].T) - 0.6))])
    ball = ShapedTool(sphere((met[0], met[1], 1.3 + 0.9 * 0.05), 0.3), (0.0, 0.0, -0.05), ("top",), MU)
    hole = ShapedTool(roll((0.0, 0.0, 0.0), up, 1.0, concave=True), (0.0, 0.0, 0.0), ("side",), 0.0)
    return Scene(mesh, Geometry.SOLID, HARD, (), (ball, chuck, hole) if bush else (ball, chuck))


def test_a_shaft_turns_in_its_bush():
    """Said to rest, because its chords are off the round, it rubbed on the ball with 15 times the work."""
    by, exact = taken(shaft(bush=True))
    np.testing.assert_allclose(by, exact, atol=1e-15)
    rubbed = []
    for bush in (False, True):
        asked = shaft(bush)
        (accepted,) = march(asked, Schedule(1), Control(Newton(), fallbacks=()))
        assert max(m.energies for m in measured_in_space(Ran(asked, [accepted], ""))) < 1e-8
        rubbed.append(accepted.energies.friction / -accepted.tool_force(0)[2])
    assert rubbed[1] == pytest.approx(rubbed[0], rel=0.1)


@pytest.mark.parametrize(("beside", "share"), [(0.0, 1.0), (0.1, 0.0)])
def test_a_block_turns_on_a_peg_that_is_round_about_the_place_of_the_turn(beside, share):
    """In a plane, by a weld; not about a place beside that."""
    asked, radius = slab(2, plate(2, ANGLE)), 0.3
    x, low = asked.mesh.nodes.copy(), asked.mesh.boundary_nodes("base")
    x[low, 0] = 0.5 + 0.5 * (x[low, 0] - 0.5)
    x[low, 1] = np.sqrt(radius**2 - (x[low, 0] - 0.5) ** 2) - radius
    lid = replace(asked.tools[1], turn=Turn(-ANGLE, (0.5, beside - radius)))
    peg = ShapedTool(Circle((0.5, -radius), radius), (0.0, 0.0), ("base",), 0.0)
    stop = FlatTool((1.2, 0.0), (-1.0, 0.0), (0.0, 0.0), ("right",), MU)
    by, exact = taken(replace(asked, mesh=replace(asked.mesh, nodes=x), tools=(stop, lid, peg)))
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)


@pytest.mark.parametrize(("radius", "share"), [(None, 1.0), (0.3, 0.0)])
def test_a_weld_at_one_place_turns_nothing_about_it(radius, share):
    """By a lid or a ball, about the normal."""
    asked = slab(3, plate(3, ANGLE), axis=(0.0, 0.0, 1.0))
    if radius is not None:
        lid = replace(asked.tools[1], surface=sphere((0.5, 0.25, 0.1 + radius), radius))
        asked = replace(asked, tools=(asked.tools[0], lid))
    by, exact = taken(asked)
    assert np.abs(by).max() > 0
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)


def test_jaws_that_turn_alike_about_two_places_turn_a_body_between_them():
    """Said to rest, it rubbed on the ball with 4.4 times the work in the increment in which it lands."""
    ball = ShapedTool(sphere((1.0, 0.8 + 0.9 * ANGLE, 0.05), 0.3), (0.0, 0.0, ANGLE / 2), ("side",), MU)
    asked = jawed(aside=0.05)
    asked = replace(asked, tools=(ball, *asked.tools[1:]))
    one, many = (list(march(asked, Schedule(n), Control(Newton(), fallbacks=())))[-1] for n in (1, 8))
    assert one.energies.friction == pytest.approx(many.energies.friction, rel=0.1)


def test_a_jaw_that_turns_alike_but_touches_nothing_yet_turns_nothing():
    """Raised that there is no largest of no places."""
    asked = slab(2, plate(2, ANGLE))
    stop = FlatTool((1.0, 0.0), (-1.0, 0.0), (0.0, 0.0), ("right",), MU)
    lower = ShapedTool(Plane((0.0, -0.1), (0.0, 1.0)), (0.0, 0.0), ("base",), np.inf, turn=asked.tools[1].turn)
    by, exact = taken(replace(asked, tools=(stop, asked.tools[1], lower)))
    np.testing.assert_allclose(by, exact, atol=1e-15)


TURNED = (0.0, 0.0), (0.3, 0.0), (0.6, 0.4), (1.0, 1.0)


def vice(angle: float = 2 * ANGLE, other: float | None = None) -> Scene:
    """A strip that two flat jaws grip by friction at its near end and turn, and a peg that its far end comes to."""
    mesh, grip = block(1.0, 0.2, 8, 2, element=Element.Q4), ((0.0, 0.0), (0.3, 1.0), (1.0, 1.0))
    parts = {}
    for name in ("base", "top"):
        edges = np.array(mesh.boundaries[name])
        near = (mesh.nodes[edges, 0] < 0.51).all(axis=1)
        parts |= {f"near {name}": edges[near], f"far {name}": edges[~near]}

    def jaw(name: str, y: float, up: float, angle: float) -> ShapedTool:
        turn = Turn(angle, (0.0, 0.0), Amplitude(TURNED))
        return ShapedTool(Plane((0.0, y), (0.0, up)), (0.0, 1e-3 * up), (name,), 0.3, path=grip, turn=turn)

    x, y = Rotation.from_rotvec([0.0, 0.0, angle]).apply([0.875, 0.2, 0.0])[:2]
    peg = ShapedTool(Circle((x, y + 0.3 - 0.0035), 0.3), (0.0, 0.0), ("far top",), MU)
    tools = peg, jaw("near base", 0.0, 1.0, angle), jaw("near top", 0.2, -1.0, angle if other is None else other)
    gripped = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, **parts})
    return Scene(gripped, Geometry.PLANE_STRAIN, HARD, (), tools)


@pytest.mark.parametrize(("other", "share"), [(ANGLE, 1.0), (ANGLE / 2, 0.0), (-ANGLE, 0.0)])
def test_what_a_vice_grips_by_friction_does_not_roll_on_its_jaws(other, share):
    def forces(system):
        return (system.candidates.tool > 0)[:, None] * np.array([1.0, 0.1])

    by, exact = taken(vice(ANGLE, other), forces)
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)


def test_what_a_vice_turns_to_a_peg_rubs_the_way_it_goes():
    """Said to rest, it was pulled the other way where it lands, with 2.9 times the work."""
    found = []
    for times in ((0.3, 0.6, 1.0), (0.3, 0.6, 0.8, 0.9, 0.95, 1.0)):
        steps = list(march(vice(), Listed(1, ends=times), Control(Newton(), fallbacks=())))
        before = next(step for step in steps if step.state.tau == 0.6)
        found.append([steps[-1].energies.friction - before.energies.friction, *steps[-1].tool_force(0)])
    assert found[0][1] < 0
    np.testing.assert_allclose(found[0], found[1], rtol=0.02)
