"""Hard case 8: the punch is a free unknown under a given load, below and above the limit load.

``dissipation`` takes the punch into its program, whose dual infeasibility certificate is the collapse mechanism. The
other forms know the punch's position only, so the load is sought by increments from rest
(:mod:`bipot.force_control`); the mechanism is then the difference of the last two. The Farkas inequalities judge both.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

import numpy as np

from bipot.errors import BipotError, UnboundedProgram
from bipot.force_control import press
from bipot.forms import Cache, FormName
from bipot.increment import System
from bipot.iterate import Increment
from bipot.marching import Attempt, Control, attempt_increment, system_of
from bipot.response import State
from bipot.typing import Floats
from studies.hard_forms import FORMS
from studies.hard_programs import LIMIT_LOAD, Ended, Farkas, ProgramCase, force_controlled, limit_scene
from studies.hard_scenes import Outcome

FACTORS = {0.9: Outcome.CERTIFIED, 1.1: Outcome.UNBOUNDED}


def load_cases(forms: Iterable[FormName]) -> list[ProgramCase]:
    """Case 8 by each form."""
    chosen = list(forms)
    return [
        ProgramCase(f"8 {factor} of the limit load", form, expected, partial(loaded, factor, form))
        for factor, expected in FACTORS.items()
        for form in chosen
    ]


def loaded(factor: float, name: FormName) -> Ended:
    """``factor`` times the limit load, by the program or by seeking the travel."""
    return force_controlled(factor) if name is FormName.DISSIPATION else sought(factor, name)


def sought(factor: float, name: FormName) -> Ended:
    """Seek the increment from rest that ends at the load; above the limit load judge the mechanism it stops with."""
    scene = limit_scene()
    system = system_of(scene)
    state = system.rest()
    form, fallbacks = FORMS[name](scene)
    control, cache, passes = Control(form, fallbacks), Cache(), 0

    def solve(tau: float) -> Attempt:
        nonlocal passes
        attempt = attempt_increment(Increment(system, state, tau), control, cache, 0.0)
        passes += attempt.passes
        return attempt

    try:
        found = press(system, state, factor * LIMIT_LOAD, solve)
    except UnboundedProgram as unbounded:
        farkas = mechanism(system, state, np.asarray(unbounded.ray), factor)
        return Ended(farkas.outcome, passes, 0.0, said=f"{unbounded}; {farkas}")
    except BipotError as error:
        return Ended(Outcome.FAILED, passes, 0.0, said=str(error))
    fallbacks_used = int(found.attempt.form is not name)
    return Ended(Outcome.CERTIFIED, passes, found.solved.certificate.relative_gap, fallbacks_used)


def mechanism(system: System, state: State, v: Floats, factor: float) -> Farkas:
    """The Farkas inequalities for dx/dtau (n,) under the punch's own speed."""
    speed = float(np.linalg.norm(system.body.scene.tools[0].moved(0.0, 1.0)))
    model = system.body.plastic_model(system.body.respond(state, np.zeros(len(v))))
    rows = system.candidates.rows(state.gap, 0.0, 1.0)
    opening = rows.G_n @ v + rows.gap - state.gap
    return Farkas.of(model, v, factor * LIMIT_LOAD * speed, max(0.0, -float(opening.min()) / speed))
