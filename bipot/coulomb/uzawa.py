"""Uzawa's iteration on the bipotential: project the force moved against the shifted displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.coulomb.solver import ScaledProblem, SolverState
from bipot.errors import require_count, require_type
from bipot.laws import coulomb
from bipot.laws.projections import project_cone
from bipot.typing import Floats

_SHRINK, _GROW = 2.0 / 3.0, 1.5
_TOO_LONG, _SHORT = 0.9, 0.3
_SHORTEST = 1e-12


@dataclass(frozen=True, eq=False)
class UzawaState(SolverState):
    """Force and step length ρ."""

    r: Floats
    length: float


@dataclass(frozen=True)
class Uzawa:
    """r <- P_K(r - ρ û(r)), û = u + μ |u_t| n; with ``corrector``, û is taken again at the predicted force.

    The prediction is that of De Saxce and Feng; the second evaluation makes it the extragradient iteration.
    ρ shrinks until ρ |û(r') - û(r)| <= 0.9 |r' - r|, and grows again below 0.3. ``passes`` are done a step.
    Slow: linear, with a rate that the condition of W sets.
    """

    corrector: bool = True
    passes: int = 20
    name = "uzawa"

    def __post_init__(self) -> None:
        require_type(self.corrector, bool, "corrector")
        require_count(self.passes, "passes")

    def init(self, problem: ScaledProblem, r: Floats) -> UzawaState:
        """Unit step: the problem is scaled."""
        return UzawaState(r, 1.0)

    def step(self, problem: ScaledProblem, state: UzawaState) -> UzawaState:
        """``passes`` predictions, each with its step length."""
        r, length = state.r, state.length
        for _ in range(self.passes):
            r, length = self._pass(problem, r, length)
        return UzawaState(r, length)

    def _pass(self, problem: ScaledProblem, r: Floats, length: float) -> tuple[Floats, float]:
        shifted = _shifted(problem, r)
        while length > _SHORTEST:
            ahead = _projected(problem, r - length * shifted)
            change = float(np.linalg.norm(ahead - r))
            if change == 0.0:
                break
            shifted_ahead = _shifted(problem, ahead)
            ratio = length * float(np.linalg.norm(shifted_ahead - shifted)) / change
            if ratio <= _TOO_LONG:
                new = _projected(problem, r - length * shifted_ahead) if self.corrector else ahead
                return new, length * _GROW if ratio < _SHORT else length
            length *= _SHRINK
        return r, length


def _shifted(problem: ScaledProblem, r: Floats) -> Floats:
    return coulomb.de_saxce_shift(problem.by_contact(problem.velocity(r)), problem.mu).ravel()


def _projected(problem: ScaledProblem, r: Floats) -> Floats:
    return project_cone(problem.by_contact(r), problem.mu).ravel()
