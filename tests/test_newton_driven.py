"""Newton alone under curved tools that forces press onto a body from their first contact on, in few passes.

The meshes are graded: in space the stiffness of a node grows with the size of its elements, and on a ring with their
radius, so that what is far away is many times as stiff as the contact.
"""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton
from bipot.forms.base import Cache
from bipot.forms.search import Search
from bipot.iterate import Increment
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.programs.frames import SOFTENED
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Force
from bipot.tools.revolved import sphere
from bipot.tools.surfaces import Surface
from bipot.tools.tool import ShapedTool
from tests.space import RUBBER, dented

RADIUS, NEAR = 10.0, 0.85
LINE = NEAR * np.concatenate([[0.0, 1 / 3, 2 / 3], (1 - np.arange(6) / 6) ** -3.0])
"""Nodes of a line: the last element is four hundred times as long as the first."""

DEPTH = np.append(0.0, NEAR / 2 * (1 - np.arange(6) / 6) ** -3.0)


def graded(mesh: Mesh) -> Mesh:
    """A mesh of unit steps, its last coordinate downwards, along the lines; ``near`` is its top near the origin."""
    up = mesh.nodes.shape[1] - 1
    nodes = np.interp(mesh.nodes, np.arange(len(LINE)), LINE)
    nodes[:, up] = -np.interp(len(DEPTH) - 1 - mesh.nodes[:, up], np.arange(len(DEPTH)), DEPTH)
    top = mesh.boundary("top")
    near = top[(nodes[top] <= NEAR * (1 + 1e-9)).all(axis=(1, 2))]
    return Mesh(nodes, mesh.elements, dict(mesh.boundaries) | {"near": near})


def pushed(mesh: Mesh, geometry: Geometry, surface: Surface, supports, **tool) -> Scene:
    """The mesh under a tool that touches its corner, pushed by a force or on a path."""
    given = {"travel": (0.0,) * mesh.dimension, "candidates": ("near",), "mu": 0.3} | tool
    held = *(Support("base", d) for d in range(mesh.dimension)), *supports
    rubber = Elastic(Elasticity(200.0, 0.49))
    return Scene(mesh, geometry, rubber, held, (ShapedTool(surface, **given),), configuration=Configuration.SMALL)


def ball(**tool) -> Scene:
    """A quarter of a block under a sphere: by far most of it is far away."""
    n, m = len(LINE) - 1, len(DEPTH) - 1
    mesh = graded(brick(float(n), float(n), float(m), n, n, m))
    sides = Symmetry("left", 0), Symmetry("front", 1)
    return pushed(mesh, Geometry.SOLID, sphere((0.0, 0.0, RADIUS), RADIUS), sides, **tool)


def ring(**tool) -> Scene:
    """The same on a meridian."""
    n, m = len(LINE) - 1, len(DEPTH) - 1
    mesh = graded(block(float(n), float(m), n, m))
    return pushed(mesh, Geometry.AXISYMMETRIC, Circle((0.0, RADIUS), RADIUS), (Support("left", 0),), **tool)


DOWN = {ball: (0.0, 0.0, -1.0), ring: (0.0, -1.0)}


def alone(scene: Scene, search: Search | None = None, increments: int = 1):
    """The march by Newton without anything to fall back on."""
    return list(march(scene, Schedule(increments), Control(Newton(search=search or Search()), (), cuts=0)))


def scales(scene: Scene):
    """What balances forces against motions at the contacts of a scene at rest."""
    system = system_of(scene)
    cache = Cache()
    iterate = Increment(system, system.rest(), 1.0).at(np.zeros(system.body.space.size))
    return cache.setup(iterate).scale(cache.frames(iterate.rows, iterate))


@pytest.mark.parametrize("scene", [ball, ring])
def test_forces_and_motions_are_balanced_by_the_body_at_the_contact_whatever_drives_the_tool(scene):
    by_force, by_path = scales(scene(driven_by=Force(DOWN[scene]))), scales(scene(travel=DOWN[scene]))
    np.testing.assert_array_equal(by_force, by_path)
    nodal = system_of(scene()).body.rigidity.nodal
    assert by_path.max() < SOFTENED * nodal.max() / 100


@pytest.mark.parametrize("mu", [0.01, 0.3])
@pytest.mark.parametrize("scene", [ball, ring])
def test_newton_alone_goes_as_a_path_does_in_about_as_many_passes(scene, mu):
    *_, pressed = alone(scene(mu=mu, driven_by=Force(tuple(10.0 * d for d in DOWN[scene]))))
    depth = float(pressed.state.translation[0])
    *_, gone = alone(scene(mu=mu, travel=tuple(depth * d for d in DOWN[scene])))
    assert (pressed.solved.r[:, 0] > 0).sum() > 2
    assert pressed.passes <= gone.passes + 2
    np.testing.assert_allclose(pressed.solved.r, gone.solved.r, atol=1e-6 * np.abs(gone.solved.r).max())


def test_newton_alone_goes_on_with_friction_from_what_it_reached():
    assert max(a.passes for a in alone(ball(driven_by=Force((0.0, 0.0, -10.0))), increments=4)) <= 6


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_what_a_tool_comes_upon_tells_how_far_one_contact_lets_it_go(mu):
    """By the one node that it touches first the sphere would sink in four times as deep as it does: a pass more."""
    scene = dented(material=RUBBER, elements=4, travel=(0.0, 0.0, 0.0), mu=mu, driven_by=Force((0.0, 0.0, -30.0)))
    (one,), (other,) = alone(scene), alone(scene, Search(landing=0.0))
    assert one.passes <= 5
    assert other.passes > one.passes
    np.testing.assert_allclose(one.solved.r, other.solved.r, atol=1e-6 * np.abs(one.solved.r).max())


@pytest.mark.parametrize("gap", [1e-6, 0.1, 3.0])
def test_a_tool_in_the_air_comes_to_lie_on_the_body_by_newton_alone(gap):
    """Where nothing resists a tool its matrix is singular; it ends as from where the two touch."""
    force = Force((0.0, -10.0))
    (pressed,) = alone(ring(driven_by=force))
    surface = Circle((0.0, RADIUS + gap), RADIUS)
    scene = ring(driven_by=force)
    (fallen,) = alone(replace(scene, tools=(replace(scene.tools[0], surface=surface),)))
    assert fallen.passes <= pressed.passes + 1
    np.testing.assert_allclose(fallen.state.translation - gap, pressed.state.translation, rtol=1e-6)
    np.testing.assert_allclose(fallen.solved.r, pressed.solved.r, atol=1e-6 * np.abs(pressed.solved.r).max())


def test_a_tool_that_meets_nothing_stays_in_the_air_and_the_march_ends():
    scene = ring(driven_by=Force((0.0, 1.0)))
    with pytest.raises(IncrementFailed, match="singular"):
        alone(scene)
