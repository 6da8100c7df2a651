"""What ``speed_vs_error`` runs: its knobs, their values, and the path of each row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from bipot.fem.elements import Quadrature
from bipot.marching import Schedule
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from studies.methods import Method, Setting
from studies.upsetting_march import FIRST, SETTLING

EARLY, FULL = 0.20, 0.45
COARSE = 10
"""Increments that go with a start-up in steps of 0.1 % of the height."""
REDUCTIONS = {0.1: FULL, 0.3: EARLY}


class Knob(Enum):
    """What a row varies."""

    INCREMENTS = "increments"
    PENALTY = "K_over_E_h"
    TOLERANCE = "tolerance"
    ELEMENTS = "elements"
    START = "start_up"
    SCATTER = "scatter"


@dataclass(frozen=True)
class Plan:
    """Meshes, increments, and the values of every knob.

    ``further`` are increments at one mu only. Penalties are varied at ``penalised`` increments, tolerances and
    start-ups at ``increments``. A row is run ``repeats`` times if that takes less than ``row`` seconds, else once.
    """

    elements: int = 5
    reference: int = 1280
    repeats: int = 3
    row: float = 60.0
    steps: tuple[tuple[Method, tuple[int, ...]], ...] = (
        (Method.NEWTON, (10, 20, 40, 80, 160, 640)),
        (Method.EULER, (10, 40, 160, 640)),
        (Method.TANGENT, (10, 40, 80)),
        (Method.FROZEN, (40,)),
        (Method.DISSIPATION, (10, 40)),
        (Method.UZAWA, (10, 40, 80)),
        (Method.PENALTY, (10, 40, 80)),
        (Method.WRITTEN, (10, 40, 160, 640, 1280, 5120, 20480)),
        (Method.UNRETURNED, (160, 640)),
    )
    further: tuple[tuple[float, Method, int], ...] = ((0.1, Method.WRITTEN, 40960),)
    penalised: int = 40
    penalties: tuple[float, ...] = (1.0, 1e1, 1e2, 1e3, 1e4)
    increments: int = 80
    tolerances: tuple[float, ...] = (1e-3, 1e-5)
    loosened: tuple[Method, ...] = (Method.NEWTON, Method.TANGENT, Method.PENALTY, Method.UZAWA)
    starts: tuple[int, ...] = (1, 2, 4)
    meshes: tuple[tuple[Quadrature, tuple[int, ...]], ...] = (
        (Quadrature.RADON7, (5, 10, 20, 40)),
        (Quadrature.GAUSS2, (5, 10, 20, 40)),
    )
    mesh_increments: int = 20
    scatter: tuple[int, ...] = (10, 15, 20, 30, 40)


FAST = Plan(
    elements=2,
    reference=12,
    repeats=1,
    steps=((Method.NEWTON, (3,)), (Method.TANGENT, (3,)), (Method.UZAWA, (3,)), (Method.WRITTEN, (3,))),
    further=(),
    penalised=3,
    penalties=(1.0, 1e2),
    increments=3,
    tolerances=(1e-3,),
    loosened=(Method.NEWTON,),
    starts=(1,),
    meshes=((Quadrature.GAUSS2, (1, 2)),),
    mesh_increments=3,
    scatter=(3, 4),
)


class Job(NamedTuple):
    """One row to be made."""

    mu: float
    method: Method
    knob: Knob
    value: float
    elements: int
    quadrature: Quadrature
    increments: int
    setting: Setting

    @property
    def finer(self) -> int:
        """What the steps of the start-up are divided by: more with more increments, unless the row varies it."""
        return int(self.value) if self.knob is Knob.START else finer(self.increments)


def finer(increments: int) -> int:
    """Division of the start-up's steps that goes with a number of increments.

    A start-up that all runs share, reference included, would hide its own error (rows of the knob ``start_up``).
    """
    return max(1, increments // COARSE)


def jobs(plan: Plan) -> Iterator[Job]:
    """All rows, the cheap questions first."""
    radon = Quadrature.RADON7
    for mu in REDUCTIONS:
        for method, values in plan.steps:
            for n in (*values, *(n for at, what, n in plan.further if (at, what) == (mu, method))):
                yield Job(mu, method, Knob.INCREMENTS, n, plan.elements, radon, n, Setting())
        for factor in plan.penalties:
            setting = Setting(factor)
            yield Job(mu, Method.PENALTY, Knob.PENALTY, factor, plan.elements, radon, plan.penalised, setting)
        for method in plan.loosened:
            for tolerance in plan.tolerances:
                setting = Setting(tolerance=tolerance)
                yield Job(mu, method, Knob.TOLERANCE, tolerance, plan.elements, radon, plan.increments, setting)
        for division in plan.starts:
            n = plan.increments
            yield Job(mu, Method.NEWTON, Knob.START, division, plan.elements, radon, n, Setting())
    for n in plan.scatter:
        yield Job(0.3, Method.NEWTON, Knob.SCATTER, n, plan.elements, radon, n, Setting())
    for mu in REDUCTIONS:
        for quadrature, sides in plan.meshes:
            for side in sides:
                n, setting = plan.mesh_increments, Setting(fallback=False)
                yield Job(mu, Method.NEWTON, Knob.ELEMENTS, side, side, quadrature, n, setting)


WEIGHTS = {Method.TANGENT: 2, Method.FROZEN: 9, Method.DISSIPATION: 20, Method.PENALTY: 9, Method.UZAWA: 9}
"""Rough cost of an increment, that of Newton and of the paper's single solve being one."""


def cost(job: Job) -> float:
    """Rough cost of a job, to say how far a study is."""
    return WEIGHTS.get(job.method, 1) * (10 + job.increments) * (job.elements / 5) ** 1.6


def key(job: Job) -> tuple[float, str, str, float, int, str, int]:
    """What tells one row from another in the table."""
    return job.mu, job.method.value, job.knob.value, job.value, job.elements, job.quadrature.value, job.increments


class Course(NamedTuple):
    """What is upset how far, on which mesh: what a reference depends on besides its increments."""

    mu: float
    reduction: float
    elements: int
    quadrature: Quadrature

    @staticmethod
    def of(job: Job) -> Course:
        """The path of a job."""
        special = {Knob.SCATTER: FULL, Knob.ELEMENTS: EARLY}
        reduction = special.get(job.knob, REDUCTIONS[job.mu])
        return Course(job.mu, reduction, job.elements, job.quadrature)

    def scene(self) -> Scene:
        """The cylinder."""
        return upsetting(mu=self.mu, reduction=self.reduction, elements=self.elements, quadrature=self.quadrature)

    def schedule(self, increments: int, division: int) -> Schedule:
        """Start-up in steps of 0.1 % of the height over ``division``, landing on 20 % where the path goes on."""
        landings = (EARLY / self.reduction,) if self.reduction > EARLY else ()
        return Schedule(increments, FIRST / division / self.reduction, SETTLING * division, landings=landings)
