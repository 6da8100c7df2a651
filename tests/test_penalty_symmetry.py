"""The penalised law in planes of symmetry: what is modelled of a node there has its share of the node's penalty."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.fem.reduction import Geometry
from bipot.forms import Penalty, contact_penalty
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.revolved import sphere
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from studies.fuzz.unfolded import unfolded

STEEL = VonMises(Elasticity(2e5, 0.3), Linear(300.0, 2000.0))
SOFT = 1e4


def strips(tool, **how):
    """A strip in plane strain, and its half."""
    meshes = block(4.0, 1.0, 4, 1, **how), block(2.0, 1.0, 2, 1, **how)
    supports = Support("base", 0), Support("base", 1)
    whole = Mesh(meshes[0].nodes - [2.0, 0.0], meshes[0].elements, meshes[0].boundaries)
    return (
        Scene(whole, Geometry.PLANE_STRAIN, STEEL, supports, tools=(tool,)),
        Scene(meshes[1], Geometry.PLANE_STRAIN, STEEL, (*supports, Symmetry("left", 0)), tools=(tool,)),
    )


def blocks(tool, **how):
    """A block in space, and its quarter."""
    meshes = brick(2.0, 2.0, 1.0, 2, 2, 1, **how), brick(1.0, 1.0, 1.0, 1, 1, 1, **how)
    supports = tuple(Support("base", k) for k in range(3))
    whole = Mesh(meshes[0].nodes - [1.0, 1.0, 0.0], meshes[0].elements, meshes[0].boundaries)
    return (
        Scene(whole, Geometry.SOLID, STEEL, supports, tools=(tool,)),
        Scene(meshes[1], Geometry.SOLID, STEEL, (*supports, Symmetry("left", 0), Symmetry("front", 1)), tools=(tool,)),
    )


def roofed(scenes, *ways):
    """The same, higher and falling steeply along ``ways`` from their planes of symmetry: means stop at these.

    Their platen starts at the means next to them.
    """
    for scene in scenes:
        x, mesh, (tool,) = scene.mesh.nodes.copy(), scene.mesh, scene.tools
        x[:, -1] *= 3 * np.prod(1 - 0.25 * np.abs(x[:, ways]), axis=1)
        up = tuple(3 * (1 - 0.25 / 3) ** len(ways) * np.eye(x.shape[1])[-1])
        yield replace(scene, mesh=Mesh(x, mesh.elements, mesh.boundaries), tools=(replace(tool, point=up),))


def platen(d, **how):
    up = np.eye(d)[-1]
    return FlatTool(tuple(up), tuple(-up), tuple(-0.05 * up), ("top",), 0.1, **how)


SCENES = {
    "strip": lambda: strips(platen(2)),
    "means": lambda: strips(platen(2, sampling=Sampling.WEIGHTED), element=Element.Q8),
    "block": lambda: blocks(platen(3)),
    "ridge": lambda: roofed(strips(platen(2, sampling=Sampling.WEIGHTED), element=Element.Q8), 0),
    "roof": lambda: roofed(blocks(platen(3, sampling=Sampling.WEIGHTED), element=Element.H20), 0),
    "pyramid": lambda: roofed(blocks(platen(3, sampling=Sampling.WEIGHTED), element=Element.H20), 0, 1),
    "ball": lambda: blocks(
        ShapedTool(sphere((0.0, 0.0, 3.0), 2.0), travel=(0.0, 0.0, -0.3), candidates=("top",), mu=0.2)
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_penalty_gives_half_a_body_the_forces_and_energies_of_the_whole(name):
    found = []
    for scene in SCENES[name]():
        *_, last = march(scene, Schedule(2), Control(Penalty(SOFT, SOFT), ()))
        energies = last.energies
        found.append([*last.tool_force(0), energies.work, energies.elastic, energies.plastic, energies.friction])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6, atol=1e-6 * np.abs(found[0]).max())


def test_a_tool_that_a_plane_does_not_cut_has_the_whole_penalty_there():
    """Its mirror image pushes at the node of the plane as well."""
    slope = np.array([-0.1, -1.0]) / np.hypot(0.1, 1.0)
    aslant = FlatTool((0.0, 1.0), tuple(slope), (0.0, -0.05), ("top",), 0.1)
    _, half = strips(aslant)
    np.testing.assert_array_equal(system_of(half).candidates.share, 1.0)
    _, half = strips(platen(2))
    candidates = system_of(half).candidates
    np.testing.assert_array_equal(candidates.share, np.where(half.mesh.nodes[candidates.node, 0] == 0, 0.5, 1.0))


@pytest.mark.parametrize("name", ["block", "ridge", "roof", "pyramid"])
def test_the_scaled_penalty_of_half_a_body_is_that_of_the_whole(name):
    found = []
    for scene in SCENES[name]():
        # Edges of two lengths, of which those in the planes are edges of both halves.
        mesh = replace(scene.mesh, nodes=scene.mesh.nodes * np.arange(1, scene.mesh.dimension + 1))
        found.append(contact_penalty(system_of(replace(scene, mesh=mesh)).candidates, 2.0))
    assert found[1] == pytest.approx(found[0], rel=1e-12)


@pytest.mark.parametrize("sampling", Sampling)
def test_sides_that_end_on_a_plane_count_as_in_the_whole_body(sampling):
    """A platen on a ridge touches one node: what may touch it are top and side, which the plane of the base cuts."""
    _, half = strips(platen(2, sampling=sampling), element=Element.Q8)
    x = half.mesh.nodes * [1.0, 1.0]
    x[:, 1] *= 1.2 - 0.1 * x[:, 0]
    tool = replace(half.tools[0], point=(0.0, 1.2), candidates=("top", "right"))
    mesh, planes = Mesh(x, half.mesh.elements, half.mesh.boundaries), (Symmetry("left", 0), Symmetry("base", 1))
    quarter = replace(half, mesh=mesh, supports=planes, tools=(tool,))
    for seen in unfolded(quarter):
        whole, own = (contact_penalty(system_of(scene).candidates) for scene in (seen.scene, quarter))
        assert own == pytest.approx(whole, rel=1e-12)
