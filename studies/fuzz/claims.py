"""Claims of the library that a load is above the limit load, judged by inequalities of the study's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np

from bipot.errors import LimitPassed
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from studies.fuzz.placed import led_of
from studies.fuzz.record import candidates_at, loads_at, setting_of
from studies.independent.collapse import Proof
from studies.independent.limit import Collapse, judged, rigid_part

LIMITS = {"volume": 1e-5, "overtaken": 1e-5, "held": 1e-9}
"""Ten times what the library lets pass; held nodes hardly move at all."""

FRACTION = 1e-5
"""What the fraction that is carried may be below that of the study; a part of a motion or a load that is none."""


@dataclass(frozen=True)
class Claim:
    """The motion (a, d) of a march that ended at ``state``, the ``fraction`` carried and the time asked for.

    ``ways`` (m,) are those of the driven tools in it.
    """

    state: State
    motion: Floats
    fraction: float
    tau: float
    ways: Floats = field(default_factory=lambda: np.empty(0))


def claim_of(error: BaseException) -> Claim | None:
    """The claim that ends a march, None if it makes none."""
    if not isinstance(error, LimitPassed):
        return None
    state: Any = error.state
    ways = np.array(error.translation, dtype=np.float64)
    return Claim(state, np.array(error.ray, dtype=np.float64), error.fraction, error.tau, ways)


def proofs(scene: Scene, claim: Claim) -> list[Proof]:
    """The study's own judgements of the motion as it is claimed, of the rigid motion in it, and of tools alone.

    Those that touch nothing rest; then the motion and the rigid motion once more, where such tools follow the body. Of
    shaped tools that are driven the ways are those that are claimed.
    """
    setting, state = setting_of(scene), claim.state
    placed = scene.mesh.nodes if setting.small else state.nodes
    loads, led = loads_at(scene, setting, placed, claim.tau)[0], led_of(scene, claim.tau, state)
    collapse = Collapse(placed, claim.motion, loads, led, *candidates_at(scene, setting, state))
    ways = claim.ways if any(not isinstance(scene.tools[k], FlatTool) for k in led.tool.tolist()) else None

    def judge(motion: Floats, following: bool) -> Proof:
        return judged(setting, replace(collapse, motion=motion, following=following), ways)

    return tried(claim.motion, rigid_part(setting, placed, claim.motion), judge)


def tried(motion: Floats, rigid: Floats, judge: Callable[[Floats, bool], Proof]) -> list[Proof]:
    """The judgements of a motion, of the ``rigid`` one in it and of none; then of the former two, tools ``following``.

    Where ways of tools are given they follow nothing, and what is judged twice is the same.
    """
    motions = motion, rigid, np.zeros_like(motion)
    return [judge(way, False) for way in motions] + [judge(way, True) for way in motions[:2]]


def refuted(scene: Scene, claim: Claim) -> list[str]:
    """Why neither the motion of a claim nor what is in it proves it, in words of the former; nothing if one does.

    The library's motion is without those of the tools. Here these go as far as they can, so that the load gains as much
    or more, and what is carried is as much or less.
    """
    return unmet(proofs(scene, claim), claim.fraction)


def unmet(found: list[Proof], fraction: float) -> list[str]:
    """What the first two of proofs lack if none of them proves that a ``fraction`` of the load is carried at most."""
    reasons = [_missing(proof, fraction) for proof in found]
    return [f"claim: {what}" for what in dict.fromkeys(chain(*reasons[:2]))] if all(reasons) else []


def _missing(found: Proof, fraction: float) -> list[str]:
    """What a proof lacks, of which ``fraction`` of the load is said to be carried."""
    if not found.gain >= 1 - FRACTION:
        return [f"the load gains {found.gain:.6g}, not one, where tools that are yet to land rest"]
    out = [f"{name} {getattr(found, name):.1e}" for name, most in LIMITS.items() if not getattr(found, name) <= most]
    if not found.carried < 1:
        out.append(f"{found.carried:.6g} of the load's gain is dissipated")
    if not found.carried <= fraction + FRACTION:
        out.append(f"{fraction:.6g} of the load is said to be carried, not {found.carried:.6g}")
    if found.carried <= FRACTION and found.nearer > FRACTION:
        out.append(f"a motion that costs nothing ends where an open contact lands, nearer by {found.nearer:.1e}")
    return out
