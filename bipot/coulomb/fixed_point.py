"""Coulomb's law as a sequence of convex programs: Tresca's threshold, or De Saxce's shift."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from scipy import sparse

from bipot.coulomb.acceleration import Acceleration, Anderson, Past
from bipot.coulomb.conic import ConicSettings, ForceProgram, force_program, polished_force
from bipot.coulomb.functions import ConeMap, ContactFunction, TrescaMap
from bipot.coulomb.solver import ScaledProblem, SolverState
from bipot.errors import require_type
from bipot.tensors import norm
from bipot.typing import Floats


@dataclass(frozen=True, eq=False)
class FixedPointState(SolverState):
    """The last program's answer r, the point x the next program is made at, and the acceleration's memory."""

    r: Floats
    point: Floats
    memory: Past
    program: ForceProgram
    antisymmetric: sparse.csr_array


@dataclass(frozen=True)
class _FixedPoint:
    """What both sequences share: ``acceleration`` acts on r, ``settings`` are those of the programs."""

    acceleration: Acceleration = field(default_factory=Anderson)
    settings: ConicSettings = field(default_factory=ConicSettings)
    label: ClassVar[str]
    discs: ClassVar[bool]
    """Whether the programs' cones are discs of given radii, or those of friction."""

    def __post_init__(self) -> None:
        require_type(self.acceleration, Acceleration, "acceleration")
        require_type(self.settings, ConicSettings, "settings")

    @property
    def name(self) -> str:
        """Label: tresca-Damped, tresca-Anderson, de-saxce-Damped, de-saxce-Anderson."""
        return f"{self.label}-{type(self.acceleration).__name__}"

    def init(self, problem: ScaledProblem, r: Floats) -> FixedPointState:
        """Set up the program."""
        program = force_program(problem, np.zeros_like(problem.mu) if self.discs else problem.mu, self.settings)
        return FixedPointState(r, r, Past(), program, problem.antisymmetric_part())

    def _pass(
        self,
        problem: ScaledProblem,
        state: FixedPointState,
        law: ContactFunction,
        shift: Floats,
        radius: Floats,
    ) -> FixedPointState:
        """Program and polish at the point x, then the acceleration; (W - Wᵀ)/2 x - ε x + shift is a load on it."""
        carried = state.antisymmetric @ state.point
        r = state.program.solve(problem.q + carried + shift, radius, state.point)
        # the polish takes the whole W: at the fixed point nothing is left to carry
        r = polished_force(problem, law, r, problem.q + shift)
        memory, point = self.acceleration.advance(state.memory, state.point, r)
        return replace(state, r=r, point=point, memory=memory)


@dataclass(frozen=True)
class TrescaFixedPoint(_FixedPoint):
    """r <- argmin ½ r·W r + q·r over r_n >= 0, |r_t| <= s, with the threshold s = mu r_n of the last point.

    Needs no dual-cone velocity to exist, but can cycle undamped.
    """

    label: ClassVar[str] = "tresca"
    discs: ClassVar[bool] = True

    def step(self, problem: ScaledProblem, state: FixedPointState) -> FixedPointState:
        """One program and one acceleration step."""
        threshold = problem.mu * np.maximum(problem.by_contact(state.point)[:, 0], 0.0)
        return self._pass(problem, state, TrescaMap(threshold), np.zeros(problem.size), threshold)


@dataclass(frozen=True)
class DeSaxceFixedPoint(_FixedPoint):
    """r <- argmin ½ r·W r + (q + s n)·r over r in K_mu, with the shift s = mu |u_t| of the last point.

    Each program is that of Acary, Cadoux, Lemaréchal and Malick, unbounded where no velocity is in the dual cone.
    """

    label: ClassVar[str] = "de-saxce"
    discs: ClassVar[bool] = False

    def step(self, problem: ScaledProblem, state: FixedPointState) -> FixedPointState:
        """One program and one acceleration step."""
        u = problem.by_contact(problem.velocity(state.point))
        shift = np.zeros(u.shape)
        shift[:, 0] = problem.mu * norm(u[:, 1:])
        return self._pass(problem, state, ConeMap(), shift.ravel(), np.zeros_like(problem.mu))
