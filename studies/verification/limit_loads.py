"""Limit loads of :mod:`studies.element_scenes` as cases: a series of uniform meshes, and a strict bound beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from studies.element_scenes import PROBLEMS, Choice
from studies.element_types import ElementType
from studies.verification.case import Asked, Sense, Watch

PROBLEM = {problem.name: problem for problem in PROBLEMS}
NEAR, STRICT = ElementType.T6, ElementType.T3
"""What comes nearest, and what is a bound: of constant strain, it keeps the volume everywhere."""


def value(problem: str, kind: ElementType, n: int) -> float:
    """Of the uniform mesh of n elements along a unit length, by the type's own rule."""
    asked = PROBLEM[problem]
    return asked.value(asked.uniform(Choice(kind, kind.quadrature), n))


def asked(names: dict[str, str], tolerance: float) -> tuple[Asked, ...]:
    """The exact value of each problem, called as it is here, and that the bound is not below it."""
    out = list[Asked]()
    for name, words in names.items():
        exact = PROBLEM[name].exact
        out += [Asked(f"{words}, T6", exact, tolerance), Asked(f"{words}, T3", exact, 0.0, Sense.AT_LEAST)]
    return tuple(out)


def runner(names: Sequence[str]) -> Callable[[int, Watch], list[float]]:
    """Runs these problems by both types."""

    def run(n: int, watch: Watch) -> list[float]:
        return [value(name, kind, n) for name in names for kind in (NEAR, STRICT)]

    return run
