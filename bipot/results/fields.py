"""The fields of one step of a run: at nodes and elements for VTK, at integration points for resuming."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from bipot.control.accepted import Accepted
from bipot.control.course import Course
from bipot.energy import ended_forces
from bipot.fem.elements import Quadrature, tabulated
from bipot.laws.coulomb import Status
from bipot.meshes.mesh import Mesh
from bipot.state import State
from bipot.system import System
from bipot.traction import ContactTraction
from bipot.typing import Floats, Ints, einsum, max_abs

NO_CANDIDATE = -1

SINGLE = 1e-20, 1e20
"""Range of Young's moduli with which any stress fits into single precision, 1e-38 to 3e38."""


@dataclass(frozen=True)
class StoredStep:
    """The stored data of one step: course of the march, contact forces, gaps of candidates, their tractions and status.

    ``forces`` (a, d) are those on nodes, ``volume`` (e, q) is that of the integration points, ``poses`` (k, p)
    are those of the tools (:mod:`bipot.tools.poses`).
    """

    course: Course
    forces: Floats
    gap: Floats
    tractions: ContactTraction
    volume: Floats
    poses: Floats

    @staticmethod
    def at_start(system: System, course: Course) -> StoredStep:
        """Step 0: without a known slip, tractions of a start that carries forces are unknown (NaN, UNDECIDED)."""
        scene, state = system.body.scene, course.state
        rests = not state.forces.any()
        unknown = np.full(len(state.gap), 0.0 if rests else np.nan)
        status = np.full(len(state.gap), Status.OPEN if rests else Status.UNDECIDED, dtype=np.int8)
        placed = system.body.space.gradients(system.balanced(state))
        tractions = ContactTraction(unknown, unknown, status, 0.0, 0.0)
        poses = scene.placed(state.tau, state.translation)
        contacts = system.facing(state.nodes).candidates
        forces = contacts.vectors(ended_forces(system, state), contacts.frames_at(state.nodes, poses))
        return StoredStep(course, contacts.met.nodal(forces), state.gap, tractions, placed.volume, poses)

    @staticmethod
    def after(accepted: Accepted) -> StoredStep:
        """The step of an accepted increment, its tractions on the configuration of equilibrium."""
        solved = accepted.solved
        contacts = solved.iterate.increment.system.candidates
        forces = contacts.met.nodal(contacts.vectors(solved.iterate.rubbed(solved.r), solved.iterate.frames))
        gap, volume = solved.iterate.motion[:, 0], solved.response.kinematics.volume
        return StoredStep(accepted.course, forces, gap, accepted.traction, volume, accepted.poses)

    @property
    def state(self) -> State:
        """The accepted state."""
        return self.course.state


def point_fields(system: System, step: StoredStep, averaging: Averaging, values: Floats) -> dict[str, NDArray[Any]]:
    """Nodal fields: vectors (a, 3), tensors (a, 6), scalars (a,); NaN (status: -1) where a node is no candidate.

    Where two tools share a node, the fields are those of the one with the larger normal force, or of the nearer one
    if neither has any, except for the force, which is the sum. The ``values`` (:func:`together`) after ``averaging``
    are stored in single precision, unless stresses do not fit into that.
    """
    mesh, candidates, state = system.body.scene.mesh, system.candidates, step.state
    least, most = SINGLE
    kind = np.float32 if least <= max_abs(system.body.scene.materials.elasticity.young) <= most else np.float64
    order = rising(step.gap, state.forces)
    node, count = candidates.node[order], len(mesh.nodes)

    def scatter(values: NDArray[Any], empty: float) -> NDArray[Any]:
        out = np.full(count, empty, dtype=values.dtype)
        out[node] = values[order]
        return out

    return {
        "displacement": in_space(state.nodes - mesh.nodes),
        "velocity": in_space(state.velocity),
        "contact_force": in_space(step.forces),
        "contact_pressure": scatter(step.tractions.recovered_pressure, np.nan),
        "contact_shear": scatter(step.tractions.recovered_shear, np.nan),
        "gap": scatter(step.gap, np.nan),
        "status": scatter(step.tractions.status, NO_CANDIDATE),
        **_apart(averaging(step.volume, values), kind),
    }


def rising(gap: Floats, forces: Floats) -> Ints:
    """The order of candidates, with ``gap`` (c,) and ``forces`` (c, d), in which the last of a node has its fields."""
    return np.lexsort((-gap, np.abs(forces[:, 0])))


def cell_fields(step: StoredStep, values: Floats) -> dict[str, NDArray[Any]]:
    """Averages of the ``values`` (:func:`together`) over the elements: tensors (e, 6) in VTK's order, scalars."""
    weight = step.volume / step.volume.sum(axis=1, keepdims=True)
    return _apart(einsum("eq,eqs->es", weight, values), np.float64)


def together(state: State) -> Floats:
    """Stress, plastic strain, and the scalars von Mises, pressure, peeq of integration points, as (e, q, 2 s + 3)."""
    scalars = np.stack([state.mises, state.pressure, state.peeq], axis=-1)
    return np.concatenate([state.stress, state.plastic_strain, scalars], axis=-1)


def _apart(values: Floats, kind: type) -> dict[str, NDArray[Any]]:
    """Averages (n, 2 s + 3) as arrays by name, of the type ``kind``."""
    size = (values.shape[1] - 3) // 2
    mises, pressure, peeq = values[:, 2 * size :].T.astype(kind)
    return {
        "stress": _symmetric(values[:, :size]).astype(kind),
        "plastic_strain": _symmetric(values[:, size : 2 * size]).astype(kind),
        # Extrapolation may make non-negative fields negative.
        "mises": np.maximum(mises, 0),
        "pressure": pressure,
        "peeq": np.maximum(peeq, 0),
    }


def step_fields(step: StoredStep) -> dict[str, ArrayLike]:
    """The data of one step in ``/bipot/steps``: all that a resumed march needs, except times and nodes."""
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
        "pose": step.poses,
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
        "before_times": [(paced.tau, paced.middle) for paced in course.before],
        "before_velocity": [paced.velocity for paced in course.before],
        "before_forces": [paced.forces for paced in course.before],
        "force_tol": step.tractions.force_tol,
        "slip_tol": step.tractions.slip_tol,
    }


def in_space(vectors: Floats) -> Floats:
    """Vectors (a, d) with zeros up to three components."""
    # Several times faster than np.pad.
    out = np.zeros((len(vectors), 3))
    out[:, : vectors.shape[1]] = vectors
    return out


def _symmetric(mandel: Floats) -> Floats:
    """VTK's symmetric tensor (e, 6), xx yy zz xy yz xz, from Mandel vectors (e, s), of a plane or of space.

    >>> _symmetric(np.array([[1.0, 2.0, 3.0, np.sqrt(2.0)]])).round(12)
    array([[1., 2., 3., 1., 0., 0.]])
    """
    out = np.zeros((len(mandel), 6))
    out[:, : mandel.shape[1]] = mandel
    out[:, 3:] /= np.sqrt(2.0)
    return out


@dataclass(frozen=True)
class Averaging:
    r"""Fields of points at nodes: the best linear function of each element, averaged over those around a node.

    In the reference element the function is the least-squares fit of the values s_q in the rule's weights; for one
    point it is constant. With its values E s at the nodes of an element of volume V_e, the value at a node is

        sum_e V_e (E s_e) / sum_e V_e.

    Functions linear in the reference coordinates are reproduced. Extrapolated values may exceed the extremes at the
    points, more so for steep fields; the solved values are those at the points.

    ``extrapolation`` E (k, q) is from points to nodes of an element, ``gathering`` (a, e k) from elements to nodes.
    """

    extrapolation: Floats
    gathering: sp.csr_matrix

    @staticmethod
    def of(mesh: Mesh, rule: Quadrature) -> Averaging:
        """The averaging for a mesh and its integration rule."""
        count, k = mesh.elements.shape
        columns = np.arange(count * k)
        ones = np.ones(count * k)
        gathering = sp.csr_matrix((ones, (mesh.elements.ravel(), columns)), shape=(len(mesh.nodes), count * k))
        return Averaging(_extrapolation(mesh, rule), gathering)

    def __call__(self, volume: Floats, values: Floats) -> Floats:
        """Values (a, f) at nodes from ``values`` (e, q, f) at points with the ``volume`` (e, q)."""
        k = len(self.extrapolation)
        weight = volume.sum(axis=1)
        weighted = weight[:, None, None] * (self.extrapolation @ values)
        total = self.gathering @ np.repeat(weight, k)
        return (self.gathering @ weighted.reshape(-1, values.shape[-1])) / total[:, None]


def _extrapolation(mesh: Mesh, rule: Quadrature) -> Floats:
    """E (k, q) of :class:`Averaging`."""
    reference, nodes = tabulated(mesh.element, rule), mesh.element.every_place
    # A linear function needs as many points as it has coefficients.
    if len(reference.weights) < 1 + nodes.shape[1]:
        return np.full((len(nodes), len(reference.weights)), 1 / len(reference.weights))
    at_points, at_nodes = (np.column_stack([np.ones(len(x)), x]) for x in (reference.points, nodes))
    weighted = at_points.T * reference.weights
    return at_nodes @ np.linalg.solve(weighted @ at_points, weighted)
