r"""What every marched case is asked beside its own numbers: how its increments ended, and what other forms find.

Of each mesh: the part of the increments that ended in a conic form, which Newton falls back on, and the worst measure
of all certificates over its bound. Of the coarsest mesh: the largest relative difference of the forces that other forms
find from Newton's. Each march is gone through again from rest by the other form alone, on the pseudo-times that the
first one reached; where it had to cut, Newton goes again through its pseudo-times, so that increments are the same.

Forces are those of the tools and, along its direction, of each support. An increment whose forces the law leaves open,
which the library names, tells nothing and is left out.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bipot import Accepted, Control, Dissipation, Schedule, Tangent
from bipot.errors import BipotError
from bipot.forms import Form
from bipot.typing import Floats
from studies.command import say
from studies.verification.case import CONTROL, Asked, Case, Marched, Row, Sense, Watch, row_of

CONIC = Asked("increments in a conic form", 0.0, 0.05)
CERTIFICATE = Asked("certificate over its bounds", 1.0, 0.0, Sense.AT_MOST)
EVERY = (CONIC, CERTIFICATE)


@dataclass(frozen=True)
class Other:
    """A form beside Newton, and the number it is asked for."""

    asked: Asked
    form: Form


OTHERS = (
    Other(Asked("force, tangent", 0.0, 1e-5), Tangent()),
    Other(Asked("force, dissipation", 0.0, 1e-5), Dissipation()),
)


class Found(NamedTuple):
    """Forces of an increment at its pseudo-time, and whether the law determines them."""

    tau: float
    forces: Floats
    determined: bool


def forces(accepted: Accepted) -> Floats:
    """Of all tools, component by component, and of each support along its direction, on the modelled part."""
    solved, scene = accepted.solved, accepted.solved.iterate.increment.system.body.scene
    reactions = solved.iterate.reactions(solved.r)
    held = [
        (reactions[scene.mesh.boundary_nodes(one.boundary)] @ one.along(scene.mesh.dimension)).sum()
        for one in scene.supports
    ]
    return np.array([*accepted.tool_forces.ravel(), *held])


def again(marched: Marched, times: Sequence[float], control: Control, watch: Watch) -> list[Found]:
    """A march through the same scene on these pseudo-times, to the last of them."""
    out = list[Found]()
    # One increment between any two; of a march that failed the last one is before the end.
    schedule = Schedule(1, landings=tuple(tau for tau in times if tau < 1))
    for accepted in watch.march(marched.scene, schedule, control):
        out.append(Found(accepted.state.tau, forces(accepted), not accepted.solved.undetermined))
        if accepted.state.tau >= times[-1]:
            break
    return out


def difference(found: Sequence[Found], reference: Sequence[Found]) -> float:
    """Largest of the increments', over the largest force so far; NaN where they are not the same increments.

    What is left when a load is gone may be nothing.

    >>> one, two = Found(1.0, np.array([1.0, -4.0]), True), Found(1.0, np.array([1.5, -4.0]), True)
    >>> difference([two], [one]), difference([two], [two, one])
    (0.125, nan)
    """
    if [one.tau for one in found] != [one.tau for one in reference]:
        return math.nan
    both = [(one.forces, other.forces) for one, other in zip(found, reference, strict=True) if _tells(one, other)]
    largest = np.maximum.accumulate([np.abs(other).max() for _, other in both])
    relative = [float(np.abs(one - other).max() / scale) for (one, other), scale in zip(both, largest, strict=True)]
    return max(relative, default=math.nan)


def _tells(one: Found, other: Found) -> bool:
    return one.determined and other.determined and bool(other.forces.any())


@dataclass
class Beside:
    """The marches of a run, and what Newton finds on pseudo-times of theirs: made once."""

    marches: Sequence[Marched]
    _newton: dict[tuple[int, tuple[float, ...]], list[Found]] = field(default_factory=dict)

    def difference(self, other: Other, watch: Watch) -> float:
        """The largest of all marches; NaN where one of them has none."""
        return float(np.max([self._of(number, other, watch) for number in range(len(self.marches))]))

    def _of(self, number: int, other: Other, watch: Watch) -> float:
        marched = self.marches[number]
        found = again(marched, marched.times, Control(other.form, ()), watch)
        times = tuple(one.tau for one in found)
        key = number, times
        if key not in self._newton:
            self._newton[key] = again(marched, times, CONTROL, Watch())
        return difference(found, self._newton[key])


def asked_on(case: Case, mesh: int, *, others: bool) -> tuple[Asked, ...]:
    """All that is asked of a case on a mesh; ``others``, of the coarsest also what other forms find."""
    if not case.marched:
        return case.asked
    beside = tuple(other.asked for other in OTHERS) if others and mesh == case.meshes[0] else ()
    return (*case.asked, *EVERY, *beside)


def judged_on(case: Case, quantity: str) -> int:
    """The finest mesh of which a quantity is asked."""
    return case.meshes[0] if quantity in {other.asked.quantity for other in OTHERS} else case.finest


def measured(case: Case, mesh: int, *, others: bool) -> Iterator[Row]:
    """Run a case on a mesh, and rows of all that is asked; a run that fails misses all of it, and says why."""
    watch, began = Watch(), time.perf_counter()
    try:
        values = [*case.run(mesh, watch)]
    except BipotError as failed:
        _tell(case, mesh, failed)
        values = [math.nan] * len(case.asked)
        watch = Watch()
    seconds = time.perf_counter() - began
    every = zip(EVERY, (watch.conic_share, watch.worst), strict=True) if case.marched else ()
    for asked, value in (*zip(case.asked, values, strict=True), *every):
        yield row_of(case, asked, mesh, value, watch, seconds)
    if others and case.marched and mesh == case.meshes[0]:
        if case.beside is not None:
            watch = Watch()
            case.beside(mesh, watch)
        yield from _beside(case, mesh, watch.marches)


def _beside(case: Case, mesh: int, marches: Sequence[Marched]) -> Iterator[Row]:
    """Rows of the other forms; passes, cuts, certificate and seconds are theirs."""
    beside = Beside([marched for marched in marches if marched.times])
    for other in OTHERS:
        watch, began = Watch(), time.perf_counter()
        try:
            value = beside.difference(other, watch)
        except BipotError as failed:
            _tell(case, mesh, failed)
            value = math.nan
        yield row_of(case, other.asked, mesh, value, watch, time.perf_counter() - began)


def _tell(case: Case, mesh: int, failed: BipotError) -> None:
    say(f"{case.name}, {mesh}: {' '.join(str(failed).split())}", sys.stderr)
