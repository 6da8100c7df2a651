"""Bodies that a tool which turns takes along: what another tool meets goes with it as a rigid body."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from bipot.forms import Newton
from bipot.iterate import Increment
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.deformable import AnyTool
from bipot.tools.poses import Turn
from bipot.tools.revolved import roll, sphere
from bipot.tools.tool import FlatTool, ShapedTool
from studies.fuzz.judge import Ran, measured
from studies.fuzz.solid import measured as measured_in_space
from tests.riding import ALONG, ANGLE, MU, plate, slab, taken, turned


def barrel(dimension: int) -> ShapedTool:
    """So far beneath the far end, going along."""
    if dimension == 2:
        return ShapedTool(Circle((0.9, -0.3 - 0.9 * ANGLE / 2), 0.3), (ALONG, 0.0), ("base",), MU)
    return ShapedTool(sphere((0.9, 0.25, -0.3 - 0.9 * ANGLE / 2), 0.3), (ALONG, 0.03, 0.0), ("base",), MU)


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_edge_of_a_slab_on_a_lid_that_turns_rubs_once_it_is_down(dimension):
    """Its end comes down at a steady pace, and is pressed in the last tenth of the way, at half its last force."""
    asked = slab(dimension, plate(dimension, drop := 0.9 * ANGLE))
    (accepted,) = march(asked, Schedule(1), Control(Newton(), fallbacks=()))
    contacts, r = accepted.solved.iterate.increment.system.candidates, accepted.solved.r[:, 0]
    along = ALONG * np.eye(dimension)[0]
    slip = np.linalg.norm((accepted.state.du[contacts.node] - along)[:, :-1], axis=1)
    exact = MU / 2 * (r * slip)[contacts.tool == 0].sum() * (1 - drop / ANGLE)
    assert exact > 0
    assert accepted.energies.friction == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("dimension", [2, 3])
def test_slip_on_a_barrel_begins_where_the_turning_slab_comes_to_it(dimension):
    asked = slab(dimension, barrel(dimension), angle=2 * ANGLE)
    way = np.array(asked.tools[0].travel)
    over = [0.9, *[0.25] * (dimension - 2)]
    centre, radius = np.array([*over, -0.3 - 0.9 * ANGLE / 2]), 0.3
    system = system_of(asked)
    increment = Increment(system, system.rest(), 1.0)
    du = turned(asked, asked.mesh.nodes) - asked.mesh.nodes
    motion = increment.tools.meeting(du, increment.tools.path).motion
    landed = 0
    for m, a, k in zip(motion, system.candidates.node, system.candidates.tool, strict=True):
        if k == 0 and m[0] < 0:

            def off(part, a=a):
                return turned(asked, asked.mesh.nodes[[a]], part)[0] - centre - part * way

            lands = brentq(lambda part: float(np.linalg.norm(off(part))) - radius, 0.0, 1.0, xtol=1e-15)
            one, other = (v / np.linalg.norm(v) for v in (off(lands), off(1.0)))
            exact = 2 * radius * np.arcsin(np.linalg.norm(one - other) / 2)
            assert np.linalg.norm(m[1:]) == pytest.approx(exact, rel=1e-9)
            landed += 1
    assert landed


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_weld_takes_along_as_a_rigid_body(dimension):
    by, exact = taken(slab(dimension, plate(dimension, ANGLE)))
    np.testing.assert_allclose(by, exact, atol=1e-15)


@pytest.mark.parametrize(
    ("supports", "axis", "share"),
    [
        ((), (0.0, 0.0, 1.0), 1.0),
        ((Support("left", 2),), (0.0, 0.0, 1.0), 1.0),
        ((Support("left", 0),), (0.0, 0.0, 1.0), 0.0),
        ((Support("left", 2),), (0.0, 1.0, 0.0), 0.0),
    ],
)
def test_supports_leave_the_turn_about_their_own_direction(supports, axis, share):
    """Of others what is left is a translation, where they are free."""
    by, exact = taken(slab(3, plate(3, ANGLE), supports=supports, axis=axis))
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)


@pytest.mark.parametrize(("sticks", "share"), [(0.5, 1.0), (1.0, 0.0)])
def test_friction_takes_a_turn_along_as_long_as_it_holds(sticks, share):
    """A twist about the normal, by forces with so much of their largest friction."""

    def forces(system):
        own = system.candidates.tool == 1
        return own[:, None] * np.array([1.0, 0.3 * sticks, 0.0])

    by, exact = taken(slab(3, plate(3, ANGLE), mu=0.3, axis=(0.0, 0.0, 1.0)), forces)
    np.testing.assert_allclose(by, share * exact, atol=1e-15)


@pytest.mark.parametrize(("radius", "share"), [(None, 1.0), (3.0, 0.0)])
def test_friction_on_a_lid_takes_the_body_over_and_on_a_roll_it_rolls(radius, share):
    """What of the turn is no translation, of tools that turn about the same place."""

    def forces(system):
        return (system.candidates.tool == 1)[:, None] * np.array([1.0, 0.0])

    asked = slab(2, plate(2, ANGLE), mu=0.3)
    if radius is not None:
        roll = replace(asked.tools[1], surface=Circle((0.5, 0.1 + radius), radius))
        nodes = asked.mesh.nodes.copy()
        nodes[asked.mesh.boundary_nodes("top"), 1] = 0.1 + radius
        nodes[asked.mesh.boundary_nodes("top"), 1] -= np.sqrt(radius**2 - (np.linspace(0, 1, 7) - 0.5) ** 2)
        asked = replace(asked, mesh=replace(asked.mesh, nodes=nodes), tools=(asked.tools[0], roll))
    by, exact = taken(asked, forces)
    np.testing.assert_allclose(by - by.mean(axis=0), share * (exact - exact.mean(axis=0)), atol=1e-15)


def test_what_two_tools_hold_is_not_turned():
    asked = slab(2, plate(2, ANGLE))
    stop = FlatTool((0.0, 0.0), (1.0, 0.0), (0.0, 0.0), ("left",), 0.0)
    by, _ = taken(replace(asked, tools=(*asked.tools, stop)))
    np.testing.assert_allclose(np.ptp(by, axis=0), 0.0, atol=1e-15)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_plate_that_two_rolls_carry_goes_straight_on(dimension):
    """They turn by the same about their own axes, and friction holds the plate on both: it rolls."""
    asked, radius = slab(dimension, plate(dimension, 1.0)), 0.15
    across, axis = (0.25,) * (dimension - 2), (0.0, 1.0, 0.0)
    nowhere, inward = (0.0,) * dimension, (-1.0, *[0.0] * (dimension - 1))
    tools: list[AnyTool] = [FlatTool((1.1, *across, 0.0), inward, nowhere, ("right",), MU)]
    for x in (1 / 3, 2 / 3):
        centre = (x, *across, -radius)
        surface = Circle(centre, radius) if dimension == 2 else roll(centre, axis, radius)
        turn = Turn(-ANGLE, centre) if dimension == 2 else Turn(ANGLE, centre, axis=axis)
        tools.append(ShapedTool(surface, nowhere, ("base",), 0.3, turn=turn))

    def forces(system):
        return (system.candidates.tool > 0)[:, None] * np.array([1.0, 0.1, 0.0][:dimension])

    by, _ = taken(replace(asked, tools=tuple(tools)), forces)
    np.testing.assert_allclose(by, np.eye(dimension)[[0] * len(by)] * radius * np.sin(ANGLE), atol=radius * ANGLE**2)


def test_a_plate_goes_straight_on_on_two_wheels_of_one_axle():
    """They hold it from one side, at several places each."""
    asked, radius, axis = slab(3, plate(3, 1.0)), 0.3, (0.0, 1.0, 0.0)
    x, low = asked.mesh.nodes.copy(), asked.mesh.boundary_nodes("base")
    worn = low[np.abs(x[low, 0] - 0.5) < 0.2]
    x[worn, 2] = np.sqrt(radius**2 - (x[worn, 0] - 0.5) ** 2) - radius
    wheel = roll((0.5, 0.0, -radius), axis, radius)
    turn = Turn(ANGLE, (0.5, 0.0, -radius), axis=axis)
    base, flat = np.array(asked.mesh.boundaries["base"]), asked.mesh.nodes
    parts = {"near": base[(flat[base, 1] < 0.3).all(axis=1)], "far": base[(flat[base, 1] > 0.2).all(axis=1)]}
    stop = FlatTool((1.1, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), ("right",), MU)
    wheels = [ShapedTool(wheel, (0.0, 0.0, 0.0), (name,), 0.3, turn=turn) for name in parts]
    mesh = Mesh(x, asked.mesh.elements, {**asked.mesh.boundaries, **parts})

    def forces(system):
        touching = np.isin(system.candidates.node, worn) & (system.candidates.tool > 0)
        return touching[:, None] * np.array([1.0, 0.1, 0.0])

    by, _ = taken(replace(asked, mesh=mesh, tools=(stop, *wheels)), forces)
    np.testing.assert_allclose(np.ptp(by, axis=0), 0.0, atol=1e-15)
    assert by[0, 0] == pytest.approx(radius * np.sin(ANGLE), rel=0.1)


@pytest.mark.parametrize("beneath", ["plate", "barrel"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_fuzz_study_s_own_sums_have_what_turns(dimension, beneath):
    asked = slab(dimension, plate(dimension, 0.9 * ANGLE) if beneath == "plate" else barrel(dimension))
    accepted = list(march(asked, Schedule(1), Control(Newton(), fallbacks=())))
    assert accepted[-1].energies.friction > 0
    if dimension == 3:
        assert max(m.energies for m in measured_in_space(Ran(asked, accepted, ""))) < 1e-8
        return
    (found,) = measured(Ran(asked, accepted, ""))
    now = np.array(list(vars(accepted[-1].energies).values()))
    np.testing.assert_allclose(found.energies, now, atol=1e-9 * np.abs(now).max())
