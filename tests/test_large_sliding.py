"""What a march through a long tool asks of its surface: a few numbers a pass and candidate, however many there are."""

import numpy as np

from bipot.control.accepted import Accepted
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.meshes.sections import block
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.tool import ShapedTool


def rolled(elements: int) -> list[Accepted]:
    """A strip held at its end under a roll that presses and turns."""
    strip, centre = block(3.0, 0.2, elements, 2), (0.5, 1.2)
    roll = ShapedTool(Circle(centre, 1.0), (0.0, -0.01), ("top",), 0.3, turn=Turn(0.1, centre))
    rubber = Elastic(Elasticity(1e3, 0.3))
    supports = (Symmetry("base", 1), Support("left", 0))
    scene = Scene(strip, Geometry.PLANE_STRAIN, rubber, supports, (roll,))
    return list(march(scene, Schedule(3), Control(Newton(), fallbacks=())))


def asked(monkeypatch, elements: int) -> float:
    """Points that the surface is asked for, an element along the strip and a pass."""
    points = 0
    for name in ("distance", "gap", "passed", "crossed", "beyond"):
        own = getattr(Circle, name)

        def counted(self, x, *rest, own=own):
            nonlocal points
            points += x.size // 2
            return own(self, x, *rest)

        monkeypatch.setattr(Circle, name, counted)
    steps = rolled(elements)
    monkeypatch.undo()
    return points / (elements * sum(step.passes for step in steps))


def test_the_surface_is_asked_for_as_many_points_as_there_are_candidates(monkeypatch):
    few, many = asked(monkeypatch, 40), asked(monkeypatch, 320)
    assert 1 < many < 1.5 * few < 100


def test_a_long_strip_is_rolled_as_a_short_one_is():
    """Which candidates touch changes from increment to increment; who has left carries nothing."""
    last = rolled(320)[-1]
    r = last.solved.r[:, 0]
    x = last.state.nodes[last.solved.iterate.increment.system.candidates.node, 0]
    touching = r > 1e-9 * r.max()
    assert 10 < touching.sum() < len(r) / 4
    assert np.ptp(x[touching]) < 2 * np.sqrt(2 * 1.0 * 0.01) * 1.5
