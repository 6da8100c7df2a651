"""Marches under profiles: wedges and punches, all forms of the exact law, symmetry, open ends, thin tools, unions."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.contact.supported import driven_into
from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Form, Newton, Penalty, Tangent, Uzawa
from bipot.forms.penalty import contact_penalty
from bipot.laws.hardening import Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.limit_analysis import limit_load
from bipot.marching import march
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, Union, flat_punch, wedge
from bipot.tools.surfaces import Plane, Surface
from bipot.tools.tool import ShapedTool
from tests.curved import PUNCH, RADIUS, TIGHT, apart, dragged, forces, marched, pressed, pushed
from tests.scenes import PLANES, refused

TIP = 0.05


def blunt(semi_angle: float) -> Profile:
    """A wedge whose rounded tip touches the block's top in its middle."""
    sunk = TIP * (1 / np.sin(np.radians(semi_angle)) - 1)
    return wedge((0.0, 1.0 - sunk), semi_angle, 2.0, TIP)


SHAPES = {
    "wedge of 70 degrees": blunt(70.0),
    "wedge of 62 degrees": blunt(62.0),
    "sharp wedge": wedge((0.0, 1.0), 70.0, 2.0),
    "punch with round edges": flat_punch((0.0, 1.0), 1.1, 2.0, 0.1),
    "punch with sharp edges": flat_punch((0.0, 1.0), 1.1, 2.0),
    "groove": Profile(((3.0, 0.5), (1.0, 1.0), (0.0, 1.2), (-1.0, 1.0), (-3.0, 0.5)), (0.1, 0.5, 0.1)),
}
RUNS = dict[tuple[str, Geometry, type[Form]], list]()


def run(name, geometry, form):
    """To a tenth of the block."""
    key = name, geometry, type(form)
    if key not in RUNS:
        # With the patience to go on where a node lands on a flank: an increment that is cut has another flow.
        RUNS[key] = marched(pressed(geometry, SHAPES[name]), form, increments=10, bounds=TIGHT, patience=20)
    return RUNS[key]


@pytest.mark.parametrize("name", SHAPES)
def test_a_tool_goes_in_by_a_tenth_and_every_increment_is_certified(name):
    whole = run(name, Geometry.PLANE_STRAIN, Newton())
    assert whole[-1].state.tau == 1.0
    for accepted in whole:
        assert max(accepted.solved.certificate.ratios(Bounds()).values()) <= 1
        contacts = accepted.solved.iterate.increment.system.candidates
        scene = accepted.solved.iterate.increment.system.body.scene
        there = accepted.state.nodes[contacts.node] - scene.travel(0.0, accepted.state.tau)[0]
        np.testing.assert_allclose(accepted.state.gap, SHAPES[name].distance(there).gap, atol=1e-12)
    pushes = forces(whole)[:, 1]
    assert (pushes < 0).all()
    assert pushes[-1] < 1.5 * pushes[0] < 0


@pytest.mark.parametrize(
    ("name", "form"),
    [(name, Tangent()) for name in SHAPES]
    + [(name, Dissipation()) for name in ("sharp wedge", "punch with round edges")],
)
def test_forms_of_the_exact_law_agree(name, form):
    one, other = run(name, Geometry.PLANE_STRAIN, Newton()), run(name, Geometry.PLANE_STRAIN, form)
    assert apart(forces(other), forces(one)) < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wedge of 70 degrees"])
def test_delassus_uzawa_and_the_penalty_agree_within_the_default_bounds(name):
    """Of a body that does not flow; the penalty as far as it penetrates."""
    rubber, plain = Elastic(Elasticity(1e3, 0.3)), pressed(surface=SHAPES[name], mu=0.0)
    scene = replace(plain, material=rubber)
    K = 10 * contact_penalty(system_of(scene).candidates)
    exact = forces(marched(scene))
    assert apart(forces(marched(scene, Uzawa(K, K))), exact) < 1e-5
    assert 1e-5 < apart(forces(marched(scene, Penalty(100 * K, 100 * K))), exact) < 1e-3
    rough = pressed(surface=SHAPES[name], material=rubber)
    assert apart(forces(marched(rough, Delassus())), forces(marched(rough))) < 1e-5


@pytest.mark.parametrize("name", ["wedge of 70 degrees", "punch with round edges"])
def test_on_a_meridian_they_are_a_cone_and_a_cylinder(name):
    one, other = (run(name, Geometry.AXISYMMETRIC, form) for form in (Newton(), Tangent()))
    assert apart(forces(other)[-1], forces(one)[-1]) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("geometry", PLANES)
def test_a_square_of_fillets_alone_marches_as_a_circle(geometry):
    x, y = PUNCH.centre
    corners = ((1, 1), (1, -1), (-1, -1), (-1, 1))
    square = Profile(tuple((x + RADIUS * a, y + RADIUS * b) for a, b in corners), RADIUS, closed=True)
    assert apart(forces(marched(pressed(geometry, square))), forces(pushed(geometry))) < 1e-9


def test_a_long_line_marches_as_a_plane():
    """Over a block that slides, to the round-off of iterations."""
    line = Profile(((9.0, 1.0), (-9.0, 1.0)))
    one, other = (marched(pressed(surface=s), bounds=TIGHT) for s in (line, Plane((0.0, 1.0), (0.0, -1.0))))
    assert apart(forces(one), forces(other)) < 1e-10


def test_half_a_body_has_half_the_force_of_the_whole_one():
    """A symmetric profile is its own mirror image: the node in the plane of symmetry has no friction row."""
    half = pressed(surface=blunt(70.0))
    system = system_of(half)
    middle = half.mesh.nodes[system.candidates.node, 0] < 1e-9
    assert middle.sum() == 1
    assert not system.candidates.tangent_free[middle].any()
    assert system.candidates.tangent_free[~middle].all()
    assert half.planes[0].cuts(half.tools[0])
    last = marched(half)[-1]
    assert last.tool_force(0) == pytest.approx([0.0, 2 * last.tool_forces[0, 1]])
    with pytest.raises(ValueError, match=r"tools\[0\].travel"):
        replace(half, tools=(replace(half.tools[0], travel=(0.1, -0.1)),))


def edged(punch: Surface, travel=(0.1, -0.02), mu=0.1, material=None) -> Scene:
    """The whole block, held at its base, under a tool that presses and then goes aside."""
    scene = dragged(material=material or Elastic(Elasticity(1e3, 0.3)))
    path = ((0.0, 0.0), (0.3, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    return replace(scene, tools=(ShapedTool(punch, travel, ("top",), mu, path),))


@pytest.mark.slow
def test_a_tool_that_slides_off_a_node_over_its_open_end_is_reported():
    """It begins at x = 0.45, between nodes 0.375 and 0.5, and goes to the right; the body would pass behind its end."""
    begins = Profile(((2.0, 1.0), (0.45, 1.0)))
    with pytest.raises(
        IncrementFailed, match=r"touched past an open end of tools\[0\]\). Continue the surface of tools"
    ):
        list(march(edged(begins), Schedule(10)))
    # From a body that the end never comes to, and with a side, on which the body may come.
    for surface in (Profile(((2.0, 1.0), (-0.5, 1.0))), Profile(((2.0, 1.0), (0.45, 1.0), (0.45, 2.0)), 0.05)):
        assert list(march(edged(surface), Schedule(10)))[-1].state.tau == 1.0


@pytest.mark.slow
def test_a_body_that_starts_behind_an_open_end_is_told_so():
    """Half of its top is past the end, and above the line that goes on, which is 0.1 lower at its corner."""
    with pytest.raises(IncrementFailed, match=r"Node \d+ starts behind an open end of tools\[0\], by 0.0981: continue"):
        list(march(edged(Profile(((0.5, 1.0), (-2.0, 1.5)))), Schedule(4)))


def test_an_open_end_over_which_a_touching_node_slides_is_reported():
    """It is past the node 0.75 at the start, and not at the end."""
    ends = Profile(((0.8, 1.0), (0.8 - 1e-3, 1.0), (-2.0, 1.0 + 0.2)))
    seen = []
    with pytest.raises(IncrementFailed, match="past an open end") as failed:
        seen += list(march(edged(ends, travel=(-0.15, -0.05)), Schedule(10)))
    assert failed.value.state is not None


@pytest.mark.slow
def test_what_is_past_an_open_end_and_does_not_touch_is_no_matter():
    """Flanks that end where the body is not are as good as long ones."""
    short = replace(blunt(70.0), points=wedge((0.0, 1.0), 70.0, 0.4).points)
    sunk = np.array([0.0, TIP * (1 / np.sin(np.radians(70.0)) - 1)])
    short = Profile(tuple(map(tuple, (np.array(short.points) - sunk).tolist())), TIP)
    scene = pressed(surface=short, travel=(0.0, -0.05))
    right = scene.mesh.nodes[:, 0] > 0.5
    assert short.beyond(scene.mesh.nodes[right]).any()
    one, other = (marched(pressed(surface=s, travel=(0.0, -0.05))) for s in (short, blunt(70.0)))
    assert apart(forces(one), forces(other)) < 1e-9


def test_a_blade_that_stands_in_the_body_is_refused_and_none_goes_through_a_node():
    """Between two nodes no candidate feels it; and past the node 0.5 it would be on the other side."""
    blade = Profile(((0.49, 3.0), (0.49, 0.95), (0.47, 0.95), (0.47, 3.0)), 0.009)
    refused(lambda: edged(blade, mu=0.0), r"tools\[0\].surface.*behind nodes")
    node = np.array([[0.5, 1.0]])
    assert blade.crossed(node, np.array([[-0.2, 0.0]])).all()
    assert not blade.crossed(node, np.array([[-0.005, 0.0]])).any()
    assert not blade.crossed(node - (0.0, 0.06), np.array([[-0.2, 0.0]])).any()


@pytest.mark.slow
def test_a_union_presses_with_each_of_its_surfaces_once():
    """Two rolls side by side, as one tool and as two."""
    rolls = Circle((0.25, 1.3), 0.3), Circle((0.8, 1.35), 0.35)
    scene = edged(Union(rolls), travel=(0.05, -0.02))
    tool = scene.tools[0]
    apart_ = replace(scene, tools=tuple(replace(tool, surface=roll) for roll in rolls))
    one, two = (list(march(s, Schedule(10)))[-1].tool_forces for s in (scene, apart_))
    np.testing.assert_allclose(one[0], two.sum(axis=0), rtol=1e-6)
    # Of one surface twice the union is that surface, where two tools share the force in no one way.
    twice, once = (list(march(edged(s), Schedule(5)))[-1] for s in (Union((rolls[0],) * 2), rolls[0]))
    np.testing.assert_array_equal(twice.tool_forces, once.tool_forces)


def test_the_limit_load_knows_what_is_past_an_open_end():
    """A block that a traction lifts against a line: what is past its end is free."""
    body = pressed(material=VonMises(Elasticity(210e3, 0.3), Perfect(300.0)))
    supports = (Symmetry("left", 0),)

    def multiple(surface):
        tool = ShapedTool(surface, (0.0, 0.0), ("top",), 0.0)
        loads = (Traction("base", (0.0, 150.0)),)
        return limit_load(replace(body, supports=supports, tools=(tool,), loads=loads)).multiple

    plane, whole = multiple(Plane((0.0, 1.0), (0.0, -1.0))), multiple(Profile(((3.0, 1.0), (-3.0, 1.0))))
    part, sided = multiple(Profile(((0.55, 1.0), (-0.55, 1.0)))), multiple(flat_punch((0.0, 1.0), 1.1, 1.0))
    assert whole == pytest.approx(plane, rel=1e-9)
    assert part < 0.8 * whole
    assert part == pytest.approx(sided, rel=1e-6)


def test_held_nodes_past_an_open_end_are_in_no_tool():
    scene = pressed()
    held = (*scene.supports, Support("right", 0), Support("right", 1))

    def driven(surface):
        candidates = system_of(replace(pressed(surface=surface), supports=held)).candidates
        return driven_into(candidates, np.array([[0.0, -0.1]]), np.zeros(scene.mesh.nodes.shape)).depth

    assert driven(Profile(((5.0, 1.0), (-5.0, 1.0)))) == pytest.approx(0.1)
    assert driven(Profile(((0.55, 1.0), (-0.55, 1.0)))) == 0


def test_a_half_model_doubles_the_force_of_a_tool_that_is_its_own_image_as_a_whole():
    """Two circles that are each other's image; a punch whose open ends are at different heights."""
    pair = Union((Circle((-0.3, 1.4), 0.4), Circle((0.3, 1.4), 0.4)))
    unlike = Profile(((0.4, 5.0), (0.4, 1.0), (-0.4, 1.0), (-0.4, 4.0)), 0.1)
    even = Profile(((0.4, 4.0), (0.4, 1.0), (-0.4, 1.0), (-0.4, 4.0)), 0.1)
    for surface in (pair, unlike):
        scene = pressed(surface=surface, travel=(0.0, -0.02))
        last = marched(scene)[-1]
        assert scene.planes[0].cuts(scene.tools[0])
        np.testing.assert_allclose(last.tool_force(0), (0.0, 2 * last.tool_forces[0, 1]))
        refused(lambda surface=surface: pressed(surface=surface, travel=(0.05, -0.02)), r"tools\[0\].travel")
    assert even.same(unlike, 1e-9)
    assert not even.same(replace(even, fillets=0.11), 1e-9)
    assert not even.same(Profile(((0.4, 4.0), (0.4, 1.0), (-0.41, 1.0), (-0.41, 4.0)), 0.1), 1e-9)
    assert not pair.same(Union(pair.surfaces[:1]), 1e-9)
