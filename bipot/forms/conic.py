"""The two conic forms: exact contact with a frozen threshold or shift, the material as tangent energy or dissipation.

Both end a pass with a semismooth Newton step on a quadratic model: interior-point answers stall where strict
complementarity fails. `tangent` polishes its own program; `dissipation` takes the step of the tangent model at its
answer, and keeps it only if equilibrium and the exact law are then met better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import ConicProgram, Outcome, Timing
from bipot.conic.solver import Accuracy, ConicSolver
from bipot.conic.through_cvxpy import Cvxpy
from bipot.errors import InvertedElement, ProgramError, require, require_count, require_type
from bipot.forms.base import Answer, FormName, Measured, Pass, Workspace
from bipot.laws.coulomb import natural_map
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.polish import couple, polish
from bipot.programs.terms import ContactTerms
from bipot.response import Response, TangentKind

Floats = NDArray[np.float64]


NEARBY = 1e-4
"""An answer this near to equilibrium and law, in units of the program, is not far from the next: its pieces hold."""


@dataclass(frozen=True)
class Tangent:
    """Quadratic C^ep energy, solved as a cone program and polished.

    With ``coupled``, the polish carries exact Coulomb friction on the same quadratic model (its result is used only
    when exact); otherwise the threshold moves by the fixed point alone. The model leaves out how the configuration
    moves: with ``coupled``, a step that leads away from equilibrium and law is halved, at most ``halvings`` times.
    """

    kind: TangentKind = TangentKind.CONSISTENT
    solver: ConicSolver = Clarabel()
    accuracy: Accuracy = Accuracy(1e-9)
    coupled: bool = True
    halvings: int = 3
    name: ClassVar[FormName] = FormName.TANGENT
    exact: ClassVar[bool] = True
    shifts: ClassVar[bool] = True
    nearby: ClassVar[bool] = True

    def __post_init__(self) -> None:
        require_type(self.kind, TangentKind, "tangent.kind")
        _require_solver(self.solver, "tangent.solver")
        require_type(self.accuracy, Accuracy, "tangent.accuracy")
        require_type(self.coupled, bool, "tangent.coupled")
        require_count(self.halvings, "tangent.halvings", 0)

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """One proximal-Newton pass."""
        program = tangent_program(given, given.response, self.kind, workspace)
        began = workspace.assembly.outside()
        coupled = self._gone_on(given, program, workspace)
        if coupled is not None:
            raw = Raw(*coupled, Outcome.SOLVED, 0, Timing(solve=workspace.assembly.outside() - began))
        else:
            raw = _solved(self, program, workspace)
            coupled = couple(program, raw.u, raw.r, workspace.elimination) if self.coupled else None
        exact = coupled is not None
        u, r = coupled or polish(program, raw.u, raw.r, workspace.elimination)
        answer = Answer(
            u * given.units.length, r * given.units.force, raw.outcome, raw.iterations, raw.timing, coupled=exact
        )
        return _shortened(given, answer, self.halvings, workspace) if self.coupled else answer

    def _gone_on(self, given: Pass, program: TangentProgram, workspace: Workspace) -> tuple[Floats, Floats] | None:
        """The polish from the last pass's answer, where that is near and this is exact: the program tells nothing new.

        None in the first pass of an increment and through cvxpy, which poses every pass.
        """
        last = workspace.measured
        if last is None or last.response is not given.response or last.rows is not given.rows:
            return None
        if last.distance > NEARBY or not self.coupled or isinstance(self.solver, Cvxpy):
            return None
        start = given.response.x / given.units.length
        return couple(program, start, given.last_forces / given.units.force, workspace.elimination)


@dataclass(frozen=True)
class Dissipation:
    """Plastic strain as a variable, one second-order cone a point; globally convergent at a frozen threshold.

    With ``polished``, a pass ends with the Newton step described above.
    """

    solver: ConicSolver = Clarabel()
    accuracy: Accuracy = Accuracy(1e-11)
    polished: bool = True
    name: ClassVar[FormName] = FormName.DISSIPATION
    exact: ClassVar[bool] = True
    shifts: ClassVar[bool] = True
    nearby: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _require_solver(self.solver, "dissipation.solver")
        require_type(self.accuracy, Accuracy, "dissipation.accuracy")
        require_type(self.polished, bool, "dissipation.polished")

    def program(self, given: Pass) -> DissipationProgram:
        """The dimensionless program of a pass."""
        model = given.body.plastic_model(given.response)
        contact = ContactTerms(given.rows, given.threshold, given.shift)
        return DissipationProgram(model, given.force, contact).scaled(given.units)

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """One program with the configuration and the line of the yield stress frozen."""
        with workspace.assembly:
            program = self.program(given)
        raw = _solved(self, program, workspace)
        x, r = raw.u * given.units.length, raw.r * given.units.force
        answer = Answer(x, r, raw.outcome, raw.iterations, raw.timing)
        return _improved(given, answer, workspace) if self.polished else answer


def _shortened(given: Pass, answer: Answer, halvings: int, workspace: Workspace) -> Answer:
    """The answer with the body's response, or what is nearest to equilibrium and law on the way to it."""
    start, last = given.response, workspace.measured
    known = last is not None and last.response is start and last.rows is given.rows
    least = last.distance if last and known else _distance(given, start, given.last_forces)
    best: tuple[float, Answer] | None = None
    t, failure = 1.0, InvertedElement()
    for _ in range(halvings + 1):
        x, r = start.x + t * (answer.x - start.x), given.last_forces + t * (answer.r - given.last_forces)
        try:
            with workspace.assembly:
                response = given.body.respond(start.state, x)
        except InvertedElement as inverted:
            failure = inverted
        else:
            distance = _distance(given, response, r)
            if best is None or distance < best[0]:
                best = distance, replace(answer, x=x, r=r, response=response, coupled=answer.coupled and t == 1.0)
            if distance <= least:
                break
        t /= 2
    if best is None:
        raise failure
    workspace.measured = Measured(best[1].response or start, given.rows, best[0])
    return best[1]


def _improved(given: Pass, answer: Answer, workspace: Workspace) -> Answer:
    """The answer with its response, after one Newton step of the tangent model if that is nearer to balance and law."""
    with workspace.assembly:
        response = given.body.respond(given.response.state, answer.x)
    answer = replace(answer, response=response)
    try:
        program = tangent_program(given, response, TangentKind.CONSISTENT, workspace)
        start = answer.x / given.units.length
        coupled = couple(program, start, answer.r / given.units.force, workspace.elimination)
        if coupled is None:
            return answer
        x, r = coupled[0] * given.units.length, coupled[1] * given.units.force
        with workspace.assembly:
            after = given.body.respond(given.response.state, x)
    except (InvertedElement, ProgramError):
        return answer
    if _distance(given, after, r) >= _distance(given, response, answer.r):
        return answer
    return replace(answer, x=x, r=r, response=after, coupled=True)


def _distance(given: Pass, response: Response, r: Floats) -> float:
    """Largest component of equilibrium residual and natural map of the exact law, in the units of the program."""
    units, rows = given.units, given.rows
    residual = (response.internal - given.force - rows.forces(r)) / units.force
    motion, force = rows.motion(response.x) / units.length, r / units.force
    law = np.where(rows.tied[:, None], motion, natural_map(force, motion, rows.mu, 1.0))
    return float(max(np.abs(residual).max(), np.abs(law).max(initial=0.0)))


def tangent_program(given: Pass, response: Response, kind: TangentKind, workspace: Workspace) -> TangentProgram:
    """The tangent program at ``response``, dimensionless."""
    with workspace.assembly:
        K = given.body.stiffness(response, kind)
    f = K @ response.x - response.internal + given.force
    program = TangentProgram(K, f, ContactTerms(given.rows, given.threshold, given.shift)).scaled(given.units)
    workspace.eliminate(K, program.contact.rows)
    return program


@dataclass(frozen=True)
class Raw:
    """An answer in the program's own units, and what the interior points claimed and cost."""

    u: Floats
    r: Floats
    outcome: Outcome
    iterations: int
    timing: Timing


class Exact(Protocol):
    """A program with exact contact terms."""

    @property
    def contact(self) -> ContactTerms:
        """Its contact terms."""
        ...

    def conic(self) -> ConicProgram:
        """Its data."""
        ...


def _solved(form: Tangent | Dissipation, program: Exact, workspace: Workspace) -> Raw:
    """The program solved by the form's solver, which keeps in the workspace what it can use again."""
    answer, handle = form.solver.solve(program.conic(), form.accuracy, workspace.handles.get(form.name))
    workspace.handles[form.name] = handle
    r = program.contact.contact_forces(answer)
    return Raw(answer.block(Block.DISPLACEMENT), r, answer.outcome, answer.iterations, answer.timing)


def _require_solver(solver: object, field: str) -> None:
    require(callable(getattr(solver, "solve", None)), field, solver, "a ConicSolver, e.g. Clarabel() or Cvxpy('SCS')")
