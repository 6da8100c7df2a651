"""An accepted increment for other codes: its condensed Coulomb problem in physical units, its convex programs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bipot.contact.closeness import near_tools
from bipot.control.accepted import Accepted
from bipot.coulomb import CoulombProblem, write_fclib
from bipot.errors import require, require_type
from bipot.forms import Cache, Dissipation, Penalty, Tangent, Uzawa
from bipot.forms.posed import tangent_program
from bipot.programs.condensation import condense, reduce
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Stopwatch
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.penalty import PenaltyProgram
from bipot.programs.terms import ContactTerms
from bipot.response import TangentKind


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """u = W r + q at the c candidates near a tool (their numbers ``candidate`` (c,)), and the march's forces r (c d,).

    u in length, r in force, W in length per force.
    """

    problem: CoulombProblem
    r: NDArray[np.float64]
    candidate: NDArray[np.intp]


def contact_problem(accepted: Accepted) -> ContactProblem:
    """The Coulomb problem of an accepted increment, on the tangent at its solution.

    The increment's contact forces solve it as exactly as they meet the law, and W r + q is the increment's motion to
    round-off of W r. To this end q is made from that motion and not from the load: in perfect flow W is so large that
    the error of the increment's equilibrium would move the contacts visibly.

    It contains every candidate that carries a force, and those near their tool at the end
    (:func:`bipot.contact.closeness.near_tools`), judged by the motion of the tools in the increment, or of the body
    where the tools rest; closed ones also where both rest.

    Raises:
        ProgramError: a welded point, capped friction, or a singular stiffness, as where forces drive a tool or contact
            alone holds a part.
    """
    require_type(accepted, Accepted, "accepted")
    iterate, rows, r = accepted.solved.iterate, accepted.solved.rows, accepted.solved.r
    near = near_tools(rows, iterate.x, iterate.length) | (r != 0).any(axis=1)
    taken, forces = rows.take(near), r[near].ravel()
    terms = ContactTerms(taken, np.zeros(len(taken.frictional)))
    program = TangentProgram(iterate.stiffness(TangentKind.CONSISTENT), np.zeros_like(iterate.x), terms)
    reduced = reduce(condense(program).program).problem
    problem = replace(reduced, q=taken.motion(iterate.x).ravel() - reduced.W @ forces)
    return ContactProblem(problem, forces, np.flatnonzero(near))


def export_fclib(path: str | Path, accepted: Accepted) -> None:
    """Write the increment's contact problem, with the march's forces and motion as its solution, to an FCLIB file."""
    found = contact_problem(accepted)
    write_fclib(
        path,
        found.problem,
        title=f"increment {accepted.number} of a march",
        description=f"condensed contact problem at tau = {accepted.state.tau:.6g}",
        solution={"u": found.problem.velocity(found.r), "r": found.r},
    )


def conic_program(
    accepted: Accepted, form: Tangent | Dissipation | Penalty | Uzawa
) -> TangentProgram | DissipationProgram | PenaltyProgram:
    """The convex program of the pass by ``form`` that would follow the last one of an accepted increment.

    Its threshold is that of the increment's contact forces, so that its minimiser is the increment's displacement, but
    for how far the error of the increment's equilibrium moves the body (far in perfect flow); that of :class:`Penalty`
    is so only where the march itself was by that penalty. The program contains all free
    unknowns (which :class:`Tangent` condenses before it solves) and rows of the candidates near their tool. It is
    dimensionless: lengths in ``accepted.units.length``, forces in ``accepted.units.force``, energies in their product.
    ``conic()`` is the standard form, ``statement()`` the same in cvxpy. The multipliers of the rows "gap" are the
    normal contact forces, those of "friction" the thresholds mu r_n, or their caps, and the tangential forces.
    """
    require_type(accepted, Accepted, "accepted")
    poses = isinstance(form, Tangent | Dissipation | Penalty | Uzawa)
    require(poses, "form", form, "one that poses a conic program: Tangent, Dissipation, Penalty or Uzawa")
    iterate, r = accepted.solved.iterate, accepted.solved.r
    state = form.init(iterate, r, Cache())
    if isinstance(form, Dissipation):
        return form.program(iterate, r, state)
    if isinstance(form, Penalty | Uzawa):
        return form.program(iterate, r, state).scaled(state.units)
    return tangent_program(iterate, state.terms(iterate, r), state, form.kind, Stopwatch())
