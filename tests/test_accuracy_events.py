"""Increments by accuracy where a face lands just before a scheduled pseudo-time: the force there is the new one."""

import numpy as np
import pytest

from bipot.control.reason import ReasonKind
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.scene.supports import Symmetry
from bipot.tools.tool import FlatTool

SIGMA_Y, PRESSED = 100.0, 0.2
SUPPORTS = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)


def with_wall(landing: float) -> Scene:
    """A cube pressed along z, without friction, whose side meets a wall at this pseudo-time."""
    gap = 1 / np.sqrt(1 - PRESSED * landing) - 1
    tools = (
        FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -PRESSED), ("top",), 0.0),
        FlatTool((1.0 + gap, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), ("right",), 0.0),
    )
    steel = VonMises(Elasticity(210e3, 0.3), Perfect(SIGMA_Y))
    return Scene(brick(1.0, 1.0, 1.0, 1, 1, 1), Geometry.SOLID, steel, SUPPORTS, tools)


def marched(landing, schedule):
    return list(march(with_wall(landing), schedule, Control(Newton())))


def pressures(step):
    """Of punch and wall (MPa)."""
    width, depth, height = np.ptp(step.state.nodes, axis=0)
    return -step.tool_forces[0, 2] / (width * depth), -step.tool_forces[1, 0] / (depth * height)


def shortened(steps):
    return [r for step in steps for r in step.reasons if r.kind is ReasonKind.ACCURACY]


@pytest.mark.parametrize("landing", [0.9, 0.98, 0.99])
@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_a_face_that_lands_before_the_end_leaves_the_force_of_the_new_motion(landing, accuracy):
    """Plane strain by then: 2/sqrt(3) sigma_Y on top and half of it on the wall. It was sigma_Y on top: 12 % off."""
    punch, wall = pressures(marched(landing, Schedule(accuracy=accuracy))[-1])
    assert punch == pytest.approx(2 / np.sqrt(3) * SIGMA_Y, rel=6e-4)
    # The wall does no work: its force is not what an accuracy is asked of.
    assert wall == pytest.approx(SIGMA_Y / np.sqrt(3), rel=0.06)


def test_the_same_at_a_pseudo_time_on_the_way():
    steps = marched(0.48, Schedule(accuracy=1e-3, landings=(0.5,)))
    (there,) = (step for step in steps if step.state.tau == 0.5)
    assert pressures(there)[0] == pytest.approx(2 / np.sqrt(3) * SIGMA_Y, rel=1e-3)


def test_nodes_that_land_one_by_one_before_the_end_are_not_sought():
    """What the force jumps by is an error of the mesh, and where they land is not known as well as that."""
    scene = upsetting(mu=0.3, reduction=0.4, elements=6, element=Element.Q4, volume=VolumeChange.P0)
    steps = list(march(scene, Schedule(accuracy=1e-3), Control(Newton())))
    assert steps[-1].solved.landed.size
    assert not any("lands" in reason.said for reason in shortened(steps))


def test_a_landing_on_the_way_shortens_nothing_and_one_at_the_very_end_is_not_sought_for_ever():
    assert not shortened(marched(0.3, Schedule(accuracy=1e-3)))
    late = marched(0.999, Schedule(accuracy=1e-3))
    assert len(late) < 20
    assert late[-1].state.tau - late[-2].state.tau <= 1e-3
    assert shortened(late)[0].said == "shortened: a face lands before the end"
