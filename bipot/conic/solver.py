"""The interface of a conic solver: one program in, one measured solution out, and data that the next one reuses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from bipot.conic.problem import ConicProgram, ConicSolution
from bipot.errors import InfeasibleProgram, ProgramError, UnboundedProgram, require, require_count
from bipot.typing import make_floats

Handle = Any
"""Data that a solver keeps of its last program and receives with the next; known to the solver only."""


@dataclass(frozen=True)
class Accuracy:
    """Tolerance on gap and feasibility, in the units of the program, and iteration limit."""

    tolerance: float = 1e-10
    iterations: int = 100

    def __post_init__(self) -> None:
        make_floats(self, "tolerance")
        require(0 < self.tolerance < 1e-2, "tolerance", self.tolerance, "in (0, 0.01)")
        require_count(self.iterations, "iterations")


@runtime_checkable
class ConicSolver(Protocol):
    """Solves one program after another. Its claim is recorded; the solution measures itself."""

    def solve(self, program: ConicProgram, accuracy: Accuracy, last: Handle = None) -> tuple[ConicSolution, Handle]:
        """The solution, and the handle to pass as ``last`` with the next program.

        Raises:
            InfeasibleProgram, UnboundedProgram: the solver claims it; a certificate that it returns is checked
                (:mod:`bipot.conic.proofs`).
            ProgramError: no answer within the limits.
        """
        ...


def infeasible() -> InfeasibleProgram:
    """The error of constraints that exclude each other."""
    return InfeasibleProgram("no displacement satisfies the contact and support constraints together")


def unbounded(ray: Any = None) -> UnboundedProgram:
    """The error of a cost without lower bound along ``ray``."""
    return UnboundedProgram("its program has no minimum: a mechanism gains more than it dissipates", ray)


def unsolved(status: object) -> ProgramError:
    """The error of a solver that stopped with any other ``status``."""
    return ProgramError(f"conic solver stopped with {status}: refine the increment or loosen the tolerance")
