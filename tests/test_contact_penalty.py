"""The penalty that a scene proposes: E A/(m h) of what may touch."""

from dataclasses import replace

import pytest

from bipot.forms import (
    contact_penalty,
)
from bipot.marching import system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.scene.supports import Support
from bipot.tools.tool import Sampling
from tests.scenes import scene, tool


@pytest.mark.parametrize(
    ("changes", "area", "edge"),
    [
        ({}, 1.0, 0.5),
        ({"tools": (tool(point=(0.0, 1.1)),)}, 1.0, 0.5),
        # One corner touches at rest: no edge does, so the line is that of all candidates.
        ({"tools": (tool(normal=(-0.6, -0.8), point=(1.0, 1.0), candidates=("top", "right")),)}, 2.0, 0.5),
        # All edges hold a node that cannot move along the normal.
        (
            {"mesh": block(1.0, 1.0, 1, 1, element=Element.Q8), "supports": (Support("left", 1), Support("left", 0))},
            1.0,
            1.0,
        ),
    ],
)
def test_contact_penalty_where_little_or_nothing_touches(changes, area, edge):
    """E A/(m h) of the line of three-node edges; at most one closed node divided by zero."""
    nodes = 2 * round(area / edge) + 1
    K = contact_penalty(system_of(scene(**changes)).candidates)
    assert K == pytest.approx(210e3 * area / (nodes * edge))


@pytest.mark.parametrize("at_rest", [0.0, 0.1], ids=["touching", "apart"])
def test_contact_penalty_of_weighted_points_beside_nodes(at_rest):
    """Three points on top, one more at the corner of two boundaries; five nodes below."""
    punch = tool(point=(0.0, 1.0 + at_rest), sampling=Sampling.WEIGHTED)
    base = tool(point=(0.0, -at_rest), normal=(0.0, 1.0), travel=(0.0, 0.0), candidates=("base",))
    held = {"supports": (Support("left", 0),)}
    for tools, area, points in (((punch,), 1.0, 3), ((punch, base), 2.0, 8)):
        K = contact_penalty(system_of(scene(tools=tools, **held)).candidates)
        assert K == pytest.approx(210e3 * area / (points * 0.5))
    if at_rest:
        both = replace(punch, candidates=("top", "right"))
        K = contact_penalty(system_of(scene(tools=(both,), **held)).candidates)
        assert K == pytest.approx(210e3 * 2.0 / (6 * 0.5))
