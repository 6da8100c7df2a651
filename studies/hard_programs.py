"""Hard cases that are programs, not marches: fixed points that cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from bipot.conic.clarabel import solve_once
from bipot.conic.solver import Accuracy
from bipot.forms import FormName
from bipot.laws.coulomb import bipotential_gap, natural_map
from bipot.programs.conic import TangentProgram, polish
from bipot.programs.data import Block, ContactRows
from bipot.programs.fixed_point import Coupled, Coupling, Safeguard, image
from bipot.programs.terms import ContactTerms
from bipot.typing import Floats
from studies.hard_scenes import Outcome

ACCURACY = Accuracy(1e-10)
SETTLED = 1e-8
RULE = Safeguard()


class Ended(NamedTuple):
    """How a case ended: outcome, passes, relative gap, fallbacks, and what was said on the way."""

    outcome: Outcome
    passes: int
    gap: float
    fallbacks: int = 0
    said: str = ""


@dataclass(frozen=True)
class ProgramCase:
    """A named case of one increment or program, and how it must end."""

    name: str
    form: FormName
    expected: Outcome
    run: Callable[[], Ended]


def program_cases() -> list[ProgramCase]:
    """Case 14."""
    return [
        ProgramCase(f"14 {name}", FormName.TANGENT, Outcome.CERTIFIED, lambda W=W, q=q, mu=mu: coupled(W, q, mu))
        for name, W, q, mu in DISCRETE
    ]


DISCRETE = (
    (
        "Gauss-Seidel cycles",
        np.array([[15.0, 11, 4, 7], [11, 17, 11, 8], [4, 11, 11, 4], [7, 8, 4, 9]]),
        np.array([-1.0, 0, -1, -3]),
        1.0,
    ),
    (
        "De Saxce cycles",
        np.array([[28.0, -5, -12, -10], [-5, 17, -12, -5], [-12, -12, 22, 7], [-10, -5, 7, 10]]),
        np.array([-4.0, 1, -4, -4]),
        1.0,
    ),
    (
        "threshold cycles",
        np.array([[10.0, 4, 14, 2], [4, 20, -4, -7], [14, -4, 32, 12], [2, -7, 12, 11]]),
        np.array([-2.0, -3, -3, -1]),
        1.0,
    ),
)
"""Name, W, q, mu. The first two are published; the third is a search's. Each has one solution."""


@dataclass(frozen=True)
class Small:
    """A pass on a small problem: forces and motions (c, 2), their distance from the law, how they were coupled."""

    r: Floats
    u: Floats
    distance: float
    coupled: Coupled


def coupled(W: Floats, q: Floats, mu: float, passes: int = 200) -> Ended:
    """The increment's own coupling code on u = W r + q, until Coulomb's law holds."""
    for number, small in enumerate(islice(passes_of(W, q, mu), passes), start=1):
        if small.distance <= SETTLED:
            gap = np.abs(bipotential_gap(small.u, small.r, mu)).sum() / np.abs(small.r * small.u).sum()
            return Ended(Outcome.CERTIFIED, number, float(gap))
    return Ended(Outcome.FAILED, passes, np.inf)


def passes_of(W: Floats, q: Floats, mu: float, rule: Safeguard = RULE) -> Iterator[Small]:
    """Pass after pass. The distance is that of the natural map, over the largest force."""
    K, c = np.asarray(np.linalg.inv(W), dtype=np.float64), len(q) // 2
    identity = sp.csr_matrix(np.eye(2 * c))
    zero, rho = np.zeros(c), 2 * c / float(np.trace(W))
    law = zero + mu, np.full(c, np.inf), zero > 0
    rows = ContactRows(identity[::2], zero, identity[1::2], zero[:, None], np.arange(c), *law)
    coupling = Coupling.start(image(rows, np.zeros((c, 2)), q), rule)
    while True:
        program = TangentProgram(K, K @ q, ContactTerms(rows, coupling.value, coupling.shift))
        answer = solve_once(program.conic(), ACCURACY)
        x, r = polish(program, answer.block(Block.DISPLACEMENT), program.contact.contact_forces(answer))
        u = rows.motion(x)
        coupling = coupling.update(image(rows, r, x))
        distance = float(np.abs(natural_map(r, u, mu, rho)).max() / np.abs(r).max(initial=1e-300))
        yield Small(r, u, distance, coupling.report)
