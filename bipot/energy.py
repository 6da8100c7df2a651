r"""Energy of a run: external work against elastic energy, plastic and frictional dissipation.

Work and friction by the trapezoidal rule over an increment, plastic dissipation as the hardening's own integral
int sigma_Y dp, so the balance closes with order two in the increment where the solution is smooth.
All energies are those of the modelled part; ``copies`` of it make the body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bipot.increment import Solved, System, tool_forces, tool_travel
from bipot.response import State

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Energies:
    """External work, elastic energy, plastic and frictional dissipation since the start (energy units)."""

    work: float = 0.0
    elastic: float = 0.0
    plastic: float = 0.0
    friction: float = 0.0

    def after(self, system: System, start: State, solved: Solved, tau: float) -> Energies:
        """Add one increment."""
        material, response = system.body.scene.material, solved.response
        weight, stress = response.kinematics.volume, response.returned.stress
        compliance = material.elasticity.compliance(stress.shape[-1])
        mean_force = (tool_forces(system, start.forces) + tool_forces(system, solved.r)) / 2
        mean_shear = (start.forces[:, 1:] + solved.r[:, 1:]) / 2
        slip = solved.rows.motion(response.x)[:, 1:]
        dissipated = weight * material.hardening.energy(
            start.peeq, response.state.peeq + response.returned.dpeeq - start.peeq
        )
        return Energies(
            self.work + float(np.sum(mean_force * tool_travel(system, start.tau, tau))),
            float(np.sum(weight * np.sum(stress * (stress @ compliance), axis=-1)) / 2),
            self.plastic + float(dissipated.sum()),
            self.friction - float(np.sum(mean_shear * slip)),
        )
