"""What a case of the verification suite is, what it asks, and the row that each of its numbers makes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum, StrEnum

from bipot import Accepted, Control, Dissipation, Newton, Scene, Schedule, Tangent, march

CONTROL = Control(Newton(), (Tangent(), Dissipation()))


class Subject(Enum):
    """Headings of the page, in its order."""

    UPSETTING = "Upsetting"
    LIMITS = "Limit loads"
    ELASTIC_CONTACT = "Elastic contact with friction"
    TWO_BODIES = "Two deformable bodies"
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


@dataclass(frozen=True)
class Marched:
    """A march of a run: its scene and the pseudo-times that it reached."""

    scene: Scene
    times: list[float] = field(default_factory=list)


@dataclass
class Watch:
    """Sees the marches of a run: worst certificate, passes and cuts, conic forms; NaN where a case marches nothing.

    ``worst`` is the largest measure of a certificate over its bound, ``conic`` counts the increments that did not end
    in Newton's form.
    """

    equilibrium: float = math.nan
    relative_gap: float = math.nan
    worst: float = math.nan
    passes: int = 0
    cuts: int = 0
    conic: int = 0
    marches: list[Marched] = field(default_factory=list)

    @property
    def conic_share(self) -> float:
        """Increments that ended in a conic form over all of them; NaN where there are none."""
        count = sum(len(marched.times) for marched in self.marches)
        return self.conic / count if count else math.nan

    def march(self, scene: Scene, schedule: Schedule, control: Control = CONTROL) -> Iterator[Accepted]:
        """The increments of :func:`bipot.march`, counted."""
        marched = Marched(scene)
        self.marches.append(marched)
        for accepted in march(scene, schedule, control):
            found = accepted.solved.certificate
            self.equilibrium = _larger(self.equilibrium, found.equilibrium)
            self.relative_gap = _larger(self.relative_gap, found.relative_gap)
            self.worst = _larger(self.worst, max(found.ratios(control.limits.bounds).values()))
            self.passes += accepted.passes
            self.cuts += accepted.cuts
            self.conic += accepted.form is not Newton.name
            marched.times.append(accepted.state.tau)
            yield accepted

    def end(self, scene: Scene, schedule: Schedule, control: Control = CONTROL) -> Accepted:
        """The last of them."""
        *_, last = self.march(scene, schedule, control)
        return last


def _larger(so_far: float, now: float) -> float:
    """The larger one, of which the first may be unknown."""
    return now if math.isnan(so_far) else max(so_far, now)


@dataclass(frozen=True)
class Case:
    """A problem with a known answer: its texts, its series of meshes from the coarsest on, and how one is run.

    ``counted`` says what the numbers of ``meshes`` count. ``run`` gives the numbers that are asked, in their order.
    ``note`` is what the page adds, such as why a tolerance is missed; ``{QUANTITY}`` in it stands for how far the value
    is from its reference on the finest mesh, in per cent. ``marched`` says that a run marches: then more is asked of it
    (:mod:`studies.verification.forms`). ``beside`` is a run whose marches other forms go through instead of those of
    ``run``, where these are not for all of them.
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
    marched: bool = True
    beside: Callable[[int, Watch], Sequence[float]] | None = None

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


def row_of(case: Case, asked: Asked, mesh: int, value: float, watch: Watch, seconds: float) -> Row:
    """The row of a number that a run found; a value that is NaN misses."""
    error = asked.error(float(value), mesh)
    return Row(
        case=case.name,
        source=case.source,
        quantity=asked.quantity,
        mesh=mesh,
        reference=asked.exact(mesh),
        value=float(value),
        error=error,
        tolerance=asked.tolerance,
        ok=YES if abs(error) <= asked.tolerance else NO,
        equilibrium=watch.equilibrium,
        relative_gap=watch.relative_gap,
        passes=watch.passes,
        cuts=watch.cuts,
        seconds=seconds,
    )
