"""QOCO on a conic program's own data: few iterations on small programs, and no certificate of infeasibility.

Its form is ``A x = b``, ``h - G x`` in the nonnegative orthant times second-order cones.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any

import numpy as np
import scipy.sparse as sp

from bipot.conic.problem import Claim, Cone, ConicProgram, ConicSolution, Timing, stacked
from bipot.conic.solver import Accuracy, unsolved
from bipot.errors import require
from bipot.typing import Floats

CLAIMS = {"QOCO_SOLVED": Claim.SOLVED, "QOCO_SOLVED_INACCURATE": Claim.ALMOST}


@dataclass(frozen=True)
class Qoco:
    """Interior points by QOCO, set up anew for each program: nothing is kept.

    Raises:
        SceneError: the package ``qoco`` is not installed.
    """

    def __post_init__(self) -> None:
        require(find_spec("qoco") is not None, "solver", "qoco", "installed: pip install qoco")

    def solve(self, program: ConicProgram, accuracy: Accuracy, last: None = None) -> tuple[ConicSolution, None]:
        """As :meth:`~bipot.conic.solver.ConicSolver.solve`; a program without a solution ends as ProgramError."""
        import qoco

        started = time.perf_counter()
        kinds = Cone.ZERO, Cone.NONNEGATIVE, Cone.SECOND_ORDER
        zero, nonnegative, second = ([r for r in program.rows if r.cone is kind and r.count] for kind in kinds)
        groups = zero, nonnegative + second
        equal, bounded = (stacked(group, len(program.q)) for group in groups)
        widths = [r.width for r in second for _ in range(r.count)]
        solver: Any = qoco.QOCO()
        solver.setup(
            len(program.q),
            len(bounded[1]),
            len(equal[1]),
            program.P if program.P.nnz else None,
            program.q,
            *_negated(*equal),
            *_negated(*bounded),
            sum(r.count for r in nonnegative),
            len(widths),
            np.array(widths, dtype=np.int32),
            abstol=accuracy.tolerance,
            reltol=accuracy.tolerance,
            max_iters=accuracy.iterations,
            verbose=0,
        )
        built = time.perf_counter()
        answer = solver.solve()
        solved = time.perf_counter()
        if answer.status not in CLAIMS:
            raise unsolved(answer.status)
        dual = {r.term: np.zeros((0, r.width)) for r in program.rows}
        for group, multipliers in zip(groups, (answer.y, answer.z), strict=True):
            dual |= replace(program, rows=tuple(group)).split(np.array(multipliers))
        timing = Timing(built - started, solved - built)
        return ConicSolution(program, np.array(answer.x), dual, CLAIMS[answer.status], answer.iters, timing), None


def _negated(A: sp.csr_matrix, b: Floats) -> tuple[sp.csc_matrix, Floats] | tuple[None, None]:
    """(-A, b) by columns, as QOCO takes them; None without rows."""
    return (sp.csc_matrix(-A), b) if len(b) else (None, None)
