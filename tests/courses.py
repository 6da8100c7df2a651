"""Marches compared to the last bit, a course as a file gives it back, and small marches in which much happens."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, ClassVar

import numpy as np

from bipot.conic.through_cvxpy import Cvxpy
from bipot.control.accepted import Accepted
from bipot.control.landing import Locate
from bipot.errors import NotConverged
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Form, FormName, Newton, Penalty, Tangent, Uzawa
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.meshes.together import together
from bipot.paper import upsetting
from bipot.paths import Amplitude
from bipot.results.columns import (
    COURSE,
    ERROR_ESTIMATE,
    FLOW_GAP,
    INCREMENT,
    MIN_JACOBIAN,
    OVERLAP,
    certificate,
    energies,
)
from bipot.scene.loads import BodyForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.schedule import Schedule
from bipot.tools.deformable import DeformableTool
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool
from tests.deformable import shifted
from tests.scenes import scene, tool

COLUMNS = (INCREMENT, *COURSE, *certificate("J"), *energies("J"), OVERLAP, FLOW_GAP, ERROR_ESTIMATE, MIN_JACOBIAN)
"""All that a study may write of an increment but its seconds."""

HELD = (Support("base", 0), Support("base", 1))
SOFT = VonMises(Elasticity(1000.0, 0.3), Linear(1.0, 100.0))
K_PENALTY, K_UZAWA = 1e6, 1e8

FORMS: dict[str, Form[Any]] = {
    "tangent": Tangent(),
    "tangent through cvxpy": Tangent(solver=Cvxpy()),
    "tangent uncoupled": Tangent(coupled=False),
    "dissipation": Dissipation(),
    "newton": Newton(),
    "penalty": Penalty(K_PENALTY, K_PENALTY),
    "uzawa": Uzawa(K_UZAWA, K_UZAWA),
    "delassus": Delassus(),
}


@dataclass(frozen=True)
class March:
    """What a march is asked."""

    scene: Scene
    schedule: Schedule
    control: Control

    def run(self, **options: Any) -> list[Accepted]:
        """All of its increments."""
        return list(march(self.scene, self.schedule, self.control, **options))

    def seen(self, accepted: Accepted) -> dict[str, Any]:
        """What the increment leaves behind, to the last bit: columns, course, solution, but no seconds."""
        system, solved = system_of(self.scene), accepted.solved
        values = {
            **{column.name: column.value(system, accepted) for column in COLUMNS},
            "course": accepted.course,
            "start": accepted.start,
            "form": accepted.form,
            "said": accepted.reasons,
            "landed": accepted.landed,
            "strayed": accepted.strayed,
            "tool_forces": accepted.tool_forces,
            "r": solved.r,
            "x": solved.iterate.x,
            "spent": (solved.passes, solved.iterations, solved.almost),
        }
        return {name: got for key, value in values.items() for name, got in bits(value, key)}


def bits(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Names and bytes of the numbers in a value, and in the dataclasses that it holds."""
    if is_dataclass(value):
        for f in fields(value):
            yield from bits(getattr(value, f.name), f"{name}.{f.name}")
    elif isinstance(value, float | np.ndarray):
        yield name, np.ascontiguousarray(value).tobytes()
    else:
        yield name, repr(value)


def unlike(one: list[dict[str, Any]], other: list[dict[str, Any]]) -> list[str]:
    """Names of what differs in the first of increments that does: none where two marches are the same."""
    for a, b in zip(one, other, strict=True):
        different = sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
        if different:
            return different
    return []


def stored(value: Any) -> Any:
    """A course as a file gives it back: every array anew, row by row, every number of its own."""
    if isinstance(value, np.ndarray):
        return np.frombuffer(value.tobytes(order="C"), value.dtype).reshape(value.shape)
    if isinstance(value, float):
        return float.fromhex(float(value).hex())
    if is_dataclass(value) and not isinstance(value, type):
        return type(value)(**{f.name: stored(getattr(value, f.name)) for f in fields(value)})
    return value


class Refusing:
    """The tangent form, which does not take increments longer than ``longest``, nor any until ``until``."""

    name: ClassVar[FormName] = FormName.TANGENT
    init = Tangent().init

    def __init__(self, longest: float = np.inf, until: float = 0.0) -> None:
        self.longest, self.until = longest, until

    def step(self, iterate: Any, r: Any, state: Any) -> Any:
        tau, start = iterate.increment.tau, iterate.increment.start.tau
        if tau - start > self.longest or tau < self.until:
            raise NotConverged("not today")
        return Tangent().step(iterate, r, state)


SCHEDULE = Schedule(3, first=1 / 60, settling=2, growth=3)


def upset(form: Form[Any], *fallbacks: Form[Any], **options: Any) -> March:
    """The cylinder, a little, with a start-up."""
    given = {"mu": 0.3, "elements": 2, "reduction": 0.03} | options
    return March(upsetting(**given), SCHEDULE, Control(form, fallbacks))


def cut(form: Form[Any]) -> March:
    """Increments halved twice, those between scheduled ones doubled again."""
    return replace(upset(Refusing(longest=0.12)), schedule=Schedule(2, first=0.1, settling=1))


def fallen_back(form: Form[Any]) -> March:
    """Increments whose form fails in the first half of the path, all by ``form``."""
    return upset(Refusing(until=0.5), form)


def landing(form: Form[Any]) -> March:
    """A block between a punch and a wall, whose landings are located: of three nodes in one scheduled increment."""
    wall = tool(point=(1.01, 0.0), normal=(-1.0, 0.0), travel=(0.0, 0.0), candidates=("right",))
    body = scene(mesh=block(1.0, 1.0, 1, 1, element=Element.Q8), tools=(tool(point=(0.0, 1.004)), wall))
    return March(body, Schedule(4), Control(form, (), locate=Locate(tolerance=1e-2)))


def loaded(form: Form[Any]) -> March:
    """A plastic block under traction, weight, a pressure that follows it, and a punch that comes later."""
    loads = (Traction("top", (0.0, -1.5)), BodyForce((0.1, -0.2)), Pressure("right", 0.3))
    punch = tool(point=(0.0, 1.02), travel=(0.0, -0.03))
    body = Scene(block(2.0, 1.0, 2, 2, element=Element.Q8), Geometry.PLANE_STRAIN, SOFT, HELD, (punch,), loads=loads)
    return March(body, Schedule(4), Control(form, ()))


def forced(form: Form[Any]) -> March:
    """A block that a force on the punch presses and the punch then drags."""
    pressing = Force((0.0, -2.0), Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.1))))
    dragging = ((0.0, 0.0), (0.5, 0.0), (1.0, 1.0))
    punch = FlatTool((0.0, 1.0), (0.0, -1.0), (0.03, 0.0), ("top",), 0.2, dragging, driven_by=pressing)
    body = Scene(block(2.0, 1.0, 2, 2, element=Element.Q8), Geometry.PLANE_STRAIN, SOFT, HELD, (punch,))
    return March(body, Schedule(4), Control(form, ()))


def moving(form: Form[Any]) -> March:
    """A block on a tool at rest, pressed and sheared by supports, one of which goes back."""
    there = Amplitude(((0.0, 0.0), (0.6, 1.0), (1.0, 0.5)))
    supports = (Prescribed("top", 1, -0.02, there), Prescribed("top", 0, 0.03))
    floor = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.3)
    body = Scene(block(2.0, 1.0, 2, 2, element=Element.Q8), Geometry.PLANE_STRAIN, SOFT, supports, (floor,))
    return March(body, Schedule(4), Control(form, ()))


def sliding(form: Form[Any]) -> March:
    """A block that slides on a wider one past several of its nodes."""
    mesh = together({"low": block(2.0, 0.5, 6, 1), "up": shifted(block(0.8, 0.5, 3, 1), 0.1, 0.5)})
    going = Prescribed("up/top", 1, -0.01), Prescribed("up/top", 0, 1.0)
    supports = (Support("low/base", 0), Support("low/base", 1), *going)
    body = Scene(mesh, Geometry.PLANE_STRAIN, SOFT, supports, (DeformableTool(("low/top",), ("up/base",), 0.2),))
    return March(body, Schedule(4), Control(form, ()))


EVENTS: tuple[Callable[[Form[Any]], March], ...] = (upset, fallen_back, landing, loaded, forced, moving)
"""What may happen to any form."""


def digest(marches: Iterable[March]) -> str:
    """A number that tells whether anything differs in all increments of the marches."""
    found = hashlib.sha256()
    for asked in marches:
        for accepted in asked.run():
            found.update(repr(sorted(asked.seen(accepted).items())).encode())
    return found.hexdigest()
