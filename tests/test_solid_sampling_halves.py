"""Weighted means on faces that end at planes of symmetry: a half is the whole body under tools and their images."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Bounds,
    Control,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Limits,
    Mesh,
    Newton,
    Perfect,
    Sampling,
    Scene,
    Schedule,
    Support,
    Symmetry,
    VonMises,
    brick,
    march,
)
from bipot.fem.elements import RULES
from bipot.system import system_of

STEEL = VonMises(Elasticity(210e3, 0.3), Perfect(300.0))
BASE = tuple(Support("base", d) for d in range(3))
TIGHT = Limits(Bounds(equilibrium=1e-12, penetration=1e-15))
QUADRATIC = (Element.H20, Element.T10)


def askew(names, side):
    """A punch that leans out of the plane x = 0 by about six degrees, and touches the body first in it."""
    normal = np.array([side * 0.1, 0.0, -1.0])
    normal /= np.linalg.norm(normal)
    return FlatTool((0.0, 0.0, 2.0), tuple(normal), (0.0, 0.01, -0.05), names, 0.2, sampling=Sampling.WEIGHTED)


def course_of(mesh, supports, tools):
    scene = Scene(mesh, Geometry.SOLID, STEEL, supports, tools)
    return list(march(scene, Schedule(3, first=0.02, settling=1, growth=4.0), Control(Newton(), (), limits=TIGHT)))


def half(element):
    return brick(2.0, 2.0, 2.0, 2, 1, 1, element=element)


def mirrored_twice(mesh):
    """The body with its mirror image in x = 0, whose sides have names that begin with "other"."""
    flip = np.array([-1.0, 1.0, 1.0])
    on = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    number = np.arange(len(mesh.nodes)) + len(mesh.nodes)
    number[on] = on
    kept = np.setdiff1d(np.arange(len(mesh.nodes)), on)
    number[kept] = len(mesh.nodes) + np.arange(len(kept))
    nodes = np.vstack([mesh.nodes, mesh.nodes[kept] * flip])
    elements = np.vstack([mesh.elements, number[mesh.elements[:, mesh.element.mirrored]]])
    own = {name: faces for name, faces in mesh.boundaries.items() if name != "left"}
    return Mesh(nodes, elements, own | {f"other {name}": number[faces] for name, faces in own.items()}), number


@pytest.mark.parametrize("element", QUADRATIC)
def test_a_tool_askew_to_a_plane_of_symmetry_meets_its_own_half_of_the_body(element):
    """In the plane the whole body has two points, of a tool and of its mirror image."""
    mesh = half(element)
    alone = course_of(mesh, (*BASE, Symmetry("left", 0)), (askew(("top",), -1.0),))
    whole, image = mirrored_twice(mesh)
    held = (*BASE, *(Support("other base", d) for d in range(3)))
    together = course_of(whole, held, (askew(("top",), -1.0), askew(("other top",), 1.0)))
    assert [a.state.tau for a in alone] == [a.state.tau for a in together]
    one, both = alone[-1], together[-1]
    np.testing.assert_allclose(both.state.nodes[: len(mesh.nodes)], one.state.nodes, atol=1e-8)
    np.testing.assert_allclose(both.state.nodes[image] * (-1, 1, 1), one.state.nodes, atol=1e-8)
    np.testing.assert_allclose(both.tool_forces[0], one.tool_forces[0], rtol=1e-6)
    assert abs(one.tool_forces[0, 0]) > 0.05 * abs(one.tool_forces[0, 2])
    candidates = one.solved.iterate.increment.system.candidates
    gap = candidates.distance(one.state.nodes, one.scene.placed(1.0, one.state.translation))
    np.testing.assert_allclose(one.state.gap, gap, atol=1e-14)


def skewed(element):
    """Half a body of which one side of a ridge, aslant to the plane x = 0, goes on beyond it and the other does not."""
    mesh = brick(1.0, 2.0, 1.0, 1, 2, 1, element=element)
    x, y, z = mesh.nodes.T
    return Mesh(np.column_stack([x, y - x, z - 0.9 * np.maximum(y - 1.0, 0.0)]), mesh.elements, mesh.boundaries)


def in_one_point(element):
    """Half a body of which the tool is given what touches the plane x = 0 in single nodes only."""
    mesh = brick(2.0, 2.0, 1.0, 2, 2, 1, element=element)
    top = mesh.boundary("top")
    beside = (mesh.nodes[top, 0] == 0.0).sum(axis=1) == 1
    return Mesh(mesh.nodes, mesh.elements, dict(mesh.boundaries) | {"top": top[beside]})


BODIES = {
    "flat": half(Element.H20),
    "flat, of tetrahedra": half(Element.T10),
    "a ridge": skewed(Element.H20),
    "a ridge, of tetrahedra": skewed(Element.T10),
    "in one point": in_one_point(Element.T10),
}


@pytest.mark.parametrize("name", BODIES)
def test_means_move_as_those_of_the_whole_body_where_that_moves_as_a_mirror_image(name):
    mesh = BODIES[name]
    whole, image = mirrored_twice(mesh)
    tool = FlatTool((0.0, 0.0, 3.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.1), ("top",), 0.2, sampling=Sampling.WEIGHTED)
    one = system_of(Scene(mesh, Geometry.SOLID, STEEL, (*BASE, Symmetry("left", 0)), (tool,))).candidates
    both = replace(tool, candidates=("top", "other top"))
    rule = RULES[mesh.element][-1]
    together = system_of(Scene(whole, Geometry.SOLID, STEEL, BASE, (both,), quadrature=rule)).candidates
    u = np.random.default_rng(1).normal(size=mesh.nodes.shape)
    u[mesh.nodes[:, 0] == 0.0, 0] = 0.0
    moved = np.zeros_like(whole.nodes)
    moved[image], moved[: len(u)] = u * (-1, 1, 1), u
    ways = together.means.motion(moved)
    for node, way in zip(one.node, one.means.motion(u), strict=True):
        assert np.abs(ways[together.node == node] - way).max(axis=1).min() < 1e-14
    assert (np.abs(u[one.node, 0]) == 0.0).any()
