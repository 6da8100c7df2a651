"""The fields of one step of a run: of nodes and of elements for VTK, of integration points for whoever goes on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.accepted import Accepted
from bipot.course import Course
from bipot.fem.kinematics import gradients
from bipot.laws.coulomb import Status
from bipot.response import State
from bipot.system import System
from bipot.traction import Traction
from bipot.typing import Floats

NO_CANDIDATE = -1

POINT_FIELDS = {
    "displacement": ("f", (3,), True),
    "velocity": ("f", (3,), True),
    "contact_force": ("f", (3,), True),
    "recovered_pressure": ("f", (), False),
    "recovered_shear": ("f", (), False),
    "gap": ("f", (), False),
    "status": ("i", (), True),
}
"""Kind of number, shape at a node, and whether always finite."""

CELL_FIELDS = {
    "stress": ("f", (6,), True),
    "plastic_strain": ("f", (6,), True),
    "mises": ("f", (), True),
    "peeq": ("f", (), True),
}
"""The same of elements."""


@dataclass(frozen=True)
class Step:
    """What is stored of one step: where the march is, forces and gaps of all candidates, what they carry and do.

    ``forces`` (c, d) are vectors on the body, ``volume`` (e, q) is that of the integration points.
    """

    course: Course
    forces: Floats
    gap: Floats
    tractions: Traction
    volume: Floats

    @staticmethod
    def at_start(system: System, course: Course) -> Step:
        """Step 0: nothing has slipped yet, so the tractions of a start that carries forces are unknown (NaN, UNDECIDED)."""
        scene, state = system.body.scene, course.state
        rests = not state.forces.any()
        unknown = np.full(len(state.gap), 0.0 if rests else np.nan)
        status = np.full(len(state.gap), Status.OPEN if rests else Status.UNDECIDED, dtype=np.int8)
        placed = gradients(state.nodes, scene.mesh.elements, system.body.space.reference, scene.geometry)
        tractions = Traction(unknown, unknown, status, 0.0, 0.0)
        frames = system.candidates.frames_at(state.nodes, scene.placed(state.tau, state.translation))
        forces = system.candidates.vectors(state.forces, frames)
        return Step(course, forces, state.gap, tractions, placed.volume)

    @staticmethod
    def after(accepted: Accepted) -> Step:
        """The step of an accepted increment, its tractions on the configuration of equilibrium."""
        solved = accepted.solved
        increment = solved.iterate.increment
        forces = increment.system.candidates.vectors(solved.iterate.rubbed(solved.r), solved.iterate.frames)
        gap = solved.iterate.motion[:, 0]
        return Step(accepted.course, forces, gap, accepted.traction, solved.response.kinematics.volume)

    @property
    def state(self) -> State:
        """The accepted state."""
        return self.course.state


def point_fields(system: System, step: Step) -> dict[str, NDArray[Any]]:
    """Nodal fields: vectors (a, 3), scalars (a,); NaN (status: -1) where a node is no candidate.

    Where two tools share a node, the one that pushes harder speaks, except for the force, which is the sum.
    """
    mesh, candidates, state = system.body.scene.mesh, system.candidates, step.state
    order = np.argsort(state.forces[:, 0], kind="stable")
    node, count = candidates.node[order], len(mesh.nodes)

    def scatter(values: NDArray[Any], empty: float) -> NDArray[Any]:
        out = np.full(count, empty, dtype=values.dtype)
        out[node] = values[order]
        return out

    return {
        "displacement": padded(state.nodes - mesh.nodes),
        "velocity": padded(state.velocity),
        "contact_force": padded(candidates.nodal(step.forces)),
        "recovered_pressure": scatter(step.tractions.recovered_pressure, np.nan),
        "recovered_shear": scatter(step.tractions.recovered_shear, np.nan),
        "gap": scatter(step.gap, np.nan),
        "status": scatter(step.tractions.status, NO_CANDIDATE),
    }


def cell_fields(step: Step) -> dict[str, Floats]:
    """Volume averages: stress and plastic strain (e, 6) in VTK's order, von Mises stress and peeq (e,)."""
    state = step.state
    weight = step.volume / step.volume.sum(axis=1, keepdims=True)
    return {
        "stress": symmetric(np.einsum("eq,eqs->es", weight, state.stress)),
        "plastic_strain": symmetric(np.einsum("eq,eqs->es", weight, state.plastic_strain)),
        "mises": np.einsum("eq,eq->e", weight, state.mises),
        "peeq": np.einsum("eq,eq->e", weight, state.peeq),
    }


def step_fields(step: Step) -> dict[str, ArrayLike]:
    """What ``/bipot/steps`` holds of one step: everything that a march goes on from, but times and nodes."""
    course, state = step.course, step.state
    flow = state.flow
    return {
        "stress": state.stress,
        "plastic_strain": state.plastic_strain,
        "peeq": state.peeq,
        "flows": np.uint8(flow is not None),
        "flow_strain": np.zeros_like(state.plastic_strain) if flow is None else flow.strain,
        "flow_peeq": np.zeros_like(state.peeq) if flow is None else flow.peeq,
        "volume": step.volume,
        "contact_force": state.forces,
        "gap": state.gap,
        "du": state.du,
        "translation": state.translation,
        "translated": state.translated,
        "length": state.length,
        "number": np.int64(course.number),
        "energies": list(vars(course.energies).values()),
        "largest": course.largest,
        "size": course.size,
        "uncut": course.uncut,
        "proposed": course.proposed,
        "landed": course.landed.astype(np.uint8),
        "before_times": [course.before.tau, course.before.middle],
        "before_velocity": course.before.velocity,
        "force_tol": step.tractions.force_tol,
        "slip_tol": step.tractions.slip_tol,
    }


def padded(vectors: Floats) -> Floats:
    """Vectors (a, d) with zeros up to three components."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def symmetric(mandel: Floats) -> Floats:
    """VTK's symmetric tensor (e, 6), xx yy zz xy yz xz, from Mandel vectors (e, s), of a plane or of space.

    >>> symmetric(np.array([[1.0, 2.0, 3.0, np.sqrt(2.0)]])).round(12)
    array([[1., 2., 3., 1., 0., 0.]])
    """
    out = np.pad(mandel, ((0, 0), (0, 6 - mandel.shape[1])))
    out[:, 3:] /= np.sqrt(2.0)
    return out
