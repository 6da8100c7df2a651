"""One point of a sweep: a case of the main study marched to its end, and what is told of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

from bipot.certificate import Bounds
from bipot.control.accepted import Accepted
from bipot.errors import BipotError, SceneError, require
from bipot.marching import Schedule, march
from studies.upsetting_case import Case
from studies.upsetting_columns import force

SAME = 1e-9
"""Reductions nearer to each other are one."""


class Status(Enum):
    """How a point ended."""

    SOLVED = "solved"
    STOPPED = "stopped"
    """The march refused to go on: it would again."""
    LOST = "lost"
    """Nothing came of it, as where its process died: another try may bring more."""


@dataclass(frozen=True)
class Point:
    """A case, and the reductions ``at`` which its force is told.

    Raises:
        SceneError: a reduction outside (0, the case's], or in its start-up; a scene, a schedule or a control that is
            none.
    """

    case: Case
    at: tuple[float, ...]

    def __post_init__(self) -> None:
        for reduction in self.at:
            inside = 0 < reduction <= self.case.reduction + SAME
            require(inside, "--at", reduction, f"in (0, {self.case.reduction:g}], where the march ends")
        self.case.scene()
        self.case.control()
        try:
            self.schedule()
        except SceneError as error:
            raise SceneError(f"--at {self.at}: as fractions of the path: {error}") from error

    @property
    def key(self) -> tuple[float, int]:
        """What tells it from the others of its sweep."""
        return self.case.mu, self.case.elements

    def schedule(self) -> Schedule:
        """The case's, which lands on the reductions before its end."""
        early = {reduction for reduction in self.at if reduction < self.case.reduction - SAME}
        return replace(self.case.schedule(), landings=tuple(sorted(r / self.case.reduction for r in early)))


@dataclass(frozen=True)
class Outcome:
    """What a march came to: forces (N) at the asked reductions, NaN beyond its end; how far it went and at what cost.

    ``certificate`` is the worst measure of all its certificates as a fraction of its bound, ``measure`` its name.
    """

    forces: tuple[float, ...]
    status: Status
    reduction: float = 0.0
    increments: int = 0
    passes: int = 0
    cuts: int = 0
    seconds: float = 0.0
    certificate: float = 0.0
    measure: str = ""
    reason: str = ""

    @staticmethod
    def none(point: Point, status: Status, reason: str = "") -> Outcome:
        """Before the first increment."""
        return Outcome((math.nan,) * len(point.at), status, reason=reason)

    def after(self, point: Point, accepted: Accepted, bounds: Bounds) -> Outcome:
        """With another increment."""
        reduction, own = (
            accepted.state.tau * point.case.reduction,
            force(accepted.solved.iterate.increment.system, accepted),
        )
        ratios = accepted.solved.certificate.ratios(bounds)
        measure = max(ratios, key=ratios.__getitem__)
        worse = {"certificate": ratios[measure], "measure": measure} if ratios[measure] > self.certificate else {}
        return replace(
            self,
            forces=tuple(own if abs(a - reduction) < SAME else f for a, f in zip(point.at, self.forces, strict=True)),
            reduction=reduction,
            increments=self.increments + 1,
            passes=self.passes + accepted.passes,
            cuts=self.cuts + accepted.cuts,
            seconds=self.seconds + accepted.seconds,
            **worse,
        )


def solve(point: Point) -> Outcome:
    """March to the end, or to where the march stops."""
    found = Outcome.none(point, Status.SOLVED)
    try:
        control = point.case.control()
        for accepted in march(point.case.scene(), point.schedule(), control):
            found = found.after(point, accepted, control.limits.bounds)
    except BipotError as error:
        return replace(found, status=Status.STOPPED, reason=" ".join(str(error).split()))
    return found
