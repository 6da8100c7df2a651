"""What a case of the verification suite is, what it asks, and the row that each of its numbers makes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum

from bipot import Accepted, Control, Dissipation, Newton, Scene, Schedule, Tangent, march

CONTROL = Control(Newton(), (Tangent(), Dissipation()))


class Subject(Enum):
    """Headings of the page, in its order."""

    UPSETTING = "Upsetting"
    LIMITS = "Limit loads"
    ELASTIC_CONTACT = "Elastic contact with friction"
    DISCRETE = "Discrete Coulomb problems"
    MATERIAL = "Bodies without contact"
    TOOLS = "Curved tools"
    ELEMENTS = "Elements"


class Sense(StrEnum):
    """How a value is compared with its reference: a bound is missed by what is beyond it alone."""

    EQUAL = "="
    AT_LEAST = ">="
    AT_MOST = "<="


@dataclass(frozen=True)
class Asked:
    """A number that a case finds, its reference (one for all meshes, or by mesh) and the error that is allowed.

    Errors are relative to the reference, absolute where that is zero.
    """

    quantity: str
    reference: float | Callable[[int], float]
    tolerance: float
    sense: Sense = Sense.EQUAL

    def exact(self, mesh: int) -> float:
        """The reference on this mesh."""
        return self.reference(mesh) if callable(self.reference) else self.reference

    def error(self, value: float, mesh: int) -> float:
        """Of a value on this mesh.

        >>> Asked("force", 2.0, 0.01).error(3.0, 1), Asked("force", 2.0, 0.01, Sense.AT_MOST).error(1.0, 1)
        (0.5, 0.0)
        """
        exact = self.exact(mesh)
        error = (value - exact) / (abs(exact) or 1.0)
        if self.sense is Sense.AT_LEAST:
            return error if math.isnan(error) else min(error, 0.0)
        if self.sense is Sense.AT_MOST:
            return error if math.isnan(error) else max(error, 0.0)
        return error


@dataclass
class Watch:
    """Sees the marches of a run: worst certificate, passes and cuts; NaN where a case marches nothing."""

    equilibrium: float = math.nan
    relative_gap: float = math.nan
    passes: int = 0
    cuts: int = 0

    def march(self, scene: Scene, schedule: Schedule, control: Control = CONTROL) -> Iterator[Accepted]:
        """The increments of :func:`bipot.march`, counted."""
        for accepted in march(scene, schedule, control):
            found = accepted.solved.certificate
            self.equilibrium = max(found.equilibrium, 0.0 if math.isnan(self.equilibrium) else self.equilibrium)
            self.relative_gap = max(found.relative_gap, 0.0 if math.isnan(self.relative_gap) else self.relative_gap)
            self.passes += accepted.passes
            self.cuts += accepted.cuts
            yield accepted

    def end(self, scene: Scene, schedule: Schedule, control: Control = CONTROL) -> Accepted:
        """The last of them."""
        *_, last = self.march(scene, schedule, control)
        return last


@dataclass(frozen=True)
class Case:
    """A problem with a known answer: its texts, its series of meshes from the coarsest on, and how one is run.

    ``counted`` says what the numbers of ``meshes`` count. ``run`` gives the numbers that are asked, in their order.
    ``note`` is what the page adds, such as why a tolerance is missed.
    """

    name: str
    subject: Subject
    source: str
    purpose: str
    setup: str
    asked: tuple[Asked, ...]
    counted: str
    meshes: tuple[int, ...]
    run: Callable[[int, Watch], Sequence[float]]
    note: str = ""

    @property
    def finest(self) -> int:
        """The mesh on which the case is judged."""
        return self.meshes[-1]


@dataclass(frozen=True)
class Row:
    """One number of one mesh; certificate, passes, cuts and seconds are those of the run that found all of them."""

    case: str
    source: str
    quantity: str
    mesh: int
    reference: float
    value: float
    error: float
    tolerance: float
    ok: str
    equilibrium: float
    relative_gap: float
    passes: int
    cuts: int
    seconds: float


YES, NO = "yes", "no"


def rows_of(case: Case, mesh: int, values: Sequence[float], watch: Watch, seconds: float) -> list[Row]:
    """The rows of a run; a value that is NaN misses."""
    out = []
    for asked, value in zip(case.asked, values, strict=True):
        error = asked.error(float(value), mesh)
        out.append(
            Row(
                case.name,
                case.source,
                asked.quantity,
                mesh,
                asked.exact(mesh),
                float(value),
                error,
                asked.tolerance,
                YES if abs(error) <= asked.tolerance else NO,
                watch.equilibrium,
                watch.relative_gap,
                watch.passes,
                watch.cuts,
                seconds,
            )
        )
    return out
