"""Bodies that nothing holds and that turn as tools push them: rigidly, and no more than they must."""

from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest

from bipot import (
    Bounds,
    Circle,
    Control,
    Dissipation,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    IncrementFailed,
    Linear,
    Newton,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Turn,
    VolumeChange,
    VonMises,
    block,
    brick,
    march,
    sphere,
)
from bipot.checks.determinacy import loose_motions
from bipot.checks.examined import Examined
from bipot.checks.settling import at_least, moved_on, settled, unloaded
from bipot.iterate import Increment
from bipot.meshes.mesh import Mesh
from bipot.system import system_of

MATERIAL = VonMises(Elasticity(2000.0, 0.3), Linear(30.0, 50.0))


def test_a_screw_goes_on_along_its_axis():
    """In space: what turns about an axis by a third of a turn, and moves along it."""
    places = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [2, 3, 5]])
    axis, angle = np.ones(3) / np.sqrt(3), 2 * np.pi / 3
    point, along = np.array([1.0, -2.0, 0.5]), 0.7 * np.ones(3)
    rate = angle * np.cross(axis, places - point) + along
    ends = (places - point) @ np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]) + point + along
    np.testing.assert_allclose(places + moved_on(places, rate), ends, atol=1e-14)


def test_a_pivot_stays_where_it_is_however_far_the_body_turns():
    places = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    rate = 2.0 * np.array([[0.0, 0.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0]])
    assert np.abs(moved_on(places, rate)[0]).max() < 1e-15


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_free_block_turns_rigidly_out_of_the_way_of_a_tool(mu):
    """A plane inclined by 0.1 presses down on a corner; by every form the block goes the same way."""
    tool = FlatTool((0.0, 4.0), (np.sin(0.1), -np.cos(0.1)), (0.0, -1.0), ("top",), mu)
    mesh = block(10.0, 4.0, 5, 2)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, MATERIAL, (), (tool,))
    ends = []
    for form in (Newton(), Dissipation()):
        run = list(march(scene, Schedule(4), Control(form, ())))
        assert all(any("position" in words for words in a.solved.undetermined) for a in run)
        ends.append(run[-1].state)
    np.testing.assert_allclose(ends[0].nodes, ends[1].nodes, atol=1e-8)
    for end in ends:
        apart, before = (np.linalg.norm(x[:, None] - x, axis=2) for x in (end.nodes, mesh.nodes))
        np.testing.assert_allclose(apart, before, atol=1e-9)
        assert np.abs(end.stress).max() < 1e-8
        assert end.gap.min() >= -1e-9
    # It turns: the end beneath the tool goes down by most of the tool's way, the other hardly.
    down = mesh.nodes[:, 1] - ends[0].nodes[:, 1]
    assert down.max() > 0.9
    assert np.abs(down).min() < 0.1


def test_forces_that_are_all_round_off_are_none():
    """Beside larger ones they may be what is left of balance; alone they would say who carries."""
    tool = FlatTool((0.0, 4.0), (np.sin(0.1), -np.cos(0.1)), (0.0, -1.0), ("top",), 0.3)
    scene = Scene(block(10.0, 4.0, 5, 2), Geometry.PLANE_STRAIN, MATERIAL, (), (tool,))
    *_, last = march(scene, Schedule(1), Control(Newton(), ()))
    r = last.solved.r.copy()
    assert not r.any()
    r[0] = 1e-13, 3e-14
    answer = Examined(last.solved.iterate, r, 0.0, Bounds())
    assert not unloaded(answer).r.any()
    beside = replace(answer, r=np.where(np.arange(len(r))[:, None] == 1, 1.0, r))
    assert unloaded(beside) is beside


def test_a_contact_that_carries_nothing_does_not_hold_a_free_block():
    """A roll pushes it along a floor: it tips as it least moves, whether or not a form has closed the floor's gap."""
    roll = ShapedTool(Circle((-1.0, 3.3), 1.0), (1.5, 0.0), ("left",), 0.0)
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.0)
    scene = Scene(block(10.0, 4.0, 5, 6), Geometry.PLANE_STRAIN, MATERIAL, (), (roll, floor))
    first, *others = (list(march(scene, Schedule(2), Control(form, ())))[-1] for form in (Newton(), Dissipation()))
    for other in others:
        np.testing.assert_allclose(first.state.nodes, other.state.nodes, atol=1e-8)
    tipped = np.arctan2(*(first.state.nodes[-1] - first.state.nodes[0])[::-1]) - np.arctan2(4.0, 10.0)
    assert -0.05 < tipped < -0.01


@pytest.mark.parametrize(("length", "stress"), [(1e-3, 1e6), (25.4, 1.0)])
def test_units_do_not_choose_whether_a_free_block_comes_to_lie_on_a_tool(length, stress):
    """A smooth plane inclined by 0.1 pushes its corner: faces that touch without a force may part again."""

    def pushed(length, stress):
        material = VonMises(Elasticity(2000.0 * stress, 0.3), Linear(30.0 * stress, 50.0 * stress))
        plane = FlatTool((0.0, 4.0 * length), (np.cos(0.1), -np.sin(0.1)), (length, 0.0), ("left",), 0.0)
        scene = Scene(block(10.0 * length, 4.0 * length, 5, 2), Geometry.PLANE_STRAIN, material, (), (plane,))
        *_, end = march(scene, Schedule(4), Control(Newton()))
        return end.state.nodes / length

    np.testing.assert_allclose(pushed(length, stress), pushed(1.0, 1.0), atol=1e-8)


@pytest.mark.parametrize("length", [1.0, 1e-3])
def test_a_body_that_rests_stays_where_it_is(length):
    """It was moved off the floor by a millionth of whatever lengths are given in."""
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.0)
    lid = FlatTool((0.0, 1.01 * length), (0.0, -1.0), (0.0, -0.005 * length), ("top",), 0.0)
    mesh = block(2.0 * length, length, 4, 1, element=Element.Q4)
    (step,) = march(Scene(mesh, Geometry.PLANE_STRAIN, MATERIAL, (), (floor, lid)), Schedule(1), Control(Newton()))
    assert not step.state.du.any()


def pushed_by_a_roll(numbering, path):
    """A block on smooth rollers, into whose smooth top a roll comes from above and goes sideways."""
    plain = block(2.0, 1.0, 3, 1, element=Element.Q8)
    place = np.argsort(numbering)
    mesh = Mesh(plain.nodes[numbering], place[plain.elements], {k: place[v] for k, v in plain.boundaries.items()})
    roll = ShapedTool(Circle((0.815, 1.5), 0.5), (-0.2, -0.05), ("top",), 0.0, path=path)
    return Scene(mesh, Geometry.PLANE_STRAIN, MATERIAL, (Support("base", 1),), (roll,))


def test_a_block_slides_out_of_the_way_of_a_roll_by_no_more_than_it_must():
    """A gap to a curved tool is not what it is along its tangent: the block ended where the first way along it led."""
    path = (0.0, 0.0), (0.6, 1.0), (1.0, 0.66)
    given, turned = (
        next(march(pushed_by_a_roll(numbering, path), Schedule(4))).state
        for numbering in (np.arange(18), np.arange(18)[::-1])
    )
    assert np.abs(given.forces).max() < 1e-9
    assert 0 < given.gap.min() < 1e-9
    np.testing.assert_allclose(given.nodes, turned.nodes[::-1], atol=1e-10)
    assert np.ptp(given.du[:, 0]) < 1e-12


@pytest.mark.parametrize("force", [1.0, 0.0])
def test_a_block_comes_back_from_however_far_a_form_has_sent_it(force):
    """A wall pushes it between smooth planes: where it came from 1e4 of its lengths, it stayed 1e-4 too far off."""
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.0)
    lid = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), 0.0)
    wall = FlatTool((-0.02, 0.0), (1.0, 0.0), (0.1, 0.0), ("left",), 0.0)
    mesh = block(2.0, 1.0, 4, 1, element=Element.Q4)
    system = system_of(Scene(mesh, Geometry.PLANE_STRAIN, MATERIAL, (), (floor, lid, wall)))
    forces = np.zeros((len(system.candidates.node), 2))
    forces[system.candidates.tool < 2, 0] = force
    sent = system.body.space.gather(np.tile([1e4, 0.0], len(mesh.nodes)))
    iterate = Increment(system, system.rest(), 1.0).at(sent)
    least = at_least(iterate, forces, loose_motions(iterate, forces, 1e-9), 1e-9)
    np.testing.assert_allclose(system.body.space.spread(least.x)[:, 0], 0.08, rtol=1e-9)


def stretched(scale):
    """An iterate of a free block that is stretched and lifted, and whose least motion ends on the floor, unpressed."""
    floor = FlatTool((0.0, -0.05), (0.0, 1.0), (0.0, 0.0), ("base",), 0.0)
    lid = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, 0.0), ("top",), 0.0)
    mesh = block(2.0, 1.0, 4, 2, element=Element.Q4)
    system = system_of(Scene(mesh, Geometry.PLANE_STRAIN, MATERIAL, (), (floor, lid)))
    moved = scale * np.column_stack([np.zeros(len(mesh.nodes)), 0.1 * mesh.nodes[:, 1] + 0.3])
    iterate = Increment(system, system.rest(), 1.0).at(system.body.space.gather(moved.ravel()))
    return iterate, np.zeros((len(system.candidates.node), 2))


def test_where_a_gap_just_closes_all_digits_are_known():
    """A cone program finds half of them: the gap was 2e-8."""
    iterate, none = stretched(1.0)
    least = at_least(iterate, none, loose_motions(iterate, none, 0.0), 0.0)
    base = least.increment.system.candidates.tool == 0
    np.testing.assert_allclose(least.motion[base, 0], 0.0, atol=2e-12)


@pytest.mark.parametrize("scale", [1e-4, 1e-12])
def test_gaps_that_are_many_motions_off_do_not_stop_a_second_way(scale):
    iterate, none = stretched(scale)
    x = settled(iterate, none, loose_motions(iterate, none, 0.0), 0.0, np.zeros(len(none)))
    np.testing.assert_allclose(np.linalg.norm(x), 0.1 * scale * np.sqrt(2.5), rtol=1e-9)


def test_gaps_far_from_a_motion_of_round_off_do_not_bound_it():
    """A ball pushes a block in space until it comes in between the nodes, which is refused, and by nothing else."""
    ball = ShapedTool(sphere((-1.0, 1.3, 1.0), 1.0), (1.2, 0.0, 0.0), ("left",), 0.0)
    floor = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), 0.0)
    scene = Scene(brick(6.0, 2.0, 4.0, 4, 2, 2), Geometry.SOLID, MATERIAL, (), (ball, floor))
    with pytest.raises(IncrementFailed, match=r"tools\[0\] comes into the body between nodes"):
        list(march(scene, Schedule(4), Control(Newton(), ())))


@pytest.mark.parametrize("by", [-1.999, -2.001])
def test_what_a_body_that_is_all_but_turned_inside_out_strains_is_a_number(by):
    """Iterates may: the middle between places and those opposite is a point."""
    mesh = block(1.0, 1.0, 1, 1, element=Element.Q4)
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.0)
    system = system_of(Scene(mesh, Geometry.PLANE_STRAIN, MATERIAL, (), (floor,), volume=VolumeChange.P0))
    through = by * (mesh.nodes - mesh.nodes.mean(axis=0))
    response = system.body.respond(system.rest(), system.body.space.gather(through.ravel()))
    assert np.isfinite(response.internal).all()


@pytest.mark.slow
def test_the_order_of_tools_does_not_choose_where_a_body_between_them_goes():
    """Two rolls come upon a block at a wall, which nothing else holds."""
    upper = ShapedTool(Circle((5.0, 9.1), 4.0), (3.0, -0.6), ("top",), 0.3, turn=Turn(-0.5, (5.0, 9.1)))
    lower = ShapedTool(Circle((5.0, -4.0), 4.0), (3.0, 0.0), ("base",), 0.3, turn=Turn(0.5, (5.0, -4.0)))
    wall = FlatTool((20.5, 0.0), (-1.0, 0.0), (0.0, 0.0), ("right",), 0.2)
    tools = (upper, lower, wall)
    scene = Scene(block(20.0, 5.0, 10, 3), Geometry.PLANE_STRAIN, MATERIAL, (), tools)
    runs = [list(march(replace(scene, tools=order), Schedule(5))) for order in permutations(tools)]
    for run, other in pairwise(runs):
        for a, b in zip(run, other, strict=True):
            np.testing.assert_allclose(a.state.nodes, b.state.nodes, atol=1e-7)


def test_a_body_in_the_air_rests_by_a_conic_form_alone():
    """A program may take it anywhere between two tools: what strain it has at the end of that way is round-off."""
    tools = (
        FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.2),
        FlatTool((0.0, 1.05), (0.0, -1.0), (0.0, -0.06), ("top",), 0.2),
    )
    scene = Scene(block(1.0, 1.0, 3, 3), Geometry.PLANE_STRAIN, MATERIAL, (), tools)
    for accepted in march(scene, Schedule(12), Control(Dissipation(), ())):
        rests = 0.06 * accepted.state.tau <= 0.05
        assert rests == (not accepted.displacement.any())
        assert rests == (not accepted.state.forces.any())
