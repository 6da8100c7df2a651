"""Bodies in space where answers or refusals were once wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    BodyForce,
    Control,
    Dissipation,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    IncrementFailed,
    Linear,
    Mesh,
    Newton,
    Sampling,
    Scene,
    SceneError,
    Schedule,
    Support,
    Symmetry,
    Tangent,
    VonMises,
    brick,
    march,
)
from bipot.fem.elements import RULES
from bipot.forms import Cache, contact_penalty
from bipot.iterate import Increment
from bipot.marching import system_of
from studies.recovered import consistent_tractions

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))
BASE = Symmetry("base", 2)


def skewed():
    """A block whose section has no symmetry."""
    mesh = brick(5.0, 5.0, 5.0, 2, 2, 2)
    x, y, z = mesh.nodes.T
    return Mesh(np.column_stack([x * (1 + 0.08 * y), y + 0.15 * x, z]), mesh.elements, mesh.boundaries)


def punch(mu, travel):
    return FlatTool((0.0, 0.0, 5.0), (0.0, 0.0, -1.0), travel, ("top",), mu)


@pytest.mark.parametrize("form", [Newton(), Dissipation()])
def test_friction_that_slides_holds_a_body_across_its_slip(form):
    """Nothing else holds the block, of which one node of each tool sticks and all others slide, each its own way.

    A turn about those is one that friction is against: it has no resultant and no moment, and the place is determined.
    """
    base = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), 0.05)
    scene = Scene(skewed(), Geometry.SOLID, STEEL, (), (punch(0.05, (0.0, 0.0, -0.2)), base))
    end = list(march(scene, Schedule(3, first=0.05, settling=1, growth=4.0), Control(form, ())))[-1]
    assert not end.solved.undetermined
    contacts = end.solved.iterate.increment.system.candidates
    friction, slip = end.solved.r[:, 1:], end.solved.iterate.motion[:, 1:]
    slides = np.linalg.norm(slip, axis=1) > 1e-4
    assert np.bincount(contacts.tool[~slides], minlength=2).max() <= 1
    np.testing.assert_allclose(np.linalg.norm(friction, axis=1)[slides], 0.05 * end.solved.r[slides, 0], rtol=1e-5)
    x = end.state.nodes[contacts.node]
    for tool in (0, 1):
        own = contacts.tool == tool
        vectors = contacts.vectors(end.solved.r)[own]
        moment = np.cross(x[own], vectors)[:, 2].sum()
        largest = np.abs(end.solved.r).max()
        assert np.abs(vectors[:, :2].sum(axis=0)).max() < 1e-6 * largest
        assert abs(moment) < 1e-5 * largest * 5.0


@pytest.mark.parametrize("form", [Newton(), Tangent()])
@pytest.mark.parametrize(
    ("mu", "travel", "words"),
    [
        (np.inf, (0.05, 0.0, -0.05), "Node 18 cannot go with the tool that it is welded to"),
        (0.2, (0.0, 0.0, -4.99), "Use more increments|Remesh there"),
    ],
)
def test_failures_under_friction_are_explained_in_space(form, mu, travel, words):
    holds = (Support("left", 0), Support("right", 1), BASE)
    scene = Scene(brick(5.0, 5.0, 5.0, 2, 2, 2), Geometry.SOLID, STEEL, holds, (punch(mu, travel),))
    with pytest.raises(IncrementFailed, match=words):
        list(march(scene, Schedule(2), Control(form, (), cuts=1)))


def unheld(**changes):
    return Scene(brick(5.0, 5.0, 5.0, 2, 2, 2), Geometry.SOLID, STEEL, (), (punch(0.2, (0.0, 0.0, -0.05)),), **changes)


def test_what_holds_nothing_is_named_along_three_axes():
    with pytest.raises(IncrementFailed, match=r"against moving along \(0, 0, -1\)"):
        list(march(unheld(loads=(BodyForce((0.0, 0.0, -1.0)),)), Schedule(2), Control(Tangent(), (), cuts=1)))


@pytest.mark.parametrize("control", [Control(), Control(Newton(), ()), Control(Dissipation(), ())])
def test_what_a_punch_carries_without_a_force_is_somewhere_and_that_is_said(control):
    for accepted in march(unheld(), Schedule(2), control):
        assert "rigid motions" in accepted.solved.undetermined[0]
        assert np.abs(accepted.tool_forces).max() < 1e-7


def free_along_depth(loads=()):
    """A distorted block that slides between a smooth punch and a base, held across its width."""
    mesh = brick(5.0, 4.0, 3.0, 2, 2, 2)
    moved = 0.2 * np.random.default_rng(3).uniform(-1, 1, mesh.nodes.shape)
    x = mesh.nodes
    for axis in range(3):
        moved[np.isin(x[:, axis], (0.0, x[:, axis].max())), axis] = 0.0
    tool = FlatTool((0.0, 0.0, 3.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.1), ("top",), 0.0)
    mesh = Mesh(x + moved, mesh.elements, mesh.boundaries)
    return Scene(mesh, Geometry.SOLID, STEEL, (Symmetry("left", 0), Support("base", 2)), (tool,), loads=loads)


def test_what_nothing_holds_is_named_where_contacts_feel_its_round_off_alone():
    end = list(march(free_along_depth(), Schedule(2), Control(Tangent(), ())))[-1]
    assert end.solved.undetermined == ("position in 1 rigid motion",)
    with pytest.raises(IncrementFailed, match=r"Nothing holds the body against moving along \(0, 1, 0\)"):
        list(march(free_along_depth((BodyForce((0.0, 1.0, 0.0)),)), Schedule(2), Control(Tangent(), (), cuts=1)))


@pytest.mark.parametrize("element", [Element.H20, Element.T10, Element.T4])
def test_a_penalty_does_not_depend_on_the_order_of_nodes_nor_on_mid_sides(element):
    """K = E A/(m h): of a square face of one brick its edges, those of two triangles with their diagonal.

    Contact with tetrahedra is at all nodes m, with the brick in means around corners.
    """
    sampling = Sampling.WEIGHTED if element is Element.H20 else Sampling.NODES
    tool = FlatTool((0.0, 0.0, 5.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.1), ("top",), 0.1, sampling=sampling)
    mesh = brick(5.0, 5.0, 5.0, 1, 1, 1, element=element)
    turned = np.array([1, 2, 0, 3, 5, 6, 4, 8, 9, 7][: element.nodes])
    other = Mesh(mesh.nodes, mesh.elements[:, turned] if element.corners == 4 else mesh.elements, mesh.boundaries)
    held = tuple(Support("base", k) for k in range(3))
    scenes = [Scene(m, Geometry.SOLID, STEEL, held, (tool,), quadrature=RULES[element][-1]) for m in (mesh, other)]
    found = [contact_penalty(system_of(scene).candidates) for scene in scenes]
    nodes = 4 if element is Element.H20 else mesh.boundary_nodes("top").size
    h = 5.0 if element is Element.H20 else (4 * 5.0 + np.hypot(5.0, 5.0)) / 5
    np.testing.assert_allclose(found, 210e3 * 25.0 / (nodes * h), rtol=1e-12)


def test_a_brick_numbered_as_its_mirror_image_is_told_how_to_number_it():
    mesh = brick(1.0, 1.0, 1.0, 1, 1, 1)
    with pytest.raises(SceneError, match="number nodes of a base anticlockwise as seen from the top"):
        Scene(Mesh(mesh.nodes * (1.0, 1.0, -1.0), mesh.elements), Geometry.SOLID, STEEL, ())


def test_flat_tools_of_space_have_no_moment_and_a_consistent_shear_of_both_tangents():
    """A pressure and a shear that are the same everywhere, of which forces are int N dA times these."""
    holds = tuple(Support("base", k) for k in range(3))
    scene = Scene(brick(2.0, 3.0, 1.0, 2, 2, 1), Geometry.SOLID, STEEL, holds, (punch(0.5, (0.0, 0.0, 0.0)),))
    system = system_of(replace(scene, tools=(replace(scene.tools[0], point=(0.0, 0.0, 1.0)),)))
    contacts = system.candidates
    share = np.where(np.isin(scene.mesh.nodes[contacts.node, 0], (0.0, 2.0)), 0.5, 1.0)
    share *= np.where(np.isin(scene.mesh.nodes[contacts.node, 1], (0.0, 3.0)), 0.5, 1.0)
    r = 1.5 * share[:, None] * np.array([10.0, 3.0, -4.0])
    pressure, shear = consistent_tractions(contacts, scene.mesh.nodes, r, r[:, 0] > 0)
    np.testing.assert_allclose(pressure, 10.0, rtol=1e-12)
    np.testing.assert_allclose(shear, 5.0, rtol=1e-12)
    end = next(iter(march(scene, Schedule(1), Control(Newton()))))
    assert end.tool_moment(0) == 0.0
    with pytest.raises(SceneError, match="tool = 1"):
        end.tool_moment(1)


@pytest.mark.parametrize("form", [Newton(), Tangent()])
def test_where_a_support_holds_one_tangent_friction_is_against_the_whole_slip(form):
    """The tool goes askew over nodes of two sides, each held along another of the two tangents; all stays elastic.

    What friction does along a held tangent goes into the support: equilibrium does not tell of it, the law does.
    """
    holds = (Support("left", 0), Support("front", 1), BASE)
    scene = Scene(brick(5.0, 5.0, 5.0, 2, 2, 2), Geometry.SOLID, STEEL, holds, (punch(0.2, (2e-6, 4e-6, -1e-5)),))
    (end,) = march(scene, Schedule(1), Control(form, ()))
    contacts = end.solved.iterate.increment.system.candidates
    x, r, slip = scene.mesh.nodes[contacts.node], end.solved.r, end.solved.iterate.motion[:, 1:]
    for axis in (0, 1):
        held = (x[:, axis] == 0.0) & (x[:, 1 - axis] > 0.0)
        size = np.linalg.norm(slip[held], axis=1, keepdims=True)
        assert (np.abs(slip[held]) > 0.01 * size).all(axis=1).any()
        np.testing.assert_allclose(r[held, 1:], -0.2 * r[held, :1] * slip[held] / size, rtol=2e-5)


def test_frames_of_contacts_that_support_holds_along_a_tangent_are_completed():
    """Nodes of planes of symmetry own their unknowns, whichever tangent is across the plane."""
    planes = (Symmetry("left", 0), Symmetry("front", 1), BASE)
    scene = Scene(brick(5.0, 5.0, 5.0, 2, 2, 2), Geometry.SOLID, STEEL, planes, (punch(0.2, (0.0, 0.0, -0.1)),))
    system = system_of(scene)
    iterate = Increment(system, system.rest(), 0.1).at(np.zeros(system.body.space.size))
    frames = Cache().frames(iterate.rows, iterate)
    assert frames.border is None
    np.testing.assert_allclose(frames.T @ frames.T.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frames.T.shape))
