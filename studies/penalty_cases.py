"""What ``penalty_vs_conic`` runs: its cases, and how each is solved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from bipot.certificate import Bounds
from bipot.forms import Form, FormName, Penalty, Tangent, Uzawa, contact_penalty
from bipot.increment import Limits
from bipot.marching import Control, Schedule, system_of
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.system import System
from studies.runs import Run, record
from studies.upsetting_march import FIRST

REDUCTION, EARLY = 0.45, 0.20
UZAWA = 1e2
TOLERANCE = 1e-10
ROUND_OFF = 1e-14
"""Equilibrium that round-off leaves attainable, for each unit of K over E/h."""


@dataclass(frozen=True)
class Plan:
    """What is run."""

    mus: tuple[float, ...] = (0.1, 0.3, 0.6)
    decades: tuple[int, ...] = tuple(range(-3, 9))
    elements: int = 10
    increments: int = 15
    start: float = FIRST


FAST = Plan(mus=(0.3,), decades=(0, 2), elements=2, increments=3)


class Case(NamedTuple):
    """One run: friction, form, and its penalty over E/h (nan: none)."""

    mu: float
    form: FormName
    factor: float


class Done(NamedTuple):
    """A case with its run and the equilibrium tolerance it met."""

    case: Case
    run: Run
    tolerance: float


def cases(plan: Plan) -> list[Case]:
    """The conic run of each mu first: the others are measured by it."""
    none = float("nan")
    return [
        case
        for mu in plan.mus
        for case in (
            Case(mu, FormName.TANGENT, none),
            Case(mu, FormName.UZAWA, UZAWA),
            *(Case(mu, FormName.PENALTY, 10.0**k) for k in plan.decades),
        )
    ]


@cache
def system_at(mu: float, plan: Plan) -> System:
    """The system of :func:`scene_of`."""
    return system_of(scene_of(mu, plan))


def scene_of(mu: float, plan: Plan) -> Scene:
    """The paper's cylinder on the plan's mesh."""
    return upsetting(mu=mu, reduction=REDUCTION, elements=plan.elements)


def schedule_of(plan: Plan) -> Schedule:
    """The increments of every run."""
    return Schedule(plan.increments, plan.start / REDUCTION, landings=(EARLY / REDUCTION,))


def form_of(case: Case, scene: Scene) -> Form:
    """The form with its penalties in physical units."""
    if case.form is FormName.TANGENT:
        return Tangent()
    K = contact_penalty(system_of(scene).candidates, case.factor)
    return Uzawa(K, K) if case.form is FormName.UZAWA else Penalty(K, K)


def solve(case: Case, plan: Plan) -> Done:
    """Run a case at the tightest tolerance that round-off lets it meet."""
    scene = scene_of(case.mu, plan)
    tolerance = TOLERANCE if np.isnan(case.factor) else max(TOLERANCE, ROUND_OFF * case.factor)
    cone = min(Bounds().cone_violation, tolerance)
    limits = Limits(replace(Bounds(), equilibrium=tolerance, cone_violation=cone), passes=60)
    control = Control(form_of(case, scene), (), limits)
    return Done(case, record(scene, schedule_of(plan), control, (EARLY / REDUCTION, 1.0)), tolerance)
