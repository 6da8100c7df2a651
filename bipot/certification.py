r"""The certificate of an increment from its response and contact forces: which fields, which scales, which round-off.

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

from bipot.certificate import EPS, Balance, Bounds, Certificate, ContactFields, MaterialFields, certify
from bipot.fem.kinematics import MANDEL_2D
from bipot.laws.tensors import norm
from bipot.response import Response
from bipot.system import Increment, System
from bipot.typing import Floats

DEFAULT = Bounds()
FAINT = 0.1
"""Round-off below this fraction of a bound decides nothing about it."""


@dataclass(frozen=True)
class Examined:
    """A response to the ``increment`` with contact forces r (c, d) on all candidates' rows, to be certified.

    ``largest`` is the largest contact force of the run so far; round-off far below the ``bounds`` is only estimated.
    Equilibrium comes first and costs little; the rest is asked where that is met.
    """

    increment: Increment
    response: Response
    r: Floats
    largest: float
    bounds: Bounds = DEFAULT

    @cached_property
    def certificate(self) -> Certificate:
        """Every measure."""
        size = self.increment.system.body.scene.mesh.size
        work = float(np.vdot(self.increment.system.candidates.resultant(self.r), self.increment.travel))
        return certify(self._contact(), self._material(), self.balance, size, work)

    def ratios(self) -> dict[str, float]:
        """Each measure over its bound or resolution; that of equilibrium alone where it is above one."""
        ratio = self.balance.equilibrium / max(self.bounds.equilibrium, self.balance.resolution)
        return self.certificate.ratios(self.bounds) if ratio <= 1 else {"equilibrium": ratio}

    @cached_property
    def balance(self) -> Balance:
        """Nodal residuals and what they are measured by."""
        space, bounds = self.increment.system.body.space, self.bounds
        force = space.force_scale(self.response.element_forces)
        least = min(bounds.equilibrium, bounds.cone_violation, bounds.law, bounds.relative_gap)
        return Balance(
            residual=norm(space.spread(self.response.internal - self.increment.rows.forces(self.r))),
            force=force,
            blur=_force_blur(self.increment.system, self.response, self._moved, FAINT * least * force),
        )

    @cached_property
    def _moved(self) -> float:
        """Lengths of the increment (module docstring)."""
        moved = norm(self.increment.system.body.space.spread(self.response.x))
        return float(moved.max()) + self.increment.reach

    def _material(self) -> MaterialFields:
        response, material = self.response, self.increment.system.body.scene.material
        kin, returned = response.kinematics, response.returned
        sigma_e = returned.trial - returned.plastic_strain @ material.elasticity.stiffness(MANDEL_2D)
        points = (-1, MANDEL_2D)
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
        rows, r, moved = self.increment.rows, self.r, self._moved
        motion = rows.motion(self.response.x)
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
    elastic, space, rest = system.body.scene.material.elasticity, system.body.space, system.rigidity
    kin, stiffness = response.kinematics, elastic.bulk + 2 * elastic.shear
    largest = float(np.abs(response.rotated).max()) + stiffness * moved * rest.gradient
    estimate = 10 * EPS * rest.lever * largest
    if estimate <= faint:
        return estimate
    gradient = np.abs(kin.shape).sum(axis=2)
    stress = norm(response.rotated) + stiffness * moved * gradient.sum(axis=2)
    forces = ((stress * kin.volume)[:, None, :] @ gradient)[:, 0]
    return EPS * float(np.bincount(space.mesh.elements.ravel(), forces.ravel()).max())
