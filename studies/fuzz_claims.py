"""Claims of the library that a load is above the limit load, judged by inequalities of the study's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bipot.errors import LimitPassed
from bipot.fem.strain import Configuration
from bipot.increment import Trial
from bipot.response import State
from bipot.scene import Scene
from bipot.typing import Floats
from studies.fuzz_placed import led_of
from studies.fuzz_record import loads_at, nodes_of, setting_of, touching
from studies.independent_limit import Collapse, Proof, judged

LIMITS = {"volume": 1e-5, "overtaken": 1e-5, "held": 1e-12}
"""Ten times what the library lets pass; held nodes do not move at all."""

FRACTION = 1e-5
"""What the fraction that is carried may be below that of the study, which a proof with a gain of one has, too."""


@dataclass(frozen=True)
class Claim:
    """The motion (a, d) of a march that ended at ``state``, the ``fraction`` carried and the time asked for."""

    state: State
    motion: Floats
    fraction: float
    tau: float


class LastTried:
    """Sees the passes of a march: the end of the increment that was tried last."""

    def __init__(self) -> None:
        self.tau = 0.0

    def __call__(self, trial: Trial) -> None:
        """Note it."""
        self.tau = trial.iterate.increment.tau


def claim_of(error: BaseException, tried: LastTried) -> Claim | None:
    """The claim that ends a march, None if it makes none."""
    if not isinstance(error, LimitPassed):
        return None
    state: Any = error.state
    return Claim(state, np.array(error.ray, dtype=np.float64), error.fraction, tried.tau)


def proof(scene: Scene, claim: Claim) -> Proof:
    """The study's own judgement of a claim."""
    setting, state = setting_of(scene), claim.state
    placed = scene.mesh.nodes if scene.configuration is Configuration.SMALL else state.nodes
    node, tool = nodes_of(scene, setting)
    contacts = touching(scene, node, tool, state)
    led = led_of(scene, claim.tau, state)
    return judged(setting, Collapse(placed, claim.motion, loads_at(scene, setting, placed, claim.tau)[0], led, contacts))


def refuted(scene: Scene, claim: Claim) -> list[str]:
    """Why a claim proves nothing, in words; nothing where it does."""
    found = proof(scene, claim)
    out = [f"claim: {name} {getattr(found, name):.1e}" for name, most in LIMITS.items() if not getattr(found, name) <= most]
    if not found.carried < 1:
        out.append(f"claim: {found.carried:.6g} of the load's gain is dissipated")
    if not abs(found.carried - claim.fraction) <= FRACTION * max(claim.fraction, FRACTION):
        out.append(f"claim: {claim.fraction:.6g} of the load is said to be carried, not {found.carried:.6g}")
    if not abs(found.gain - 1) <= FRACTION:
        out.append(f"claim: the load gains {found.gain:.6g}, not one")
    return out
