r"""An increment, an iterate of it, and the certificate of that: which fields, which scales, which round-off.

An :class:`Increment` is what all passes share, an :class:`Iterate` a trial end of it with what hangs on it, made when
first asked for. Forces on the unknowns are summed in one place: :attr:`Iterate.residual`.

Round-off of the internal forces is that of their own assembly,

    eps sum_q w |N,j| (|sigma_n| + (K + 2 G) sum_a |N_a,j| moved),

summed at the node where it is largest, with ``moved`` the lengths of the increment, that of the largest displacement
and that of the tools within reach: what an unstressed body is measured by. That of a contact's motion is eps times
these lengths. Where an estimate from the largest stress and the mesh at rest, taken tenfold, is far below every bound,
it stands for the sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from bipot.certificate import EPS, Balance, Bounds, Certificate, ContactFields, MaterialFields, certify
from bipot.contact import LEAST_MOTION
from bipot.fem.strain import Scratch
from bipot.programs.data import ContactRows, Units
from bipot.response import Response, State, TangentKind
from bipot.system import System
from bipot.tensors import norm
from bipot.typing import Floats

DEFAULT = Bounds()

FAINT = 0.1
"""Round-off below this fraction of a bound decides nothing about it."""


@dataclass(frozen=True)
class Increment:
    """The increment of a system from the state ``start`` to pseudo-time ``tau``: what all its passes share."""

    system: System
    start: State
    tau: float

    @cached_property
    def rows(self) -> ContactRows:
        """The contact rows of all candidates."""
        return self.system.candidates.rows(self.start.gap, self.start.tau, self.tau)

    @cached_property
    def driven(self) -> Floats:
        """What is prescribed of the displacement (a, d), zero elsewhere."""
        scene = self.system.body.scene
        return scene.driven(self.tau) - scene.driven(self.start.tau)

    @cached_property
    def dragged(self) -> Floats:
        """Known slips (c,) of candidates that supports hold or drive along the tangent, zero where that is free.

        No unknown knows of the friction there, which goes from tool to support.
        """
        return self.system.candidates.dragged(self.start.tau, self.tau)

    def rubbed(self, r: Floats) -> Floats:
        """Contact forces r (c, d) with the friction -mu r_n sign(slip) where the slip is known: of tool and support."""
        mu = np.where(np.isfinite(self.rows.mu), self.rows.mu, 0.0)
        out = r.copy()
        out[:, 1] -= mu * r[:, 0] * np.sign(self.dragged)
        return out

    @cached_property
    def torn(self) -> int | None:
        """A node that a support drives off or along a tool it is welded to."""
        return self.system.candidates.torn(self.start.gap, self.start.nodes, self.start.tau, self.tau)

    @cached_property
    def load_before(self) -> Floats:
        """Nodal loads (a, d) at the start."""
        return self.system.loading.forces(self.system.body.scene.origin(self.start.nodes), self.start.tau)

    @cached_property
    def load_ahead(self) -> Floats:
        """Nodal loads (a, d) of the end where the body is at the start."""
        return self.system.loading.forces(self.system.body.scene.origin(self.start.nodes), self.tau)

    @cached_property
    def travel(self) -> Floats:
        """Displacement (tools, d) of each tool."""
        return self.system.candidates.travel(self.start.tau, self.tau)

    @cached_property
    def reach(self) -> float:
        """The longest travel of a tool that may matter to the body."""
        return self.system.candidates.reach(self.rows.gap, self.start.tau, self.tau)

    @cached_property
    def inside(self) -> float:
        """Depth in a tool of nodes that are held, hence no contacts."""
        return self.system.candidates.driven_into(self.tau).depth

    @cached_property
    def units(self) -> Units:
        """Displacements in what may be expected, stresses in what can be reached of the yield stress, volume of a cube.

        Expected is the travel of tools, or what is prescribed; where there is none the motion of the last increment,
        what would release the stress, what the new loads do to their own nodes, or a small part of the body's size.
        """
        state, scene = self.start, self.system.body.scene
        young, size, stress = scene.material.elasticity.young, scene.mesh.size, float(norm(self.start.stress).max())
        moved = float(norm(state.du).max())
        length = max(self.reach, float(norm(self.driven).max())) or moved
        if not length:
            space = self.system.body.space
            new = norm(space.spread((self.load_ahead - self.load_before).ravel()[space.free]))
            yielding = float((new / self.system.rigidity.nodal).max())
            length = max(size * stress / young, yielding, LEAST_MOTION * size)
        reached = max(young * length / size, stress)
        return Units(length, size, min(float(scene.material.yield_stress(0.0)), reached), size**3)

    def at(self, x: Floats) -> Iterate:
        """The iterate of the free displacements x (n,).

        Raises:
            InvertedElement: the trial configuration is not admissible.
        """
        return Iterate(self, self.system.body.respond(self.start, x, self.driven))


@dataclass(frozen=True)
class Iterate:
    """A trial end of the ``increment``: the body's response to a displacement, and what hangs on it."""

    increment: Increment
    response: Response

    @property
    def x(self) -> Floats:
        """The free displacements (n,)."""
        return self.response.x

    @property
    def rows(self) -> ContactRows:
        """Contact rows of all candidates; those of flat tools are the same at every iterate."""
        return self.increment.rows

    @cached_property
    def motion(self) -> Floats:
        """Gap at the end and slip (c, d) of all candidates."""
        return self.rows.motion(self.x)

    @cached_property
    def balanced(self) -> Floats:
        """The configuration (a, d) in which equilibrium is asked."""
        increment = self.increment
        return increment.system.body.scene.balanced(increment.start.nodes, self.response.du)

    @cached_property
    def nodal_load(self) -> Floats:
        """The loads at the nodes (a, d)."""
        return self.increment.system.loading.forces(self.balanced, self.increment.tau)

    @property
    def load(self) -> Floats:
        """The loads on the free unknowns (n,)."""
        return self.nodal_load.ravel()[self.increment.system.body.space.free]

    @cached_property
    def residual(self) -> Floats:
        """Internal forces less the load (n,): what the contacts have to balance."""
        internal = self.response.internal
        return internal - self.load if self.increment.system.loading.loads else internal

    def stiffness(self, kind: TangentKind) -> sp.csc_matrix:
        """K of the convex model."""
        return self.increment.system.body.stiffness(self.response, kind)

    def tangent(self, scratch: Scratch | None = None) -> Floats:
        """Element matrices (e, dk, dk) of the exact derivative of :attr:`residual`."""
        increment = self.increment
        K = increment.system.body.tangent(self.response, scratch)
        if self.response.kinematics.moves:
            increment.system.loading.add_stiffness(K, self.balanced, increment.tau)
        return K

    def tool_forces(self, r: Floats) -> Floats:
        """Force (tools, d) of each tool on the modelled body under contact forces r (c, d)."""
        return self.increment.system.candidates.resultant(self.increment.rubbed(r))

    def reactions(self, r: Floats) -> Floats:
        """Forces (a, d) of the supports on the modelled body under contact forces r (c, d); zero where none holds."""
        system = self.increment.system
        return system.reactions(self.response.element_forces, self.nodal_load, self.increment.rubbed(r))

    def work(self, r: Floats) -> float:
        """Work of tools, loads and supports, by their forces at the end, r (c, d) those of contact."""
        increment = self.increment
        tools = np.vdot(self.tool_forces(r), increment.travel)
        driven = np.vdot(self.reactions(r), increment.driven) if increment.driven.any() else 0.0
        loads = np.vdot(self.nodal_load, self.response.du) if increment.system.loading.loads else 0.0
        return float(tools + loads + driven)

    def examined(self, r: Floats, largest: float, bounds: Bounds = DEFAULT) -> Examined:
        """The same with contact forces r (c, d), to be certified; ``largest`` is the largest of the run so far."""
        return Examined(self, r, largest, bounds)

    def certificate(self, r: Floats, largest: float, bounds: Bounds = DEFAULT) -> Certificate:
        """Every measure, with contact forces r (c, d)."""
        return self.examined(r, largest, bounds).certificate


@dataclass(frozen=True)
class Examined:
    """An iterate with contact forces r (c, d) on all candidates' rows, to be certified.

    ``largest`` is the largest contact force of the run so far; round-off far below the ``bounds`` is only estimated.
    Equilibrium comes first and costs little; the rest is asked where that is met.
    """

    iterate: Iterate
    r: Floats
    largest: float
    bounds: Bounds = DEFAULT

    @property
    def increment(self) -> Increment:
        """The increment that is examined."""
        return self.iterate.increment

    @property
    def response(self) -> Response:
        """The body's response."""
        return self.iterate.response

    @cached_property
    def certificate(self) -> Certificate:
        """Every measure."""
        size = self.increment.system.body.scene.mesh.size
        return certify(self._contact(), self._material(), self.balance, size, self.iterate.work(self.r))

    def ratios(self) -> dict[str, float]:
        """Each measure over its bound or resolution; that of equilibrium alone where it is above one."""
        ratio = self.balance.equilibrium / max(self.bounds.equilibrium, self.balance.resolution)
        return self.certificate.ratios(self.bounds) if ratio <= 1 else {"equilibrium": ratio}

    @cached_property
    def balance(self) -> Balance:
        """Nodal residuals and what they are measured by."""
        space, bounds = self.increment.system.body.space, self.bounds
        loads = np.zeros((1, 1))
        if self.increment.system.loading.loads:
            # What acts on held unknowns goes into the supports: it measures nothing.
            loads = space.spread(self.iterate.load)
        force = space.force_scale(self.response.element_forces, loads)
        least = min(bounds.equilibrium, bounds.cone_violation, bounds.law, bounds.relative_gap)
        return Balance(
            residual=norm(space.spread(self.iterate.residual - self.iterate.rows.forces(self.r))),
            force=force,
            blur=_force_blur(self.increment.system, self.response, self._moved, FAINT * least * force)
            + EPS * float(np.abs(loads).max()),
        )

    @cached_property
    def _moved(self) -> float:
        """Lengths of the increment (module docstring)."""
        return float(norm(self.response.du).max()) + self.increment.reach

    def _material(self) -> MaterialFields:
        response, material = self.response, self.increment.system.body.scene.material
        kin, returned = response.kinematics, response.returned
        sigma_e = returned.trial - returned.plastic_strain @ material.elasticity.stiffness(kin.reduction.mandel)
        points = (-1, kin.reduction.mandel)
        return MaterialFields(
            before=response.rotated.reshape(points),
            stress=returned.stress.reshape(points),
            plastic_strain=returned.plastic_strain.reshape(points),
            elastic_stress=sigma_e.reshape(points),
            peeq=(response.state.peeq + returned.dpeeq).ravel(),
            weight=kin.volume.ravel(),
            material=material,
        )

    def _contact(self) -> ContactFields:
        rows, r, moved, motion = self.iterate.rows, self.r, self._moved, self.iterate.motion
        present = float(np.abs(r).max(initial=0.0))
        return ContactFields(
            r=r,
            motion=motion,
            mu=rows.mu,
            tied=rows.tied,
            stiffness=self.increment.system.rigidity.contact,
            largest=max(self.largest, present),
            present=max(present, float(np.abs(self.response.state.forces).max(initial=0.0))),
            # A far candidate's gap is never small: what it is rounded to does not matter.
            blur=EPS * (np.minimum(np.abs(motion[:, 0]), moved) + moved),
            inside=self.increment.inside,
        )


def _force_blur(system: System, response: Response, moved: float, faint: float) -> float:
    """Round-off of the internal forces at the node where it is largest, or an estimate below ``faint``."""
    estimate = system.round_off(response.rotated, moved)
    if estimate <= faint:
        return estimate
    elastic, kin = system.body.scene.material.elasticity, response.kinematics
    gradient = np.abs(kin.shape).sum(axis=2)
    stress = norm(response.rotated) + (elastic.bulk + 2 * elastic.shear) * moved * gradient.sum(axis=2)
    forces = ((stress * kin.volume)[:, None, :] @ gradient)[:, 0]
    return EPS * float(np.bincount(system.body.scene.mesh.elements.ravel(), forces.ravel()).max())
