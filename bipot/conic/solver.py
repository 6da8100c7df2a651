"""The interface of a conic solver: one program in, one measured solution out, and data that the next one reuses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np

from bipot.conic.problem import Claim, ConicProgram, ConicSolution, Timing
from bipot.errors import (
    BipotError,
    BrokenSolver,
    InfeasibleProgram,
    NotConverged,
    ProgramError,
    StalledProgram,
    UnboundedProgram,
    require,
    require_count,
    require_type,
)
from bipot.typing import make_floats

LESS = 1e-8
"""Tolerance asked of a solver that stalls on the way to a finer one: the last iterations of interior points may lose
what the ones before had found."""

Handle = Any
"""Data that a solver keeps of its last program and receives with the next; known to the solver only."""


@dataclass(frozen=True)
class Accuracy:
    """Tolerance on gap and feasibility, in the units of the program, and iteration limit."""

    tolerance: float = 1e-10
    iterations: int = 100

    def __post_init__(self) -> None:
        make_floats(self, tolerance="in (0, 0.01)")
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


@contextmanager
def asked(one: object, what: str = "solver", *also: type[BipotError]) -> Iterator[None]:
    """While ``one``, a solver or ``what`` it is, of a user's own perhaps, is asked: programming errors are no answers.

    Raises:
        BrokenSolver: for any error but that there is no answer, which errors of the kinds ``also`` say, too; from it.
    """
    try:
        yield
    except (ProgramError, NotConverged, BrokenSolver, *also):
        raise
    except Exception as broken:
        raise BrokenSolver(f"its {what} {type(one).__name__} raised {type(broken).__name__}: {broken}") from broken


def answered(
    solver: ConicSolver, program: ConicProgram, accuracy: Accuracy, last: Handle = None
) -> tuple[ConicSolution, Handle]:
    """As :meth:`ConicSolver.solve`.

    Raises:
        BrokenSolver: besides, for an answer of other types and shapes than it has to have (:func:`asked`).
        ProgramError: besides, for one that is not finite.
    """
    with asked(solver):
        found = solver.solve(program, accuracy, last)
        pair = isinstance(found, tuple) and len(found) == 2
        require(pair, "answer", type(found).__name__, "a pair of a ConicSolution and the next last")
        answer, handle = found
        require_type(answer, ConicSolution, "answer")
        shapes = {rows.term: (rows.count, rows.width) for rows in program.rows}
        _require_numbers(answer.x, program.q.shape, "answer.x")
        require_type(answer.dual, Mapping, "answer.dual")
        for term, shape in shapes.items():
            _require_numbers(answer.dual.get(term), shape, f"answer.dual, {term}")
        for value, kind, name in ((answer.outcome, Claim, "outcome"), (answer.timing, Timing, "timing")):
            require_type(value, kind, f"answer.{name}")
        require_count(answer.iterations, "answer.iterations", least=0)
        if not all(np.isfinite(part).all() for part in (answer.x, *map(answer.dual.__getitem__, shapes))):
            raise ProgramError("conic solver gave numbers that are not finite: refine the increment")
    return answer, handle


def answered_to_less(
    solver: ConicSolver, program: ConicProgram, accuracy: Accuracy, last: Handle = None
) -> tuple[ConicSolution, Handle]:
    """As :func:`answered`; to the tolerance LESS where the solver stalls on the way to a finer one.

    The answer is then claimed to be almost solved.
    """
    try:
        return answered(solver, program, accuracy, last)
    except StalledProgram:
        if accuracy.tolerance >= LESS:
            raise
    answer, handle = answered(solver, program, replace(accuracy, tolerance=LESS))
    return replace(answer, outcome=Claim.ALMOST), handle


def _require_numbers(value: object, shape: tuple[int, ...], field: str) -> None:
    found = f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
    right = isinstance(value, np.ndarray) and value.shape == shape and value.dtype.kind == "f"
    # Sparse matrices do not take numbers of more digits than their own.
    right = right and np.dtype(np.float64).itemsize >= np.asarray(value).itemsize
    require(right, field, found, f"an array {shape} of floating-point numbers of at most 64 bits")


def infeasible() -> InfeasibleProgram:
    """The error of constraints that exclude each other."""
    return InfeasibleProgram("no displacement satisfies the contact and support constraints together")


def unbounded(ray: Any = None) -> UnboundedProgram:
    """The error of a cost without lower bound along ``ray``."""
    return UnboundedProgram("its program has no minimum: a mechanism gains more than it dissipates", ray)


def unsolved(status: object, stalled: bool = False) -> ProgramError:
    """The error of a solver that stopped with any other ``status``, ``stalled`` where it came no nearer."""
    error = StalledProgram if stalled else ProgramError
    return error(f"conic solver stopped with {status}: refine the increment or loosen the tolerance")
