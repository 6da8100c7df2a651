"""The forms the hard cases are run with: ``newton`` and ``tangent`` with what they may fall back on."""

from __future__ import annotations

from collections.abc import Callable

from bipot.forms import Dissipation, Form, FormName, Newton, Penalty, Tangent, Uzawa, contact_penalty
from bipot.marching import system_of
from bipot.scene.scene import Scene

UZAWA = 30.0
"""Penalty of uzawa over E/h: its fixed point does not depend on it, its speed does."""


def _penalised(make: Callable[[float, float], Form], scene: Scene, factor: float) -> Form:
    K = contact_penalty(system_of(scene).candidates, factor)
    return make(K, K)


FORMS: dict[FormName, Callable[[Scene], tuple[Form, tuple[Form, ...]]]] = {
    FormName.NEWTON: lambda scene: (Newton(), (Tangent(), Dissipation())),
    FormName.TANGENT: lambda scene: (Tangent(), (Dissipation(),)),
    FormName.DISSIPATION: lambda scene: (Dissipation(), ()),
    FormName.PENALTY: lambda scene: (_penalised(Penalty, scene, 1.0), ()),
    FormName.UZAWA: lambda scene: (_penalised(Uzawa, scene, UZAWA), ()),
}
