"""Tools that turn as they come down: points land where the tool is on its way, and slip from there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.iterate import Increment
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.revolved import sphere
from bipot.tools.surfaces import Surface
from bipot.tools.tool import ShapedTool
from studies.fuzz.judge import Ran, measured
from studies.fuzz.solid import measured as measured_in_space

RADIUS, DROP, MU = 2.0, 0.05, 0.1
HARD = VonMises(Elasticity(1e3, 0.0), Linear(1e4, 1.0))
"""Never yields here."""


def scene(dimension: int, travel: float, angle: float, off: tuple[float, float] = (0.0, 0.0)) -> Scene:
    """A clamped block and a roll, in space a ball, the drop above it, that goes down and turns, about a point ``off``.

    The ball turns about an axis along the face.
    """
    over = (0.5,) * (dimension - 1)
    middle, base = (*over, 1 + RADIUS + DROP), [Support("base", k) for k in range(dimension)]
    surface: Surface = (
        Circle((middle[0], middle[1]), RADIUS) if dimension == 2 else sphere((0.5, 0.5, middle[2]), RADIUS)
    )
    about = tuple(c + d for c, d in zip(middle, (off[0], *(0.0,) * (dimension - 2), off[1]), strict=True))
    turn = Turn(angle, about, axis=None if dimension == 2 else (0.6, 0.8, 0.0))
    tool = ShapedTool(surface, (*(0.0,) * (dimension - 1), -travel), ("top",), MU, turn=turn)
    flat = dimension == 2
    mesh = block(1.0, 1.0, 4, 2, element=Element.Q4) if flat else brick(1.0, 1.0, 1.0, 2, 2, 1)
    return Scene(mesh, Geometry.PLANE_STRAIN if flat else Geometry.SOLID, HARD, tuple(base), (tool,))


def seen(asked: Scene, x: np.ndarray, part: float) -> np.ndarray:
    """A point at rest from the middle of the circle or ball after a ``part`` of the increment, as the tool sees it."""
    (tool,) = asked.tools
    assert tool.turn is not None
    about, flat = np.array(tool.turn.centre), len(x) == 2
    middle = np.append(np.full(len(x) - 1, 0.5), 1 + RADIUS + DROP)
    axis = np.array([0.0, 0.0, 1.0]) if flat else np.array(tool.turn.axis)
    back = Rotation.from_rotvec(-part * tool.turn.angle * axis).as_matrix()[: len(x), : len(x)]
    return back @ (x - about - part * np.array(tool.travel)) + about - middle


def slip(asked: Scene, x: np.ndarray) -> float:
    """The arc on the circle or the ball from where a point at rest comes to it; none if it does not."""
    if np.linalg.norm(seen(asked, x, 1.0)) >= RADIUS:
        return 0.0
    lands = brentq(lambda part: float(np.linalg.norm(seen(asked, x, part))) - RADIUS, 0.0, 1.0, xtol=1e-15)
    a, b = seen(asked, x, lands), seen(asked, x, 1.0)
    return RADIUS * 2 * float(np.arcsin(np.linalg.norm(a / np.linalg.norm(a) - b / np.linalg.norm(b)) / 2))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("travel", "angle", "off"),
    [(0.2, 0.4, (0.0, 0.0)), (0.06, -0.4, (0.0, 0.0)), (0.1, 0.3, (0.2, -1.0)), (0.15, 0.05, (1.0, 1.0))],
)
def test_slip_begins_where_the_tool_is_when_it_comes_to_the_point(dimension, travel, angle, off):
    """A point at rest in a body that does not yield: the arc from where the turning tool meets it."""
    asked = scene(dimension, travel, angle, off)
    system = system_of(asked)
    increment = Increment(system, system.rest(), 1.0)
    tools, nodes = increment.tools, system.candidates.node
    motion = tools.meeting(np.zeros_like(asked.mesh.nodes), tools.path).motion
    lands = motion[:, 0] < 0
    exact = np.array([slip(asked, asked.mesh.nodes[a]) for a in nodes])
    assert lands.any()
    np.testing.assert_allclose(np.linalg.norm(motion[lands, 1:], axis=1), exact[lands], rtol=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_friction_where_a_roll_lands_is_that_of_its_way_from_there(dimension):
    """It lands on one node, its force grows in the last part of the way, at half its last value in the mean."""
    asked, pressed, angle = scene(dimension, 1.2 * DROP, 0.05), 1 - 1 / 1.2, 0.05
    (accepted,) = march(asked, Schedule(1), Control(Newton(), fallbacks=()))
    node = accepted.solved.iterate.increment.system.candidates.node[np.argmax(accepted.solved.r[:, 0])]
    followed, up = float(np.linalg.norm(accepted.state.du[node, :-1])), accepted.tool_force(0)[-1]
    assert followed < RADIUS * angle * pressed / 3
    exact = MU * abs(up) / 2 * (RADIUS * angle * pressed - followed)
    assert accepted.energies.friction == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize(("dimension", "steps"), [(2, 1), (2, 3), (3, 1)])
def test_the_fuzz_study_s_own_sums_have_where_it_lands(dimension, steps):
    asked = scene(dimension, 0.1, 0.3, (0.2, -1.0))
    accepted = list(march(asked, Schedule(steps), Control(Newton(), fallbacks=())))
    if dimension == 3:
        assert max(m.energies for m in measured_in_space(Ran(asked, accepted, ""))) < 1e-8
        return
    before = np.zeros(4)
    for a, found in zip(accepted, measured(Ran(asked, accepted, "")), strict=True):
        now = np.array(list(vars(a.energies).values())) / asked.images
        np.testing.assert_allclose(found.energies, now - before, atol=1e-9 * np.abs(now).max())
        before = now


@pytest.mark.parametrize("turns", [0.5, -0.5])
def test_a_cam_lands_on_its_way_down(turns):
    """It goes down as its middle turns from above the pivot to below, and reaches the face meanwhile."""
    radius, off, pivot = 0.5, 0.4, np.array([0.5, 1.8])
    cam = ShapedTool(
        Circle((0.5, 1.8 + off), radius), (0.0, -0.3), ("top",), MU, turn=Turn(2 * np.pi * turns, (0.5, 1.8))
    )
    asked = replace(scene(2, 0.0, 0.0), tools=(cam,))
    system = system_of(asked)
    increment = Increment(system, system.rest(), 1.0)
    motion = increment.tools.meeting(np.zeros_like(asked.mesh.nodes), increment.tools.path).motion
    sign, landed = np.sign(turns), 0
    for (gap, slip), node in zip(motion, system.candidates.node, strict=True):
        x = asked.mesh.nodes[node]

        def middle(angle):
            down = 0.3 * angle / (2 * np.pi * turns)
            return pivot + [0.0, -down] + off * np.array([-np.sin(angle), np.cos(angle)])

        def place(angle, x=x):
            """Where the node is, as a direction from the middle that turns with the cam."""
            away = (x - middle(angle)) / np.linalg.norm(x - middle(angle))
            Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            return away @ Q

        def apart(angle, x=x):
            return float(np.linalg.norm(x - middle(sign * angle))) - radius

        # Nodes beside the middle are reached before or after it is at its lowest.
        nearest = np.arctan2(*(pivot - x)) * -sign + np.pi
        assert (gap < 0) == (apart(abs(2 * np.pi * turns)) < 0)
        if gap < 0:
            lands = sign * brentq(apart, 0.0, nearest, xtol=1e-15)
            exact = 2 * radius * np.arcsin(np.linalg.norm(place(lands) - place(2 * np.pi * turns)) / 2)
            assert abs(slip) == pytest.approx(exact, rel=1e-9)
            landed += 1
    assert landed
