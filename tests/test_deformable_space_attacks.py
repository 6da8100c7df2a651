"""Deformable tools in space where more than two plain sides face each other."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    DeformableTool,
    Element,
    Geometry,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    Support,
    block,
    brick,
    march,
    together,
)
from bipot.checks.refusals import _both_in
from bipot.tools.passing import _boxes_meet
from tests.deformable import ELASTIC, shifted
from tests.scenes import refused

NEWTON = Control(Newton(), ())
SIDES = "base", "right", "top", "left", "front", "back"


def test_the_faces_that_nodes_may_go_through_are_those_in_whose_way_they_are():
    rng = np.random.default_rng(1)
    ways, around = (rng.random((40, n, 3)) * 0.2 + rng.random((40, 1, 3)) for n in (2, 8))
    low, high = (np.stack([of.min(axis=1), -of.max(axis=1)]) for of in (ways, around))
    meet = (low[0] <= -high[1][:, None]).all(axis=2) & (high[0][:, None] <= -low[1]).all(axis=2)
    assert 0 < meet.sum() < meet.size / 4
    np.testing.assert_array_equal(_boxes_meet(ways, around), np.nonzero(meet))


@pytest.mark.parametrize(("height", "element"), [(0.05, Element.H8), (0.05, Element.T4), (1.0, Element.H8)])
def test_parts_of_one_element_may_touch_with_their_whole_outlines(height, element):
    """Behind a side of the one is the opposite side of the other, not farther than faces are large."""
    low, up = (brick(1.0, 1.0, height, n, n, 1, element=element) for n in (2, 3))
    mesh = together({"low": low, "up": shifted(up, 0.0, 0.0, height)})
    held = *(Support("low/base", k) for k in range(3)), Support("up/left", 0), Support("up/front", 1)
    forces = []
    for lower, upper in ((("top",), ("base",)), (SIDES, SIDES)):
        tool = DeformableTool(tuple(f"low/{s}" for s in lower), tuple(f"up/{s}" for s in upper), 0.2)
        scene = Scene(mesh, Geometry.SOLID, ELASTIC, (*held, Prescribed("up/top", 2, -0.1 * height)), (tool,))
        *_, last = march(scene, Schedule(1), NEWTON)
        forces.append(last.tool_force(0))
    np.testing.assert_allclose(*forces, rtol=1e-9, atol=1e-4)


def test_a_node_that_sinks_into_a_tetrahedron_with_no_face_on_the_other_side_is_told_by_what_may_be_done():
    """It is below an edge of the boundary, on which such elements have but two nodes."""
    low, up = (brick(1.0, 1.0, 1.0, n, n, 1, element=Element.T4) for n in (2, 3))
    mesh = together({"low": low, "up": shifted(up, 0.0, 0.0, 1.0)})
    tool = DeformableTool(("low/top",), ("up/base",), 0.2)
    beside = np.setdiff1d(mesh.region("low"), mesh.owners("low/top"))
    touching = np.isin(mesh.elements[beside], mesh.boundary_nodes("low/top")).any(axis=1)
    element, node = int(beside[touching][0]), int(mesh.boundary_nodes("up/base")[0])
    assert _both_in(mesh, tool, node, element)
    assert not _both_in(mesh, tool, int(mesh.boundary_nodes("up/top")[0]), element)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(
    ("surface", "candidates"),
    [
        (("low/top", "low/top"), ("up/base",)),
        (("low/top", "low/patch"), ("up/base",)),
        (("low/top",), ("up/base", "up/patch")),
    ],
)
def test_facets_of_two_boundaries_of_one_side_are_refused(dimension, surface, candidates):
    """They would count twice: a uniform pressure was none."""
    low, up = (brick(1.0, 1.0, 0.5, n, n, 1) if dimension == 3 else block(1.0, 0.5, n, 1) for n in (2, 3))
    low = replace(low, boundaries={**low.boundaries, "patch": low.boundaries["top"][:1]})
    up = replace(up, boundaries={**up.boundaries, "patch": up.boundaries["base"][:1]})
    mesh = together({"low": low, "up": shifted(up, *(0.0,) * (dimension - 1), 0.5)})
    geometry = Geometry.SOLID if dimension == 3 else Geometry.PLANE_STRAIN
    held, tool = (Support("low/base", 0),), DeformableTool(surface, candidates, 0.0)
    refused(lambda: Scene(mesh, geometry, ELASTIC, held, (tool,)), "boundaries without a common")


def test_bars_that_cross_do_not_pass_each_other_in_one_increment():
    """No node is in the way of the other bar, which was passed without a force."""
    low, up = brick(2.0, 0.2, 0.03, 3, 1, 1), brick(0.2, 2.0, 0.03, 1, 3, 1)
    mesh = together({"low": shifted(low, -1.0, -0.1, 0.0), "up": shifted(up, -0.1, -1.0, 0.63)})
    held = [Support(f"low/{end}", k) for end in ("left", "right") for k in range(3)]
    held += [Support(f"up/{end}", k) for end in ("front", "back") for k in range(2)]
    driven = (Prescribed(f"up/{end}", 2, -1.5) for end in ("front", "back"))
    tool = DeformableTool(tuple(f"low/{s}" for s in SIDES), tuple(f"up/{s}" for s in SIDES), 0.2)
    *_, last = march(Scene(mesh, Geometry.SOLID, ELASTIC, (*held, *driven), (tool,)), Schedule(1))
    assert last.tool_force(0)[2] > 400.0
