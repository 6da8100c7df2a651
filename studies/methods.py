"""The methods that ``speed_vs_error`` compares: one line each."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import Enum

from bipot.certificate import Bounds
from bipot.forms import Dissipation, Form, Penalty, Tangent, Uzawa, contact_penalty
from bipot.forms.newton import Newton
from bipot.increment import Limits
from bipot.laws.flow import Integration
from bipot.marching import Control, system_of
from bipot.paper import as_written, unreturned
from bipot.scene.scene import Scene


class Method(Enum):
    """A way to run the march, by its name in the tables."""

    TANGENT = "tangent"
    FROZEN = "tangent, threshold by fixed point"
    DISSIPATION = "dissipation"
    NEWTON = "newton"
    EULER = "newton, backward Euler"
    PENALTY = "penalty"
    UZAWA = "uzawa"
    WRITTEN = "paper as written"
    UNRETURNED = "paper as written, no return"

    @property
    def exactly(self) -> Method:
        """Newton with the same integration: what the same increments give with exact algebra."""
        first_order = (Method.EULER, Method.WRITTEN, Method.UNRETURNED)
        return Method.EULER if self in first_order else Method.NEWTON


@dataclass(frozen=True)
class Setting:
    """Penalty over E/h, and equilibrium tolerance; the other bounds keep their proportion to it.

    Without ``fallback`` an increment that fails is cut instead, which on fine meshes is far cheaper.
    """

    factor: float = 1e4
    tolerance: float = Bounds().equilibrium
    fallback: bool = True


EXACT: dict[Method, Form] = {
    Method.TANGENT: Tangent(),
    Method.FROZEN: Tangent(coupled=False),
    Method.DISSIPATION: Dissipation(),
    Method.NEWTON: Newton(),
    Method.EULER: Newton(),
}


def configured(method: Method, scene: Scene, setting: Setting) -> tuple[Scene, Control]:
    """Scene and control of a method; penalised forms do not fall back on exact ones."""
    limits, conic = Limits(bounds(setting.tolerance)), (EXACT[Method.TANGENT], EXACT[Method.DISSIPATION])
    if method in EXACT:
        control = Control(EXACT[method], conic if setting.fallback else (), limits)
        return scene, replace(control, integration=Integration.BACKWARD_EULER) if method is Method.EULER else control
    K = contact_penalty(system_of(scene).candidates, setting.factor)
    if method in (Method.WRITTEN, Method.UNRETURNED):
        return as_written(scene if method is Method.WRITTEN else unreturned(scene), K, K)
    return scene, Control(Penalty(K, K) if method is Method.PENALTY else Uzawa(K, K), (), limits)


def bounds(tolerance: float) -> Bounds:
    """The default bounds, all scaled so that equilibrium is held to ``tolerance``; yield is met by construction."""
    default = Bounds()
    scale = tolerance / default.equilibrium
    scaled = {f.name: getattr(default, f.name) * scale for f in fields(default)}
    return Bounds(**{**scaled, "yield_violation": default.yield_violation})
