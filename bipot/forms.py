"""The forms an increment can take: small frozen objects with one verb, one pass each.

A form turns a :class:`Pass` (response at the last iterate, contact rows, frozen threshold) into the next
displacement and contact forces. Everything else of an increment is shared, so comparisons are fair by construction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from bipot.programs.clarabel import Accuracy, solve
from bipot.programs.condensation import condense
from bipot.programs.conic import CompiledTangent, TangentProgram, structure
from bipot.programs.data import Block, ContactRows, Outcome, Timing, Units
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.polish import couple, polish
from bipot.programs.statement import Stated, solve_stated
from bipot.programs.terms import ContactTerms
from bipot.response import Body, Response, TangentKind

Floats = NDArray[np.float64]


class FormName(Enum):
    """Names of the forms on the command line and in a history."""

    TANGENT = "tangent"
    DISSIPATION = "dissipation"


class Backend(Enum):
    """Who hands a program to Clarabel: its cvxpy statement, or the same data directly."""

    CVXPY = "cvxpy"
    CLARABEL = "clarabel"


@dataclass(frozen=True)
class Pass:
    """What a form is given: body and response at the iterate, contact rows, threshold s (f,), load F (n,), units."""

    body: Body
    response: Response
    rows: ContactRows
    threshold: Floats
    force: Floats
    units: Units


@dataclass(frozen=True)
class Answer:
    """The next iterate: free displacement x (n,), contact forces r (c, d), and what the solver claimed."""

    x: Floats
    r: Floats
    outcome: Outcome
    iterations: int
    timing: Timing


@dataclass
class Workspace:
    """Programs compiled during a run, by structure: the one mutable thing, owned by the march."""

    compiled: dict[bytes, CompiledTangent] = field(default_factory=dict)

    def stated(self, program: TangentProgram) -> Stated:
        """The compiled statement with the numbers of ``program`` assigned."""
        key = structure(program)
        if key not in self.compiled:
            self.compiled[key] = CompiledTangent.of(program)
        return self.compiled[key].assign(program)


class Form(Protocol):
    """One way to solve a pass."""

    @property
    def name(self) -> FormName:
        """How the history calls it."""
        ...

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """Next displacement and forces; raises ProgramError and its kin."""
        ...


@dataclass(frozen=True)
class Tangent:
    """Quadratic C^ep energy, condensed on the contact unknowns, solved as a cone program and polished."""

    kind: TangentKind = TangentKind.CONSISTENT
    backend: Backend = Backend.CVXPY
    accuracy: Accuracy = Accuracy()
    coupled: bool = True
    name: ClassVar[FormName] = FormName.TANGENT

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """One proximal-Newton pass."""
        K = given.body.stiffness(given.response, self.kind)
        f = K @ given.response.x - given.response.internal + given.force
        program = TangentProgram.of(K, f, given.rows, given.threshold).scaled(given.units)
        condensed = condense(program)
        small = condensed.program
        if self.backend is Backend.CVXPY:
            stated = workspace.stated(small)
            outcome, iterations, timing = solve_stated(stated, self.accuracy)
            u, r = np.asarray(stated.dU.value), stated.contact.forces()
        else:
            solution = solve(small.conic(), self.accuracy)
            outcome, iterations, timing = solution.outcome, solution.iterations, solution.timing
            u, r = solution.block(Block.DISPLACEMENT), small.contact.contact_forces(solution)
        u, r = (couple(small, u, r) if self.coupled else None) or polish(small, u, r)
        x = condensed.recover(u) * given.units.length
        return Answer(x, r * given.units.force, outcome, iterations, timing)


@dataclass(frozen=True)
class Dissipation:
    """Plastic strain as a variable, one second-order cone a point; globally convergent at a frozen threshold."""

    backend: Backend = Backend.CLARABEL
    accuracy: Accuracy = Accuracy()
    name: ClassVar[FormName] = FormName.DISSIPATION

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """One program with the configuration and the line of the yield stress frozen."""
        model = given.body.plastic_model(given.response)
        contact = ContactTerms(given.rows, given.threshold)
        program = DissipationProgram(model, given.force, contact).scaled(given.units)
        if self.backend is Backend.CVXPY:
            stated = program.statement()
            outcome, iterations, timing = solve_stated(stated, self.accuracy)
            u, r = np.asarray(stated.dU.value), stated.contact.forces()
        else:
            solution = solve(program.conic(), self.accuracy)
            outcome, iterations, timing = solution.outcome, solution.iterations, solution.timing
            u, r = solution.block(Block.DISPLACEMENT), program.contact.contact_forces(solution)
        return Answer(u * given.units.length, r * given.units.force, outcome, iterations, timing)
