"""Bodies that supports leave free and tools take along: what another tool meets is as if supports did."""

import numpy as np
import pytest

from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.increment import Increment
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic, Material
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.profiles.profile import Profile
from bipot.tools.tool import FlatTool, ShapedTool
from studies.fuzz.judge import Ran, measured
from studies.fuzz.solid import measured as measured_in_space
from studies.fuzz.unfolded import unfolded
from studies.verification.cases.strip_rolling import MU, PRESSED, RADIUS, STEADY, rolled
from tests.inclined import turned

SLAB = block(1.0, 0.1, 6, 2, element=Element.Q4)
CORK = Elastic(Elasticity(1e3, 0.0))
STEEL = VonMises(Elasticity(1e3, 0.0), Linear(300.0, 100.0))
DEPTH, ALONG = 0.002, 0.1
"""How deep the slab is pressed, and how far what rubs beneath it goes."""

LIFTED = ((0.0, 0.0), (0.5, 1.0), (1.0, -3.0))


def lying(support: bool, path, beneath, material: Material = CORK):
    """A slab whose top goes down by multiples of the depth, by its supports or welded to a tool."""
    taus, multiples = zip(*path, strict=True)
    if support:
        down = Prescribed("top", 1, -DEPTH, Amplitude(tuple(zip(taus, multiples, strict=True))))
        return Scene(SLAB, Geometry.PLANE_STRAIN, material, (Support("top", 0), down), (beneath,))
    lid = FlatTool((0.0, 0.1), (0.0, -1.0), (0.0, -DEPTH), ("top",), np.inf, path)
    return Scene(SLAB, Geometry.PLANE_STRAIN, material, (), (beneath, lid))


def last(scene, increments=1):
    """The last increment, with a landing where paths have a corner."""
    return list(march(scene, Schedule(increments), Control(Newton(), fallbacks=())))[-1]


def plate(drop=0.0, path=((0.0, 0.0), (1.0, 1.0)), **own):
    """What rubs beneath the slab, so far below it."""
    return FlatTool((0.0, -DEPTH * drop), (0.0, 1.0), (ALONG, 0.0), ("base",), 0.2, path, **own)


@pytest.mark.parametrize("drop", [1.0, 9.0])
def test_a_tool_that_takes_a_body_to_another_is_no_slip_before_they_touch(drop):
    one, other = (last(lying(support, ((0.0, 0.0), (1.0, 1.0 + drop)), plate(drop))) for support in (True, False))
    assert other.energies.friction == pytest.approx(one.energies.friction, rel=1e-6)
    # The forces grow as the slab is pressed, in the last 1/(1 + drop) of the way.
    exact = 0.2 * -one.tool_force(0)[1] * -1 / 2 * ALONG / (1 + drop)
    assert other.energies.friction == pytest.approx(exact, rel=0.02)


def test_a_tool_that_takes_a_body_off_another_is_no_slip_once_they_are_apart():
    along = ((0.0, 0.0), (0.5, 0.0), (1.0, 1.0))
    one, other = (last(lying(support, LIFTED, plate(path=along))) for support in (True, False))
    assert other.energies.friction == pytest.approx(one.energies.friction, rel=1e-6)
    assert other.energies.work == pytest.approx(one.energies.work, rel=1e-6)


@pytest.mark.parametrize("drop", [1.0, 9.0])
def test_a_body_lands_on_a_curved_tool_as_if_supports_took_it_there(drop):
    """Slip begins where it lands: the tool rubs to its limit, though a body at rest would not have met it."""
    barrel = ShapedTool(Circle((0.5, -3.0 - DEPTH * drop), 3.0), (ALONG, 0.0), ("base",), 0.2)
    one, other = (last(lying(support, ((0.0, 0.0), (1.0, 1.0 + drop)), barrel)) for support in (True, False))
    np.testing.assert_allclose(other.tool_force(0), one.tool_force(0), rtol=1e-6)
    assert other.tool_force(0)[0] > 0.15 * other.tool_force(0)[1]
    assert other.energies.friction == pytest.approx(one.energies.friction, rel=1e-6)


def raised(half: bool, **own):
    """A slab that a plate beneath raises to a plate above, which goes along or turns aside."""
    sides = (Symmetry("left", 0),) if half else ()
    beneath = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 3 * DEPTH), ("base",), 0.3)
    above = FlatTool((0.0, 0.1 + DEPTH), (0.0, -1.0), (0.0, 0.0) if half else (ALONG, 0.0), ("top",), 0.1, **own)
    return Scene(SLAB, Geometry.PLANE_STRAIN, STEEL, sides, (beneath, above))


def test_a_plate_that_pushes_takes_along_what_lies_on_it():
    """Of the whole slip the part rubs in which the slab is pressed, two thirds of the way, at half its last force."""
    accepted = last(raised(half=False))
    exact = 0.1 * accepted.tool_force(0)[1] / 2 * ALONG * 2 / 3
    assert accepted.energies.friction == pytest.approx(exact, rel=0.03)


def between(way: float):
    """Half a slab between a plate that rises, one that recedes from it, and another beside that comes in its plane."""
    tools = (
        FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 3 * DEPTH), ("base",), 0.3),
        FlatTool((0.0, 0.1 + DEPTH), (0.0, -1.0), (0.0, way), ("top",), 0.1),
        FlatTool((1.0, 0.0), (-1.0, 0.0), (-DEPTH / 2, DEPTH), ("right",), 0.2),
    )
    return Scene(SLAB, Geometry.PLANE_STRAIN, STEEL, (Symmetry("left", 0),), tools)


@pytest.mark.parametrize("way", [0.0, DEPTH / 2])
def test_half_a_body_rides_as_the_whole_does(way):
    asked = between(way)
    (seen,) = unfolded(asked)
    halves, whole = (list(march(scene, Schedule(2))) for scene in (asked, seen.scene))
    for a, b in zip(halves, whole, strict=True):
        np.testing.assert_allclose(b.tool_force(0), a.tool_force(0), rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(list(vars(b.energies).values()), list(vars(a.energies).values()), rtol=1e-7)
    assert halves[-1].energies.friction > 0


def test_half_a_body_touches_what_the_whole_does():
    """A tool off it by more than a billionth of half of the body, and less than one of the whole, touches both."""
    off, way = 1.5e-9, 2e-8
    presser = FlatTool((1.0 + off, 0.0), (-1.0, 0.0), (-way, way), ("right",), 0.2)
    asked = Scene(SLAB, Geometry.PLANE_STRAIN, STEEL, (Symmetry("left", 0), Support("base", 1)), (presser,))
    (seen,) = unfolded(asked)
    half, whole = (last(scene) for scene in (asked, seen.scene))
    assert half.energies.friction > 0
    assert whole.energies.friction == pytest.approx(half.energies.friction, rel=1e-6, abs=0.0)


def test_half_a_roof_that_nothing_pushes_yet_rides_as_the_whole_does():
    """Under a hollow lid points have different normals; of those in the plane of symmetry there is one, not two."""
    nodes, edge, slope = SLAB.nodes.copy(), 1 / 6, 0.2
    nodes[:, 1] *= 1 - slope * np.maximum(nodes[:, 0] - edge, 0.0)
    low = 0.1 * (1 - slope * (1.5 - edge))
    hollow = Profile(((1.5, low), (edge, 0.1), (-edge, 0.1), (-1.5, low)))
    lid = ShapedTool(hollow, (0.0, -4 * DEPTH), ("top",), 0.1)
    tools = (lid, FlatTool((0.0, -3 * DEPTH), (0.0, 1.0), (0.0, 0.0), ("base",), 0.3))
    roof = Mesh(nodes, SLAB.elements, SLAB.boundaries)
    asked = Scene(roof, Geometry.PLANE_STRAIN, STEEL, (Symmetry("left", 0),), tools)
    (seen,) = unfolded(asked)

    def taken(scene):
        system = system_of(scene)
        way = Increment(system, system.rest(), 1.0).tools.taken[system.candidates.tool == 1, 1]
        assert np.ptp(way) == 0
        return way[0]

    assert taken(asked) == pytest.approx(taken(seen.scene), rel=1e-12)
    assert -4 * DEPTH < taken(asked) < -0.99 * 4 * DEPTH


@pytest.mark.parametrize("frame", [0.0, 0.4, 1.3])
def test_a_squeezed_body_goes_as_its_tools_do_on_the_average(frame):
    """As seen from a place that goes down itself, too."""

    def way(below: float, above: float) -> float:
        tools = (
            FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, below + frame), ("base",), 0.0),
            FlatTool((0.0, 0.1), (0.0, -1.0), (0.0, above + frame), ("top",), 0.0),
            FlatTool((1.0, 0.0), (-1.0, 0.0), (0.0, frame), ("right",), 0.0),
        )
        system = system_of(Scene(SLAB, Geometry.PLANE_STRAIN, STEEL, (Support("left", 0),), tools))
        tools_of = Increment(system, system.rest(), 1.0).tools
        return float(tools_of.taken[system.candidates.tool == 2, 1].mean()) - frame

    assert way(0.0, -0.01) == pytest.approx(-0.005)
    assert way(0.003, -0.001) == pytest.approx(0.001)
    assert way(0.003, 0.0) == pytest.approx(0.0015)


def test_a_body_that_rides_does_so_turned_too():
    asked = lying(False, LIFTED, plate(path=((0.0, 0.0), (0.5, 0.0), (1.0, 1.0))))
    one, other = last(asked), last(turned(asked))
    assert other.energies.friction == pytest.approx(one.energies.friction, rel=1e-9)


@pytest.mark.parametrize(
    "beneath", [plate(3.0), ShapedTool(Circle((0.5, -3.0 - 3 * DEPTH), 3.0), (ALONG, 0.0), ("base",), 0.2)]
)
def test_the_fuzz_study_s_own_sums_have_what_rides(beneath):
    for asked in (lying(False, ((0.0, 0.0), (1.0, 4.0)), beneath, STEEL), raised(half=False), between(DEPTH / 2)):
        steps = list(march(asked, Schedule(1)))
        before = np.zeros(4)
        for a, found in zip(steps, measured(Ran(asked, steps, "")), strict=True):
            now = np.array(list(vars(a.energies).values())) / asked.images
            np.testing.assert_allclose(found.energies, now - before, atol=1e-9 * np.abs(now).max())
            before = now


def test_a_brick_rides_as_well():
    """In space, with what the fuzz study makes of it."""
    lid = FlatTool((0.0, 0.0, 0.1), (0.0, 0.0, -1.0), (0.0, 0.0, -4 * DEPTH), ("top",), np.inf)
    under = FlatTool((0.0, 0.0, -3 * DEPTH), (0.0, 0.0, 1.0), (ALONG, 0.03, 0.0), ("base",), 0.2)
    asked = Scene(brick(1.0, 1.0, 0.1, 2, 2, 1), Geometry.SOLID, STEEL, (), (under, lid))
    steps = list(march(asked, Schedule(1)))
    exact = 0.2 * -steps[-1].tool_force(0)[2] * -1 / 2 * np.hypot(ALONG, 0.03) / 4
    assert steps[-1].energies.friction == pytest.approx(exact, rel=0.05)
    assert max(m.energies for m in measured_in_space(Ran(asked, steps, ""))) < 1e-9


def test_a_roll_pulls_in_what_reaches_it_slower_than_it_turns():
    """A strip comes to a roll that turns in its place: it is slower there, and slips by no more than it is slower."""
    strip, landed = rolled(1), 0
    for a in march(strip, Schedule(40, first=0.002, landings=(PRESSED,), settling=1, growth=4.0)):
        contacts, r = a.solved.iterate.increment.system.candidates, a.solved.r
        slower = RADIUS * (strip.tools[0].pose(a.state.tau)[2] - strip.tools[0].pose(a.start.tau)[2])
        slower = slower - a.state.du[contacts.node, 0]
        lands = (a.start.gap > 1e-8) & (r[:, 0] > 1e-6) & (a.start.tau >= PRESSED)
        assert (slower[lands] > 0).all()
        np.testing.assert_allclose(r[lands, 1], -MU * r[lands, 0], rtol=1e-6)
        assert (np.abs(a.solved.iterate.motion[lands, 1]) < 1.1 * slower[lands]).all()
        landed += int(lands.sum())
        if a.state.tau > 0.5:
            break
    assert landed


def test_friction_under_a_force_of_round_off_has_no_sign():
    """A slab that is pushed to a roll and touches it where an increment ends: no force but round-off, either way."""
    pusher = FlatTool((1.0, 0.0), (-1.0, 0.0), (-0.06, 0.0), ("right",), 0.0)
    rail, centre = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.1), (-2.02, 0.05)
    roll = ShapedTool(Circle(centre, 2.0), (0.0, 0.0), ("left",), 0.2, turn=Turn(0.002, centre))
    asked = Scene(SLAB, Geometry.PLANE_STRAIN, CORK, (), (pusher, rail, roll))
    steps = list(march(asked, Schedule(4), Control(Newton())))
    assert not [reason for a in steps for reason in a.reasons]


@pytest.mark.slow
def test_a_rolled_strip_takes_in_few_increments_what_it_does_in_many():
    """Force of the roll on the steady way, and friction there: with the wrong sign at landings twice as much."""

    def steady(increments):
        begun, spent, force = STEADY[0] + 1e-9, [0.0], 0.0
        for a in march(
            rolled(2), Schedule(increments, first=0.002, landings=(PRESSED, *STEADY), settling=1, growth=4.0)
        ):
            if a.state.tau > STEADY[1] + 1e-9:
                break
            if a.state.tau > begun:
                force += (a.state.tau - a.start.tau) * a.tool_forces[0][1]
                spent.append(a.energies.friction)
            else:
                spent = [a.energies.friction]
        return force, spent[-1] - spent[0]

    (few, rubbed_in_few), (many, rubbed_in_many) = steady(40), steady(160)
    assert few == pytest.approx(many, rel=0.003)
    assert rubbed_in_few == pytest.approx(rubbed_in_many, rel=0.05)
