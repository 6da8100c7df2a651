"""The unit of cost kappa: assemble, factorise and solve once the stiffness of the same mesh."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from bipot.accepted import Accepted
from bipot.increment import System
from bipot.programs.condensation import factorise
from bipot.response import Response, TangentKind

LEAST = 20
"""Samples of kappa that a benchmark interleaves with its run."""


@dataclass
class Kappa:
    """Samples of the unit of cost, and of the factorisation in it, in processor seconds."""

    samples: list[float] = field(default_factory=list)
    factorisations: list[float] = field(default_factory=list)

    def sample(self, system: System, response: Response) -> None:
        """Time one assembly (the project's own), one ``splu`` with its ordering, and one solve."""
        began = time.process_time()
        K = system.body.stiffness(response, TangentKind.CONSISTENT)
        assembled = time.process_time()
        lu = factorise(K)
        factorised = time.process_time()
        lu.solve(response.internal)
        self.samples.append(time.process_time() - began)
        self.factorisations.append(factorised - assembled)

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
