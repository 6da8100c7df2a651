"""Acceleration of a fixed-point iteration x -> G(x): damping, or safeguarded Anderson mixing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from bipot.errors import require_count
from bipot.typing import Floats, make_floats


@dataclass(frozen=True, eq=False)
class Past:
    """Past points x and steps G(x) - x, oldest first, (k, n) each; ``length`` is that of the last step."""

    points: tuple[Floats, ...] = ()
    steps: tuple[Floats, ...] = ()
    length: float = float("inf")


@runtime_checkable
class Acceleration(Protocol):
    """From x and G(x) to the next x."""

    def advance(self, past: Past, x: Floats, image: Floats) -> tuple[Past, Floats]:
        """The memory with x and its ``image`` G(x) in it, and the next x; all (n,)."""
        ...


@dataclass(frozen=True)
class Damped:
    """x <- (1 - w) x + w G(x); w = 1 is the plain fixed point.

    >>> Damped(0.5).advance(Past(), np.array([0.0]), np.array([2.0]))[1].tolist()
    [1.0]
    """

    weight: float = 1.0

    def __post_init__(self) -> None:
        make_floats(self, weight="in (0, 1]")

    def advance(self, past: Past, x: Floats, image: Floats) -> tuple[Past, Floats]:
        """The damped point, without memory."""
        return past, x + self.weight * (image - x)


@dataclass(frozen=True)
class Anderson:
    """Anderson mixing of the last ``depth`` steps, with a safeguard.

    x <- x + w f - (ΔX + w ΔF) γ, f = G(x) - x, γ the least-squares solution of ΔF γ = f. Where |f| is more than
    ``growth`` times that of the step before, the memory is dropped and the damped point taken: mixing can then delay
    a convergent iteration but not keep it from converging.
    """

    depth: int = 5
    weight: float = 0.5
    growth: float = 2.0

    def __post_init__(self) -> None:
        require_count(self.depth, "depth")
        make_floats(self, weight="in (0, 1]", growth=">= 1")

    def advance(self, past: Past, x: Floats, image: Floats) -> tuple[Past, Floats]:
        """The mixed point, or the damped one after a step that the safeguard refuses."""
        step = image - x
        size = float(np.linalg.norm(step))
        damped = x + self.weight * step
        if size > self.growth * past.length:
            return Past((x,), (step,), size), damped
        points = (*past.points, x)[-self.depth - 1 :]
        steps = (*past.steps, step)[-self.depth - 1 :]
        past = Past(points, steps, size)
        if len(points) < 2:
            return past, damped
        dX, dF = np.diff(np.array(points), axis=0).T, np.diff(np.array(steps), axis=0).T
        mix = np.linalg.lstsq(dF, step, rcond=1e-10)[0]
        return past, damped - (dX + self.weight * dF) @ mix
