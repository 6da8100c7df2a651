"""What an increment's numbers are measured in."""

from __future__ import annotations

import numpy as np

from bipot.contact.closeness import LEAST_MOTION
from bipot.programs.data import Units
from bipot.response import State
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Floats


def units_of(system: System, start: State, prescribed: float, new_load: Floats) -> Units:
    """Displacements in what may be expected, stresses in what can be reached of the yield stress, volume of a cube.

    In plane strain it is that of a square, of unit thickness. Expected is the largest of what is ``prescribed``, of
    tools' travel and supports, and of what the new loads on the unknowns (n,) do to their own nodes and to those of
    their tools; where nothing goes a path, of the latter and the last motion; where all are zero, what would release
    the stress, or a small part of the body's size.
    """
    scene, space, rigidity = system.body.scene, system.body.space, system.rigidity
    young, size, stress = scene.material.elasticity.young, scene.mesh.size, float(norm(start.stress).max())
    moved, new = float(norm(start.du).max()), 0.0
    if scene.loads or scene.drives:
        yielding = norm(space.spread(new_load)) / rigidity.nodal
        sinking = np.abs(space.beside(new_load)) / rigidity.tools
        new = float(max(yielding.max(), sinking.max(initial=0.0)))
    length = max(prescribed, new) if prescribed else max(moved, new)
    length = length or max(size * stress / young, LEAST_MOTION * size)
    reached = max(young * length / size, stress)
    stress = min(float(scene.material.yield_stress(0.0)), reached)
    return Units(length, size, stress, size**scene.geometry.reduction.extents)
