"""Energies where supports and tools go along: they do not depend on who moves, nor on a motion of the whole."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import march
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.paths import Amplitude
from bipot.scene.loads import Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.schedule import Schedule
from bipot.tools.tool import FlatTool
from studies.fuzz.record import setting_of, step_of
from studies.independent.increment import measure

STEEL = VonMises(Elasticity(70_000.0, 0.3), Linear(100.0, 300.0))
DEPTH, AWAY, HALF = 0.1, 5.0, ((0.0, 0.0), (0.5, 0.0), (1.0, 1.0))
PRESSED = (Pressure("right", 20.0, Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)))),)


def pressed(space: bool, configuration: Configuration, tool: float, base: float, **more: object) -> Scene:
    """A block that a tool presses from above, which goes up by ``tool`` times its path and the base by ``base``."""
    mesh = brick(2.0, 1.0, 1.0, 2, 1, 2) if space else block(2.0, 1.0, 4, 2)
    up = mesh.dimension - 1
    point, normal, travel = (tuple((size * np.eye(up + 1)[up]).tolist()) for size in (1.0, -1.0, tool))
    held = [Support("base", d) for d in range(up)]
    below = Prescribed("base", up, base) if base else Support("base", up)
    asked = Scene(
        mesh=mesh,
        geometry=Geometry.SOLID if space else Geometry.PLANE_STRAIN,
        material=STEEL,
        supports=(*held, below),
        tools=(FlatTool(point, normal, travel, ("top",), 0.1),),
        configuration=configuration,
    )
    return replace(asked, **more)


@pytest.mark.parametrize("configuration", Configuration)
@pytest.mark.parametrize("space", [False, True])
def test_a_base_that_comes_up_does_the_work_of_a_tool_that_comes_down(space, configuration):
    asked = (pressed(space, configuration, -DEPTH + up, up) for up in (0.0, DEPTH / 2, DEPTH, -DEPTH))
    one, *others = [[list(vars(a.energies).values()) for a in march(scene, Schedule(3))] for scene in asked]
    for other in others:
        np.testing.assert_allclose(other, one, atol=1e-7 * one[-1][0])


@pytest.mark.parametrize("configuration", Configuration)
@pytest.mark.parametrize("space", [False, True])
def test_a_body_that_is_pressed_and_carried_along_takes_no_work(space, configuration):
    """Loads that follow its surface, too, hold reactions and contacts in balance on one configuration."""
    asked = pressed(space, configuration, 1.0, 0.0, loads=PRESSED)
    *held, below = asked.supports
    goes = Prescribed(below.boundary, below.direction, AWAY, Amplitude(HALF))
    path = ((0.0, 0.0), (0.5, -DEPTH), (1.0, AWAY - DEPTH))
    asked = replace(asked, supports=(*held, goes), tools=(replace(asked.tools[0], path=path),))
    accepted = list(march(asked, Schedule(4)))
    before, after = accepted[1].energies, accepted[-1].energies
    # In `paper` the shape that the last strained increment left has to settle first, which is an increment's elastic.
    assert abs(after.work - before.work) < 1e-3 * before.work
    assert abs(after.plastic - before.plastic) < 1e-3 * before.work


def test_the_independent_sums_are_the_same_in_the_configuration_of_the_paper():
    asked = pressed(False, Configuration.PAPER, -DEPTH / 2, DEPTH / 2, loads=PRESSED)
    setting, before = setting_of(asked), np.zeros(4)
    for a in march(asked, Schedule(4)):
        own = measure(setting, step_of(asked, setting, a, float(np.abs(a.state.forces).max()))).energies
        now = np.array(list(vars(a.energies).values()))
        np.testing.assert_allclose(own, now - before, atol=1e-9 * np.abs(now).max())
        before = now
