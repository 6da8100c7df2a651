"""The limit load of a mesh, inf where it locks, and how many unknowns its elements have for a volumetric constraint."""

from __future__ import annotations

import math

import numpy as np

from bipot.errors import InfeasibleProgram
from bipot.fem.kinematics import gradients
from bipot.limit_analysis import limit_load
from bipot.meshes.elements import Element
from bipot.scene.scene import Scene
from bipot.system import system_of
from bipot.tensors import identity


def limit_of_mesh(scene: Scene) -> float:
    """The multiple of its loads that the mesh at rest carries at most, of perfect plasticity; inf where it locks.

    Raises:
        ProgramError: no mechanism was found to the accuracy that its inequalities ask for.
    """
    try:
        return limit_load(scene).multiple
    except InfeasibleProgram:
        return math.inf


SHARED = {4: 4, 3: 6}
"""Elements that meet at a corner in a large mesh, of as many corners."""


def unknowns_per_constraint(scene: Scene) -> float:
    """Unknowns of an element in a large mesh over the rank of its changes of volume: 2 is the continuum's."""
    mesh, body = scene.mesh, system_of(scene).body
    placed = gradients(mesh.nodes, mesh.elements, body.space.reference, scene.geometry, body.projection)
    changes = (identity(placed.reduction.mandel) @ placed.B)[len(mesh.elements) // 2]
    return mesh.nodes.shape[1] * nodes_an_element(mesh.element) / int(np.linalg.matrix_rank(changes))


def nodes_an_element(element: Element) -> float:
    """Nodes over elements in a large mesh: those of corners, of mid-sides that two share, of the middle.

    >>> [nodes_an_element(element) for element in Element if element.dimension == 2]
    [0.5, 2.0, 1.0, 3.0, 4.0]
    """
    middles = element.corners / 2 if element.quadratic else 0.0
    return element.corners / SHARED[element.corners] + middles + element.centred
