"""Projected elements do not know units, a mirror or the numbers of nodes: the same march, to round-off."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.tools.tool import FlatTool

EACH = pytest.mark.parametrize(
    ("element", "volume"),
    [(Element.Q4, VolumeChange.P0), (Element.Q8, VolumeChange.P1), (Element.T6, VolumeChange.P0)],
    ids=lambda value: value.name,
)
ROUND_OFF = 1e-12
"""Of the largest value: 2e-14 was measured."""


def pressed(element, volume, stress=1.0, length=1.0):
    """Three by two cells, those inside distorted, pressed by four per cent under friction; units of N and mm."""
    plain = block(3.0 * length, 2.0 * length, 3, 2, element=element)
    inner = np.setdiff1d(np.arange(len(plain.nodes)), plain.boundary_nodes(*plain.boundaries))
    nodes = plain.nodes.copy()
    nodes[inner] += 0.05 * length * np.random.default_rng(3).uniform(-1, 1, (len(inner), 2))
    return Scene(
        Mesh(nodes, plain.elements, plain.boundaries),
        Geometry.PLANE_STRAIN,
        VonMises(Elasticity(210e3 * stress, 0.3), Linear(300.0 * stress, 2000.0 * stress)),
        (Support("base", 1), Support("left", 0)),
        (FlatTool((0.0, 2.0 * length), (0.0, -1.0), (0.0, -0.08 * length), ("top",), 0.2),),
        volume=volume,
    )


def end(scene):
    """The last of three increments."""
    return list(march(scene, Schedule(3), Control(Newton(), ())))[-1]


def same(found, expected):
    """Equal to round-off of the largest value."""
    assert np.abs(expected).max() > 0
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF * np.abs(expected).max())


@EACH
def test_in_metres_and_pascals_it_is_the_same_march(element, volume):
    here, there = (end(pressed(element, volume, *units)) for units in ((1.0, 1.0), (1e6, 1e-3)))
    same(there.state.nodes * 1e3, here.state.nodes)
    same(there.state.stress / 1e6, here.state.stress)
    same(there.state.peeq, here.state.peeq)
    # per thickness: N/m and N/mm
    same(there.tool_forces / 1e3, here.tool_forces)
    same(there.energies.work, here.energies.work)


@EACH
def test_in_a_mirror_it_is_the_mirrored_march(element, volume):
    scene, flip = pressed(element, volume), np.array([-1.0, 1.0])
    corner = element.corners
    order = element.mirrored
    # from the second corner, so that the lines of Radon's points stay where they are
    order = np.concatenate([np.roll(order[:corner], 1), np.roll(order[corner : 2 * corner], 1)])
    mesh = Mesh(scene.mesh.nodes * flip, scene.mesh.elements[:, order], scene.mesh.boundaries)
    here, there = end(scene), end(replace(scene, mesh=mesh))
    same(there.state.nodes * flip, here.state.nodes)
    same(there.tool_forces * flip, here.tool_forces)
    # the points of an element come in another order
    for name in ("peeq", "mises", "pressure"):
        same(np.sort(getattr(there.state, name), axis=1), np.sort(getattr(here.state, name), axis=1))


@EACH
def test_other_numbers_of_nodes_and_elements_number_the_same_march(element, volume):
    scene, rng = pressed(element, volume), np.random.default_rng(0)
    mesh = scene.mesh
    number, order = rng.permutation(len(mesh.nodes)), rng.permutation(len(mesh.elements))
    nodes = np.empty_like(mesh.nodes)
    nodes[number] = mesh.nodes
    boundaries = {name: number[edges] for name, edges in mesh.boundaries.items()}
    here, there = end(scene), end(replace(scene, mesh=Mesh(nodes, number[mesh.elements][order], boundaries)))
    same(there.state.nodes[number], here.state.nodes)
    same(there.state.stress, here.state.stress[order])
    same(there.tool_forces, here.tool_forces)
