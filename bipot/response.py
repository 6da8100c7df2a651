r"""The body's response to a trial increment: kinematics, stress, internal force, tangent. It joins fem and laws.

    f_int = sum_q w B' sigma,    sigma the material's stress after R sigma_n R' and de,

with de, R, B, w of the scene's configuration (:mod:`bipot.fem.kinematics`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.certificate import MaterialFields
from bipot.contact.coupling import pairs_of
from bipot.errors import FoldedAnswer, InvertedElement
from bipot.fem.assembly import Space, element_force, element_stiffness, space
from bipot.fem.kinematics import Kinematics
from bipot.fem.orientation import refuse_folded
from bipot.fem.projection import Projection
from bipot.fem.strain import Scratch, Stresses
from bipot.laws.flow import Flow
from bipot.laws.von_mises import Returned, TangentKind
from bipot.programs.dissipation import PlasticModel
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.tensors import deviatoric_basis, deviatoric_projector, identity, trace
from bipot.typing import Floats, einsum, max_abs, times

STILL = 1e-9
"""A motion below this fraction of the body's size is what is left of balance, in a body that nothing touches."""


def body_space(scene: Scene) -> Space:
    """The scene's unknowns: displacements, and coordinates of tools driven by forces or moments."""
    holding, pairs = scene.holding, pairs_of(scene).unknowns
    return space(scene.mesh, scene.geometry, scene.rule, holding.numbers, len(scene.drives), pairs, holding.axes)


@dataclass(frozen=True)
class Response:
    """The body's response to the trial displacement ``du`` (a, d) from ``state``, given by the unknowns x (n,).

    ``rotated`` (e, q, s) is R sigma_n R', ``element_forces`` (e, dk) and ``internal`` (n,) the internal forces of the
    returned stress.
    """

    state: State
    x: Floats
    du: Floats
    kinematics: Kinematics
    rotated: Floats
    returned: Returned
    element_forces: Floats
    internal: Floats

    @property
    def peeq(self) -> Floats:
        """Equivalent plastic strain (e, q) at the end."""
        return self.state.peeq + self.returned.dpeeq


@dataclass(frozen=True)
class Rigidity:
    """Scales of a body at rest, by which forces and motions are compared.

    ``nodal`` (a,) is the elastic stiffness of nodes, their largest diagonal entry; ``lever`` is the largest nodal sum
    of w sum_j |N,j| and ``gradient`` the largest sum of |N,j| at a point.
    """

    nodal: Floats
    lever: float
    gradient: float


@dataclass(frozen=True)
class Body:
    """A scene with its space of unknowns: computes responses and their linear or convex models."""

    scene: Scene
    space: Space

    @cached_property
    def parts(self) -> Floats:
        """What part (e, q) of the body's volume at rest is that of a point."""
        volume = self.space.gradients(self.scene.mesh.nodes).volume
        return volume / float(volume.sum())

    @cached_property
    def yield_stress(self) -> Floats:
        """sigma_Y (e, q) of the body at rest; inf where it does not flow."""
        return self.scene.materials.yield_stress(np.zeros_like(self.parts))

    @cached_property
    def rigidity(self) -> Rigidity:
        """See :class:`Rigidity`."""
        mesh, placed = self.scene.mesh, self.space.gradients(self.scene.mesh.nodes)
        B, C = placed.B, self.scene.materials.elasticity.stiffness(placed.reduction.mandel)
        slopes = np.abs(placed.shape).sum(axis=2)
        levers = einsum("eq,eqa->ea", placed.volume, slopes)
        return Rigidity(
            nodal=self.space.nodal(einsum("eq,eqsi,eqsi->ei", placed.volume, C @ B, B)).max(axis=1),
            lever=float(np.bincount(mesh.elements.ravel(), levers.ravel()).max()),
            gradient=float(slopes.sum(axis=2).max()),
        )

    @cached_property
    def projection(self) -> Projection | None:
        """The projection of the elements' volume change, None if there is none."""
        mesh = self.scene.mesh
        return Projection.of(self.scene.volume_change, mesh.nodes, mesh.elements, self.space.reference)

    def carried_on(self, state: State, flow: Flow) -> State:
        """The start of an increment of BDF2: ``state`` after ``flow`` at fixed strain (:mod:`bipot.laws.flow`)."""
        shear = np.asarray(self.scene.materials.elasticity.shear)[..., None]
        stress = state.stress - 2 * shear * flow.strain
        plastic_strain = state.plastic_strain + flow.strain
        return replace(state, stress=stress, plastic_strain=plastic_strain, peeq=state.peeq + flow.peeq)

    def respond(self, state: State, x: Floats, driven: Floats | float = 0.0) -> Response:
        """Response to the unknowns x (n,) and to the prescribed displacements ``driven`` (a, d).

        Raises:
            InvertedElement: the trial configuration is not admissible.
        """
        mesh, space_ = self.scene.mesh, self.space
        measure, geometry = self.scene.configuration.measure, self.scene.geometry
        du, origin = space_.spread(x) + driven, self.scene.origin(state.nodes)
        kin = measure.increment(origin, du, mesh.elements, space_.reference, geometry, self.projection)
        rotated = kin.turned(state.stress)
        returned = self.scene.materials.update(rotated, kin.strain, state.peeq)
        forces = element_force(kin, returned.stress)
        return Response(state, x, du, kin, rotated, returned, forces, space_.vector(forces))

    def refuse_folded(self, response: Response) -> None:
        """Refuse elements that are folded anywhere, at the end or where strain or equilibrium is posed."""
        start, du = response.state.nodes, response.du
        placements = self.scene.configuration.measure.placements(start, du)
        try:
            refuse_folded(placements, self.scene.mesh.elements, self.scene.geometry, straight=True)
        except InvertedElement as folded:
            raise FoldedAnswer(str(folded)) from None

    def stiffness(self, response: Response, kind: TangentKind) -> sp.csc_matrix:
        """K of (25) at the response, without geometric part: symmetric and positive semidefinite."""
        return self.space.matrix(element_stiffness(response.kinematics, self._moduli(response, kind)))

    def _moduli(self, response: Response, kind: TangentKind) -> Floats:
        """C (e, q, s, s) or (s, s) at the response."""
        return self.scene.materials.tangent(response.rotated, response.returned, response.state.peeq, kind)

    def softened(self, response: Response, shear: Floats) -> tuple[Floats, Floats]:
        """Internal forces (n,) and element matrices (e, dk, dk) of an elastic body with moduli of ``shear`` (e, 1)."""
        kin, bulk = response.kinematics, self.scene.materials.elasticity.bulk
        mandel = kin.reduction.mandel
        volumetric = np.multiply.outer(np.broadcast_to(bulk, shear.shape), np.outer(identity(mandel), identity(mandel)))
        C = volumetric + np.multiply.outer(2 * shear, deviatoric_projector(mandel))
        forces = element_force(kin, times(C, kin.strain))
        return self.space.vector(forces), element_stiffness(kin, C)

    def scratch(self) -> Scratch:
        """Memory for :meth:`tangent`."""
        elements, unknowns = self.space.dofs.shape
        reduction, projected = self.scene.geometry.reduction, self.projection is not None
        return Scratch.of(elements, len(self.space.reference.weights), unknowns, reduction, projected)

    def tangent(self, response: Response, scratch: Scratch | None = None) -> Floats:
        """Element matrices (e, dk, dk) of d f_int / d dU, geometric part included; unsymmetric in ``midpoint``.

        They are stored in ``scratch`` if given, and valid until it is used again.
        """
        scene, elastic = self.scene, self.scene.materials.elasticity
        stresses = Stresses(
            rotated=response.rotated,
            returned=response.returned.stress,
            moduli=self._moduli(response, TangentKind.CONSISTENT),
            shear=np.asarray(elastic.shear)[..., None],
            bulk=np.asarray(elastic.bulk)[..., None],
        )
        return scene.configuration.measure.tangent(response.kinematics, stresses, scratch or self.scratch())

    def plastic_model(self, response: Response) -> PlasticModel:
        """Data of the dissipation program about the response: strain e_k + B (x - x_k), stress rotated as at k."""
        kin, state, material = response.kinematics, response.state, self.scene.materials
        mandel, points, elastic = kin.reduction.mandel, state.peeq.size, material.elasticity
        basis = deviatoric_basis(mandel)
        volumetric = self.space.operator((identity(mandel) @ kin.B).reshape(points, 1, -1))
        deviatoric = self.space.operator((basis @ kin.B).reshape(points, len(basis), -1))
        strain = kin.strain.reshape(points, -1)
        peeq = response.peeq.ravel()
        slope = material.slope(peeq)
        rotated = response.rotated.reshape(points, -1)
        return PlasticModel(
            volumetric,
            deviatoric,
            trace(strain) - volumetric @ response.x,
            strain @ basis.T - (deviatoric @ response.x).reshape(points, -1),
            trace(rotated) / 3,
            rotated @ basis.T,
            kin.volume.ravel(),
            material.yield_stress(peeq) - slope * response.returned.dpeeq.ravel(),
            slope,
            *(np.broadcast_to(of, state.peeq.shape).ravel() for of in (elastic.bulk, elastic.shear)),
        )

    def fields(self, response: Response) -> MaterialFields:
        """The material's fields at the response that the certificate needs."""
        kin, returned, material = response.kinematics, response.returned, self.scene.materials
        sigma_e = returned.trial - material.elasticity.stress(returned.plastic_strain)
        points = (-1, kin.reduction.mandel)
        return MaterialFields(
            before=response.rotated.reshape(points),
            stress=returned.stress.reshape(points),
            plastic_strain=returned.plastic_strain.reshape(points),
            elastic_stress=sigma_e.reshape(points),
            peeq=response.peeq.ravel(),
            weight=kin.volume.ravel(),
            material=material,
        )

    def advance(self, start: State, response: Response, tau: float, forces: Floats, gap: Floats) -> State:
        """The state after accepting the response: nodes by (30), stress and plastic strain as returned.

        ``start`` is the last accepted state; that of the response may have flow carried on. Forces (c, d) and gaps
        (c,) are those of the candidates at the end.
        """
        kin, returned = response.kinematics, response.returned
        plastic = kin.turned(response.state.plastic_strain) + returned.plastic_strain
        before = kin.turned(start.plastic_strain)
        flowed = np.where(returned.plastic[..., None], plastic - before, 0.0)
        flow = Flow(flowed, np.where(returned.plastic, response.peeq - start.peeq, 0.0))
        du, translated = response.du, self.space.beside(response.x)
        # While tools go through the air, a body rests: what follows is as if it had rested before.
        moved = max_abs(du) > STILL * self.scene.mesh.size or bool(translated.any())
        rests = not (moved or start.forces.any() or forces.any())
        return State(
            tau=tau,
            nodes=start.nodes + du,
            stress=returned.stress,
            plastic_strain=plastic,
            peeq=response.peeq,
            forces=forces,
            gap=gap,
            du=du,
            translation=start.translation + translated,
            translated=translated,
            length=0.0 if rests else tau - start.tau,
            flow=flow,
        )
