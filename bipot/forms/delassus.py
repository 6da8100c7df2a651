"""The tangent model reduced to its contacts, each pass a discrete Coulomb problem for any solver of bipot.coulomb."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bipot.coulomb import CoulombSolution, Limits, Solver, run, solve
from bipot.errors import NotConverged, require
from bipot.forms.base import Answer, FormName, Pass, Workspace
from bipot.forms.conic import condensed_tangent
from bipot.programs.data import Outcome, Timing
from bipot.programs.delassus import Reduced, reduce
from bipot.response import TangentKind

USABLE = 1e-8
"""An answer short of its tolerance but within this residual is passed on as ALMOST: the certificate re-checks it."""


@dataclass(frozen=True)
class Delassus:
    """Exact Coulomb friction on the quadratic model by one discrete solver, or by ``solve()``'s chain (None)."""

    solver: Solver[Any] | None = None
    limits: Limits = Limits(tol=1e-12)
    name: ClassVar[FormName] = FormName.DELASSUS
    exact: ClassVar[bool] = True
    shifts: ClassVar[bool] = False
    nearby: ClassVar[bool] = True

    def __post_init__(self) -> None:
        runs = all(callable(getattr(self.solver, verb, None)) for verb in ("init", "step"))
        require(self.solver is None or runs, "delassus.solver", self.solver, "a Solver or None")
        require(isinstance(self.limits, Limits), "delassus.limits", self.limits, "a Limits of bipot.coulomb")

    def solve(self, given: Pass, workspace: Workspace) -> Answer:
        """One pass, started from the forces of the last.

        Raises:
            NotConverged: the solver's own sentence.
            ProgramError: from the reduction.
        """
        began = workspace.assembly.outside()
        condensed = condensed_tangent(given, given.response, TangentKind.CONSISTENT, workspace)
        reduced = reduce(condensed.program)
        built = workspace.assembly.outside()
        found = self._find(reduced, given)
        if not found.residual() <= USABLE:
            raise NotConverged(found.reason)
        r = found.r.reshape(given.last_forces.shape)
        x = condensed.recover(reduced.displacement(r)) * given.units.length
        outcome = Outcome.SOLVED if found.converged else Outcome.ALMOST
        timing = Timing(built - began, workspace.assembly.outside() - built)
        return Answer(x, r * given.units.force, outcome, found.iterations, timing, coupled=True)

    def _find(self, reduced: Reduced, given: Pass) -> CoulombSolution:
        start = np.ravel(given.last_forces) / given.units.force
        if self.solver is None:
            return solve(reduced.problem, self.limits, start)
        return run(self.solver, reduced.problem, self.limits, start)
