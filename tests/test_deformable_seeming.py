"""Which gaps of welded sides at rest only seem to be gaps: facets through nodes on one surface miss each other."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    DeformableTool,
    Elastic,
    Elasticity,
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
from bipot.tools.facing import facing
from bipot.tools.seeming import means_of
from tests.deformable import shifted
from tests.scenes import refused

SIDES = {"lower": ("low/top", "up/base"), "upper": ("up/base", "low/top")}


def bent(mesh, height):
    """A mesh of which the nodes are lifted by a height of their other coordinates, all of it where the last is 1."""
    x = mesh.nodes.copy()
    x[:, -1] += height(*x.T[:-1]) * np.clip(1 - np.abs(x[:, -1] - 1), 0, 1)
    return replace(mesh, nodes=x)


def blocks(element, lower, upper, height, clearance=0.0):
    """Two blocks on each other, of so many elements a side, which meet at this ``height`` but for a clearance."""
    if element.dimension == 2:
        low, up = (block(1.0, 1.0, n, 2, element=element) for n in (lower, upper))
    else:
        low, up = (brick(1.0, 1.0, 1.0, n, n, 2, element=element) for n in (lower, upper))
    aside = (0.0,) * (element.dimension - 1)
    low, up = (bent(of, height) for of in (low, shifted(up, *aside, 1.0)))
    return together({"low": low, "up": shifted(up, *aside, clearance)})


def gaps(mesh, candidates, surface):
    """Gaps at rest of what the candidates face, those of them that are none, and where they are."""
    tool = DeformableTool((surface,), (candidates,), np.inf).of(mesh)
    found = facing(mesh.nodes, tool.sides, False, tool.near)
    gap = np.vecdot(found.normal, means_of(mesh.nodes, found))
    return gap, tool.seeming, mesh.nodes[tool.sides.node]


def sinus(x, *_):
    return 0.1 * np.sin(2 * np.pi * x)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("lower", "upper"), [(8, 12), (16, 9)])
@pytest.mark.parametrize("element", [Element.Q4, Element.Q8, Element.T6])
def test_sides_that_curve_to_and_fro_are_welded(element, lower, upper, side):
    """Where the curvature changes, a parabola is off by order three, and its height is zero: half slipped."""
    gap, none, _ = gaps(blocks(element, lower, upper, sinus), *SIDES[side])
    np.testing.assert_allclose(none, gap, rtol=0, atol=1e-15)


def test_blocks_welded_along_a_sinus_do_the_work_of_one():
    def work(mesh, base, top, tools=()):
        supports = (*(Support(base, k) for k in range(2)), Support(top, 1), Prescribed(top, 0, 1e-3))
        scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1.0, 0.3)), supports, tools)
        *_, last = march(scene, Schedule(1), Control(Newton(), ()))
        return last.energies.work

    one = work(bent(block(1.0, 2.0, 12, 4, element=Element.Q8), sinus), "base", "top")
    tools = (DeformableTool(("low/top",), ("up/base",), np.inf),)
    assert work(blocks(Element.Q8, 8, 12, sinus), "low/base", "up/top", tools) == pytest.approx(one, rel=1e-3)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("element", [Element.H8, Element.H20, Element.T10])
def test_twisted_faces_are_welded(element, side):
    """Edges of those of bricks are straight, but flat parts between their nodes are not in the face."""
    gap, none, _ = gaps(blocks(element, 3, 4, lambda x, y: 0.3 * x * y), *SIDES[side])
    np.testing.assert_allclose(none, gap, rtol=0, atol=1e-15)
    assert np.abs(gap).max() < 2e-3


@pytest.mark.parametrize(("count", "grade"), [(4, 1.0), (20, 3.0), (20, 1.0)])
@pytest.mark.parametrize("element", [Element.Q4, Element.Q8])
@pytest.mark.parametrize("straight", [False, True])
def test_uneven_and_straight_sides_on_a_circle_are_welded(straight, element, count, grade):
    """Of quadratic elements with straight edges, as of a linear mesh, none was; of long beside short edges few were."""

    def ring(inner, n, power):
        mesh = block(0.5, 1.0, 2, n, element=Element.Q4 if straight else element)
        r, turn = mesh.nodes[:, 0] + inner, np.pi / 2 * mesh.nodes[:, 1] ** power
        return replace(mesh, nodes=r[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)).to(element)

    mesh = together({"in": ring(0.5, 4, grade), "out": ring(1.0, count, 1.0)})
    for side in (("in/right", "out/left"), ("out/left", "in/right")):
        gap, none, _ = gaps(mesh, *side)
        np.testing.assert_allclose(none, gap, rtol=0, atol=1e-15)


@pytest.mark.parametrize("element", [Element.Q4, Element.Q8])
def test_a_corner_welds_no_clearance_elsewhere(element):
    """A chamfer of 39 degrees is no crease: its edges were taken for chords of an arc, and so were all others."""
    mesh = blocks(element, 6, 6, lambda _: 0.0, 0.005)
    x = mesh.nodes.copy()
    lower = np.arange(len(x)) < len(x) // 2
    x[lower, 1] -= 0.8 * np.maximum(x[lower, 0] - 2 / 3, 0.0) * x[lower, 1]
    gap, none, at = gaps(replace(mesh, nodes=x), "low/top", "up/base")
    far = np.abs(at[:, 0] - 2 / 3) > 0.34
    assert far.sum() >= 2
    np.testing.assert_array_equal(none[far], 0.0)
    np.testing.assert_allclose(gap[at[:, 0] < 0.3], 0.005)


def test_middle_nodes_out_of_place_do_not_curve_a_straight_side():
    mesh = blocks(Element.Q8, 4, 5, lambda _: 0.0, 0.01)
    x, edges = mesh.nodes.copy(), mesh.around("low/top")
    x[edges[:, 1]] = 0.75 * x[edges[:, 0]] + 0.25 * x[edges[:, 2]]
    gap, none, _ = gaps(replace(mesh, nodes=x), "low/top", "up/base")
    np.testing.assert_allclose(gap, 0.01)
    np.testing.assert_array_equal(none, 0.0)


def test_what_is_in_a_tool_where_it_is_straight_is_refused_though_more_seems_to_be_where_it_is_curved():
    def scene(depth):
        mesh = blocks(Element.Q8, 10, 15, lambda x: 0.4 * np.maximum(x - 0.5, 0.0) ** 2)
        x = mesh.nodes.copy()
        x[(np.arange(len(x)) < len(low.nodes)) & (np.abs(x[:, 1] - 1) < 1e-12) & (x[:, 0] < 0.3), 1] += depth
        supports = (*(Support("low/base", k) for k in range(2)), Prescribed("up/top", 1, -1e-3))
        tools = (DeformableTool(("low/top",), ("up/base",), 0.3),)
        return Scene(replace(mesh, nodes=x), Geometry.PLANE_STRAIN, Elastic(Elasticity(1.0, 0.3)), supports, tools)

    low = block(1.0, 1.0, 10, 2, element=Element.Q8)
    least = gaps(scene(0.0).mesh, "up/base", "low/top")[0].min()
    assert least < -1e-6
    refused(lambda: scene(-0.5 * least), "off the tool's surface")
