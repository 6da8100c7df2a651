"""Shaped tools in space that come into a body between its nodes, or go through it, are refused."""

from dataclasses import replace

import pytest

from bipot.forms import Newton
from bipot.marching import Control, march
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.tools.profiles import Profile
from bipot.tools.revolved import Revolved, cone, sphere
from bipot.tools.tool import ShapedTool
from tests.space import RUBBER, dented

UP = (0.0, 0.0, 1.0)


def test_tools_that_come_in_between_nodes_of_a_face_are_refused():
    scene = dented(elements=2, material=RUBBER)
    held = tuple(Support("base", d) for d in range(3))
    deep = replace(scene, supports=held)
    for surface in (sphere((0.25, 0.25, 1.0 + 0.16), 0.15), cone((0.25, 0.25, 1.01), UP, 10.0, 5.0)):
        tool = ShapedTool(surface, (0.0, 0.0, -0.3), ("top",), 0.1)
        with pytest.raises(Exception, match=r"tools\[0\] comes into the body between nodes"):
            list(march(replace(deep, tools=(tool,)), Schedule(4), Control(Newton(), cuts=1)))
        inside = ShapedTool(replace(surface, point=(0.25, 0.25, 0.8)), (0.0, 0.0, -0.3), ("top",), 0.1)
        with pytest.raises(Exception, match=r"tools\[0\].surface = .*a part of it is behind nodes"):
            replace(deep, tools=(inside,))
    thin = Revolved(Profile(((1.0, 1.1), (1.0, 1.0), (-1.0, 1.0), (-1.0, 1.1)), 0.02, True), (0.5, 0.5, 1.0), UP)
    with pytest.raises(Exception, match=r"tools\[0\].surface = .*thick or more"):
        replace(deep, tools=(ShapedTool(thin, (0.0, 0.0, -0.3), ("top",), 0.1),))


def test_a_sphere_does_not_go_through_a_block_in_one_increment():
    """Its path leads right through; whoever marches has to stop at it."""
    scene = dented(elements=2, material=RUBBER)
    ball = ShapedTool(sphere((0.5, 0.5, 1.6), 0.6), (0.0, 0.0, -4.0), ("top",), 0.1)
    held = tuple(Support("base", d) for d in range(3))
    with pytest.raises(Exception, match="tau = 0"):
        list(march(replace(scene, supports=held, tools=(ball,)), Schedule(1), Control(Newton(), cuts=2)))
