"""An accepted increment's contact problem for other codes: its condensed Coulomb problem, in physical units."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bipot.contact import near_tools
from bipot.coulomb import CoulombProblem, write_fclib
from bipot.increment import System
from bipot.march import Accepted
from bipot.programs.condensation import condense
from bipot.programs.conic import TangentProgram
from bipot.programs.delassus import reduce
from bipot.response import TangentKind


@dataclass(frozen=True)
class ContactProblem:
    """u = W r + q at the c candidates near a tool (numbers ``candidate`` (c,)), and the march's own forces r (c d,).

    u in length, r in force, W in length per force.
    """

    problem: CoulombProblem
    r: NDArray[np.float64]
    candidate: NDArray[np.intp]


def contact_problem(system: System, accepted: Accepted) -> ContactProblem:
    """The Coulomb problem of an accepted increment, on the tangent at its solution.

    The increment's own contact forces solve it as exactly as the increment was solved. It holds every candidate that
    carries any force, which all balance, and those near their tool at the end (:func:`bipot.contact.near_tools`) by the
    increment's own motion, of the tools or where they rest of the body; closed ones also where both rest.

    Raises:
        ProgramError: a welded point, or a singular stiffness.
    """
    iterate, rows = accepted.solved.iterate, accepted.solved.rows
    near = _near(system, accepted)
    taken = rows.take(near)
    K = iterate.stiffness(TangentKind.CONSISTENT)
    f = K @ iterate.x - iterate.residual
    program = TangentProgram.of(K, f, taken, np.zeros(len(taken.frictional)))
    problem = reduce(condense(program).program).problem
    return ContactProblem(problem, accepted.solved.r[near].ravel(), np.flatnonzero(near))


def _near(system: System, accepted: Accepted) -> NDArray[np.bool_]:
    """The candidates (c,) of the increment's contact problem."""
    rows, x, r = accepted.solved.rows, accepted.solved.iterate.x, accepted.solved.r
    length = system.candidates.length(rows, x, accepted.start.tau, accepted.state.tau)
    return near_tools(rows, x, length) | (r != 0).any(axis=1)


def export_fclib(path: Path, system: System, accepted: Accepted) -> None:
    """Write the increment's contact problem with the march's own solution as an FCLIB file."""
    found = contact_problem(system, accepted)
    write_fclib(
        path,
        found.problem,
        title=f"upsetting, increment {accepted.number}",
        description=f"condensed contact problem at tau = {accepted.state.tau:.6g}",
        solution={"u": found.problem.velocity(found.r), "r": found.r},
    )
