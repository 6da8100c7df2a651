r"""The certificate of an increment from its response and contact forces: which fields, which scales, which round-off.

Round-off of the internal forces is that of their own assembly,

    eps sum_q w |N,j| (|sigma_n| + (K + 2 G) sum_a |N_a,j| moved),

summed at the node where it is largest, with ``moved`` the lengths of the increment, that of the largest displacement
and that of the tools within reach: what an unstressed body is measured by. That of a contact's motion is eps times
these lengths. Where an estimate from the largest stress and the mesh at rest, taken tenfold, is far below every bound,
it stands for the sum.
"""

from __future__ import annotations

import numpy as np

from bipot.certificate import EPS, Balance, Bounds, Certificate, ContactFields, MaterialFields, certify
from bipot.fem.kinematics import MANDEL_2D
from bipot.laws.tensors import norm
from bipot.programs.data import ContactRows
from bipot.response import Response
from bipot.system import System, acting, tool_forces, tool_travel
from bipot.typing import Floats

DEFAULT = Bounds()
FAINT = 0.1
"""Round-off below this fraction of a bound decides nothing about it."""


def certify_response(
    system: System,
    response: Response,
    rows: ContactRows,
    r: Floats,
    tau: float,
    largest: float,
    bounds: Bounds = DEFAULT,
) -> Certificate:
    """The certificate of a response to the increment to ``tau`` with contact forces r (c, d) on all candidates' rows.

    ``largest`` is the largest contact force of the run so far; round-off far below the ``bounds`` is only estimated.
    """
    body, state = system.body, response.state
    kin, returned, elastic = response.kinematics, response.returned, body.scene.material.elasticity
    sigma_e = response.trial - returned.plastic_strain @ elastic.stiffness(MANDEL_2D)
    points = (-1, MANDEL_2D)
    fields = MaterialFields(
        before=response.rotated.reshape(points),
        stress=returned.stress.reshape(points),
        plastic_strain=returned.plastic_strain.reshape(points),
        elastic_stress=sigma_e.reshape(points),
        peeq=(state.peeq + returned.dpeeq).ravel(),
        weight=kin.volume.ravel(),
        elasticity=elastic,
        hardening=body.scene.material.hardening,
    )
    travel = tool_travel(system, state.tau, tau)
    moved = float(norm(body.space.spread(response.x)).max() + norm(acting(system, state.gap, travel)).max())
    force = body.space.force_scale(response.element_forces)
    least = min(bounds.equilibrium, bounds.cone_violation, bounds.law, bounds.relative_gap)
    balance = Balance(
        residual=norm(body.space.spread(response.internal - rows.forces(r))),
        force=force,
        blur=_force_blur(system, response, moved, FAINT * least * force),
        size=body.scene.mesh.size,
        work=float(np.sum(tool_forces(system, r) * travel)),
    )
    return certify(_contact(system, response, rows, r, tau, moved, largest), fields, balance)


def _contact(
    system: System, response: Response, rows: ContactRows, r: Floats, tau: float, moved: float, largest: float
) -> ContactFields:
    """The contacts' fields."""
    motion = rows.motion(response.x)
    present = float(np.abs(r).max(initial=0.0))
    return ContactFields(
        r=r,
        motion=motion,
        mu=rows.mu,
        tied=rows.tied,
        stiffness=system.rigidity.contact,
        largest=max(largest, present),
        present=max(present, float(np.abs(response.state.forces).max(initial=0.0))),
        # A far candidate's gap is never small: what it is rounded to does not matter.
        blur=EPS * (np.minimum(np.abs(motion[:, 0]), moved) + moved),
        inside=system.candidates.driven_into(tau).depth,
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
