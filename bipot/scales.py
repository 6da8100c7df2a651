"""The units by which the numbers of an increment are scaled."""

from __future__ import annotations

import numpy as np

from bipot.contact.closeness import LEAST_MOTION
from bipot.programs.data import Units
from bipot.response import State
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Floats


def units_of(system: System, start: State, prescribed: float, new_load: Floats) -> Units:
    """Units: displacements to be expected, stresses that can be reached up to the yield stress, the volume of a cube.

    In plane strain the volume is that of a square of unit thickness. The expected displacement is the largest of what
    is ``prescribed`` (travel of tools and supports) and of the elastic displacement that the new loads on the unknowns
    (n,) cause at their own nodes and those of their tools. Where nothing is prescribed it is the largest of the latter
    and the last motion; where all are zero, the displacement that would release the stress, or a small part of the
    body's size. It is never less than a small part of what would release the stress: the motions of a body that rests
    fall to round-off from increment to increment, and in units of that a program has forces, but no stiffness left.
    """
    scene, space, rigidity = system.body.scene, system.body.space, system.rigidity
    young, size, stress = scene.material.elasticity.young, scene.mesh.size, float(norm(start.stress).max())
    moved, new = float(norm(start.du).max()), 0.0
    if scene.loads or scene.drives:
        yielding = norm(space.spread(new_load)) / rigidity.nodal
        sinking = np.abs(space.beside(new_load)) / rigidity.tools
        new = float(max(yielding.max(), sinking.max(initial=0.0)))
    released = size * stress / young
    length = max(prescribed or moved, new) or max(released, LEAST_MOTION * size)
    length = max(length, LEAST_MOTION * released)
    reached = max(young * length / size, stress)
    stress = min(float(scene.material.yield_stress(0.0)), reached)
    return Units(length, size, stress, size**scene.geometry.reduction.extents)
