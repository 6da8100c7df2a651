"""The marches whose increments become the conic test set, and which of their programs are taken.

Four scenes, each on meshes from coarse to fine. What is hard about an increment is its *moment*: ``easy`` flows on with
the contacts that there were and is found in a few passes; in ``first_yield`` the body flows for the first time; in
``landing`` a node meets a tool, so that a contact of the answer was none before.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from itertools import islice

import numpy as np

from bipot import (
    Accepted,
    ConicProgram,
    Dissipation,
    Elasticity,
    Element,
    Geometry,
    Mesh,
    Perfect,
    Profile,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    Tangent,
    VolumeChange,
    VonMises,
    conic_program,
    march,
    upsetting,
)
from bipot.contact.closeness import newly_closed
from bipot.forms import FormName
from bipot.meshes.cells import graded
from studies.element_scenes import tensor
from studies.upsetting_march import FIRST
from studies.verification.cases.ring_constant_shear import upper_half
from studies.verification.cases.wedge_extrusion import extruded

APART = 1e-3
"""Gap, over the increment's unit of length, above which a contact was none before."""
FEW = 4
"""Passes of an easy increment."""
TIP_FAR, TIP_ANGLE = 5.0, np.radians(75.0)
"""How far the block below the wedge reaches in both directions, and the wedge's flanks; their angle to the vertical."""
CLEARANCE = 0.01
"""Between billet and container, over the billet's half-width: it is closed part by part."""

FORMS: Mapping[FormName, Tangent | Dissipation] = {
    FormName.TANGENT: Tangent(),
    FormName.DISSIPATION: Dissipation(),
}


class Moment(Enum):
    """What happens in an increment."""

    EASY = "easy"
    FIRST_YIELD = "first_yield"
    LANDING = "landing"


@dataclass(frozen=True)
class Pick:
    """Of the increments of a moment the one of this number, counted from the end where negative, by a form."""

    form: FormName
    moment: Moment
    which: int = 0


@dataclass
class Ends:
    """Of many increments the first and the last few, which are what is asked for by number from either end."""

    first: int
    last: int
    kept: list[Accepted] = field(default_factory=list)

    @staticmethod
    def of(numbers: Iterable[int]) -> Ends:
        """Enough for these numbers."""
        low, *_, high = sorted([0, 0, *numbers])
        return Ends(high + 1, -low)

    def add(self, accepted: Accepted) -> None:
        """The next one; an increment holds megabytes."""
        self.kept.append(accepted)
        if len(self.kept) > self.first + self.last:
            del self.kept[self.first]


@dataclass(frozen=True)
class Course:
    """A scene by name, its mesh by the number that makes it, the increments that are marched, and what is taken.

    Programs of ``small`` ones are the tests' data.
    """

    scene: str
    elements: int
    increments: int
    picks: tuple[Pick, ...]
    small: bool = False

    def name(self, pick: Pick) -> str:
        """Of a program: that of its file, without the suffix."""
        which = f"-{pick.which}" if pick.which > 0 else f"-last{-1 - pick.which or ''}" if pick.which < 0 else ""
        return f"{self.scene}{self.elements}-{pick.form.value}-{pick.moment.value}{which}"

    def programs(self) -> Iterator[tuple[Pick, Accepted, ConicProgram]]:
        """March, and yield what is taken, each program without empty blocks of rows."""
        scene, schedule = SCENES[self.scene](self.elements)
        numbers = {moment: [p.which for p in self.picks if p.moment is moment] for moment in Moment}
        found = {moment: Ends.of(wanted) for moment, wanted in numbers.items() if wanted}
        for accepted in islice(march(scene, schedule), self.increments):
            if (moment := moment_of(accepted)) in found:
                found[moment].add(accepted)
        for pick in self.picks:
            accepted = found[pick.moment].kept[pick.which]
            program = conic_program(accepted, FORMS[pick.form]).conic()
            yield pick, accepted, replace(program, rows=tuple(r for r in program.rows if r.count), statement=None)


def moment_of(accepted: Accepted) -> Moment | None:
    """None where it is none of these; in that of first yield nodes may land."""
    flows, flowed = (accepted.state.peeq > accepted.start.peeq).any(), (accepted.start.peeq > 0).any()
    lands = len(newly_closed(accepted.start.gap, accepted.solved.r, APART * accepted.units.length)) > 0
    if not flowed:
        return Moment.FIRST_YIELD if flows else None
    if lands:
        return Moment.LANDING
    return Moment.EASY if flows and accepted.passes <= FEW and not accepted.strayed else None


def _upset(n: int) -> tuple[Scene, Schedule]:
    """The seed paper's cylinder at mu = 0.3, n x n Q4/P0."""
    return upsetting(mu=0.3, elements=n, element=Element.Q4, volume=VolumeChange.P0), Schedule(45, FIRST / 0.45)


def _ring(n: int) -> tuple[Scene, Schedule]:
    """The ring 6 : 3 : 2 at a constant shear of 0.8 of the yield stress in shear, 3 n x 2 n."""
    return upper_half(0.8, n), Schedule(50, 0.002)


def _wedge(n: int) -> tuple[Scene, Schedule]:
    """A wedge of semi-angle 75 degrees with a flat tip, mu = 0.2: n elements along half of the tip, of length one."""
    x = np.append(np.arange(3 * n // 2) / n, graded(1.5, TIP_FAR, n // 2 + 2, 8.0))
    y = TIP_FAR - graded(0.0, TIP_FAR, n // 2 + 4, 12.0)[::-1]
    out, up = TIP_FAR * np.sin(TIP_ANGLE), TIP_FAR * np.cos(TIP_ANGLE)
    points = ((1 + out, TIP_FAR + up), (1.0, TIP_FAR), (-1.0, TIP_FAR), (-1 - out, TIP_FAR + up))
    scene = Scene(
        mesh=tensor(x, y, Element.Q4),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(3000.0, 0.3), Perfect(1.0)),
        supports=(Symmetry("left", 0), Support("right", 0), Support("base", 0), Support("base", 1)),
        tools=(ShapedTool(Profile(points), (0.0, -0.2), ("top",), 0.2),),
    )
    return scene, Schedule(n)


def _extrusion(n: int) -> tuple[Scene, Schedule]:
    """Through a die of semi-angle 30 degrees at mu = 0.05, n elements over the half-width, with a clearance."""
    scene = _rough(extruded(30, n), 0.05)
    mesh, across = scene.mesh, np.array([1 - CLEARANCE, 1.0])
    return replace(scene, mesh=Mesh(mesh.nodes * across, mesh.elements, mesh.boundaries)), Schedule(6 * n)


def _rough(scene: Scene, mu: float) -> Scene:
    return replace(scene, tools=tuple(replace(tool, mu=mu) for tool in scene.tools))


SCENES: Mapping[str, Callable[[int], tuple[Scene, Schedule]]] = {
    "upsetting": _upset,
    "ring": _ring,
    "wedge": _wedge,
    "extrusion": _extrusion,
}


def _picks(form: FormName, *chosen: tuple[Moment, int]) -> tuple[Pick, ...]:
    return tuple(Pick(form, moment, which) for moment, which in chosen)


_T, _D = FormName.TANGENT, FormName.DISSIPATION
_E, _Y, _L = Moment

COURSES = (
    Course("upsetting", 4, 30, _picks(_D, (_E, -1)), small=True),
    Course("ring", 2, 20, _picks(_D, (_E, -1)), small=True),
    Course("ring", 3, 1, _picks(_D, (_Y, 0)), small=True),
    Course("ring", 9, 1, _picks(_T, (_Y, 0)), small=True),
    Course("wedge", 4, 4, _picks(_D, (_L, -1)), small=True),
    Course("extrusion", 4, 24, _picks(_D, (_E, -1), (_L, 0)), small=True),
    Course("extrusion", 10, 2, _picks(_T, (_Y, 0)), small=True),
    Course("upsetting", 8, 46, _picks(_D, (_Y, 0), (_L, 0))),
    Course("upsetting", 26, 36, _picks(_D, (_L, 0)) + _picks(_T, (_Y, 0), (_E, 0), (_L, 0), (_L, 1))),
    Course("upsetting", 48, 2, _picks(_D, (_Y, 0)) + _picks(_T, (_Y, 0))),
    Course("ring", 3, 46, _picks(_D, (_L, 0))),
    Course("ring", 9, 28, _picks(_D, (_L, 0)) + _picks(_T, (_E, 0), (_L, 0), (_L, 1))),
    Course("ring", 20, 1, _picks(_D, (_Y, 0)) + _picks(_T, (_Y, 0))),
    Course("wedge", 8, 8, _picks(_D, (_Y, 0), (_L, -1))),
    Course("wedge", 28, 6, _picks(_D, (_L, -1)) + _picks(_T, (_Y, 0), (_L, 0), (_L, 1), (_L, 2), (_L, -1))),
    Course("wedge", 40, 1, _picks(_D, (_Y, 0))),
    Course("extrusion", 6, 36, _picks(_D, (_Y, 0))),
    Course("extrusion", 10, 45, _picks(_D, (_L, 0)) + _picks(_T, (_E, -1), (_L, 0), (_L, -1))),
    Course("extrusion", 31, 6, _picks(_D, (_Y, 0)) + _picks(_T, (_Y, 0))),
)
"""Forty programs, the quick ones first."""
