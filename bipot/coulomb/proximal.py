"""Proximal points: a sequence of regular problems, each solved by semismooth Newton."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from bipot.coulomb.functions import AlartCurnier, ContactFunction
from bipot.coulomb.newton import LineSearch, linearise, merit, newton_direction
from bipot.coulomb.solver import ScaledProblem, SolverState
from bipot.errors import require, require_count, require_type
from bipot.typing import Floats, make_floats

_LIGHTEST, _HEAVIEST = 1e-13, 1e3
# Newton passes that are a quick success, the most without success, and those after which |F| has to be halved by the
# last few.
_QUICK, _INNER, _PATIENCE, _FEW = 4, 25, 12, 8
_TIGHTEN = 4.0
_SEARCH = LineSearch()


@dataclass(frozen=True, eq=False)
class ProximalState(SolverState):
    """Iterate r of the inner problem around ``centre``, ``merits`` of its Newton steps, ``outer`` = |F| at the centre.

    ``caution`` counts the centres for which the weight still falls cautiously.
    """

    r: Floats
    centre: Floats
    weight: float
    merits: tuple[float, ...]
    outer: float
    caution: int = 0
    stalled: str | None = None


@dataclass(frozen=True)
class ProximalPoint:
    """r_{k+1} solves u = W r + q + α_k (r - r_k) under Coulomb's law, by Newton; α falls as the steps
    succeed.

    W + α I is regular whatever the rank of W, and for large α the problem has one solution, near r_k. Each step is one
    Newton pass; the centre moves when the inner |F| <= ``accuracy`` min(|F at the centre|, 1). Quick success divides α
    by ``relax``; 25 passes without success, or no progress, return to the centre and multiply α by four. For ``memory``
    centres after that, success divides α by no more than ``cautious``: most of the time would otherwise be spent on the
    same failure again.
    """

    function: ContactFunction = field(default_factory=AlartCurnier)
    weight: float = 1.0
    accuracy: float = 0.3
    relax: float = 10.0
    cautious: float = 2.0
    memory: int = 4

    def __post_init__(self) -> None:
        require_type(self.function, ContactFunction, "function")
        require_count(self.memory, "memory", 0)
        make_floats(self, "cautious", weight="finite and > 0", accuracy="in (0, 1)", relax="finite and > 1")
        require(1 < self.cautious <= self.relax, "cautious", self.cautious, "in (1, relax]")

    @property
    def name(self) -> str:
        """Label: proximal-AlartCurnier, proximal-NaturalMap."""
        return f"proximal-{type(self.function).__name__}"

    def _centred(self, problem: ScaledProblem, r: Floats, weight: float, caution: int) -> ProximalState:
        outer = merit(problem, self.function, r, problem.velocity(r))
        return ProximalState(r, r, weight, (outer,), outer, caution)

    def init(self, problem: ScaledProblem, r: Floats) -> ProximalState:
        """Centre at the start."""
        return self._centred(problem, r, self.weight, 0)

    def step(self, problem: ScaledProblem, state: ProximalState) -> ProximalState:
        """One Newton pass on the inner problem, then the decision to continue, move the centre or return to it."""
        weight, centre = state.weight, state.centre

        def velocity(r: Floats) -> Floats:
            return problem.velocity(r) + weight * (r - centre)

        rows = linearise(problem, self.function, state.r, velocity(state.r))
        direction = newton_direction(problem, rows, weight)
        r, value = _SEARCH(lambda x: merit(problem, self.function, x, velocity(x)), state.r, direction, state.merits)
        state = replace(state, r=r, merits=(*state.merits, value))
        if value <= self.accuracy * min(state.outer, 1.0) + 1e-15:
            return self._accepted(problem, state)
        passes, merits = len(state.merits) - 1, state.merits
        if passes < _INNER and not (passes > _PATIENCE and merits[-1] > 0.5 * merits[-1 - _FEW]):
            return state
        if state.weight >= _HEAVIEST:
            return replace(state, stalled="the inner Newton fails however heavy the proximal term")
        return self._centred(problem, centre, weight * _TIGHTEN, self.memory)

    def _accepted(self, problem: ScaledProblem, state: ProximalState) -> ProximalState:
        passes = len(state.merits) - 1
        quick = self.cautious if state.caution else self.relax
        factor = quick if passes <= _QUICK else quick**0.5 if passes <= 2 * _QUICK else 1.0
        return self._centred(problem, state.r, max(state.weight / factor, _LIGHTEST), max(state.caution - 1, 0))
