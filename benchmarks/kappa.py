"""The unit of cost kappa: assemble, factorise and solve once the stiffness of the same mesh."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from bipot.control.accepted import Accepted
from bipot.programs.condensation import factorise
from bipot.programs.factors import SuperLUFactor
from bipot.programs.ordering import Pattern
from bipot.response import Response, TangentKind
from bipot.system import System

LEAST = 20
"""Samples of kappa that a benchmark interleaves with its run."""


@dataclass
class Kappa:
    """Samples of the unit of cost, and of the factorisation in it, in processor seconds.

    In the order of elimination of a ``pattern`` that was found before; without one it is found each time.
    """

    pattern: Pattern | None = None
    samples: list[float] = field(default_factory=list)
    factorisations: list[float] = field(default_factory=list)
    fill: int = 0
    """Entries of the factors."""

    def sample(self, system: System, response: Response) -> None:
        """Time one assembly (the project's own), one ``splu``, and one solve."""
        began = time.process_time()
        K = system.body.stiffness(response, TangentKind.CONSISTENT)
        data = self.pattern.by_row(np.asarray(K.data, np.float64))[:-1] if self.pattern else np.empty(0)
        assembled = time.process_time()
        factor = self.pattern.factorise(data) if self.pattern else SuperLUFactor(factorise(K))
        factorised = time.process_time()
        if self.pattern:
            self.pattern.solve(factor, response.internal)
        else:
            factor.solve(response.internal)
        self.samples.append(time.process_time() - began)
        self.factorisations.append(factorised - assembled)
        self.fill = factor.lu.L.nnz + factor.lu.U.nnz

    @property
    def median(self) -> float:
        """kappa, s."""
        return float(np.median(self.samples))

    @property
    def factorisation(self) -> float:
        """Median time of one factorisation, s."""
        return float(np.median(self.factorisations))


def interleaved(system: System, steps: Iterable[Accepted], kappa: Kappa, count: int) -> Iterator[Accepted]:
    """Yield the steps, sampling kappa after each; at least LEAST samples over ``count`` steps or more."""
    for step in steps:
        for _ in range(-(-LEAST // count)):
            kappa.sample(system, step.solved.response)
        yield step
