"""The limit load of a mesh, and how many unknowns its elements have for a volumetric constraint.

:func:`bipot.limit_load` finds a dense basis of the motions without change of volume where the rows of an element that
is not projected repeat each other. Here the sparse program is tried first, which takes seconds for thousands of
elements where they do not. Motions, dissipation, contacts and judgement are the library's.
"""

from __future__ import annotations

import math

import numpy as np

from bipot.conic.clarabel import Clarabel
from bipot.conic.solver import Accuracy
from bipot.contact import touches
from bipot.elements import Element
from bipot.errors import InfeasibleProgram, ProgramError
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VolumeChange
from bipot.increment import Increment
from bipot.limit_analysis import limit_load
from bipot.programs.data import Units
from bipot.programs.limit import LimitProgram
from bipot.scene import Scene
from bipot.system import system_of
from bipot.tensors import identity

ACCURATE = Accuracy(1e-9)
KEPT = 1e-9
"""Change of volume of a mechanism, as work of sigma_Y over the load's gain, that is none: answers have 1e-13.

Where rows repeat each other nearly, as in curved elements that lock, the solver may leave more and the load too low.
"""


def limit_of_mesh(scene: Scene) -> float:
    """The multiple of its loads that the mesh at rest carries at most, of perfect plasticity; inf where it locks.

    Raises:
        ProgramError: no mechanism was found to the accuracy that its inequalities ask for.
    """
    try:
        return _carried(scene)
    except InfeasibleProgram:
        return math.inf


def _carried(scene: Scene) -> float:
    if scene.volume_change is VolumeChange.AS_IS:
        try:
            return _sparse(scene)
        except InfeasibleProgram:
            raise
        except ProgramError:
            # rows that repeat each other have defeated it
            pass
    return limit_load(scene).multiple


def _sparse(scene: Scene) -> float:
    """Without asking whether rows repeat each other."""
    system, size = system_of(scene), scene.mesh.size
    increment, body = Increment(system, system.rest(), 1.0), system.body
    units = Units(size, size, float(scene.material.yield_stress(0.0)), size**3)
    model = body.plastic_model(body.respond(increment.start, np.zeros(body.space.size))).scaled(units)
    rows = increment.rows.take(touches(increment.start.gap, size))
    force = system.load(increment.load_ahead, increment.tau) / units.force
    found = LimitProgram(model, force, rows, model.volumetric).mechanism(Clarabel(), ACCURATE)
    if not (found.admissible and found.volume <= KEPT * found.carried):
        raise ProgramError(f"no mechanism found: the nearest changes volume by {found.volume:.2g} of the load's gain")
    return found.carried


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

    >>> [nodes_an_element(element) for element in Element]
    [0.5, 2.0, 1.0, 3.0, 4.0]
    """
    middles = element.corners / 2 if element.quadratic else 0.0
    return element.corners / SHARED[element.corners] + middles + element.centred
