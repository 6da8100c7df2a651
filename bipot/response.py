r"""The body's response to a trial increment: kinematics, return map, internal force, tangent. fem and laws meet here.

    sigma_trial = R sigma_n R' + C : de,    sigma = radial return of it (7)-(9),    f_int = sum_q w B' sigma,

with de, R, B, w of the scene's configuration (:mod:`bipot.fem.kinematics`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.fem.assembly import Space, element_force, element_stiffness, space
from bipot.fem.geometric import Scratch, element_tangent
from bipot.fem.kinematics import MANDEL_2D, Configuration, Kinematics, increment, rotate
from bipot.fem.orientation import refuse_folded
from bipot.laws.flow import Flow
from bipot.laws.tensors import deviator, deviatoric_basis, equivalent_strain, identity, trace
from bipot.laws.von_mises import Returned, consistent_tangent, continuum_tangent, radial_return, yield_function
from bipot.programs.dissipation import PlasticModel
from bipot.scene import Scene
from bipot.typing import Floats, read_only

ON_YIELD = 1e-9
"""A stress this near the yield surface, relative to it, counts as on it for (10)."""


class TangentKind(Enum):
    """Which C^ep the quadratic energy uses: algorithmic, or the rate form (10)."""

    CONSISTENT = "consistent"
    CONTINUUM = "continuum"


class StressUpdate(Enum):
    """Stress at the end of an increment: returned to the yield surface, or sigma_n + C^ep : de as (4) has it.

    Without the return C^ep is that of the start of the increment, and the stress drifts off the yield surface.
    """

    RETURN = "return"
    RATE = "rate"


@dataclass(frozen=True)
class State:
    """An accepted state and the increment that led to it.

    Pseudo-time, nodes (a, d), Cauchy stress and plastic strain (e, q, s), peeq (e, q); contact forces (c, d) and gaps
    (c,) of all candidates; displacement (a, d), length in pseudo-time and flow of the increment that led here. Gaps
    and displacement are kept as they were found, because positions lose a small travel to their round-off. Arrays are
    read-only.
    """

    tau: float
    nodes: Floats
    stress: Floats
    plastic_strain: Floats
    peeq: Floats
    forces: Floats
    gap: Floats
    displacement: Floats
    length: float = 0.0
    flow: Flow | None = None

    def __post_init__(self) -> None:
        for name in ("nodes", "stress", "plastic_strain", "peeq", "forces", "gap", "displacement"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))

    @property
    def velocity(self) -> Floats:
        """du/dtau (a, d) of the increment that led here, zero at rest."""
        return self.displacement / self.length if self.length > 0 else np.zeros_like(self.displacement)


def rest(scene: Scene, gap: Floats) -> State:
    """The stress-free state at tau = 0, in which the candidates have the gaps (c,)."""
    nodes = scene.mesh.nodes
    tensor = np.zeros((len(scene.mesh.elements), len(body_space(scene).reference.weights), MANDEL_2D))
    forces = np.zeros((len(gap), nodes.shape[1]))
    return State(
        tau=0.0,
        nodes=nodes,
        stress=tensor,
        plastic_strain=tensor,
        peeq=tensor[..., 0],
        forces=forces,
        gap=gap,
        displacement=np.zeros_like(nodes),
    )


def body_space(scene: Scene) -> Space:
    """The scene's displacement space."""
    return space(scene.mesh, scene.geometry, scene.quadrature, scene.held)


@dataclass(frozen=True)
class Response:
    """What the body does under the trial displacement ``du`` (a, d) from ``state``.

    ``rotated`` is R sigma_n R', ``trial`` the elastic trial stress, ``element_forces`` (e, 2k) and ``internal``
    (n,) the internal forces of the returned stress.
    """

    state: State
    x: Floats
    kinematics: Kinematics
    rotated: Floats
    trial: Floats
    returned: Returned
    element_forces: Floats
    internal: Floats


@dataclass(frozen=True)
class Body:
    """A scene with its space: makes responses and their linear or convex models."""

    scene: Scene
    space: Space
    update: StressUpdate = StressUpdate.RETURN

    def carried_on(self, state: State, flow: Flow) -> State:
        """The state from which BDF2 takes an increment: ``flow`` has gone on from ``state`` at fixed strain.

        See :mod:`bipot.laws.flow`.
        """
        stress = state.stress - 2 * self.scene.material.elasticity.shear * flow.strain
        plastic_strain = state.plastic_strain + flow.strain
        return replace(state, stress=stress, plastic_strain=plastic_strain, peeq=state.peeq + flow.peeq)

    def turned(self, response: Response, tensor: Floats) -> Floats:
        """A tensor (e, q, s) of the increment's start turned with the body to its end."""
        midpoint = self.scene.configuration is Configuration.MIDPOINT
        return rotate(tensor, response.kinematics.angle) if midpoint else tensor

    def respond(self, state: State, x: Floats) -> Response:
        """Response to the free displacements x (n,).

        Raises:
            InvertedElement: the trial configuration is not admissible.
        """
        mesh, space_ = self.scene.mesh, self.space
        kin = increment(
            state.nodes,
            space_.spread(x),
            mesh.elements,
            space_.reference,
            self.scene.geometry,
            self.scene.configuration,
        )
        rotated = (
            rotate(state.stress, kin.angle) if self.scene.configuration is Configuration.MIDPOINT else state.stress
        )
        elastic = self.scene.material.elasticity
        trial = rotated + kin.strain @ elastic.stiffness(MANDEL_2D)
        if self.update is StressUpdate.RETURN:
            returned = radial_return(trial, state.peeq, elastic, self.scene.material.hardening)
        else:
            returned = self._unreturned(state, rotated, kin.strain)
        forces = element_force(kin.shape, returned.stress, kin.volume)
        return Response(state, x, kin, rotated, trial, returned, forces, space_.vector(forces))

    def refuse_folded(self, response: Response) -> None:
        """Demand elements that are folded nowhere: where strain is taken or equilibrium asked, and at the end.

        Raises:
            InvertedElement: naming element, place and value (:mod:`bipot.fem.orientation`).
        """
        start, du = response.state.nodes, self.space.spread(response.x)
        placements = {"at the end of the increment": start + du}
        if self.scene.configuration is Configuration.MIDPOINT:
            placements["at the middle of the increment"] = start + du / 2
        else:
            placements["at the start of the increment"] = start
        refuse_folded(placements, self.scene.mesh.elements, self.scene.geometry)

    def stiffness(self, response: Response, kind: TangentKind) -> sp.csc_matrix:
        """K of (25) at the response, without geometric part: symmetric and positive semidefinite."""
        material, peeq = self.scene.material, response.state.peeq
        if self.update is StressUpdate.RATE:
            C = self._rate(response.state)[0]
        elif kind is TangentKind.CONSISTENT:
            C = consistent_tangent(response.trial, response.returned, peeq, material.elasticity, material.hardening)
        else:
            r = response.returned
            C = continuum_tangent(r.stress, peeq + r.dpeeq, r.plastic, material.elasticity, material.hardening)
        return self.space.matrix(element_stiffness(response.kinematics.B, C, response.kinematics.volume))

    def _rate(self, state: State) -> tuple[Floats, NDArray[np.bool_]]:
        """C^ep (e, q, s, s) of (10) at the start of the increment, and where it is plastic (e, q)."""
        elastic, hardening = self.scene.material.elasticity, self.scene.material.hardening
        sigma_y = hardening.yield_stress(state.peeq)
        plastic = yield_function(state.stress, sigma_y) >= -ON_YIELD * sigma_y
        return continuum_tangent(state.stress, state.peeq, plastic, elastic, hardening), plastic

    def _unreturned(self, state: State, rotated: Floats, strain: Floats) -> Returned:
        """sigma_n + C^ep : de (4), with the plastic strain that (5) and (6) then leave."""
        C, plastic = self._rate(state)
        change = np.einsum("eqst,eqt->eqs", C, strain)
        e_p = strain - change @ self.scene.material.elasticity.compliance(MANDEL_2D)
        e_p = np.where(plastic[..., None], deviator(e_p), 0.0)
        length = np.linalg.norm(e_p, axis=-1)
        direction = np.divide(e_p, length[..., None], out=np.zeros_like(e_p), where=length[..., None] > 0)
        return Returned(rotated + change, e_p, equivalent_strain(e_p), direction, plastic)

    def scratch(self) -> Scratch:
        """Memory for :meth:`tangent`."""
        elements, unknowns = self.space.dofs.shape
        return Scratch.of(elements, len(self.space.reference.weights), unknowns)

    def tangent(self, response: Response, scratch: Scratch | None = None) -> Floats:
        """Element matrices (e, 2k, 2k) of d f_int / d dU, geometric part included: in ``midpoint`` unsymmetric.

        With ``scratch`` they are valid until it is used again.
        """
        kin, returned, elastic = response.kinematics, response.returned, self.scene.material.elasticity
        C = consistent_tangent(response.trial, returned, response.state.peeq, elastic, self.scene.material.hardening)
        if self.scene.configuration is Configuration.PAPER:
            return element_stiffness(kin.B, C, kin.volume)
        return element_tangent(kin, response.rotated, returned.stress, C, elastic.shear, scratch or self.scratch())

    def plastic_model(self, response: Response) -> PlasticModel:
        """Data of the dissipation program about the response: strain e_k + B (x - x_k), stress rotated as at k."""
        kin, state, hardening = response.kinematics, response.state, self.scene.material.hardening
        basis = deviatoric_basis(MANDEL_2D)
        points = state.peeq.size
        volumetric = self.space.operator((identity(MANDEL_2D) @ kin.B).reshape(points, 1, -1))
        deviatoric = self.space.operator((basis @ kin.B).reshape(points, len(basis), -1))
        strain = kin.strain.reshape(points, -1)
        peeq = (state.peeq + response.returned.dpeeq).ravel()
        slope = hardening.slope(peeq)
        rotated = response.rotated.reshape(points, -1)
        return PlasticModel(
            volumetric,
            deviatoric,
            trace(strain) - volumetric @ response.x,
            strain @ basis.T - (deviatoric @ response.x).reshape(points, -1),
            trace(rotated) / 3,
            rotated @ basis.T,
            kin.volume.ravel(),
            hardening.yield_stress(peeq) - slope * response.returned.dpeeq.ravel(),
            slope,
            self.scene.material.elasticity.bulk,
            self.scene.material.elasticity.shear,
        )

    def advance(self, start: State, response: Response, tau: float, forces: Floats, gap: Floats) -> State:
        """The state after accepting the response: (30), stress and internals as returned.

        ``start`` is the last accepted state; the response's own may have its flow carried on. Forces (c, d) and gaps
        (c,) are those of the candidates at the end.
        """
        plastic = self.turned(response, response.state.plastic_strain)
        before = self.turned(response, start.plastic_strain)
        returned = response.returned
        plastic = plastic + returned.plastic_strain
        peeq = response.state.peeq + returned.dpeeq
        flowed = np.where(returned.plastic[..., None], plastic - before, 0.0)
        flow = Flow(flowed, np.where(returned.plastic, peeq - start.peeq, 0.0))
        du = self.space.spread(response.x)
        return State(
            tau=tau,
            nodes=start.nodes + du,
            stress=returned.stress,
            plastic_strain=plastic,
            peeq=peeq,
            forces=forces,
            gap=gap,
            displacement=du,
            length=tau - start.tau,
            flow=flow,
        )
