r"""The limit load of a mesh, and how many unknowns its elements have for a volumetric constraint.

:func:`bipot.limit_load` asks for no change of volume at every point, and finds a dense basis of such motions where
these rows repeat each other. Of an element that projects its volume change, tr B' v lies in span phi
(:mod:`bipot.fem.projection`), and asking

    sum_q w_q phi_k tr B v = 0    for each phi_k

is the same with as many rows as functions, which are independent: no basis has to be found, and thousands of elements
take seconds. Motions, dissipation, contacts and judgement are the library's.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import norm

from bipot.conic.clarabel import Clarabel
from bipot.conic.solver import Accuracy
from bipot.contact import touches
from bipot.elements import Element
from bipot.errors import InfeasibleProgram, ProgramError
from bipot.fem.kinematics import gradients
from bipot.fem.projection import Projection, VolumeChange
from bipot.increment import Increment
from bipot.limit_analysis import limit_load
from bipot.programs.data import Block, Units
from bipot.programs.dissipation import PlasticModel
from bipot.programs.limit import LimitProgram, Mechanism
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

    Where rows repeat each other and defeat the sparse program, it is that of :func:`bipot.limit_load`.

    Raises:
        ProgramError: no mechanism was found to the accuracy that its inequalities ask for.
    """
    try:
        return _carried(scene)
    except InfeasibleProgram:
        return math.inf
    except ProgramError:
        if scene.volume_change is not VolumeChange.AS_IS:
            raise
    try:
        return limit_load(scene).multiple
    except InfeasibleProgram:
        return math.inf


def _carried(scene: Scene) -> float:
    """By the sparse program."""
    system, size = system_of(scene), scene.mesh.size
    increment, body = Increment(system, system.rest(), 1.0), system.body
    units = Units(size, size, float(scene.material.yield_stress(0.0)), size**3)
    model = body.plastic_model(body.respond(increment.start, np.zeros(body.space.size))).scaled(units)
    if body.projection is not None:
        model = replace(model, volumetric=independent(model, body.projection))
    rows = increment.rows.take(touches(increment.start.gap, size))
    force = system.load(increment.load_ahead, increment.tau)
    program = LimitProgram(model, force / np.abs(force).max(), rows)
    answer, _ = Clarabel().solve(program.conic(), ACCURATE)
    found = Mechanism.of(model, force / units.force, rows, answer.block(Block.DISPLACEMENT))
    if not (found.admissible and found.volume <= KEPT * found.carried):
        raise ProgramError(f"no mechanism found: the nearest changes volume by {found.volume:.2g} of the load's gain")
    return found.carried


def independent(model: PlasticModel, projection: Projection) -> sp.csr_matrix:
    """Rows (e k, n) of sum_q w phi_k tr B v, each over its length."""
    phi = projection.functions
    weighted = (model.weight.reshape(phi.shape[:2])[..., None] * phi).transpose(0, 2, 1)
    rows = sp.csr_matrix(sp.block_diag(list(weighted), format="csr") @ model.volumetric)
    return sp.csr_matrix(sp.diags(1 / norm(rows, axis=1)) @ rows)


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
