"""What loads a body in space at a time, made by the fuzz study itself from the scene's numbers."""

from __future__ import annotations

import numpy as np

from bipot.control.accepted import Accepted
from bipot.fem.strain import Configuration
from bipot.scene.loads import BodyForce, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.typing import Floats
from studies.fuzz.solid_held import multiple
from studies.independent.solid import face_forces, place, rule, shape_functions


def loads_at(scene: Scene, accepted: Accepted, end: int) -> Floats:
    """Nodal forces (a, 3) at the start, 0, or the ``end``, 1, of an increment, where equilibrium is asked."""
    balanced = accepted.start.nodes
    if scene.configuration is Configuration.PAPER and not end:
        balanced = balanced - accepted.start.du
    if scene.configuration is Configuration.SMALL:
        balanced = scene.mesh.nodes
    elif scene.configuration is Configuration.MIDPOINT and end:
        balanced = accepted.state.nodes
    return loads_on(scene, balanced, (accepted.start.tau, accepted.state.tau)[end])


def loads_on(scene: Scene, balanced: Floats, tau: float) -> Floats:
    """Nodal forces (a, 3) at a time on the nodes ``balanced`` (a, 3)."""
    mesh = scene.mesh
    rest, elements, out = mesh.nodes, mesh.elements, np.zeros(mesh.nodes.shape)
    for load in scene.loads:
        now = multiple(load.amplitude, tau)
        if isinstance(load, PointForce):
            out[load.node] += now * np.array(load.vector)
        elif isinstance(load, BodyForce):
            volume = place(rest, elements, scene.rule.value).volume
            values, _ = shape_functions(rule(scene.rule.value)[0], elements.shape[1])
            np.add.at(out, elements, (volume @ values)[..., None] * (now * np.array(load.vector)))
        elif isinstance(load, Traction | Pressure):
            for face in mesh.boundaries[load.boundary]:
                owner = elements[np.isin(elements, face).sum(axis=1) == len(face)][0]
                if isinstance(load, Traction):
                    share = face_forces(rest[face], rest[owner].mean(axis=0))[0]
                    out[face] += now * np.outer(share, load.vector)
                else:
                    out[face] -= now * load.pressure * face_forces(balanced[face], balanced[owner].mean(axis=0))[1]
    return out
