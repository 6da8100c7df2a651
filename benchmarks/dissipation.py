r"""The dissipation program's cost by stage, and two choices in it measured against their alternatives.

Names of the rows, medians over the passes of a run: ``dissipation build`` (material model, scaling and cone rows as
arrays), ``dissipation transfer`` (new numbers sent to the Clarabel object of the last pass), ``dissipation solve``;
``dissipation overhead`` is (build + transfer) / solve, in the column ``ratio``. The alternatives: ``dissipation
transfer, new object`` sets Clarabel up anew each pass; ``dissipation solve, plastic variable`` solves the same program
with e_p = dev e - d as the variable instead of d, which takes B out of the cones and puts it into P:

    1/2 |dU|^2 of B_v' K w B_v + B' 2 G w B,   coupled to e_p by -2 G w B,   (t, e_p) in the second-order cone.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy.sparse as sp

from benchmarks.kappa import LEAST, Kappa
from benchmarks.rows import Row
from bipot.conic.clarabel import Transferred, transfer
from bipot.conic.problem import ConicProgram, Rows
from bipot.forms import Dissipation, FormName
from bipot.increment import Trial
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.programs.data import Term
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.terms import norm_rows
from bipot.typing import Floats

T = TypeVar("T")

REDUCTION, INCREMENTS, SMALL = 0.05, 5, 0.001


@dataclass(frozen=True)
class Stages:
    """Processor seconds of each pass (p,)."""

    build: Floats
    transfer: Floats
    solve: Floats
    anew: Floats
    plastic: Floats

    @property
    def overhead(self) -> float:
        """Median (build + transfer) / solve."""
        return float(np.median((self.build + self.transfer) / self.solve))


def recorded(mu: float, elements: int) -> list[Trial]:
    """The passes of a short run of the seed paper's cylinder."""
    scene, seen = upsetting(mu=mu, reduction=REDUCTION, elements=elements), list[Trial]()
    schedule = Schedule(INCREMENTS, first=SMALL / REDUCTION)
    for _ in march(scene, schedule, Control(form=Dissipation()), observe=seen.append):
        pass
    return seen


def stages(passes: list[Trial], between: Callable[[Trial], None] = lambda seen: None) -> Stages:
    """Time the stages pass by pass, as the form goes through them; the first pass sets Clarabel up in any case."""
    form = Dissipation()
    ours: Transferred | None = None
    other: Transferred | None = None
    table = []
    for seen in passes:
        between(seen)
        build, program = _timed(lambda seen=seen: _with_data(form.program(seen.iterate, seen.r, seen.state)))
        conic, alternative = program[1], with_plastic_variable(program[0])
        sent, ours = _timed(lambda conic=conic, last=ours: transfer(conic, form.accuracy, last))
        solved, _ = _timed(ours.clarabel.solve)
        anew, _ = _timed(lambda conic=conic: transfer(conic, form.accuracy))
        other = transfer(alternative, form.accuracy, other)
        plastic, _ = _timed(other.clarabel.solve)
        table.append((build, sent, solved, anew, plastic))
    return Stages(*np.array(table[1:]).T)


def _with_data(program: DissipationProgram) -> tuple[DissipationProgram, ConicProgram]:
    return program, program.conic()


def _timed(call: Callable[[], T]) -> tuple[float, T]:
    """Processor seconds and result."""
    began = time.process_time()
    result = call()
    return time.process_time() - began, result


def with_plastic_variable(program: DissipationProgram) -> ConicProgram:
    """The same program in (dU, e_p, t, slip bounds); its ELASTIC_DEVIATOR block is e_p."""
    m, ours = program.model, program.conic()
    points, width = m.stress.shape
    starts = [part.start for part in ours.blocks.values()]
    size, n = len(ours.q), len(program.force)
    stiffness = 2 * np.repeat(m.shear * m.weight, width)
    D = sp.diags_array(stiffness)
    coupling = -(D @ m.deviatoric)
    displacement = ours.P[:n, :n] + m.deviatoric.T @ D @ m.deviatoric
    rest = sp.diags_array(ours.P.diagonal()[starts[2] :])
    P = sp.block_diag([sp.block_array([[displacement, coupling.T], [coupling, D]]), rest], format="csc")
    load = (m.weight[:, None] * m.stress).ravel() + stiffness * m.deviator_0.ravel()
    q = ours.q.copy()
    q[:n] += m.deviatoric.T @ load
    q[starts[1] : starts[2]] = -load
    none = sp.csr_matrix((points * width, n))
    cone = norm_rows(Term.YIELD, none, np.zeros((points, width)), size, starts[2], minus=starts[1])
    rows: list[Rows] = [cone if r.term == Term.YIELD else r for r in ours.rows]
    return ConicProgram(sp.csc_matrix(P), q, tuple(rows), ours.blocks)


def measured(mu: float, elements: int) -> list[Row]:
    """The rows of a run."""
    passes = recorded(mu, elements)
    system, kappa = system_of(upsetting(mu=mu, elements=elements)), Kappa()

    def sample(seen: Trial) -> None:
        for _ in range(-(-LEAST // len(passes))):
            kappa.sample(system, seen.iterate.response)

    found, name, unit = stages(passes, sample), FormName.DISSIPATION.value, kappa.median
    named = {
        "dissipation build": found.build,
        "dissipation transfer": found.transfer,
        "dissipation solve": found.solve,
        "dissipation transfer, new object": found.anew,
        "dissipation solve, plastic variable": found.plastic,
    }
    medians = {label: float(np.median(seconds)) for label, seconds in named.items()}
    rows = [Row(label, name, mu, elements, unit, s, s / unit) for label, s in medians.items()]
    return [*rows, Row("dissipation overhead", name, mu, elements, unit, 0.0, found.overhead)]
