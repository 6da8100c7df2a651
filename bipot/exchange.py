"""An accepted increment's contact problem for other codes: its condensed Coulomb problem, in physical units."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bipot.coulomb import CoulombProblem, write_fclib
from bipot.forms.posed import NEAR
from bipot.increment import System
from bipot.march import Accepted
from bipot.programs.condensation import condense
from bipot.programs.conic import TangentProgram
from bipot.programs.delassus import reduce
from bipot.response import TangentKind
from bipot.traction import LEAST_MOTION, largest_displacement


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
    carries force or is tied, those whose gap at the end is within :data:`bipot.forms.posed.NEAR` of the increment's own
    motion (of the tools or of the body, whichever is larger; closed ones also where both rest), and the nearest.

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
    solved, iterate = accepted.solved, accepted.solved.iterate
    body = largest_displacement(system.candidates, iterate.x)
    motion = max(iterate.increment.reach, body, LEAST_MOTION * system.body.scene.mesh.size)
    gap = iterate.motion[:, 0]
    return (gap <= max(NEAR * motion, float(gap.min()))) | (solved.r != 0).any(axis=1) | solved.rows.tied


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
