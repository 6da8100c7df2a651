"""The penalised program minimised as (29) states it, on the condensed unknowns, through cvxpy and Clarabel."""

from __future__ import annotations

import time

import numpy as np

from bipot.conic.problem import Outcome, Timing
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import solve_stated
from bipot.errors import ProgramError
from bipot.programs.data import Block
from bipot.programs.penalty import Minimum, PenaltyProgram
from bipot.typing import Floats


def fictitious(program: PenaltyProgram, accuracies: tuple[Accuracy, ...]) -> Minimum:
    """Minimise through cvxpy and Clarabel to the first of ``accuracies`` that is claimed met.

    When none is, the answer of least residual stands, as almost solved. Iterations and seconds are those of all
    attempts. Raises ProgramError and its kin when no attempt gave an answer.
    """
    began = time.perf_counter()
    small, condensed = program.condensed()
    stated = small.statement()
    iterations, timing = 0, Timing(build=time.perf_counter() - began)
    answers: list[Floats] = []
    failure = ProgramError("no accuracy was asked for")
    for accuracy in accuracies:
        try:
            outcome, count, spent = solve_stated(stated, accuracy)
        except ProgramError as failed:
            failure = failed
            continue
        iterations, timing = iterations + count, timing + spent
        answers.append(np.asarray(stated.blocks[Block.DISPLACEMENT].value))
        if outcome is Outcome.SOLVED:
            return Minimum(condensed.recover(answers[-1]), outcome, iterations, timing)
    if not answers:
        raise failure
    best = min(answers, key=lambda u: float(np.abs(small.gradient(u)).max()))
    return Minimum(condensed.recover(best), Outcome.ALMOST, iterations, timing)
