"""Hard case 8: a force drives the punch, below and above the limit load.

Every form has the punch's translation as an unknown. Above the limit load the march ends with a mechanism, whichever
form it went by; here the Farkas inequalities judge it once more, by the strains of the motion itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bipot import BipotError, Configuration, Control, Force, LimitPassed, Scene, Schedule, march, upsetting
from bipot.fem.assembly import space
from bipot.fem.kinematics import gradients
from bipot.forms import FormName
from bipot.tensors import deviator, norm, trace
from bipot.typing import Floats, einsum, vdot
from studies.hard_forms import FORMS
from studies.hard_programs import Ended, ProgramCase
from studies.hard_scenes import Outcome

LIMIT_LOAD = 300.0 * np.pi * 5.0**2
"""sigma_Y pi R^2 of the cylinder (N)."""

FACTORS = {0.5: Outcome.CERTIFIED, 0.9: Outcome.CERTIFIED, 0.99: Outcome.CERTIFIED} | {
    1.01: Outcome.UNBOUNDED,
    1.1: Outcome.UNBOUNDED,
}

FARKAS = 1e-6
"""What a mechanism may change of the volume, or overtake of the punch, over what it gains."""


def load_cases(forms: Iterable[FormName]) -> list[ProgramCase]:
    """Case 8 by each form."""
    chosen = list(forms)
    return [
        ProgramCase(f"8 {factor} of the limit load", form, expected, partial(loaded, factor, form))
        for factor, expected in FACTORS.items()
        for form in chosen
    ]


def limit_scene(factor: float, elements: int = 4) -> Scene:
    """The cylinder without friction, its geometry frozen, pressed on its top by ``factor`` times the limit load."""
    scene = upsetting(mu=0.0, elements=elements, configuration=Configuration.SMALL)
    punch = replace(
        scene.tools[0], travel=(0.0, 0.0), candidates=("top",), driven_by=Force((0.0, -factor * LIMIT_LOAD))
    )
    return replace(scene, tools=(punch,))


def loaded(factor: float, name: FormName) -> Ended:
    """One increment from rest to the load, without help from another form."""
    scene = limit_scene(factor)
    form, _ = FORMS[name](scene)
    try:
        *_, accepted = march(scene, Schedule(1), Control(form, (), cuts=2))
    except LimitPassed as limit:
        farkas = Farkas.of(scene, np.asarray(limit.ray), factor * LIMIT_LOAD)
        return Ended(farkas.outcome, 0, 0.0, said=f"{limit}; {farkas}")
    except BipotError as error:
        return Ended(Outcome.FAILED, 0, 0.0, said=str(error))
    return Ended(Outcome.CERTIFIED, accepted.passes, accepted.solved.certificate.relative_gap)


@dataclass(frozen=True)
class Farkas:
    """What makes a motion of the cylinder a collapse mechanism, everything over the gain of the load.

    ``volume`` is the largest change of volume (as work of sigma_Y), ``dissipated`` what plastic flow takes, and
    ``overtaken`` how far the punch passes a node, over its own way.
    """

    volume: float
    dissipated: float
    overtaken: float

    @classmethod
    def of(cls, scene: Scene, motion: Floats, load: float) -> Farkas:
        """Of the nodes' ``motion`` (a, d); the punch goes with the node of its top that sinks the least."""
        top = motion[scene.mesh.boundary_nodes("top"), 1]
        way = -float(top.max())
        if not way > 0:
            return cls(np.inf, np.inf, np.inf)
        reference = space(scene.mesh, scene.geometry, scene.rule, scene.holding.numbers).reference
        placed = gradients(scene.mesh.nodes, scene.mesh.elements, reference, scene.geometry)
        strain = einsum("eqsi,ei->eqs", placed.B, motion[scene.mesh.elements].reshape(len(scene.mesh.elements), -1))
        sigma_y = float(scene.material.yield_stress(0.0))
        gain, dissipation = load * way, sigma_y * np.sqrt(2 / 3) * vdot(placed.volume, norm(deviator(strain)))
        change = sigma_y * float(placed.volume.sum()) * float(np.abs(trace(strain)).max())
        return cls(change / gain, dissipation / gain, float(np.ptp(top)) / way)

    @property
    def holds(self) -> bool:
        """No volume changes, less is dissipated than gained, no node is overtaken."""
        return self.volume <= FARKAS and self.dissipated < 1 and self.overtaken <= FARKAS

    @property
    def outcome(self) -> Outcome:
        """Of a run above the limit load that ended with this motion."""
        return Outcome.UNBOUNDED if self.holds else Outcome.FAILED

    def __str__(self) -> str:
        return (
            f"{'a' if self.holds else 'not a'} mechanism: volume {self.volume:.1e}, dissipation {self.dissipated:.9f} "
            f"of the load's gain, nodes overtaken by {self.overtaken:.1e}"
        )
